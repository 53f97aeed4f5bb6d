// SPDX-License-Identifier: BSD-3-Clause
// What both solvers work on: the active Gaussians, and of every view that sees one, the region they
// touch with its targets. Internal to recolor.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/monitor.h"
#include "base/ranks.h"
#include "recolor/color_edit.h"
#include "recolor/gaussian_paint.h"
#include "recolor/sh_refitter.h"
#include "render/renderer.h"

namespace retint {

// InputError naming the view when its mask is missing or not of the view's size.
void CheckTarget(const RefitTarget& target);
// A target's photo, and what is made for it, without the renderer's background where that shows
// between the Gaussians: what is fitted and measured are their colors alone. Null or empty where
// there is none. InputError where one is not of the view's size.
std::shared_ptr<const Image> PhotoOf(const RefitTarget& target, Renderer& renderer);
Image MadeFor(const RefitTarget& target, Renderer& renderer, Mask* leaves = nullptr);

// An edit in backend memory, for its kernels.
struct UploadedEdit {
  UploadedEdit(Backend& backend, const CompiledEdit& edit);
  ColorMap map{};  // refers to the rest
  Buffer<float> tables;
  Buffer<ColorProgram> program;
};

// A view's share of the problem; all arrays are backend memory, indexed by row of `region`.
struct RegionView {
  std::shared_ptr<const ViewGeometry> region;
  Buffer<int32_t> slots;      // [rows] index among the active Gaussians, -1 for the others
  Buffer<float> base_colors;  // [rows, 3] colors of the original coefficients
  // mm: what the region's pixels should change by, see RegionTargetParams.
  Buffer<int16_t> target;
  Buffer<uint8_t> weights;  // [pixels]
  // adam: the original render (and the photo, where that is the target) around the region.
  std::array<int32_t, 4> roi{}, box{};  // x0, y0, x1, y1: the region's bounds; the loss's support
  Buffer<uint16_t> render, photo;
  Buffer<uint8_t> mask;  // [H, W]
  ColorMap map{};        // of `render` or `photo`; the identity where the target was made

  size_t Bytes() const;
};

// The rows of a view that have a slot, by part of the active Gaussians (part_begins()), host.
struct RowsByPart {
  std::vector<int32_t> row, gaussian, slot;
  std::vector<size_t> begin;  // [parts + 1] into these
};

// Scratch of one view at a time, in backend memory, sized for the largest.
struct RefitScratch {
  Buffer<float> images[3];    // [H, W, 3]
  Buffer<float> features[3];  // [rows, 3]
};

class RefitProblem {
 public:
  enum class Targets { kRegions, kBoxes };  // for mm, for adam

  // Step of the 16-bit render and photo boxes; they hold [0, 4).
  static constexpr float kBoxUnit = 1.0f / 16384;

  // Restricts every view to the Gaussians of share > options.active_threshold and prepares its
  // targets; views that do not fit into options.region_cache_mb are prepared again at each
  // visit.
  RefitProblem(Renderer& renderer, const GaussianModel& model, std::vector<RefitTarget> targets,
               const ColorEdit& edit, std::vector<float> shares, const RefitOptions& options,
               Targets form, Monitor& monitor, const GaussianPaint* paint = nullptr);

  size_t NumViews() const { return views_.size(); }  // that see an active Gaussian
  // Those of them that this rank owns, ascending; only these may be visited.
  std::span<const size_t> own_views() const { return own_views_; }
  int OwnerOf(size_t view) const { return views_[view].owner; }
  std::shared_ptr<const RegionView> Visit(size_t view);
  size_t NumKeptViews() const;
  size_t KeptBytes() const { return kept_bytes_; }

  std::span<const int32_t> active() const { return active_; }
  int64_t NumActive() const { return int64_t(active_.size()); }
  int num_coeffs() const { return num_coeffs_; }
  size_t NumValues() const { return active_.size() * size_t(num_coeffs_) * 3; }
  // Of all masks and a little of every view, 3 a pixel, in units of the pixels' weights: what a
  // loss is divided by. It does not depend on the region cache.
  double NumTargetValues() const;
  double RegionFraction() const { return image_values_ > 0 ? target_values_ / image_values_ : 0; }
  float target_unit() const { return target_unit_; }
  const ColorMap& map() const { return edit_.map; }  // of a Gaussian's own colors
  // Coefficients of the active Gaussians, [active, K, 3], host.
  std::span<const float> original() const { return {original_.get(), NumValues()}; }
  std::span<const float> start() const { return {start_.get(), NumValues()}; }

  Ranks& ranks() { return ranks_; }
  // Whether sums over the views wait for all of them, see ViewSum.
  bool SumsInOrder() { return ranks_.AreMany() && backend().IsHost(); }
  // The first active Gaussian of each part in which such sums go from rank to rank, and the end.
  std::span<const int32_t> part_begins() const { return part_begins_; }
  std::shared_ptr<const RowsByPart> ByPart(size_t view, const RegionView& region);

  Backend& backend() { return renderer_.backend(); }
  Model& model() { return renderer_.model(); }
  RefitScratch& scratch() { return scratch_; }
  // At least so many floats of host memory, which a device reaches quickly.
  std::span<float> HostScratch(size_t count);
  Buffer<float>& transfer_scratch() { return transfer_scratch_; }  // of SumOnDevices

  // The weights as an image, [H, W] into `image` (zero outside the region).
  void WeightImage(const RegionView& view, float* image);
  // What active coefficients `sh` change in the region, against the original ones: their colors
  // into `colors`, the difference into `change` (both [rows, 3]).
  void FindChange(const RegionView& view, const float* sh, float* colors, float* change);
  // Its blend too, into `image` ([H, W, 3], where the region has pixels; what lies outside is
  // kept).
  void BlendChange(const RegionView& view, const float* sh, float* colors, float* change,
                   float* image);
  // change [rows, 3] = the transpose of BlendChange's blend applied to `residual`, [H, W, 3], for
  // ViewSum.
  void BlendBack(const RegionView& view, const float* residual, float* change);
  // gradient [active, K, 3] += what the colors' gradients, [rows, 3], mean for the coefficients,
  // gated where `colors`, of BlendChange, is clamped.
  void AddGradient(const RegionView& view, const float* color_gradients, const float* colors,
                   float* gradient);

 private:
  struct Slot {
    size_t target = 0;  // index into targets_
    int owner = 0;
    bool keeps = false;                      // its owner keeps it
    std::shared_ptr<const RegionView> kept;  // null: prepared at each visit
  };
  // A view that sees an active Gaussian, as its owner tells it to all ranks.
  struct Found {
    uint64_t target, tiles, bytes;
  };

  // Restricts the views of this rank, and learns of the others'. [N]: which Gaussians one of all
  // sees.
  std::vector<uint8_t> FindViews(Monitor& monitor);
  void AddSeen(std::vector<uint8_t>* seen);
  void NumberActive(const std::vector<uint8_t>& seen);
  void KeepViews(const std::vector<Found>& found, const std::vector<int>& owners,
                 const std::vector<size_t>& budgets,
                 std::vector<std::shared_ptr<RegionView>>* prepared);
  void SplitActive();
  RegionView Prepare(const RefitTarget& target, size_t budget);
  // The colors of a whole view's rows, into scratch_.features[0].
  const float* OriginalColors(const ViewGeometry& geometry);
  // The original render, into scratch_.images[0].
  void RenderOriginal(const ViewGeometry& geometry, const ViewGeometry& region);
  void PrepareRegionTarget(const RefitTarget& target, RegionView& view);
  void PrepareBoxes(const RefitTarget& target, RegionView& view);
  void FillSlots(RegionView& view);
  // Colors of the view's rows for active coefficients, [rows, 3].
  void EvalColors(const RegionView& view, const float* sh, float* colors);
  void FitStart(const ColorEdit& edit, const GaussianPaint* paint, std::span<const float> shares,
                Monitor& monitor);
  void FitColors(const ColorEdit& edit, std::span<const float> starts, Monitor& monitor);
  void FitToViews(Buffer<float>& sh, Monitor& monitor);

  Ranks& ranks_ = CurrentRanks();
  Renderer& renderer_;
  std::vector<RefitTarget> targets_;
  UploadedEdit edit_;
  RefitOptions options_;
  Targets form_;
  int num_coeffs_;
  std::vector<Slot> views_;
  std::vector<size_t> own_views_;
  std::vector<int32_t> part_begins_;
  std::vector<std::shared_ptr<const RowsByPart>> by_part_;  // [views], null: not asked for yet
  std::vector<int32_t> active_;
  Buffer<int32_t> slot_of_;  // [N] index among the active Gaussians, -1 for the others
  // Hundreds of megabytes, maybe: not filled with zeros first, which one thread would do.
  std::unique_ptr<float[]> original_, start_;
  Buffer<uint8_t> active_flags_;  // [N]
  Buffer<float> photo_;           // [H, W, 3] scratch
  Buffer<uint8_t> mask_;          // [H, W] scratch
  RefitScratch scratch_;
  Buffer<float> transfer_scratch_;
  std::vector<float> host_scratch_;
  std::shared_ptr<void> host_lock_;  // of its pages
  size_t kept_bytes_ = 0;
  std::unique_ptr<GeometryCache::Reservation> reserved_;  // of as much; may be null
  double mask_values_ = 0;                                // of AreasOf()
  double target_values_ = 0, image_values_ = 0;
  float target_unit_ = 0;
};

}  // namespace retint
