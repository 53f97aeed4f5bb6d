#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# From photos to cameras with COLMAP, and on to a splat with a trainer of yours.
#   apps/photos.sh --photos FOLDER --output FOLDER [--camera MODEL] [--train COMMAND] [--features N]
#   --photos    the photos; one camera took them all
#   --output    the workspace to make: images, sparse/0, and splat.ply where there is a trainer
#   --camera    COLMAP's camera model of the photos (SIMPLE_RADIAL; PINHOLE where they are undistorted)
#   --train     a command that reads $WORKSPACE and writes $SPLAT, such as
#                 'opensplat "$WORKSPACE" -n 7000 --keep-crs -o "$SPLAT"'
#   --features  at most so many features a photo (8192); fewer are quicker
# Exit codes: 0 done, 2 usage, 3 the photos cannot be used, 77 COLMAP is not installed.
set -euo pipefail

fail() {
  echo "photos.sh: $1" >&2
  exit "${2:-2}"
}

photos= output= camera=SIMPLE_RADIAL train= features=8192
while (($# > 0)); do
  case $1 in
    --photos) photos=${2:?"--photos needs a folder"} ;;
    --output) output=${2:?"--output needs a folder"} ;;
    --camera) camera=${2:?"--camera needs a model such as SIMPLE_RADIAL"} ;;
    --train) train=${2:?"--train needs a command"} ;;
    --features) features=${2:?"--features needs a number"} ;;
    -h | --help) sed -n '3,12s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; exit 0 ;;
    *) fail "unknown option $1 (apps/photos.sh --help)" ;;
  esac
  shift 2
done
[[ -n $photos && -n $output ]] || fail "--photos and --output are needed (apps/photos.sh --help)"
[[ -d $photos ]] || fail "$photos: no such folder" 3
[[ ! -e $output/sparse ]] || fail "$output/sparse is there already" 3
command -v colmap >/dev/null || fail "colmap is not installed (apt-get install colmap)" 77

mkdir -p "$output/sparse" "$output/images"
cp -r "$photos/." "$output/images"
log=$output/colmap.log
# COLMAP asks for a display even where it shows nothing.
export QT_QPA_PLATFORM=offscreen
run() {
  echo "colmap $1" >&2
  colmap "$@" >>"$log" 2>&1 || fail "colmap $1 failed; $log has the reason" 3
}
# Without a GPU: Debian's COLMAP has no CUDA, and its other way needs OpenGL and a display.
run feature_extractor --database_path "$output/database.db" --image_path "$output/images" \
  --ImageReader.single_camera 1 --ImageReader.camera_model "$camera" \
  --SiftExtraction.use_gpu 0 --SiftExtraction.max_num_features "$features"
run exhaustive_matcher --database_path "$output/database.db" --SiftMatching.use_gpu 0
run mapper --database_path "$output/database.db" --image_path "$output/images" --output_path "$output/sparse"
[[ -d $output/sparse/0 ]] || fail "COLMAP found no cameras: take more photos that overlap; $log has its reasons" 3
echo "cameras:  $output/sparse"

[[ -n $train ]] || { echo "next:     train a splat on $output with a trainer of yours"; exit 0; }
export WORKSPACE=$output SPLAT=$output/splat.ply
bash -c "$train" || fail "the trainer failed: $train" 3
[[ -f $SPLAT ]] || fail "the trainer wrote no $SPLAT" 3
echo "splat:    $SPLAT"
