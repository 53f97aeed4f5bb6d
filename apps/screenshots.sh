#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Takes the pictures of docs/viewer.md anew, from a synthetic workspace, without a display.
#   apps/screenshots.sh [FOLDER]    default docs/images
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

output=$(realpath -m "${1:-docs/images}")
folder=$(bash apps/build.sh retint screenshots)
workspace=$(mktemp -d)
trap 'rm -rf "$workspace"' EXIT
"$folder/apps/retint" synth --output "$workspace/still-life" --quiet
# On a screen of usual size: the window's first layout depends on it.
xvfb-run -a -s "-screen 0 1920x1200x24" "$folder/tests/viewer/screenshots" "$workspace/still-life" "$output"
ls -l "$output"/viewer-*.jpg
