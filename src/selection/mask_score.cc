// SPDX-License-Identifier: BSD-3-Clause
#include "selection/mask_score.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "base/error.h"
#include "scene/mask_pixels.h"

namespace retint {
namespace {

constexpr float kVisibleStep = 8;  // of 255

// Counts the inside pixels of any rectangle of a mask in constant time.
class InsideSums {
 public:
  explicit InsideSums(const Mask& mask)
      : width_(mask.width), height_(mask.height), sums_(size_t(width_ + 1) * size_t(height_ + 1)) {
    for (int y = 0; y < height_; ++y) {
      int64_t row = 0;
      for (int x = 0; x < width_; ++x) {
        row += IsInside(mask(x, y));
        sums_[At(x + 1, y + 1)] = sums_[At(x + 1, y)] + row;
      }
    }
  }

  // Whether all pixels at most `radius` from (x, y) in both directions are inside. Pixels beyond
  // the image count as outside if `edge_is_border`; otherwise they do not count.
  bool Full(int x, int y, int radius, bool edge_is_border) const {
    const int x0 = std::max(0, x - radius), x1 = std::min(width_, x + radius + 1);
    const int y0 = std::max(0, y - radius), y1 = std::min(height_, y + radius + 1);
    const int64_t side = 2 * int64_t(radius) + 1;
    const int64_t area = edge_is_border ? side * side : int64_t(x1 - x0) * (y1 - y0);
    return sums_[At(x1, y1)] - sums_[At(x0, y1)] - sums_[At(x1, y0)] + sums_[At(x0, y0)] == area;
  }

 private:
  size_t At(int x, int y) const { return size_t(y) * size_t(width_ + 1) + size_t(x); }
  int width_, height_;
  std::vector<int64_t> sums_;  // [H + 1, W + 1]
};

struct Counts {
  int64_t both = 0, in_mask = 0, in_truth = 0;

  void Add(bool mask, bool truth) {
    both += mask && truth;
    in_mask += mask;
    in_truth += truth;
  }
  std::optional<double> Iou() const { return Ratio(both, in_mask + in_truth - both); }
  static std::optional<double> Ratio(int64_t part, int64_t whole) {
    if (whole == 0) return std::nullopt;
    return double(part) / double(whole);
  }
};

Counts Overlap(const Mask& mask, const Mask& truth) {
  CheckOption(mask.width == truth.width && mask.height == truth.height,
              "a mask and its truth need one size");
  Counts counts;
  for (size_t i = 0; i < mask.data.size(); ++i) {
    counts.Add(IsInside(mask.data[i]), IsInside(truth.data[i]));
  }
  return counts;
}

Eigen::Vector3f Shown(const Image& image, size_t pixel) {
  return Eigen::Map<const Eigen::Vector3f>(&image.data[3 * pixel]).cwiseMax(0.0f).cwiseMin(1.0f);
}

}  // namespace

std::optional<double> Iou(const Mask& mask, const Mask& truth) {
  return Overlap(mask, truth).Iou();
}

MaskScore ScoreMask(const Mask& mask, const Mask& truth, double margin) {
  const Counts all = Overlap(mask, truth);
  const double diagonal = std::hypot(double(mask.width), double(mask.height));
  const int radius = std::max(1, int(std::lround(margin * diagonal)));
  const InsideSums of_mask(mask), of_truth(truth);
  Counts boundary;
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      boundary.Add(IsInside(mask(x, y)) && !of_mask.Full(x, y, radius, true),
                   IsInside(truth(x, y)) && !of_truth.Full(x, y, radius, true));
    }
  }
  return {all.Iou(), boundary.Iou(), Counts::Ratio(all.both, all.in_mask),
          Counts::Ratio(all.both, all.in_truth)};
}

EditScore ScoreEdit(const Image& before, const Image& edited, const Image& after, const Mask& truth,
                    int border) {
  for (const Image* image : {&before, &edited, &after}) {
    CheckOption(image->width == truth.width && image->height == truth.height,
                "a picture and its true mask need one size");
  }
  const InsideSums inside(truth);
  double arrived = 0, leak = 0;
  int64_t judged = 0, missed = 0, outside = 0, stained = 0;
  for (int y = 0; y < truth.height; ++y) {
    for (int x = 0; x < truth.width; ++x) {
      const size_t pixel = truth.Index(x, y);
      const Eigen::Vector3f old = Shown(before, pixel), change = Shown(after, pixel) - old;
      if (!IsInside(truth.data[pixel])) {
        ++outside;
        leak += 255.0 * double(change.cwiseAbs().mean());
        stained += 255 * change.cwiseAbs().maxCoeff() > kVisibleStep;
        continue;
      }
      const Eigen::Vector3f wanted = Shown(edited, pixel) - old;
      if (255 * wanted.cwiseAbs().maxCoeff() < kVisibleStep) continue;
      if (!inside.Full(x, y, border, false)) continue;
      const double share = double(change.dot(wanted) / wanted.squaredNorm());
      arrived += std::clamp(share, 0.0, 1.0);
      missed += share < 0.5;
      ++judged;
    }
  }
  EditScore score;
  if (judged > 0) score.hit = arrived / double(judged);
  score.missed = Counts::Ratio(missed, judged);
  if (outside > 0) score.leak = leak / double(outside);
  score.stained = Counts::Ratio(stained, outside);
  return score;
}

}  // namespace retint
