// SPDX-License-Identifier: BSD-3-Clause
#include "selection/depth_agreement.h"

#include <algorithm>
#include <cmath>

#include "base/median.h"

namespace retint {

DepthView Downloaded(Device& device, const PosedCamera& posed, const Buffer<float>& depth) {
  DepthView view{posed, DepthMap(posed.camera.width, posed.camera.height)};
  view.depth.data = device.Download(depth.data(), view.depth.data.size());
  return view;
}

void AddDifferences(const DepthView& view, const DepthView& other, float most,
                    std::vector<float>* differences) {
  constexpr int kStep = 4;  // enough for a quantile
  for (int y = 0; y < view.depth.height; y += kStep) {
    for (int x = 0; x < view.depth.width; x += kStep) {
      const float z = view.depth(x, y);
      if (!(z > 0)) continue;
      const auto at = other.camera.Project(view.camera.Unproject({x + 0.5, y + 0.5}, double(z)));
      if (!at || !((*at)[0] >= 0 && (*at)[1] >= 0 && (*at)[0] < other.depth.width &&
                   (*at)[1] < other.depth.height)) {
        continue;
      }
      const float seen = other.depth(int((*at)[0]), int((*at)[1]));
      const float apart = std::abs(float((*at)[2]) - seen) / seen;
      if (seen > 0 && apart <= most) differences->push_back(apart);
    }
  }
}

float AgreeingTolerance(std::vector<float>& differences, float most) {
  constexpr double kAgreeing = 0.8;
  constexpr float kTimesAgreeing = 3;
  if (differences.empty()) return most;
  const float usual = kTimesAgreeing * Quantile(differences, kAgreeing);
  return std::min(most, std::max(kSameSurface, usual));
}

}  // namespace retint
