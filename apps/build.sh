#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Sets up the machine, configures and builds. The second time only what changed is built.
#   apps/build.sh [--sanitize LIST] [--no-cuda] [--no-mpi] [--cuda-arch LIST] [--quick] [--jobs N] [TARGET...]
#   TARGET            what to build: programs (the command line, the editor, the Python module) when none is named;
#                     all for tests and benchmarks too
#   --sanitize LIST   address,undefined or thread; each kind has a folder of its own below build/
#   --no-cuda         leave the CUDA backend out; else it is built if a CUDA compiler and a GPU are found
#   --no-mpi          leave MPI out (docs/cluster.md), as apps/packages/release.sh does
#   --cuda-arch LIST  the GPU generations to build it for, such as 86-real or "80-real;90-real" or all-major, also
#                     without a GPU; else those of the GPUs in this machine
#   --quick           only the command line, for apps/demo.sh: from few packages, in few large pieces, and with less
#                     optimization (apps/quick.cmake), into build/quick
# The last line on stdout names the folder.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

sanitize=
cuda=AUTO
mpi=ON
cuda_arch=
jobs=
quick=false
while (($# > 0)); do
  case $1 in
    --sanitize) sanitize=${2:?"--sanitize needs a list such as address,undefined"}; shift 2 ;;
    --no-cuda) cuda=OFF; shift ;;
    --no-mpi) mpi=OFF; shift ;;
    --cuda-arch) cuda_arch=${2:?"--cuda-arch needs a list such as 86-real or all-major"}; shift 2 ;;
    --quick) quick=true; shift ;;
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
targets=("${@:-programs}")
if $quick; then
  if [[ -n $sanitize || ${*:-retint} != retint ]]; then
    echo "build.sh: --quick builds retint alone, without --sanitize" >&2
    exit 2
  fi
  folder=build/quick
  targets=(retint)
fi

# All targets need all packages. A folder that was made for them is kept so: its programs are built in the same way.
group=build
if [[ $(cat "$folder/settings.txt" 2>/dev/null) == *RETINT_COMPLETE=ON* ]]; then group='test'; fi
for target in "${targets[@]}"; do
  case $target in
    programs | retint | retint-viewer | retint_python | retint_python_asan | retint_manual | retint_viewer_manual) ;;
    *) group='test' ;;
  esac
done
if $quick; then group=demo; fi
bash apps/setup.sh --for $group >&2

# CUDA code takes minutes to compile, and without a GPU nothing runs it.
if [[ $cuda == AUTO && -z $cuda_arch &&
  ! $(timeout 30 nvidia-smi --query-gpu=compute_cap --format=csv,noheader 2>/dev/null) =~ [0-9]\.[0-9] ]]; then
  echo "build.sh: no GPU was found, so the CUDA backend is left out; --cuda-arch LIST builds it all the same" >&2
  cuda=OFF
fi

# A translation unit with PCL or Ceres takes more than 1 GB, a piece of several more than 2: no more jobs than memory
# allows.
if [[ -z $jobs ]]; then
  jobs=$(nproc) kb_each=1500000
  if $quick; then kb_each=2500000; fi
  memory_kb=$(sed -n 's/^MemAvailable: *\([0-9]*\).*/\1/p' /proc/meminfo)
  fitting=$((memory_kb / kb_each))
  ((fitting < jobs)) && jobs=$((fitting > 0 ? fitting : 1))
fi

# What another checkout has compiled is found too.
export CCACHE_NOHASHDIR=1 CCACHE_BASEDIR=$PWD
settings=(-DCMAKE_BUILD_TYPE="$type" -DRETINT_SANITIZE="$sanitize" -DRETINT_CUDA="$cuda" -DRETINT_MPI="$mpi")
if [[ -n $cuda_arch ]]; then
  settings+=(-DCMAKE_CUDA_ARCHITECTURES="$cuda_arch")
else
  settings+=(-UCMAKE_CUDA_ARCHITECTURES)
fi
case $group in
  test) settings+=(-DRETINT_COMPLETE=ON) ;;
  demo)
    settings+=(-DRETINT_QUICK=ON -DRETINT_TESTS=OFF -DRETINT_VIEWER=OFF -DRETINT_PYTHON=OFF -DRETINT_MPI=OFF)
    if [[ -d build/unpacked ]]; then settings+=(-DRETINT_UNPACKED="$PWD/build/unpacked"); fi ;;
esac
configure() { cmake -S . -B "$folder" -G Ninja "${settings[@]}" "$@"; }
{
  # Configured anew when asked for something else than the last time.
  if [[ ! -f $folder/build.ninja || $(cat "$folder/settings.txt" 2>/dev/null) != "${settings[*]}" ]]; then
    configure
    echo "${settings[*]}" >"$folder/settings.txt"
  fi
  if ! ninja -C "$folder" -j "$jobs" "${targets[@]}"; then
    $quick || exit 1
    echo "build.sh: a piece of several sources does not compile (apps/quick.cmake); compiling them one by one" >&2
    configure -DRETINT_PIECES=OFF
    ninja -C "$folder" -j "$jobs" "${targets[@]}"
  fi
} >&2
echo "$folder"
