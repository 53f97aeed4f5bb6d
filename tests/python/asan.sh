#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The Python tests under AddressSanitizer, which is in the bindings alone (apps/python). What it needs is built.
#   tests/python/asan.sh [PYTEST ARGUMENT...]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
folder=$PWD/build/release
python=/usr/bin/python3
if [[ ! -f $folder/build.ninja ]]; then bash apps/build.sh retint_python_asan; fi
ninja -C "$folder" ${JOBS:+-j "$JOBS"} retint_python_asan retint

export RETINT_EXECUTABLE=$folder/apps/retint RETINT_CACHE='' RETINT_TEST_FOLDER=$folder/asan-scenes
export PYTHONPATH=$folder/apps/python/asan

# The interpreter was built without the sanitizer, so it is loaded before all else; libstdc++ with it, or it would not
# find the functions that throw. Python's own allocator would hide from it what is used after it is freed; what is freed
# is overwritten, because the interpreter's own reads are not checked. What the interpreter leaves behind at its end is
# no leak of Retint's.
export LD_PRELOAD="$(c++ -print-file-name=libasan.so) $(c++ -print-file-name=libstdc++.so)"
export PYTHONMALLOC=malloc ASAN_OPTIONS=detect_leaks=0:max_free_fill_size=4096
# One test measures the memory of the process, of which the sanitizer keeps what is freed.
exec "$python" -B -m pytest -q -p no:cacheprovider tests/python \
  --deselect tests/python/test_session.py::test_a_thousand_sessions_leave_nothing_behind "$@"
