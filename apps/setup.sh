#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs the packages that Retint needs on Debian 12 (as root or with sudo).
# Safe to run again: without a missing package it changes nothing and takes no time.
#   apps/setup.sh [--for demo|build|test|docs] [PACKAGE...]
#   --for demo    what the command line needs. Headers of large packages are only unpacked, into build/unpacked
#   --for build   what the command line, the editor and the Python module need (the default)
#   --for test    what all targets, .ci/run and the site need
#   --for docs    what the site needs
#   PACKAGE       to be installed too, for example chromium
# With RETINT_SKIP_SETUP=1 it does nothing.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

group=build
if [[ ${1:-} == --for ]]; then
  group=${2:?"--for needs demo, build, test or docs"}
  shift 2
fi

compilers=(build-essential cmake ninja-build pkg-config)
libraries=(
  libeigen3-dev libglm-dev libtbb-dev libhwy-dev libceres-dev libjpeg62-turbo-dev libcli11-dev nlohmann-json3-dev
  libspdlog-dev zlib1g-dev libzstd-dev libwebp-dev libzip-dev libopencolorio-dev
)
programs=(
  ccache libopencv-dev libpcl-dev libopenmpi-dev openmpi-bin
  python3-dev python3-numpy python3-pybind11 pybind11-dev
  qt6-base-dev qt6-qpa-plugins libqt6svg6 libgl1-mesa-dri
)
docs=(python3 mkdocs doxygen)
tests=(
  libgtest-dev libgmock-dev libbenchmark-dev clang-format-14 colmap python3-pytest python3-scipy python3-pil
  fonts-dejavu-core xvfb xauth
)
# Debian's libopencv-dev and libpcl-dev bring almost 600 packages, among them Java and Qt 5. The demo needs only
# these libraries and the headers of these packages; apps/unpacked.cmake finds both.
demo=(libopencv-imgcodecs406 libopencv-calib3d406 libpcl-kdtree1.13)
headers=(
  libopencv-core-dev libopencv-imgproc-dev libopencv-imgcodecs-dev libopencv-calib3d-dev libopencv-features2d-dev
  libopencv-flann-dev libpcl-dev libflann-dev libboost1.74-dev
)

case $group in
  demo) packages=("${compilers[@]}" "${libraries[@]}" "${demo[@]}") ;;
  build) packages=("${compilers[@]}" "${libraries[@]}" "${programs[@]}") ;;
  test) packages=("${compilers[@]}" "${libraries[@]}" "${programs[@]}" "${docs[@]}" "${tests[@]}") ;;
  docs) packages=("${docs[@]}") ;;
  *) echo "setup.sh: --for takes demo, build, test or docs" >&2; exit 2 ;;
esac
packages+=("$@")

if [[ ${RETINT_SKIP_SETUP:-} == 1 ]]; then exit 0; fi
if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
  if [[ $group == demo ]]; then packages+=(libopencv-dev libpcl-dev); fi
  echo "setup.sh: this is not a Debian system. Install the equivalents of: ${packages[*]}" >&2
  echo "setup.sh: then set RETINT_SKIP_SETUP=1." >&2
  exit 1
fi

# missing_of PACKAGE...: those that are not installed. dpkg-query fails if it does not know a package; the packages that
# it knows are listed all the same.
missing_of() {
  local installed package
  installed=" $(dpkg-query -W -f='${db:Status-Status}:${binary:Package}\n' "$@" 2>/dev/null |
    sed -n 's/^installed:\([^:]*\).*/\1/p' | tr '\n' ' ' || true) "
  for package in "$@"; do
    if [[ $installed != *" $package "* ]]; then echo "$package"; fi
  done
}
mapfile -t missing < <(missing_of "${packages[@]}")

if ((${#missing[@]} > 0)); then
  as_root=()
  if ((EUID != 0)); then
    if ! command -v sudo >/dev/null; then
      echo "setup.sh: missing packages; as root: apt-get install ${missing[*]}" >&2
      exit 1
    fi
    as_root=(sudo)
  fi
  apt() {
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -o DPkg::Lock::Timeout=300 "$@"
  }
  echo "setup.sh: installing ${missing[*]}"
  apt update
  apt install -y --no-install-recommends "${missing[@]}"
fi

# Whoever has the packages themselves needs no headers beside them.
if [[ $group == demo && ! -e build/unpacked && -n $(missing_of "${headers[@]}") ]]; then
  echo "setup.sh: unpacking ${headers[*]}"
  mkdir -p build
  unpacked=$(mktemp -d build/unpacking.XXXXXX)
  trap 'rm -rf "$unpacked"' EXIT
  (cd "$unpacked" && apt-get -q download "${headers[@]}")
  for package in "$unpacked"/*.deb; do dpkg-deb -x "$package" "$unpacked"; done
  rm "$unpacked"/*.deb
  chmod 755 "$unpacked"
  mv "$unpacked" build/unpacked
fi
