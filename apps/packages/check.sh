#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Checks the files of a release: apps/packages/check.sh FOLDER, the folder with packages or an archive.
#   lintian      no package has an error
#   fresh        they install on a fresh Debian 12, and one edit, the editor and the Python module run there
#   relocatable  the archive runs on a fresh Debian 12 and 13, from a folder of any name, beside libexpat and nothing else;
#                so does its Python module where Python is 3.11
# The last two need mmdebstrap, a mirror of Debian and root. The script says which check cannot be made here.
# Exit codes: 0 what could be checked is right, 1 something is wrong, 2 usage.
set -euo pipefail
folder=${1:-}
shopt -s nullglob
packages=("$folder"/*.deb)
archives=("$folder"/*.tar.xz)
if [[ -z $folder ]] || ((${#packages[@]} + ${#archives[@]} == 0)); then
  echo "check.sh: name the folder in which cpack left packages" >&2
  exit 2
fi
work=$(mktemp -d)
clean() {
  for root in "$work"/root-*; do
    if mountpoint -q "$root/proc"; then umount "$root/proc"; fi
  done
  rm -rf --one-file-system "$work"
}
trap clean EXIT
left_out() { echo "left out: $1: $2"; }

# What a user does first, with the programs in the PATH.
cat >"$work/try.sh" <<'TRY'
set -eu
cd "$(mktemp -d)"
retint --version
retint synth --output scene --width 120 --height 90 --photos 4 --quiet
mask=$(find scene/truth/masks/ball -name '002*')
retint recolor scene --view 002.png --mask "$mask" --to '#3060ff' --output a.ply --quiet
test -s a.ply
QT_QPA_PLATFORM=offscreen retint-viewer --version
TRY

if ((${#packages[@]} == 0)); then
  left_out lintian "there is no .deb"
elif command -v lintian >/dev/null; then
  lintian --fail-on error --tag-display-limit 0 "${packages[@]}"
  echo "right: lintian finds no error in ${#packages[@]} packages"
else
  left_out lintian "it is not installed"
fi

# make_root SUITE [PACKAGE...]: a system of its own, in which no directory of this machine is mounted. Java, which VTK's
# headers bring, cannot be installed without /proc.
make_root() {
  root=$work/root-$1
  if mountpoint -q "$root/proc"; then umount "$root/proc"; fi
  rm -rf --one-file-system "$root"
  mmdebstrap --quiet --variant=apt --mode=root --include="$(IFS=,; echo "${*:2}")" "$1" "$root" ||
    { echo "check.sh: no fresh $1" >&2; exit 1; }
  cp "$work/try.sh" "$root/tmp"
  mount -t proc proc "$root/proc"
}
inside() { chroot "$root" env DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 HOME=/root "$@"; }
roots=true
if ! command -v mmdebstrap >/dev/null || ((EUID != 0)); then roots=false; fi

if ((${#packages[@]} == 0)); then
  left_out fresh "there is no .deb"
elif ! $roots; then
  left_out fresh "it needs mmdebstrap and root"
else
  make_root bookworm ca-certificates
  cp "${packages[@]}" "$root/tmp"
  inside apt-get -q update
  inside sh -c 'apt-get -q install -y --no-install-recommends /tmp/*.deb'
  inside sh /tmp/try.sh
  inside python3 -c 'import retint; print("Python module", retint.__version__)'
  inside dpkg --audit
  # Found by what they bring, since packages with CUDA have names of their own.
  inside sh -c 'dpkg -S man1/retint.1.gz && dpkg -S man1/retint-viewer.1.gz'
  echo "right: they install on a fresh Debian 12 and work there"
fi

if ((${#archives[@]} == 0)); then
  left_out relocatable "there is no .tar.xz"
elif ! $roots; then
  left_out relocatable "it needs mmdebstrap and root"
else
  for suite in bookworm trixie; do
    make_root "$suite" libexpat1 python3-numpy
    place="/opt/a folder of any name"
    mkdir "$root$place"
    tar -C "$root$place" --strip-components 1 -xf "${archives[0]}"
    inside env PATH="$place/bin:/usr/bin:/bin" sh /tmp/try.sh
    if [[ -n $(find "$root/usr/bin" -name python3.11) ]]; then
      inside env PYTHONPATH="$place/lib/python3/dist-packages" python3 -c \
        'import retint; print("Python module", retint.__version__, "from", retint.__file__)'
    fi
    echo "right: the archive runs on a fresh $suite"
  done
fi
