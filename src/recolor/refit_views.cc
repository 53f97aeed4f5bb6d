// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/refit_views.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

#include "base/parallel.h"
#include "recolor/refit_start.h"

namespace retint {
namespace {

constexpr int kTilePixels = kTileSize * kTileSize;
// Of the memory that a view may keep; the rest is for its targets.
constexpr double kWeightsShare = 0.8;
constexpr int64_t kGaussians = 1 << 16;  // a task

// By the areas: a view's part must not depend on the others', so that all backends fit the same
// pixels.
std::vector<size_t> SharesOfCache(const std::vector<double>& areas, size_t bytes) {
  double sum = 0;
  for (const double area : areas) sum += area;
  std::vector<size_t> shares;
  for (const double area : areas) {
    shares.push_back(size_t(kWeightsShare * double(size_t(double(bytes) * area / sum))));
  }
  return shares;
}

}  // namespace

size_t RegionView::Bytes() const {
  return (region ? region->bytes() : 0) + slots.size() * sizeof(int32_t) +
         base_colors.size() * sizeof(float);
}

RefitViews::RefitViews(Renderer& renderer, RefitInput input, const RefitOptions& options,
                       TargetForm& form, Monitor& monitor)
    : renderer_(renderer),
      targets_(std::move(input.targets)),
      reducer_(ShareTargets(renderer.backend(), targets_)),
      edit_(renderer.backend(), CompiledEdit(input.edit)),
      cache_bytes_(options.RegionCacheBytes()),
      form_(form),
      num_coeffs_(input.model.NumShCoeffs()),
      reserved_(renderer.Reserve()) {
  const GaussianModel& model = input.model;
  const size_t count = model.NumGaussians();
  const size_t per_gaussian = size_t(num_coeffs_) * 3;
  std::vector<uint8_t> flags(count);
  ParallelRanges(int64_t(count), kGaussians, [&](int64_t begin, int64_t end) {
    for (size_t g = size_t(begin); g < size_t(end); ++g) {
      flags[g] = input.shares[g] > options.active_threshold;
    }
  });
  active_flags_ = backend().Upload(std::span<const uint8_t>(flags));
  renderer_.SetSh(model.sh);

  const bool any = std::find(flags.begin(), flags.end(), 1) != flags.end();
  NumberActive(any ? FindViews(monitor) : std::vector<uint8_t>(count, 0));
  row_parts_ = RowParts(reducer_.Parts(active_.size()), views_.size());
  for (auto& slot : views_) {
    if (slot.kept) FillSlots(*slot.kept);
  }

  std::vector<float> active_shares(active_.size());
  original_ = std::make_unique_for_overwrite<float[]>(NumValues());
  ParallelRanges(NumActive(), 4096, [&](int64_t begin, int64_t end) {
    for (size_t i = size_t(begin); i < size_t(end); ++i) {
      const size_t g = size_t(active_[i]);
      std::copy_n(model.sh.data() + g * per_gaussian, per_gaussian, &original_[i * per_gaussian]);
      active_shares[i] = input.shares[g];
    }
  });
  start_ = FitStart(*this, input.edit, input.paint, active_shares, monitor);
}

std::vector<uint8_t> RefitViews::FindViews(Monitor& monitor) {
  const std::vector<double> areas = AreasOf(targets_);
  const std::vector<size_t> budgets = SharesOfCache(areas, cache_bytes_);
  mask_values_ = 3 * std::accumulate(areas.begin(), areas.end(), 0.0);
  const auto marks = backend().Allocate<uint8_t>(active_flags_.size());
  std::vector<Found> found;
  std::vector<std::shared_ptr<RegionView>> prepared(targets_.size());
  size_t held = 0;
  for (const size_t t : reducer_.own()) {
    monitor.Step("refit", 0, 1);
    auto view = Prepare(targets_[t], budgets[t]);
    if (!view) continue;
    backend().refit().MarkRows(*view->region, marks.data());
    const size_t bytes = view->Bytes();
    found.push_back({t, view->region->tiles().size(), bytes});
    if (bytes > cache_bytes_ - held) continue;
    held += bytes;
    if (reserved_) reserved_->Set(held);
    prepared[t] = std::move(view);
  }
  std::vector<uint8_t> seen = backend().Download(marks.data(), marks.size());
  reducer_.Unite(&seen);
  KeepViews(reducer_.Gather<Found>(found), budgets, &prepared);
  return seen;
}

// active_: those that are seen, in their order.
void RefitViews::NumberActive(const std::vector<uint8_t>& seen) {
  const int64_t count = int64_t(seen.size()), pieces = (count + kGaussians - 1) / kGaussians;
  const auto end_of = [&](int64_t piece) { return std::min((piece + 1) * kGaussians, count); };
  std::vector<int64_t> first(size_t(pieces + 1), 0);  // each piece's first number
  ParallelTasks(pieces, [&](int64_t p) {
    first[size_t(p + 1)] =
        std::count(seen.begin() + p * kGaussians, seen.begin() + end_of(p), uint8_t{1});
  });
  std::partial_sum(first.begin(), first.end(), first.begin());
  active_.resize(size_t(first.back()));
  std::vector<int32_t> slot_of(seen.size(), -1);
  ParallelTasks(pieces, [&](int64_t p) {
    int64_t next = first[size_t(p)];
    for (int64_t g = p * kGaussians; g < end_of(p); ++g) {
      if (!seen[size_t(g)]) continue;
      slot_of[size_t(g)] = int32_t(next);
      active_[size_t(next++)] = int32_t(g);
    }
  });
  slot_of_ = backend().Upload(std::span<const int32_t>(slot_of));
}

// As one process keeps them that meets one view after the other: as long as they fit into the rest.
void RefitViews::KeepViews(const std::vector<Found>& found, const std::vector<size_t>& budgets,
                           std::vector<std::shared_ptr<RegionView>>* prepared) {
  for (const auto& [t, tiles, bytes] : found) {
    target_values_ += double(tiles) * kTilePixels * 3;
    image_values_ += double(targets_[t].mask->NumPixels()) * 3;
    Slot slot{t, bytes <= cache_bytes_ - kept_bytes_, nullptr};
    if (slot.keeps) kept_bytes_ += bytes;
    if (reducer_.Owns(t)) {
      own_views_.push_back(views_.size());
      if (slot.keeps && !(*prepared)[t]) {
        (*prepared)[t] = Prepare(targets_[t], budgets[t]);
      }
      if (slot.keeps) slot.kept = std::move((*prepared)[t]);
    }
    (*prepared)[t].reset();
    views_.push_back(std::move(slot));
  }
}

size_t RefitViews::NumKeptViews() const {
  return size_t(std::count_if(views_.begin(), views_.end(), [](auto& v) { return v.keeps; }));
}

void RefitViews::EvalSh(const ViewGeometry& view, const int32_t* slots, const float* sh,
                        float* colors) {
  const float* const center = view.camera().center;
  backend().sh().EvalSh(model(), {.rows = view.rows(),
                                  .slots = slots,
                                  .count = view.num_rows(),
                                  .sh = sh,
                                  .center = {center[0], center[1], center[2]},
                                  .colors = colors});
}

const float* RefitViews::OriginalColors(const ViewGeometry& whole) {
  float* const colors = backend().Grow(scratch_.features[0], size_t(whole.num_rows()) * 3);
  EvalSh(whole, nullptr, model().sh(), colors);
  return colors;
}

std::shared_ptr<RegionView> RefitViews::Prepare(const RefitTarget& target, size_t budget) {
  const auto whole = renderer_.Geometry(target.camera);
  const size_t pixels = target.mask->NumPixels();
  for (auto& image : scratch_.images) backend().Grow(image, pixels * 3);
  const auto region = form_.Restrict(*this, *whole, budget);
  const size_t rows = size_t(region->num_rows());
  if (rows == 0) return nullptr;
  for (auto& features : scratch_.features) backend().Grow(features, rows * 3);
  std::shared_ptr<RegionView> view = form_.Make(*this, *whole, *region, Upload(target));
  view->region = region;
  view->base_colors = backend().Allocate<float>(rows * 3);
  EvalSh(*region, nullptr, model().sh(), view->base_colors.data());
  return view;
}

TargetImages RefitViews::Upload(const RefitTarget& target) {
  const size_t pixels = target.mask->NumPixels();
  backend().CopyToDevice(backend().Grow(mask_, pixels), target.mask->data.data(), pixels);
  TargetImages images{target, mask_.data(), nullptr, target.edited ? ColorMap{} : map()};
  if (!target.edited && !target.photo) return images;
  const Image made = MadeFor(target, renderer_);
  const std::shared_ptr<const Image> photo = target.edited ? nullptr : PhotoOf(target, renderer_);
  const Image& source = photo ? *photo : made;
  images.source = backend().Grow(photo_, pixels * 3);
  backend().CopyToDevice(images.source, source.data.data(), pixels * 3 * sizeof(float));
  renderer_.ToColorsOfModel(target.mask->width, target.mask->height, images.source);
  return images;
}

void RefitViews::FillSlots(RegionView& view) {
  view.slots = backend().Allocate<int32_t>(size_t(view.region->num_rows()));
  backend().refit().NumberRows(*view.region, slot_of_.data(), view.slots.data());
}

std::shared_ptr<const RegionView> RefitViews::VisitRegion(size_t index) {
  const Slot& slot = views_[index];
  if (slot.kept) return slot.kept;
  const auto view = Prepare(targets_[slot.target], 0);
  FillSlots(*view);
  return view;
}

void RefitViews::EvalColors(const RegionView& view, const float* sh, float* colors) {
  EvalSh(*view.region, view.slots.data(), sh, colors);
}

void RefitViews::FindChange(const RegionView& view, const float* sh, float* colors, float* change) {
  EvalColors(view, sh, colors);
  backend().solve().LinearCombination({.x = colors,
                                       .y = view.base_colors.data(),
                                       .a = 1,
                                       .b = -1,
                                       .out = change,
                                       .count = view.region->num_rows() * 3});
}

void RefitViews::BlendChange(const RegionView& view, const float* sh, float* colors, float* change,
                             float* image) {
  FindChange(view, sh, colors, change);
  backend().blend().Blend(
      *view.region, {.features = change, .channels = 3, .image = image, .keep_outside = true});
}

}  // namespace retint
