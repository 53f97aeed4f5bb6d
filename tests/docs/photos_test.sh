#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# docs/tutorials/photos.md, from photos to a recolored splat: photos_test.sh RETINT. Photos are those of the sample scene, whose
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
"$retint" synth --output truth --width 320 --height 240 --photos 7 --quiet

bash "$here/../../apps/photos.sh" --photos truth/images --output scene --camera PINHOLE --features 1200 \
  --train 'cp truth/splat.ply "$SPLAT"' || { tail -n 30 scene/colmap.log; exit 1; }
# COLMAP chooses origin, turn and scale as it likes. A trainer would follow it; the sample's splat cannot. So COLMAP moves
# its cameras near to where the sample's are, and `retint align` finds what is left.
colmap model_converter --input_path truth/sparse/0 --output_path truth --output_type TXT >>scene/colmap.log 2>&1
# Of "ID QW QX QY QZ TX TY TZ CAMERA NAME": the name and the center, -R^T t.
awk '!/^#/ && ++line % 2 == 1 {
  w = $2; x = $3; y = $4; z = $5
  print $10, -((1 - 2 * (y * y + z * z)) * $6 + 2 * (x * y + w * z) * $7 + 2 * (x * z - w * y) * $8), \
    -(2 * (x * y - w * z) * $6 + (1 - 2 * (x * x + z * z)) * $7 + 2 * (y * z + w * x) * $8), \
    -(2 * (x * z + w * y) * $6 + 2 * (y * z - w * x) * $7 + (1 - 2 * (x * x + y * y)) * $8)
}' truth/images.txt >centers.txt
mkdir moved
colmap model_aligner --input_path scene/sparse/0 --output_path moved --ref_images_path centers.txt --ref_is_gps 0 \
  --alignment_type custom --robust_alignment 1 --robust_alignment_max_error 0.02 >>scene/colmap.log 2>&1 ||
  { tail -n 30 scene/colmap.log; exit 1; }
mv moved/* scene/sparse/0
"$retint" align scene --compare 2 --transform scene/t.json | tee align.txt
mask=$(find truth/masks -name '*.png')
view=$(basename "$mask" .png)
"$retint" recolor scene --world-from-splat scene/t.json --view "$view" \
  --mask "$mask" --to '#3060ff' --output blue.ply --save-stages stages --quiet

# COLMAP's cameras are good where renders from them look like the photos: 26 dB at this size. A wrong alignment stays
# below 20.
psnr=$(sed -n 's/^PSNR .* before, \([0-9.]*\) dB after.*/\1/p' align.txt)
awk -v psnr="$psnr" 'BEGIN { exit !(psnr > 22) }' || { echo "PSNR $psnr after the alignment"; exit 1; }
# The box that was painted in one view is found in the others.
"$retint" score --truth truth/truth/masks/box --masks stages/masks --painted "$view" | tee score.txt
iou=$(awk '$1 == "mean" { print $2; exit }' score.txt)
awk -v iou="$iou" 'BEGIN { exit !(iou > 0.6) }' || { echo "IoU $iou"; exit 1; }
