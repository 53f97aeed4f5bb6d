// SPDX-License-Identifier: BSD-3-Clause
// Colors for overlays that stand out from the picture below.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>

#include <Eigen/Core>
#include <QColor>
#include <QImage>

#include "editing/region.h"

namespace retint {

// The first of orange, azure, magenta and green that stands out from `under`. If `current` stands
// out, `current`: an overlay keeps its color as long as possible.
QColor ContrastingColor(const QColor& under, const QColor& current = {});

// The mean color of the pixels that `inside` selects; of a large picture, of some of them. Invalid
// if it selects none.
QColor MeanColor(const QImage& picture, const std::function<bool(int x, int y)>& inside);

// The main colors of regions (FindMainColor), from the first coefficients of their Gaussians. Close
// to those that an edit measures in views, but available at once. Invalid for a region without
// Gaussians. Computed once for each selection, because that reads every Gaussian.
class RegionColors {
 public:
  // Without the region's edit, and with it.
  QColor Before(const Region& region, const GaussianModel& original);
  QColor After(const Region& region, const GaussianModel& original);
  void Clear() { colors_.clear(); }  // for another scene

 private:
  std::optional<Eigen::Vector3f> Of(const RegionSelection& selection,
                                    const GaussianModel& original);
  std::map<uint64_t, std::optional<Eigen::Vector3f>> colors_;  // by selection
};

}  // namespace retint
