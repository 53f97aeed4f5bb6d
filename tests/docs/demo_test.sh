#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# How apps/demo.sh reads its command line, with programs in place of the build and of retint.
set -euo pipefail
script=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)/apps/demo.sh
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
mkdir -p "$folder/apps" "$folder/build/apps" "$folder/scene"
cp "$script" "$folder/apps"
echo 'echo build' >"$folder/apps/build.sh"
echo 'echo installed' >"$folder/apps/setup.sh"
printf '#!/bin/sh\necho "$@"\n' >"$folder/build/apps/retint"
chmod +x "$folder/build/apps/retint"
cd "$folder"
touch s.ply m.png

fail() {
  echo "demo_test.sh: $1" >&2
  exit 1
}

# The arguments that retint gets, or the exit code of what is refused.
demo() { bash apps/demo.sh "$@" 2>/dev/null | head -n 1; }
refused() {
  local code=0 wanted=$1
  shift
  bash apps/demo.sh "$@" >/dev/null 2>&1 || code=$?
  ((code == wanted)) || fail "$*: exit code $code, not $wanted"
}

paint=(s.ply --view=a.png --mask=m.png)
[[ $(demo "${paint[@]}") == *"--to #3060ff --output"* ]] || fail "a demo without an edit has none"
[[ $(demo "${paint[@]}" --to='#ff0000') != *"#3060ff"* ]] || fail "--to=COLOR is no edit"
[[ $(demo s.ply --edited a.png=b.png) == *"--edited a.png=b.png --output"* ]] ||
  fail "an edited picture needs no mask"
refused 2 s.ply --view a.png
refused 2 --view a.png --mask m.png
refused 2 "${paint[@]}" --output=x.ply
refused 2 "${paint[@]}" --no-report-html
refused 3 none --view a.png --mask m.png
refused 3 scene --splat=none.ply --view a.png --mask m.png
