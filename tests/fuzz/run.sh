#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# run.sh TARGET [SECONDS]: builds one libFuzzer program with clang, AddressSanitizer and UBSan, and runs it on its seeds.
# What it finds is left in build/fuzz/found/TARGET; the corpus grows in build/fuzz/corpus/TARGET.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
target=${1:?usage: run.sh TARGET [SECONDS]}
seconds=${2:-600}
CC=${CC:-clang} CXX=${CXX:-clang++} cmake -S . -B build/fuzz -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo \
  -DRETINT_FUZZERS=ON -DRETINT_CUDA=OFF -DRETINT_VIEWER=OFF -DRETINT_PYTHON=OFF -DRETINT_BENCHMARKS=OFF >/dev/null
cmake --build build/fuzz --target "fuzz_$target"
mkdir -p "build/fuzz/corpus/$target" "build/fuzz/found/$target"
program=build/fuzz/tests/fuzz/fuzz_$target
"$program" --seeds "build/fuzz/corpus/$target"
# A reader may take 64 KiB and 256 times the file (splat_io/compression.h); files are 8 KiB at most here.
"$program" "build/fuzz/corpus/$target" -max_total_time="$seconds" -max_len=8192 -timeout=20 -rss_limit_mb=2048 \
  -malloc_limit_mb=256 -artifact_prefix="build/fuzz/found/$target/" -print_final_stats=1
