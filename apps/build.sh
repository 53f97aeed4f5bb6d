#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Sets up the machine, configures and builds. The second time only what changed is built.
#   apps/build.sh [--sanitize LIST] [--jobs N] [TARGET...]
# LIST is address,undefined or thread. Each kind has a folder of its own below build/; the last line
# on stdout names it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

sanitize=
jobs=
while (($# > 0)); do
  case $1 in
    --sanitize) sanitize=${2:?"--sanitize needs a list such as address,undefined"}; shift 2 ;;
    --jobs) jobs=${2:?"--jobs needs a number"}; shift 2 ;;
    --) shift; break ;;
    -*) echo "build.sh: unknown option $1" >&2; exit 2 ;;
    *) break ;;
  esac
done
case $sanitize in
  '') folder=build/release type=Release ;;
  address,undefined | undefined,address | address | undefined | thread)
    folder=build/sanitize-${sanitize//,/-} type=RelWithDebInfo ;;
  *) echo "build.sh: --sanitize takes address,undefined or thread" >&2; exit 2 ;;
esac

bash apps/setup.sh >&2

# A translation unit with PCL or Ceres takes more than 1 GB: no more jobs than memory allows.
if [[ -z $jobs ]]; then
  jobs=$(nproc)
  memory_kb=$(sed -n 's/^MemAvailable: *\([0-9]*\).*/\1/p' /proc/meminfo)
  fitting=$((memory_kb / 1500000))
  ((fitting < jobs)) && jobs=$((fitting > 0 ? fitting : 1))
fi

export CCACHE_NOHASHDIR=1
{
  if [[ ! -f $folder/build.ninja ]]; then
    cmake -S . -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=$type -DRETINT_SANITIZE="$sanitize"
  fi
  ninja -C "$folder" -j "$jobs" "$@"
} >&2
echo "$folder"
