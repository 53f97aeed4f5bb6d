// SPDX-License-Identifier: BSD-3-Clause
#include "editing/jpeg_noise.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "base/color_difference.h"
#include "base/files.h"
#include "base/parallel.h"
#include "colmap_io/image_io.h"
#include "colmap_io/webp_copy.h"
#include "editing/picture_changes.h"
#include "scene/contact_sheet.h"

namespace retint {
namespace {

constexpr float kOverNoise = 3;  // times the noise that the file has nearby
constexpr float kSurely = 12;    // DeltaE00: so much is a change, whatever the noise
constexpr int kRounds = 3;       // of finding the changes, and their noise in the rest

using Colors = std::vector<CieLab>;  // of every pixel

template <typename Body>
void ForPixels(size_t count, const Body& body) {
  constexpr size_t kPiece = 1 << 14;
  ParallelTasks(int64_t((count + kPiece - 1) / kPiece), [&](int64_t piece) {
    const size_t begin = size_t(piece) * kPiece;
    for (size_t p = begin; p < std::min(begin + kPiece, count); ++p) body(p);
  });
}

Colors ColorsOf(const Image8& picture) {
  Colors colors(picture.NumPixels());
  ForPixels(colors.size(), [&](size_t p) {
    float rgb[3];
    for (size_t c = 0; c < 3; ++c) rgb[c] = float(picture.data[3 * p + c]) / 255;
    colors[p] = CieLabFromSrgb(rgb);
  });
  return colors;
}

ScalarImage Differences(const Colors& a, const Colors& b, const Image8& picture) {
  ScalarImage differences(picture.width, picture.height);
  ForPixels(a.size(), [&](size_t p) { differences.data[p] = float(ColorDifference(a[p], b[p])); });
  return differences;
}

// Its maximum within two pixels, after the values of single pixels were evened out.
void Spread(ScalarImage& noise) {
  cv::Mat pixels(noise.height, noise.width, CV_32F, noise.data.data());
  cv::GaussianBlur(pixels, pixels, {}, 1);
  cv::dilate(pixels, pixels, cv::Mat::ones(5, 5, CV_8U));
}

}  // namespace

ScalarImage LeastChanges(const Image8& picture, const Image& view,
                         const std::filesystem::path& file) {
  const Image8 before = ToImage8(view);
  // Read once: a paint program may save it again meanwhile.
  const std::string bytes = !file.empty() && IsFile(file) ? ReadFile(file) : std::string();
  int quality = IsLossyWebp(bytes) ? WebpQuality(before, bytes.size()) : 0;
  const auto as_file_holds = [&](const Image8& one) {
    return quality > 0 ? std::optional(AsWebpHolds(one, quality)) : AsJpegHolds(one, bytes);
  };
  const std::optional<Image8> saved = as_file_holds(before);
  if (!saved) return {picture.width, picture.height, LeastChange(picture, view)};

  const float least_anywhere = LeastChange(picture, ToImage(*saved));
  const Colors painted = ColorsOf(picture), was = ColorsOf(before), held = ColorsOf(*saved);
  const ScalarImage from_view = Differences(painted, was, picture);
  const ScalarImage from_held = Differences(painted, held, picture);
  ScalarImage noise_of_view = Differences(was, held, picture);
  Spread(noise_of_view);
  // A file of the view with the paint that is known so far has the paint's noise around it.
  // Differences that it explains are no paint.
  Mask changed(picture.width, picture.height);
  for (size_t p = 0; p < changed.data.size(); ++p) {
    changed.data[p] = from_held.data[p] > kSurely ? 255 : 0;
  }
  ScalarImage least(picture.width, picture.height);
  for (int round = 0; round < kRounds; ++round) {
    Image8 composed = before;
    for (size_t p = 0; p < changed.data.size(); ++p) {
      if (changed.data[p]) std::copy_n(&picture.data[3 * p], 3, &composed.data[3 * p]);
    }
    // Paint makes a file larger.
    if (quality > 0 && round == 1) quality = WebpQuality(composed, bytes.size());
    const Colors expected = ColorsOf(as_file_holds(composed).value());
    ScalarImage noise = Differences(expected, ColorsOf(composed), picture);
    const ScalarImage from_expected = Differences(painted, expected, picture);
    for (size_t p = 0; p < noise.data.size(); ++p) {
      if (changed.data[p]) noise.data[p] = 0;  // it has been through the file already
    }
    Spread(noise);
    for (size_t p = 0; p < least.data.size(); ++p) {
      const float bound =
          std::max(least_anywhere, kOverNoise * std::max(noise.data[p], noise_of_view.data[p]));
      const float unexplained =
          changed.data[p] ? from_held.data[p] : std::min(from_held.data[p], from_expected.data[p]);
      least.data[p] = unexplained > bound ? bound : std::max(bound, from_view.data[p]);
    }
    changed = ChangedPixels(from_view, least);
  }
  return least;
}

}  // namespace retint
