// SPDX-License-Identifier: BSD-3-Clause
// Synthetic scenes photographed through a lens.
#pragma once

#include <string_view>

#include "base/monitor.h"
#include "synthetic/synthetic_scene.h"

namespace retint {

// A camera of the model of that name, with a distortion as strong as real lenses have, whose field
// holds that of the pinhole `camera`: the same focal length in the middle, and the same size but
// for EQUIRECTANGULAR, whose pictures are four times as wide and half as high as that. OptionError
// for other models than SIMPLE_RADIAL, OPENCV, OPENCV_FISHEYE and EQUIRECTANGULAR.
Camera MakeLens(std::string_view model, const Camera& camera);

// Takes the photos of `scene`, which MakeSyntheticScene(options) made, anew through MakeLens():
// camera, photos, depth (the distance along the ray for EQUIRECTANGULAR), object ids, normals and
// observations. The Gaussians, the points and the poses stay.
void TakeThroughLens(std::string_view model, const SyntheticOptions& options, SyntheticScene* scene,
                     Monitor& monitor);
// The same through any lens whose field holds that of the scene's camera.
void TakeThroughLens(Camera lens, const SyntheticOptions& options, SyntheticScene* scene,
                     Monitor& monitor);

}  // namespace retint
