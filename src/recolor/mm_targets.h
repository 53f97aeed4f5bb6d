// SPDX-License-Identifier: BSD-3-Clause
// The mm solver's data of a target: by how much each of the region's pixels should change, and the
// weight of its error. Internal to recolor.
#pragma once

#include <cstdint>
#include <memory>

#include "recolor/refit_views.h"

namespace retint {

struct MmView : RegionView {
  size_t Bytes() const override;
  Buffer<int16_t> target;   // [pixels, 3] in steps of `unit`, see RegionTargetParams
  Buffer<uint8_t> weights;  // [pixels]
  float unit = 0;
};

class MmTargets : public TargetForm {
 public:
  // `photos`: a target is more than the edited render.
  MmTargets(const MmOptions& options, const CompiledEdit& edit, bool photos);

  // The divisor of a loss, in units of the pixels' weights.
  static double NumValues(const RefitViews& views);

 private:
  std::shared_ptr<const ViewGeometry> Restrict(RefitViews& views, const ViewGeometry& whole,
                                               size_t budget_bytes) override;
  std::unique_ptr<RegionView> Make(RefitViews& views, const ViewGeometry& whole,
                                   const ViewGeometry& region, const TargetImages& images) override;

  float min_weight_, outside_weight_, unit_;
};

}  // namespace retint
