// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/mm_targets.h"

#include <algorithm>
#include <cmath>

namespace retint {
namespace {

// A compact region keeps at least every eighth row.
constexpr double kMostRowsPerRow = 8;

// Largest |change| that an edit makes to a color in [0, 2], the range of renders.
float LargestChange(const CompiledEdit& edit, bool photos) {
  float largest = 1e-3f;
  if (edit.IsAffine()) {
    const Eigen::Matrix3f delta = edit.affine().gain - Eigen::Matrix3f::Identity();
    for (int c = 0; c < 3; ++c) {
      float change = std::abs(edit.affine().offset[c]);
      for (int d = 0; d < 3; ++d) change += 2 * std::abs(delta(c, d));
      largest = std::max(largest, change);
    }
  } else {
    constexpr int kNodes = 13;        // a side
    constexpr float kBetween = 1.1f;  // for values between them
    for (int i = 0; i < kNodes * kNodes * kNodes; ++i) {
      const Eigen::Vector3f color = Eigen::Vector3f(float(i % kNodes), float(i / kNodes % kNodes),
                                                    float(i / (kNodes * kNodes))) *
                                    (2.0f / (kNodes - 1));
      const Eigen::Vector3f change = edit.Apply(color) - color;
      largest = std::max(largest, kBetween * change.cwiseAbs().maxCoeff());
    }
  }
  return photos ? largest + 2 : largest;
}

}  // namespace

size_t MmView::Bytes() const {
  return RegionView::Bytes() + target.size() * sizeof(int16_t) + weights.size();
}

MmTargets::MmTargets(const MmOptions& options, const CompiledEdit& edit, bool photos)
    : min_weight_(float(options.min_weight)),
      outside_weight_(float(options.outside_weight)),
      unit_(LargestChange(edit, photos) / 32767) {}

double MmTargets::NumValues(const RefitViews& views) {
  return views.NumMaskValues() / kMostRowsPerRow;
}

std::shared_ptr<const ViewGeometry> MmTargets::Restrict(RefitViews& views,
                                                        const ViewGeometry& whole,
                                                        size_t budget_bytes) {
  const RegionBlend original = {views.OriginalColors(whole), views.scratch().images[0].data()};
  return views.backend().blend().Restrict(whole, views.active_flags(), budget_bytes, min_weight_,
                                          &original);
}

std::unique_ptr<RegionView> MmTargets::Make(RefitViews& views, const ViewGeometry& /*whole*/,
                                            const ViewGeometry& region,
                                            const TargetImages& images) {
  auto view = std::make_unique<MmView>();
  const size_t pixels = NumRegionPixels(region);
  view->target = views.backend().Allocate<int16_t>(pixels * 3);
  view->weights = views.backend().Allocate<uint8_t>(pixels);
  view->unit = unit_;
  // Rows that the region left out pass their weight on to the ones that stay.
  // Weights are stored up to 1: the larger of the two kinds has the part that the rows leave of it.
  const float largest = float(region.pixel_row_step() / kMostRowsPerRow);
  const float inside = largest / std::max(outside_weight_, 1.0f);
  views.backend().refit().RegionTarget(region, {.render = views.scratch().images[0].data(),
                                                .source = images.source,
                                                .mask = images.mask,
                                                .map = images.map,
                                                .unit = unit_,
                                                .target = view->target.data(),
                                                .weights = view->weights.data(),
                                                .inside_weight = inside,
                                                .outside_weight = inside * outside_weight_});
  return view;
}

}  // namespace retint
