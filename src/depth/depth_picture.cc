// SPDX-License-Identifier: BSD-3-Clause
#include "depth/depth_picture.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "base/error.h"
#include "base/median.h"
#include "scene/mask_pixels.h"

namespace retint {

Image8 DepthPicture(const DepthMap& depth, const Mask& valid) {
  CheckOption(valid.Empty() || (valid.width == depth.width && valid.height == depth.height),
              "a depth map and its validity must have one size");
  Image8 picture(depth.width, depth.height, 0);
  const auto known = [](float d) { return std::isfinite(d) && d > 0; };
  std::vector<float> inverse;
  inverse.reserve(depth.data.size());
  for (const float d : depth.data) {
    if (known(d)) inverse.push_back(1 / d);
  }
  if (inverse.empty()) return picture;
  const float low = Quantile(inverse, 0.01);
  const float span = std::max(Quantile(inverse, 0.99) - low, 1e-6f * low);

  cv::Mat ramp(1, 256, CV_8U), colors;
  for (int i = 0; i < 256; ++i) ramp.at<uint8_t>(i) = uint8_t(i);
  cv::applyColorMap(ramp, colors, cv::COLORMAP_TURBO);
  for (size_t i = 0; i < depth.data.size(); ++i) {
    if (!known(depth.data[i])) continue;
    const float level = std::clamp((1 / depth.data[i] - low) / span, 0.0f, 1.0f);
    const cv::Vec3b bgr = colors.at<cv::Vec3b>(int(std::lround(level * 255)));
    const bool dim = !valid.Empty() && !IsInside(valid.data[i]);
    for (int c = 0; c < 3; ++c)
      picture.data[3 * i + c] = uint8_t(dim ? bgr[2 - c] / 2 : bgr[2 - c]);
  }
  return picture;
}

}  // namespace retint
