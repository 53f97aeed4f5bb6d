#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Puts beside installed programs the libraries that they load, so that the folder runs on other systems, from any place:
#   apps/packages/bundle.sh PREFIX    where `cmake --install` has put the command line, the editor and the Python module
# The libraries go to PREFIX/lib/retint, Qt's plugins to PREFIX/lib/retint/plugins, all licenses to
# PREFIX/share/doc/retint/licenses. The system must have glibc 2.35 or newer, libstdc++ of GCC 12 or newer, and libexpat:
# Debian's need a newer glibc. Needs patchelf.
set -euo pipefail
prefix=$(realpath "${1:?"usage: bundle.sh PREFIX"}")
most_glibc=2.35 # of Ubuntu 22.04
command -v patchelf >/dev/null || { echo "bundle.sh: patchelf is not installed" >&2; exit 1; }
libraries=$prefix/lib/retint plugins=$prefix/lib/retint/plugins
mkdir -p "$libraries"

# A desktop's platform; and the one without a screen, for `retint-viewer --version`.
if [[ -x $prefix/bin/retint-viewer ]]; then
  qt=$(qtpaths6 --query QT_INSTALL_PLUGINS 2>/dev/null || echo /usr/lib/"$(uname -m)"-linux-gnu/qt6/plugins)
  mkdir -p "$plugins/platforms"
  cp "$qt"/platforms/libq{xcb,offscreen,minimal}.so "$plugins/platforms"
  for kind in imageformats platforminputcontexts; do
    if [[ -d $qt/$kind ]]; then cp -r "$qt/$kind" "$plugins"; fi
  done
  printf '[Paths]\nPrefix = ..\nPlugins = lib/retint/plugins\n' >"$prefix/bin/qt.conf"
fi

mapfile -t programs < <(find "$prefix/bin" "$prefix/lib" -type f \( -name '*.so*' -o -perm -u+x \) -exec \
  sh -c 'head -c 4 "$1" | grep -q ELF' - {} \; -print)
# ldd names what a library needs, and where that was found; also for what it needs in turn.
missing=$(ldd "${programs[@]}" | grep 'not found' || true)
[[ -z $missing ]] || { echo "bundle.sh: $missing" >&2; exit 1; }
ldd "${programs[@]}" | awk '$3 ~ /^\// { print $1, $3 }' | sort -u | while read -r name file; do
  case $name in
    libc.so.6 | libm.so.6 | libdl.so.2 | libpthread.so.0 | librt.so.1 | libresolv.so.2 | libutil.so.1) continue ;;
    libstdc++.so.6 | libgcc_s.so.1 | libexpat.so.1) continue ;;
    libcuda.so.1 | libnvidia*) continue ;; # of the driver
  esac
  cp -L "$file" "$libraries/${name##*/}"
  readlink -f "$file"
done >"$prefix/bundled"

# Where each looks for the others, from its own place.
while read -r -d '' file; do
  if head -c 4 "$file" | grep -q ELF; then
    chmod u+w "$file"
    patchelf --set-rpath "\$ORIGIN/$(realpath --relative-to "$(dirname "$file")" "$libraries")" "$file"
  fi
done < <(find "$prefix/bin" "$prefix/lib" -type f -print0)

licenses=$prefix/share/doc/retint/licenses
mkdir -p "$licenses"
# dpkg knows some of them below /lib, which is /usr/lib.
while read -r file; do dpkg -S "$file" 2>/dev/null || dpkg -S "${file#/usr}"; done <"$prefix/bundled" |
  cut -d: -f1 | sort -u | while read -r package; do
  cp -L "/usr/share/doc/$package/copyright" "$licenses/$package"
done
rm "$prefix/bundled"

newest() { objdump -T "$1" 2>/dev/null | grep -o 'GLIBC_2\.[0-9]*' | sort -Vu | tail -n 1; }
too_new=$(find "$prefix/bin" "$prefix/lib" -type f | while read -r file; do
  version=$(newest "$file" || true)
  if [[ -n $version && $(printf '%s\n' "GLIBC_$most_glibc" "$version" | sort -V | tail -n 1) != "GLIBC_$most_glibc" ]]
  then echo "$file: $version"; fi
done)
[[ -z $too_new ]] || { echo "bundle.sh: these need a glibc newer than $most_glibc (was MPI built in?): $too_new" >&2; exit 1; }
du -sh "$prefix" | cut -f1
