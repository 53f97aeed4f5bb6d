// SPDX-License-Identifier: BSD-3-Clause
// Internal to editing: a view as it was when somebody took it into another program.
#pragma once

#include <span>

#include "opening/open_scene.h"
#include "recolor/color_edit.h"
#include "recolor/picture_edit.h"

namespace retint {

// The render of the picture's view with the coefficients `sh`, or its photo: whichever the picture
// was made from. sRGB in [0, 1], the view's size.
Image ViewBefore(const EditedPicture& picture, OpenScene& scene, std::span<const float> sh);

// The view as the operations `before` leave it, in 8 bits where it was handed out. `share`: how
// much of each pixel they change.
Image BeforePicture(const EditedPicture& picture, const ColorEdit& before, const Mask& share,
                    OpenScene& scene, std::span<const float> sh);

}  // namespace retint
