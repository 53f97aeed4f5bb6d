// SPDX-License-Identifier: BSD-3-Clause
// Which Gaussians a view may see, told from a box about their means and their largest extent.
#pragma once

#include <array>

#include "kernels/common/types.h"

namespace retint {

// A box of the world and the largest standard deviation of the Gaussians whose means lie in it.
struct GaussianBounds {
  std::array<float, 3> low{}, high{};
  float sigma = 0;
};

// Conservative: if it says that a view does not see a Gaussian, the projection of
// kernels/common/projection.h culls it. So a view renders the same bits from the Gaussians that it
// may see as from all.
//
// With x = fx X/Z + cx and a half width of at most r s(x) pixels, s(x)^2 = sigma^2 (fx/Z)^2 (1 +
// u^2)
// + kCovarianceDilation (EWA splatting, Zwicker et al. 2001, u clamped as there), a Gaussian beyond
// the right side W obeys
//   fx X - (W - cx + r sqrt(kCovarianceDilation)) Z > r fx sqrt(1 + u_max^2) sigma,
// and so on for the other sides: planes, which are moved out by the Gaussian's extent.
class Frustum {
 public:
  explicit Frustum(const CameraParams& camera);
  bool MaySee(const GaussianBounds& bounds) const;

 private:
  // Inside: normal . x + offset <= reach * sigma + rounding.
  struct Plane {
    std::array<double, 3> normal{};
    double offset = 0, reach = 0;
    double slack = 0;  // of the rounding of single precision, per unit of the coordinates
    double constant_slack = 0;
  };
  std::array<Plane, 5> planes_;  // right, left, bottom, top, near
};

}  // namespace retint
