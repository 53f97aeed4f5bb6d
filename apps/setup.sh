#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs the packages that building and testing Retint need on Debian 12 (as root or with sudo).
# Safe to run again: without a missing package it changes nothing and takes no time.
#   apps/setup.sh [PACKAGE...]   PACKAGE: what is to be installed beside them
set -euo pipefail

packages=(
  build-essential cmake ninja-build ccache
  libeigen3-dev libglm-dev libtbb-dev libhwy-dev libceres-dev libopencv-dev libpcl-dev
  libjpeg62-turbo-dev libcli11-dev nlohmann-json3-dev libspdlog-dev
  pkg-config zlib1g-dev libzstd-dev libwebp-dev libzip-dev
  libopencolorio-dev
  libopenmpi-dev openmpi-bin
  libgtest-dev libgmock-dev libbenchmark-dev clang-format-14
  colmap
  python3-dev python3-numpy python3-pybind11 pybind11-dev python3-pytest
  qt6-base-dev qt6-qpa-plugins libgl1-mesa-dri fonts-dejavu-core xvfb xauth
  mkdocs doxygen
  "$@"
)

if [[ ${RETINT_SKIP_SETUP:-} == 1 ]]; then exit 0; fi
if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
  echo "setup.sh: this is not a Debian system. Install the equivalents of: ${packages[*]}" >&2
  echo "setup.sh: then set RETINT_SKIP_SETUP=1." >&2
  exit 1
fi

# dpkg-query fails when it does not know a package; what it knows is listed all the same.
installed=" $(dpkg-query -W -f='${db:Status-Status}:${binary:Package}\n' "${packages[@]}" 2>/dev/null |
  sed -n 's/^installed:\([^:]*\).*/\1/p' | tr '\n' ' ' || true) "
missing=()
for package in "${packages[@]}"; do
  [[ $installed == *" $package "* ]] || missing+=("$package")
done
if ((${#missing[@]} == 0)); then exit 0; fi

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
