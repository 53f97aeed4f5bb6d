// SPDX-License-Identifier: BSD-3-Clause
#include "editing/jpeg_noise.h"

#include <algorithm>
#include <optional>
#include <string>

#include <opencv2/imgproc.hpp>

#include "base/color_difference.h"
#include "base/files.h"
#include "colmap_io/image_io.h"
#include "colmap_io/webp_copy.h"
#include "editing/picture_changes.h"
#include "scene/contact_sheet.h"

namespace retint {

ScalarImage LeastChanges(const Image8& picture, const Image& view,
                         const std::filesystem::path& file) {
  constexpr float kOverNoise = 4;  // times the noise that the file has nearby
  // Read once: a paint program may save it again meanwhile.
  const std::string bytes = !file.empty() && IsFile(file) ? ReadFile(file) : std::string();
  const Image8 before = ToImage8(view);
  const std::optional<Image8> held = IsLossyWebp(bytes)
                                         ? AsWebpHolds(before, WebpQuality(before, bytes.size()))
                                         : AsJpegHolds(before, bytes);
  if (!held) return {picture.width, picture.height, LeastChange(picture, view)};
  const Image saved = ToImage(*held);
  ScalarImage least(view.width, view.height);
  for (size_t p = 0; p < least.data.size(); ++p) {
    least.data[p] = float(
        ColorDifference(CieLabFromSrgb(&view.data[3 * p]), CieLabFromSrgb(&saved.data[3 * p])));
  }
  // The most within two pixels, after single pixels are evened out.
  cv::Mat noise(least.height, least.width, CV_32F, least.data.data());
  cv::GaussianBlur(noise, noise, {}, 1);
  cv::dilate(noise, noise, cv::Mat::ones(5, 5, CV_8U));
  const float anywhere = LeastChange(picture, saved);
  for (float& value : least.data) value = std::max(anywhere, kOverNoise * value);
  return least;
}

}  // namespace retint
