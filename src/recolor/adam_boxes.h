// SPDX-License-Identifier: BSD-3-Clause
// The adam solver's data of a target: the original render around the region, the photo if that is
// the target, and the mask. Internal to recolor.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "recolor/refit_views.h"

namespace retint {

struct AdamView : RegionView {
  size_t Bytes() const override;
  // x0, y0, x1, y1, half-open: the region's bounds, and the support of their loss.
  std::array<int32_t, 4> roi{}, box{};
  Buffer<uint16_t> render, photo;  // `box` in steps of AdamBoxes::kUnit
  Buffer<uint8_t> mask;            // [H, W]
  ColorMap map{};                  // of `render` or `photo`
};

class AdamBoxes : public TargetForm {
 public:
  // Step of the 16-bit render and photo; they hold [0, 4).
  static constexpr float kUnit = 1.0f / 16384;

 private:
  std::shared_ptr<const ViewGeometry> Restrict(RefitViews& views, const ViewGeometry& whole,
                                               size_t budget_bytes) override;
  std::unique_ptr<RegionView> Make(RefitViews& views, const ViewGeometry& whole,
                                   const ViewGeometry& region, const TargetImages& images) override;
};

}  // namespace retint
