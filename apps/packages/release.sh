#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Makes the files of a release, on Debian 12, as root or with sudo:
#   apps/packages/release.sh [--build FOLDER] [FOLDER]    default build/retint-VERSION; it must be empty or missing
# The folder gets the Debian packages, the archive that runs on other systems, the wheel, the site as a .zip, and
# SHA256SUMS. They have no CUDA: docs/licenses.md says why; and no MPI, so that they need none. At the end,
# apps/packages/check.sh checks them. --build takes a build that exists, as it is.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

fail() {
  echo "release.sh: $1" >&2
  exit 1
}
build=
if [[ ${1:-} == --build ]]; then
  build=$(realpath "${2:?"--build needs a folder"}")
  shift 2
fi
version=$(sed -n 's/^project(retint VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
out=$(realpath -m "${1:-build/retint-$version}")
[[ -z $(ls -A "$out" 2>/dev/null) ]] || fail "$out is not empty"
grep -q "^## $version\$" CHANGELOG.md || fail "CHANGELOG.md has no section $version"
grep -q "^version: $version\$" CITATION.cff || fail "CITATION.cff has another version than $version"

# cpack needs file, bundle.sh patchelf, the site mkdocs and doxygen, check.sh the others.
bash apps/setup.sh --for build file patchelf mkdocs doxygen lintian mmdebstrap
if [[ -z $build ]]; then build=$PWD/$(bash apps/build.sh --no-cuda --no-mpi); fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$out"

(cd "$build" && cpack -G DEB -B "$work/packages")
cp "$work"/packages/*.deb "$out"

# The archive: the three programs with the libraries that they load.
name=retint-$version-linux-$(uname -m)
for component in cli viewer python; do
  cmake --install "$build" --component "$component" --strip --prefix "$work/$name" >/dev/null
done
cp LICENSE "$work/$name"
bash apps/packages/bundle.sh "$work/$name"
tar -C "$work" --owner 0 --group 0 -I 'xz -T0' -cf "$out/$name.tar.xz" "$name"

# The wheel holds the module that was just built, with the system's libraries.
cmake --install "$build" --component python --strip --prefix "$work/python" >/dev/null
/usr/bin/python3 - "$work/python/lib/python3/dist-packages" "$out" <<'PYTHON'
import pathlib
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, "apps/python")
import build_backend

root, out = map(pathlib.Path, sys.argv[1:])
files = {path.relative_to(root).as_posix(): path.read_bytes()
         for path in (root / "retint").rglob("*") if path.is_file()}
print(build_backend.write_wheel(out, files))
PYTHON

bash apps/docs/build.sh "$work/retint-$version-site"
(cd "$work" && /usr/bin/python3 -m zipfile -c "$out/retint-$version-site.zip" "retint-$version-site")

bash apps/packages/check.sh "$out"
(cd "$out" && sha256sum -- * >"$work/sums" && mv "$work/sums" SHA256SUMS)
echo "$out"
