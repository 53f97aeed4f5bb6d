// SPDX-License-Identifier: BSD-3-Clause
// The data of all solvers: the active Gaussians, and of every view that sees one, the region they
// touch, with the solver's form of its target. Internal to recolor.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/monitor.h"
#include "recolor/color_edit.h"
#include "recolor/gaussian_paint.h"
#include "recolor/refit_target.h"
#include "recolor/row_parts.h"
#include "recolor/sh_refitter.h"
#include "render/renderer.h"

namespace retint {

class RefitViews;

// A view's share of the fit, in backend memory, by row of `region`. A solver's TargetForm derives
// from it and adds its form of the target.
struct RegionView {
  virtual ~RegionView() = default;
  virtual size_t Bytes() const;

  std::shared_ptr<const ViewGeometry> region;
  Buffer<int32_t> slots;      // [rows] index among the active Gaussians, -1 for the others
  Buffer<float> base_colors;  // [rows, 3] colors of the original coefficients
};

// A target, and its pixels in backend memory.
struct TargetImages {
  const RefitTarget& target;
  const uint8_t* mask;  // [H, W]
  float* source;  // [H, W, 3] the photo, or the picture made for it; null: the original render
  ColorMap map;   // of the source; the identity where it was made
};

// How a solver makes its part of a RegionView.
class TargetForm {
 public:
  virtual ~TargetForm() = default;
  // The part of a whole view that the active Gaussians of `views` touch (BlendOps::Restrict).
  virtual std::shared_ptr<const ViewGeometry> Restrict(RefitViews& views, const ViewGeometry& whole,
                                                       size_t budget_bytes) = 0;
  // Only if the region has rows, right after Restrict().
  virtual std::unique_ptr<RegionView> Make(RefitViews& views, const ViewGeometry& whole,
                                           const ViewGeometry& region,
                                           const TargetImages& images) = 0;
};

// Scratch of one view at a time, in backend memory, sized for the largest.
struct RefitScratch {
  Buffer<float> images[3];    // [H, W, 3]
  Buffer<float> features[3];  // [rows, 3]
};

struct RefitInput {
  const GaussianModel& model;  // outlives the fit
  std::vector<RefitTarget> targets;
  const ColorEdit& edit;
  std::vector<float> shares;             // [N]
  const GaussianPaint* paint = nullptr;  // the edit's on each Gaussian
};

class RefitViews {
 public:
  // `renderer` and `form` outlive it. Restricts every view to the Gaussians of share >
  // options.active_threshold and prepares its targets; views that do not fit into
  // options.region_cache_mb are prepared again at each visit.
  RefitViews(Renderer& renderer, RefitInput input, const RefitOptions& options, TargetForm& form,
             Monitor& monitor);

  size_t NumViews() const { return views_.size(); }  // that see an active Gaussian
  // Those of them that this process owns, ascending; only these may be visited.
  std::span<const size_t> own_views() const { return own_views_; }
  // The number of a view's target, which counts in reducer().
  size_t TargetOf(size_t view) const { return views_[view].target; }
  // `View` is the TargetForm's own type of view.
  template <typename View = RegionView>
  std::shared_ptr<const View> Visit(size_t view) {
    return std::static_pointer_cast<const View>(VisitRegion(view));
  }
  size_t NumKeptViews() const;
  size_t KeptBytes() const { return kept_bytes_; }

  std::span<const int32_t> active() const { return active_; }
  int64_t NumActive() const { return int64_t(active_.size()); }
  int num_coeffs() const { return num_coeffs_; }
  size_t NumValues() const { return active_.size() * size_t(num_coeffs_) * 3; }
  // Of all masks and a little of every view, 3 a pixel. It does not depend on the region cache.
  double NumMaskValues() const { return mask_values_; }
  double RegionFraction() const { return image_values_ > 0 ? target_values_ / image_values_ : 0; }
  const ColorMap& map() const { return edit_.map; }  // of a Gaussian's own colors
  // Coefficients of the active Gaussians, [active, K, 3], host.
  std::span<const float> original() const { return {original_.get(), NumValues()}; }
  std::span<const float> start() const { return {start_.get(), NumValues()}; }

  ViewReducer& reducer() { return reducer_; }  // of the targets
  RowParts& row_parts() { return row_parts_; }

  Backend& backend() { return renderer_.backend(); }
  Model& model() { return renderer_.model(); }
  RefitScratch& scratch() { return scratch_; }
  const uint8_t* active_flags() const { return active_flags_.data(); }  // [N] backend memory

  // The original colors of a whole view's rows, into scratch().features[0].
  const float* OriginalColors(const ViewGeometry& whole);
  // Colors of the view's rows for active coefficients `sh`, [rows, 3].
  void EvalColors(const RegionView& view, const float* sh, float* colors);
  // The change of active coefficients `sh` from the original ones in the region: their colors into
  // `colors`, the difference into `change` (both [rows, 3]).
  void FindChange(const RegionView& view, const float* sh, float* colors, float* change);
  // Its blend too, into `image` [H, W, 3], at the region's pixels; other pixels keep their
  // values.
  void BlendChange(const RegionView& view, const float* sh, float* colors, float* change,
                   float* image);

 private:
  struct Slot {
    size_t target = 0;                 // index into targets_
    bool keeps = false;                // its owner keeps it
    std::shared_ptr<RegionView> kept;  // null: prepared at each visit
  };
  // A view that sees an active Gaussian, as its owner describes it to all processes.
  struct Found {
    uint64_t target, tiles, bytes;
  };

  // Restricts the own views, and learns of the others. [N]: the active Gaussians that a view sees.
  std::vector<uint8_t> FindViews(Monitor& monitor);
  void NumberActive(const std::vector<uint8_t>& seen);
  void KeepViews(const std::vector<Found>& found, const std::vector<size_t>& budgets,
                 std::vector<std::shared_ptr<RegionView>>* prepared);
  // Null: the view sees no active Gaussian.
  std::shared_ptr<RegionView> Prepare(const RefitTarget& target, size_t budget);
  TargetImages Upload(const RefitTarget& target);
  void FillSlots(RegionView& view);
  std::shared_ptr<const RegionView> VisitRegion(size_t view);
  void EvalSh(const ViewGeometry& view, const int32_t* slots, const float* sh, float* colors);

  Renderer& renderer_;
  std::vector<RefitTarget> targets_;
  ViewReducer reducer_;
  UploadedEdit edit_;
  size_t cache_bytes_;
  TargetForm& form_;
  int num_coeffs_;
  std::vector<Slot> views_;
  std::vector<size_t> own_views_;
  RowParts row_parts_;
  std::vector<int32_t> active_;
  Buffer<int32_t> slot_of_;  // [N] index among the active Gaussians, -1 for the others
  // Hundreds of megabytes, maybe: not filled with zeros first, which one thread would do.
  std::unique_ptr<float[]> original_, start_;
  Buffer<uint8_t> active_flags_;  // [N]
  Buffer<float> photo_;           // [H, W, 3] scratch
  Buffer<uint8_t> mask_;          // [H, W] scratch
  RefitScratch scratch_;
  size_t kept_bytes_ = 0;
  std::unique_ptr<GeometryCache::Reservation> reserved_;  // of as much; may be null
  double mask_values_ = 0;                                // of AreasOf()
  double target_values_ = 0, image_values_ = 0;
};

}  // namespace retint
