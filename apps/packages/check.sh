#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Checks what cpack made: apps/packages/check.sh FOLDER, the folder with the packages.
#   lintian      no package has an error
#   fresh        they install on a fresh Debian 12, and one edit, the editor and the Python module run there
#   relocatable  the archive runs from a folder of any name
# The second needs mmdebstrap, a mirror of Debian and root. A check that cannot be made here is told and left out.
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
  if mountpoint -q "$work/fresh/proc"; then umount "$work/fresh/proc"; fi
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

if ((${#packages[@]} == 0)); then
  left_out fresh "there is no .deb"
elif ! command -v mmdebstrap >/dev/null || ((EUID != 0)); then
  left_out fresh "it needs mmdebstrap and root"
else
  # Directories of the machine are not mounted into it: it is a file system of its own. Java, which VTK's
  # headers bring, cannot be installed without /proc.
  mmdebstrap --quiet --variant=apt --mode=root bookworm "$work/fresh" || { echo "check.sh: no fresh Debian" >&2; exit 1; }
  cp "${packages[@]}" "$work/try.sh" "$work/fresh/tmp"
  mount -t proc proc "$work/fresh/proc"
  inside() { chroot "$work/fresh" env DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 HOME=/root "$@"; }
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
else
  place="$work/a folder of any name"
  mkdir "$place"
  tar -C "$place" --strip-components 1 -xf "${archives[0]}"
  PATH="$place/bin:$PATH" sh "$work/try.sh"
  if [[ -d $place/lib/python3 ]]; then
    PYTHONPATH="$place/lib/python3/dist-packages" /usr/bin/python3 -c \
      'import retint; print("Python module", retint.__version__, "from", retint.__file__)'
  fi
  echo "right: the archive runs from another folder"
fi
