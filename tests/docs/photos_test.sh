#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# docs/pipelines.md, from photos to a recolored splat: photos_test.sh RETINT. Photos are those of the sample scene, whose
# own splat takes the place of a trained one: it is right, but in another frame than COLMAP's.
set -euo pipefail
retint=$1
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
if ! command -v colmap >/dev/null; then
  echo "colmap is not installed"
  exit 77
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
"$retint" synth --output truth --width 400 --height 300 --views 8 --quiet

bash "$here/../../apps/photos.sh" --photos truth/images --output scene --camera PINHOLE --features 1500 \
  --train 'cp truth/splat.ply "$SPLAT"' || { tail -n 30 scene/colmap.log; exit 1; }
"$retint" align --workspace scene --splat scene/splat.ply --transform scene/t.json | tee align.txt
mask=$(find truth/masks -name '*.png')
view=$(basename "$mask" .png)
"$retint" recolor --workspace scene --splat scene/splat.ply --world-from-splat scene/t.json --view "$view" \
  --mask "$mask" --to '#3060ff' --output blue.ply --save-stages stages --quiet

# COLMAP's cameras are good where renders from them look like the photos. The renders of the splat from the true
# cameras reach 30 dB; a wrong alignment stays below 20.
psnr=$(sed -n 's/^PSNR .* before, \([0-9.]*\) dB after.*/\1/p' align.txt)
awk -v psnr="$psnr" 'BEGIN { exit !(psnr > 24) }' || { echo "PSNR $psnr after the alignment"; exit 1; }
# The box that was painted in one view is found in the others.
"$retint" score --truth truth/truth/masks/box --masks stages/masks --painted "$view" | tee score.txt
iou=$(awk '$1 == "mean" { print $2; exit }' score.txt)
awk -v iou="$iou" 'BEGIN { exit !(iou > 0.6) }' || { echo "IoU $iou"; exit 1; }
