// SPDX-License-Identifier: BSD-3-Clause
#include "selection/mask_tools/paint_border.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "base/parallel.h"
#include "scene/mask_pixels.h"
#include "selection/mask_tools/scribbles.h"

namespace retint {
namespace {

// Chosen on cape, fox, flower and one synthetic scene; docs/notebook.md says what else was tried.
// Log odds by which the edge is looked for outward and inward.
constexpr std::array<double, 2> kFavors = {2, -2};
constexpr float kLeastEdge = 0.05f;  // OKLab; less is a plain surface
// Times the edge that the paint itself ends at.
constexpr float kStrongerOutward = 1.2f, kStrongerInward = 1.3f;

// How much color and depth change across each pixel of `where`, 1 at most; 0 elsewhere.
cv::Mat EdgesAt(const cv::Mat& where, const PixelArray<float, 4>& features) {
  constexpr std::array<std::pair<int, int>, 4> kDirections = {{{1, 0}, {0, 1}, {1, 1}, {1, -1}}};
  const int width = features.width, height = features.height;
  cv::Mat edges = cv::Mat::zeros(height, width, CV_32F);
  ParallelRanges(height, 16, [&](int64_t begin, int64_t end) {
    for (int y = int(begin); y < int(end); ++y) {
      for (int x = 0; x < width; ++x) {
        if (where.at<uint8_t>(y, x) == 0) continue;
        float most = 0;
        for (const auto& [dx, dy] : kDirections) {
          const int i = std::clamp(x - dx, 0, width - 1), j = std::clamp(y - dy, 0, height - 1);
          const int k = std::clamp(x + dx, 0, width - 1), l = std::clamp(y + dy, 0, height - 1);
          float sum = 0;
          for (int c = 0; c < 4; ++c) {
            const float change = features(i, j, c) - features(k, l, c);
            sum += change * change;
          }
          most = std::max(most, sum);
        }
        edges.at<float>(y, x) = std::min(1.0f, std::sqrt(most));
      }
    }
  });
  return edges;
}

// Mean of `values` over the pixels of `where` that lie in a window about each pixel; 0 where there
// are none.
cv::Mat MeanOver(const cv::Mat& values, const cv::Mat& where, int radius) {
  cv::Mat weight, sum, mean;
  where.convertTo(weight, CV_32F, 1.0 / 255);
  cv::multiply(values, weight, sum);
  const cv::Size window(2 * radius + 1, 2 * radius + 1);
  cv::boxFilter(weight, weight, -1, window);
  cv::boxFilter(sum, sum, -1, window);
  cv::divide(sum, cv::max(weight, 1e-9), mean);
  return mean;
}

const cv::Mat& Square() {
  static const cv::Mat square = cv::Mat::ones(3, 3, CV_8U);
  return square;
}

// The pixels beside those of a shape.
cv::Mat RimOf(const cv::Mat& shape) {
  cv::Mat wider;
  cv::dilate(shape, wider, Square());
  return wider & ~shape;
}

// What the cut gives to a shape that is `shape` as it is painted and `grown` by the cut, where the
// cut ends at an edge, and the paint at none or at a weaker one: the cut ends somewhere within
// reach in any case.
cv::Mat GrownToEdge(const PixelArray<float, 4>& features, const cv::Mat& shape,
                    const cv::Mat& grown, int reach, float stronger) {
  cv::Mat added = grown & ~shape;
  if (cv::countNonZero(added) == 0) return added;
  const cv::Mat cut_rim = RimOf(grown) & ~RimOf(shape), shape_rim = RimOf(shape) & added;
  cv::Mat at, nearby;
  cv::dilate(cut_rim | shape_rim, at, Square());
  const cv::Mat edges = EdgesAt(at, features);
  cv::dilate(edges, nearby, Square());  // the cut's border may be a pixel off
  const cv::Mat ahead = MeanOver(nearby, cut_rim, reach);
  const cv::Mat here = MeanOver(edges, shape_rim, reach);
  const cv::Mat least = cv::max(kLeastEdge, stronger * here);
  return added & (ahead > least);
}

Mask Placed(const cv::Mat& values, const GridRect& part, const Mask& like) {
  Mask whole(like.width, like.height);
  Place(values.data, part, &whole);
  return whole;
}

}  // namespace

MissedBorder FindMissedBorder(const ViewLayers& layers, const Mask& mask, int reach,
                              Monitor& monitor) {
  const GridRect part = PartAboutBorder(mask, reach);
  if (part.width == 0) return {};
  const PixelArray<float, 4> features = Features(layers, part);
  const Mask painted = Crop(mask, part);
  const std::vector<Mask> refined =
      RefineEdgeOfPart(features, PixelsPerRadian(layers), painted, reach, kFavors, monitor);
  cv::Mat paint(part.height, part.width, CV_8U);
  cv::Mat grown(part.height, part.width, CV_8U), shrunk(part.height, part.width, CV_8U);
  for (size_t p = 0; p < painted.data.size(); ++p) {
    paint.data[p] = IsInside(painted.data[p]) ? 255 : 0;
    grown.data[p] = paint.data[p] > 0 || IsInside(refined[0].data[p]) ? 255 : 0;
    shrunk.data[p] = paint.data[p] > 0 && IsInside(refined[1].data[p]) ? 255 : 0;
  }
  return {Placed(GrownToEdge(features, paint, grown, reach, kStrongerOutward), part, mask),
          Placed(GrownToEdge(features, ~paint, ~shrunk, reach, kStrongerInward), part, mask)};
}

}  // namespace retint
