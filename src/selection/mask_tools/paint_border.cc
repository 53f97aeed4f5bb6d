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

// Chosen on cape, fox, flower and one synthetic scene; docs/decisions/0011 lists rejected
// alternatives. kFavors: log odds of "inside" that move the border outward and inward.
constexpr std::array<double, 2> kFavors = {2, -2};
constexpr float kLeastEdge = 0.05f;  // OKLab; less is a plain surface
// An edge must be so many times stronger than the one at which the paint itself ends.
constexpr float kStrongerOutward = 1.2f, kStrongerInward = 1.3f;

// How much color and depth change across each pixel of `where`, at most 1; 0 elsewhere. Row 0 of
// `where` is row `top` of `features`.
cv::Mat EdgesAt(const cv::Mat& where, const PixelArray<float, 4>& features, int top) {
  constexpr std::array<std::pair<int, int>, 4> kDirections = {{{1, 0}, {0, 1}, {1, 1}, {1, -1}}};
  const int width = features.width, height = features.height;
  cv::Mat edges = cv::Mat::zeros(where.size(), CV_32F);
  for (int row = 0; row < where.rows; ++row) {
    for (int x = 0, y = top + row; x < width; ++x) {
      if (where.at<uint8_t>(row, x) == 0) continue;
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
      edges.at<float>(row, x) = std::min(1.0f, std::sqrt(most));
    }
  }
  return edges;
}

// The mean of `values` over the pixels of `where` in a window about each pixel; 0 if it has
// none.
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

// The pixels next to a shape.
cv::Mat RimOf(const cv::Mat& shape) {
  cv::Mat wider;
  cv::dilate(shape, wider, Square());
  return wider & ~shape;
}

// The pixels that the cut adds to the painted `shape`, for the parts of `grown` that end at an
// edge. The cut always ends somewhere within reach, so the edge must be stronger than the one at
// which the paint ends. Row 0 of the shapes is row `top` of `features`.
cv::Mat GrownToEdge(const PixelArray<float, 4>& features, int top, const cv::Mat& shape,
                    const cv::Mat& grown, int reach, float stronger) {
  cv::Mat added = grown & ~shape;
  if (cv::countNonZero(added) == 0) return added;
  const cv::Mat cut_rim = RimOf(grown) & ~RimOf(shape), shape_rim = RimOf(shape) & added;
  cv::Mat at, nearby;
  cv::dilate(cut_rim | shape_rim, at, Square());
  const cv::Mat edges = EdgesAt(at, features, top);
  cv::dilate(edges, nearby, Square());  // the cut's border may be one pixel off
  const cv::Mat ahead = MeanOver(nearby, cut_rim, reach);
  const cv::Mat here = MeanOver(edges, shape_rim, reach);
  const cv::Mat least = cv::max(kLeastEdge, stronger * here);
  return added & (ahead > least);
}

// The same for all rows, in parallel strips, into `part` of `found`.
void GrownToEdge(const PixelArray<float, 4>& features, const cv::Mat& shape, const cv::Mat& grown,
                 int reach, float stronger, const GridRect& part, Mask* found) {
  const int strip = 4 * reach, margin = reach + 4;  // the filters above read this far
  ParallelTasks((shape.rows + strip - 1) / strip, [&](int64_t i) {
    const int first = int(i) * strip, last = std::min(shape.rows, first + strip);
    const int top = std::max(0, first - margin);
    const cv::Range rows(top, std::min(shape.rows, last + margin));
    const cv::Mat added =
        GrownToEdge(features, top, shape.rowRange(rows), grown.rowRange(rows), reach, stronger);
    for (int y = first; y < last; ++y)
      std::copy_n(added.ptr(y - top), part.width, &(*found)(part.x, part.y + y));
  });
}

}  // namespace

ScalarImage FarFromBorder(const Mask& mask, int reach) {
  cv::Mat inside(mask.height, mask.width, CV_8U);
  ScalarImage far(mask.width, mask.height);
  cv::Mat result(mask.height, mask.width, CV_32F, far.data.data());
  for (size_t p = 0; p < mask.data.size(); ++p) inside.data[p] = IsInside(mask.data[p]) ? 255 : 0;
  const cv::Mat window = cv::Mat::ones(2 * reach + 1, 2 * reach + 1, CV_8U);
  ParallelRanges(mask.height, 2 * window.rows, [&](int64_t begin, int64_t end) {
    // The filters also read the rows next to these.
    const cv::Range rows(static_cast<int>(begin), static_cast<int>(end));
    cv::Mat wider, narrower;
    cv::dilate(inside.rowRange(rows), wider, window);
    cv::erode(inside.rowRange(rows), narrower, window);
    cv::Mat(wider == narrower).convertTo(result.rowRange(rows), CV_32F, 1.0 / 255);
  });
  return far;
}

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
  MissedBorder missed = {Mask(mask.width, mask.height), Mask(mask.width, mask.height)};
  GrownToEdge(features, paint, grown, reach, kStrongerOutward, part, &missed.left_out);
  GrownToEdge(features, ~paint, ~shrunk, reach, kStrongerInward, part, &missed.spilled);
  return missed;
}

}  // namespace retint
