// SPDX-License-Identifier: BSD-3-Clause
// Colors for overlays on a picture, so that they can be told from it.
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

// Orange, azure, magenta or green: the first of them that stands out from `under`; `current`, where
// it does, so that an overlay keeps its color while it can.
QColor ContrastingColor(const QColor& under, const QColor& current = {});

// The mean color of the pixels of a picture that `inside` picks, of a large one a part of them;
// invalid where there is none.
QColor MeanColor(const QImage& picture, const std::function<bool(int x, int y)>& inside);

// The main colors of regions (FindMainColor), by their Gaussians' first coefficients; invalid of a
// region without any. Near those that an edit measures in views, and at hand at once. Those of a
// selection are asked once: that takes every Gaussian.
class RegionColors {
 public:
  // Without the region's edit, and as the edit shows it.
  QColor Before(const Region& region, const GaussianModel& original);
  QColor After(const Region& region, const GaussianModel& original);
  void Clear() { colors_.clear(); }  // for another scene

 private:
  std::optional<Eigen::Vector3f> Of(const RegionSelection& selection,
                                    const GaussianModel& original);
  std::map<uint64_t, std::optional<Eigen::Vector3f>> colors_;  // by selection
};

}  // namespace retint
