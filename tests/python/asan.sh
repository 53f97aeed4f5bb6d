#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The Python tests under AddressSanitizer. Builds the module, and nothing else, in a folder of its own.
#   tests/python/asan.sh [PYTEST ARGUMENT...]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
folder=$PWD/build/sanitize-python
python=/usr/bin/python3

# -O1 compiles fastest of what runs these tests in a minute or two.
export CCACHE_NOHASHDIR=1
cmake -S . -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -DNDEBUG" \
  -DRETINT_SANITIZE=address -DRETINT_PYTHON=ON -DRETINT_CUDA=OFF -DRETINT_MPI=OFF -DRETINT_VIEWER=OFF \
  -DRETINT_TESTS=OFF -DRETINT_BENCHMARKS=OFF >/dev/null
ninja -C "$folder" ${JOBS:+-j "$JOBS"} retint_python

# The tests compare the module with the executable; here that is the module's own command line.
export RETINT_EXECUTABLE=$folder/retint
printf '#!/bin/sh\nexec %s -m retint "$@"\n' "$python" >"$RETINT_EXECUTABLE"
chmod +x "$RETINT_EXECUTABLE"
export RETINT_CACHE='' RETINT_TEST_FOLDER=$folder/scenes PYTHONPATH=$folder/apps/python

# The interpreter was built without the sanitizer, so it is loaded before all else; libstdc++ with it, or it would not
# find the functions that throw. Python's own allocator would hide from it what is used after it is freed; what is freed
# is overwritten, because the interpreter's own reads are not checked. What the interpreter leaves behind at its end is
# no leak of Retint's.
export LD_PRELOAD="$(c++ -print-file-name=libasan.so) $(c++ -print-file-name=libstdc++.so)"
export PYTHONMALLOC=malloc ASAN_OPTIONS=detect_leaks=0:max_free_fill_size=4096
# One test measures the memory of the process, of which the sanitizer keeps what is freed.
exec "$python" -B -m pytest -q -p no:cacheprovider tests/python \
  --deselect tests/python/test_session.py::test_a_thousand_sessions_leave_nothing_behind "$@"
