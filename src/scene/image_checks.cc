// SPDX-License-Identifier: BSD-3-Clause
#include "scene/image_checks.h"

#include <algorithm>

namespace retint {

std::string SizeText(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

void RequireSize(const std::string& what, int width, int height, const Camera& camera) {
  if (width == camera.width && height == camera.height) return;
  throw InputError(what + " is " + SizeText(width, height) + ", the view is " +
                   SizeText(camera.width, camera.height));
}

bool AnySet(const Mask& mask) {
  return std::any_of(mask.data.begin(), mask.data.end(), [](uint8_t value) { return value > 0; });
}

}  // namespace retint
