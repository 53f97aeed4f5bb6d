// SPDX-License-Identifier: BSD-3-Clause
#include "selection/projection_checks.h"

#include <algorithm>
#include <atomic>
#include <numeric>

#include "base/error.h"
#include "base/parallel.h"
#include "scene/image_checks.h"
#include "scene/mask_pixels.h"

namespace retint {

void CheckProjection(const SelectionCloud& cloud, const std::vector<PaintedView>& painted,
                     const std::vector<const View*>& views) {
  if (cloud.points.empty()) throw InputError("the selection is empty: its cloud has no points");
  if (views.empty()) throw InputError("there is no view to project the selection to");
  for (const auto& view : painted) {
    RequireSize("the mask of view " + view.name, view.mask, view.camera.camera);
    if (view.seen.Empty()) continue;
    RequireSize("what is seen in view " + view.name, view.seen, view.camera.camera);
  }
}

bool HoldsPaint(const std::vector<PaintedView>& painted, const ProjectedMasks& projected) {
  bool any_painted = false;
  for (const PaintedView& view : painted) {
    const auto found = projected.masks.find(view.name);
    if (found == projected.masks.end()) continue;
    for (size_t p = 0; p < view.mask.data.size(); ++p) {
      if (!IsInside(view.mask.data[p])) continue;
      if (IsInside(found->second.data[p])) return true;
      any_painted = true;
    }
  }
  return !any_painted;
}

bool HoldsGaussians(const std::vector<float>& shares) {
  constexpr float kLeast = 0.05f;  // as RefitOptions::active_threshold
  return std::any_of(shares.begin(), shares.end(), [](float share) { return share > kLeast; });
}

double MeanCoverage(const std::map<std::string, Mask>& of_views) {
  std::vector<const Mask*> masks;
  for (const auto& [name, mask] : of_views) masks.push_back(&mask);
  std::vector<double> covered(masks.size());
  std::atomic<bool> any = false;
  ParallelTasks(int64_t(masks.size()), [&](size_t i) {
    int64_t inside = 0;
    uint8_t largest = 0;
    for (const uint8_t value : masks[i]->data) {
      largest = std::max(largest, value);
      inside += value;
    }
    if (IsInside(largest)) any = true;
    covered[i] = static_cast<double>(inside) /
                 (255.0 * static_cast<double>(std::max<size_t>(1, masks[i]->NumPixels())));
  });
  if (!any) throw InputError("the selection reaches no view");
  return std::accumulate(covered.begin(), covered.end(), 0.0) / static_cast<double>(masks.size());
}

}  // namespace retint
