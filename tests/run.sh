#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Sets up the machine, builds, and runs every test. Ends with ctest's summary.
#   tests/run.sh [--sanitize address,undefined|thread] [--no-cuda] [--cuda-arch LIST] [CTEST ARGUMENT...]
# The options are those of apps/build.sh; everything else goes to ctest.
# Real captures are read from $RETINT_DATA (else shared/data beside the checkout); tests that need
# them are shown as skipped where they are missing.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

build_arguments=()
while (($# > 0)); do
  case $1 in
    --sanitize | --cuda-arch) build_arguments+=("$1" "${2:?"$1 needs a list"}"); shift 2 ;;
    --no-cuda) build_arguments+=("$1"); shift ;;
    *) break ;;
  esac
done
folder=$(bash apps/build.sh "${build_arguments[@]}" all)

suppressions=$PWD/tests/support
export ASAN_OPTIONS="strict_string_checks=1:detect_stack_use_after_return=1:${ASAN_OPTIONS:-}"
export UBSAN_OPTIONS="halt_on_error=1:print_stacktrace=1:${UBSAN_OPTIONS:-}"
export LSAN_OPTIONS="suppressions=$suppressions/lsan.supp:print_suppressions=0:${LSAN_OPTIONS:-}"
export TSAN_OPTIONS="suppressions=$suppressions/tsan.supp:halt_on_error=1:die_after_fork=0:${TSAN_OPTIONS:-}"
exec ctest --test-dir "$folder" --output-on-failure --no-tests=error -j "$(nproc)" "$@"
