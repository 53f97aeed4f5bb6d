// SPDX-License-Identifier: BSD-3-Clause
// The conditions for pictures before work on them begins.
#pragma once

#include <string>

#include "base/error.h"
#include "scene/camera.h"
#include "scene/image.h"

namespace retint {

std::string SizeText(int width, int height);  // "64x48"

// InputError "WHAT is 64x48, the view is 80x60" unless a picture has its camera's size.
void RequireSize(const std::string& what, int width, int height, const Camera& camera);
template <typename T, int C>
void RequireSize(const std::string& what, const PixelArray<T, C>& picture, const Camera& camera) {
  RequireSize(what, picture.width, picture.height, camera);
}

// Whether any pixel is selected at all, however softly.
bool AnySet(const Mask& mask);

}  // namespace retint
