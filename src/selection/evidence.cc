// SPDX-License-Identifier: BSD-3-Clause
#include "selection/evidence.h"

#include <algorithm>
#include <cmath>

#include <oneapi/tbb/parallel_for.h>

#include "selection/depth_sampling.h"

namespace retint {
namespace {

// Pixels of one camera to pixels of another, through the depth: x' = z * rotation * ray +
// translation.
struct Transfer {
  Eigen::Matrix3f rotation;
  Eigen::Vector3f translation;
  float fx, fy, cx, cy;
  const PaintedSurface* to;

  Transfer(const PosedCamera& from, const PaintedSurface& painted) : to(&painted) {
    const Rigid3d to_from_from = painted.camera.cam_from_world * from.cam_from_world.Inverse();
    rotation = to_from_from.rotation.toRotationMatrix().cast<float>();
    translation = to_from_from.translation.cast<float>();
    const Camera& camera = painted.camera.camera;
    fx = static_cast<float>(camera.fx()), fy = static_cast<float>(camera.fy());
    cx = static_cast<float>(camera.cx()), cy = static_cast<float>(camera.cy());
  }

  // The paint, in [0, 255], on the surface at `point` (source camera); -1 when it is not seen.
  int Paint(const Eigen::Vector3f& point, float tolerance) const {
    const Eigen::Vector3f moved = rotation * point + translation;
    if (!(moved.z() > 0)) return -1;
    const float column = fx * moved.x() / moved.z() + cx, row = fy * moved.y() / moved.z() + cy;
    if (!(column >= 0 && row >= 0 && column < float(to->depth.width) &&
          row < float(to->depth.height))) {
      return -1;
    }
    const int x = static_cast<int>(column), y = static_cast<int>(row);
    const float seen = to->depth(x, y);
    if (!(seen > 0) || std::abs(moved.z() - seen) > tolerance * seen) return -1;
    return (*to->mask)(x, y);
  }
};

}  // namespace

Evidence PaintedEvidence(const Mask& mask, double weight) {
  Evidence evidence{ScalarImage(mask.width, mask.height),
                    ScalarImage(mask.width, mask.height, static_cast<float>(weight))};
  std::transform(mask.data.begin(), mask.data.end(), evidence.inside.data.begin(),
                 [](uint8_t value) { return static_cast<float>(value) / 255.0f; });
  return evidence;
}

Evidence LookUpPaint(const PosedCamera& view, const DepthMap& depth,
                     const std::vector<PaintedSurface>& painted, double tolerance,
                     double unknown_weight) {
  Evidence evidence{ScalarImage(depth.width, depth.height),
                    ScalarImage(depth.width, depth.height, static_cast<float>(unknown_weight))};
  std::vector<Transfer> transfers;
  for (const auto& surface : painted) transfers.emplace_back(view, surface);
  const Camera& camera = view.camera;
  const auto near = static_cast<float>(tolerance);
  tbb::parallel_for(0, depth.height, [&](int y) {
    const auto v = static_cast<float>((y + 0.5 - camera.cy()) / camera.fy());
    for (int x = 0; x < depth.width; ++x) {
      if (!HasDepth(depth, x, y)) continue;
      const auto u = static_cast<float>((x + 0.5 - camera.cx()) / camera.fx());
      const Eigen::Vector3f point = depth(x, y) * Eigen::Vector3f(u, v, 1);
      int sum = 0, count = 0;
      for (const auto& transfer : transfers) {
        const int paint = transfer.Paint(point, near);
        if (paint < 0) continue;
        sum += paint;
        ++count;
      }
      if (count == 0) continue;
      evidence.inside(x, y) = static_cast<float>(sum) / (255.0f * static_cast<float>(count));
      evidence.weight(x, y) = 1;
    }
  });
  return evidence;
}

void AddCoverage(const Mask& coverage, Evidence* evidence) {
  for (size_t i = 0; i < coverage.data.size(); ++i) {
    const float covered = static_cast<float>(coverage.data[i]) / 255.0f;
    evidence->inside.data[i] = std::max(evidence->inside.data[i], covered);
    evidence->weight.data[i] = std::max(evidence->weight.data[i], covered);
  }
}

}  // namespace retint
