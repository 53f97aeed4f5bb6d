#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Sets up the machine, configures and builds. The second time only what changed is built.
#   apps/build.sh [--sanitize LIST] [--no-cuda] [--cuda-arch LIST] [--jobs N] [TARGET...]
#   TARGET            what to build: programs (the command line, the editor, the Python module) when none is named;
#                     all for tests and benchmarks too
#   --sanitize LIST   address,undefined or thread; each kind has a folder of its own below build/
#   --no-cuda         leave the CUDA backend out; else it is built where a CUDA compiler is found
#   --cuda-arch LIST  the GPU generations to build it for, such as 86-real or "80-real;90-real" or all-major;
#                     else those of the GPUs in this machine, or a list that runs on all of them where it has none
# The last line on stdout names the folder.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

sanitize=
cuda=AUTO
cuda_arch=
jobs=
while (($# > 0)); do
  case $1 in
    --sanitize) sanitize=${2:?"--sanitize needs a list such as address,undefined"}; shift 2 ;;
    --no-cuda) cuda=OFF; shift ;;
    --cuda-arch) cuda_arch=${2:?"--cuda-arch needs a list such as 86-real or all-major"}; shift 2 ;;
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

# What another checkout has compiled is found too.
export CCACHE_NOHASHDIR=1 CCACHE_BASEDIR=$PWD
settings=(-DCMAKE_BUILD_TYPE=$type -DRETINT_SANITIZE="$sanitize" -DRETINT_CUDA=$cuda)
if [[ -n $cuda_arch ]]; then
  settings+=(-DCMAKE_CUDA_ARCHITECTURES="$cuda_arch")
else
  settings+=(-UCMAKE_CUDA_ARCHITECTURES)
fi
{
  # Configured anew when asked for something else than the last time.
  if [[ ! -f $folder/build.ninja || $(cat "$folder/settings.txt" 2>/dev/null) != "${settings[*]}" ]]; then
    cmake -S . -B "$folder" -G Ninja "${settings[@]}"
    echo "${settings[*]}" >"$folder/settings.txt"
  fi
  ninja -C "$folder" -j "$jobs" "${@:-programs}"
} >&2
echo "$folder"
