// SPDX-License-Identifier: BSD-3-Clause
#include "depth/sparse_errors.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/error.h"

namespace retint {
namespace {

// The value at or below which a share of `values`, of which there is at least one, lies.
double Quantile(std::vector<double>& values, double share) {
  const double last = double(values.size() - 1);
  const auto nth = values.begin() + std::ptrdiff_t(std::ceil(share * last));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

}  // namespace

SparseErrors CompareWithSparse(const DepthMap& depth, const Reconstruction& reconstruction,
                               const View& view) {
  const PosedCamera camera = reconstruction.Posed(view);
  CheckOption(depth.width == camera.camera.width && depth.height == camera.camera.height,
              "the depth map must have the size of the view's camera");
  SparseErrors errors;
  std::vector<double> relative, lengths, signs;
  for (const Observation& observation : view.observations) {
    if (observation.point_id == kInvalidPointId) continue;
    const auto seen = camera.Project(reconstruction.points.at(observation.point_id).xyz);
    if (!seen) continue;
    const int x = int(std::floor(seen->x())), y = int(std::floor(seen->y()));
    if (!depth.Contains(x, y)) continue;
    ++errors.points;
    if (!(depth(x, y) > 0)) continue;
    lengths.push_back(std::abs(depth(x, y) - seen->z()));
    relative.push_back(lengths.back() / seen->z());
    signs.push_back(depth(x, y) / seen->z() - 1);
  }
  errors.compared = relative.size();
  if (relative.empty()) return errors;
  errors.median = Quantile(relative, 0.5);
  errors.ninety = Quantile(relative, 0.9);
  errors.median_length = Quantile(lengths, 0.5);
  errors.ninety_length = Quantile(lengths, 0.9);
  errors.bias = Quantile(signs, 0.5);
  return errors;
}

}  // namespace retint
