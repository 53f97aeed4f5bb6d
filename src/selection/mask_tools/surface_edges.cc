// SPDX-License-Identifier: BSD-3-Clause
#include "selection/mask_tools/surface_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "base/median.h"
#include "base/parallel.h"

namespace retint {
namespace {

constexpr std::array<std::pair<int, int>, 4> kDirections = {{{1, 0}, {0, 1}, {1, 1}, {1, -1}}};
constexpr std::array<int, 3> kSteps = {1, 2, 3};  // pixels
constexpr double kNoise = 4;                      // times the usual change of slope
constexpr double kSlope = 1;
constexpr float kFar = 0.1f;  // of the median inverse depth, the least divisor

ScalarImage WithoutSpikes(const ScalarImage& image) {
  ScalarImage result(image.width, image.height);
  const cv::Mat from(image.height, image.width, CV_32F, const_cast<float*>(image.data.data()));
  cv::Mat to(image.height, image.width, CV_32F, result.data.data());
  cv::medianBlur(from, to, 3);
  return result;
}

float UsualDepth(const ScalarImage& inverse_depth) {
  std::vector<double> some;
  for (const float value : inverse_depth.data) {
    if (value > 0) some.push_back(double(value));
  }
  return float(Median(std::move(some), 1));
}

// The change of slope at every pixel, from its two neighbors `step` pixels away along the
// direction.
std::vector<float> Bends(const ScalarImage& inverse_depth, float far, double focal, int step,
                         std::pair<int, int> direction) {
  const int width = inverse_depth.width, height = inverse_depth.height;
  const int dx = direction.first, dy = direction.second;
  const auto scale = float(focal / (step * std::hypot(dx, dy)));
  std::vector<float> bends(inverse_depth.data.size());
  ParallelRanges(height, 16, [&](int64_t first, int64_t last) {
    for (int y = int(first); y < int(last); ++y) {
      for (int x = 0; x < width; ++x) {
        const auto at = [&](int sign) {
          return inverse_depth(std::clamp(x + sign * step * dx, 0, width - 1),
                               std::clamp(y + sign * step * dy, 0, height - 1));
        };
        const float here = at(0);
        bends[inverse_depth.Index(x, y)] =
            scale * (at(1) + at(-1) - 2 * here) / std::max(here, far);
      }
    }
  });
  return bends;
}

}  // namespace

ScalarImage SurfaceValleys(const ScalarImage& inverse_depth, double focal) {
  const ScalarImage smooth = WithoutSpikes(inverse_depth);
  const float far = kFar * UsualDepth(smooth);
  const size_t kinds = kSteps.size() * kDirections.size();
  std::vector<std::vector<float>> bends(kinds);
  std::vector<double> usual(kinds);
  ParallelTasks(int64_t(kinds), [&](int64_t i) {
    std::vector<float>& some = bends[size_t(i)];
    some = Bends(smooth, far, focal, kSteps[size_t(i) / kDirections.size()],
                 kDirections[size_t(i) % kDirections.size()]);
    std::vector<double> sizes(some.size());
    std::transform(some.begin(), some.end(), sizes.begin(),
                   [](float bend) { return double(std::abs(bend)); });
    usual[size_t(i)] = Median(std::move(sizes));
  });
  ScalarImage valleys(smooth.width, smooth.height);
  ParallelRanges(int64_t(valleys.data.size()), 4096, [&](int64_t begin, int64_t end) {
    for (const std::vector<float>& some : bends) {
      for (auto p = size_t(begin); p < size_t(end); ++p)
        valleys.data[p] = std::max(valleys.data[p], some[p]);
    }
  });
  const double noise = kNoise * Median(std::move(usual));
  for (float& value : valleys.data) {
    value = float(std::clamp((double(value) - noise) / (kSlope + noise), 0.0, 1.0));
  }
  return valleys;
}

}  // namespace retint
