// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/refit_problem.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "base/error.h"
#include "base/parallel.h"
#include "scene/image_checks.h"

namespace retint {
namespace {

constexpr int kTilePixels = kTileSize * kTileSize;
// The 11x11 window reaches 5 pixels; SSIM inside the region's bounds and its gradient reach twice
// that.
constexpr int kLossHalo = 10;
// A compact region keeps at least every eighth row.
constexpr double kMostRowsPerRow = 8;
// Of what a view may keep; the rest is for its targets.
constexpr double kWeightsShare = 0.8;
constexpr int64_t kGaussians = 1 << 16, kPixels = 1 << 16;  // a task

// Pixel bounds of a region's tiles: x0, y0, x1, y1, half-open.
std::array<int32_t, 4> TileBounds(const ViewGeometry& region) {
  const CameraParams& camera = region.camera();
  const int tiles_x = region.tiles_x();
  std::array<int32_t, 4> bounds = {camera.width, camera.height, 0, 0};
  for (const int32_t tile : region.tiles()) {
    const int x = tile % tiles_x * kTileSize, y = tile / tiles_x * kTileSize;
    bounds = {std::min(bounds[0], x), std::min(bounds[1], y),
              std::max(bounds[2], std::min(x + kTileSize, camera.width)),
              std::max(bounds[3], std::min(y + kTileSize, camera.height))};
  }
  return bounds;
}

// The area of each mask, and a little for every view.
std::vector<double> AreasOf(const std::vector<RefitTarget>& targets) {
  constexpr double kLeast = 0.05;  // of a view's pixels
  std::vector<double> areas(targets.size());
  ParallelTasks(int64_t(targets.size()), [&](int64_t t) {
    const auto& mask = targets[size_t(t)].mask->data;
    const auto empty = std::count(mask.begin(), mask.end(), uint8_t{0});
    areas[size_t(t)] = double(mask.size()) - double(empty) + kLeast * double(mask.size());
  });
  return areas;
}

// By the areas: what a view gets must not depend on what the others took, so that all backends fit
// the same pixels.
std::vector<size_t> SharesOfCache(const std::vector<double>& areas, size_t bytes) {
  double sum = 0;
  for (const double area : areas) sum += area;
  std::vector<size_t> shares;
  for (const double area : areas) {
    shares.push_back(size_t(kWeightsShare * double(size_t(double(bytes) * area / sum))));
  }
  return shares;
}

size_t BoxValues(const std::array<int32_t, 4>& box) {
  return size_t(box[2] - box[0]) * size_t(box[3] - box[1]) * 3;
}

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
    constexpr float kBetween = 1.1f;  // for what lies between them
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

std::vector<int> OwnersByArea(const std::vector<double>& areas) {
  const Ranks& ranks = CurrentRanks();
  return ranks.AreMany() ? ShareOut(areas, ranks) : std::vector<int>(areas.size(), 0);
}

}  // namespace

std::vector<int> OwnersOf(const std::vector<RefitTarget>& targets) {
  return CurrentRanks().AreMany() ? OwnersByArea(AreasOf(targets))
                                  : std::vector<int>(targets.size(), 0);
}

namespace {

void CheckSize(const RefitTarget& target, int width, int height, size_t values, int channels,
               const char* what) {
  const Camera& camera = target.camera.camera;
  if (width != camera.width || height != camera.height ||
      values != size_t(std::max(width, 0)) * size_t(std::max(height, 0)) * size_t(channels)) {
    throw InputError("view '" + target.name + "': " + what + " is " + SizeText(width, height) +
                     ", the camera is " + SizeText(camera.width, camera.height));
  }
}

}  // namespace

void CheckTarget(const RefitTarget& target) {
  if (!target.mask) throw InputError("view '" + target.name + "': has no mask");
  CheckSize(target, target.mask->width, target.mask->height, target.mask->data.size(), 1, "mask");
}

namespace {

bool HasBackground(const Renderer& renderer) {
  const auto& background = renderer.background();
  return std::any_of(background.begin(), background.end(), [](float value) { return value != 0; });
}

Image WithoutBackground(Image image, const PosedCamera& camera, Renderer& renderer) {
  RenderRequest request;
  request.rgb = false;
  request.alpha = true;
  const ScalarImage alpha = renderer.Render(camera, request).alpha;
  ParallelRanges(int64_t(alpha.data.size()), kPixels, [&](int64_t begin, int64_t end) {
    for (size_t p = size_t(begin); p < size_t(end); ++p) {
      const float through = 1 - alpha.data[p];
      for (size_t c = 0; c < 3; ++c) image.data[3 * p + c] -= through * renderer.background()[c];
    }
  });
  return image;
}

}  // namespace

std::shared_ptr<const Image> PhotoOf(const RefitTarget& target, Renderer& renderer) {
  if (!target.photo) return nullptr;
  std::shared_ptr<const Image> photo = target.photo();
  CheckSize(target, photo->width, photo->height, photo->data.size(), 3, "photo");
  if (!HasBackground(renderer)) return photo;
  return std::make_shared<const Image>(WithoutBackground(*photo, target.camera, renderer));
}

Image MadeFor(const RefitTarget& target, Renderer& renderer, Mask* leaves) {
  if (!target.edited) return {};
  Image made = target.edited(renderer, leaves);
  CheckSize(target, made.width, made.height, made.data.size(), 3, "edited picture");
  return HasBackground(renderer) ? WithoutBackground(std::move(made), target.camera, renderer)
                                 : made;
}

UploadedEdit::UploadedEdit(Backend& backend, const CompiledEdit& edit) {
  if (edit.IsAffine()) {
    map = edit.Map();
    return;
  }
  ColorProgram resident = edit.program();
  if (!edit.tables().empty()) tables = backend.Upload(edit.tables());
  resident.tables = tables.data();
  program = backend.Upload(std::span<const ColorProgram>(&resident, 1));
  map.program = program.data();
}

size_t RegionView::Bytes() const {
  return (region ? region->bytes() : 0) + slots.size() * sizeof(int32_t) +
         base_colors.size() * sizeof(float) + target.size() * sizeof(int16_t) + weights.size() +
         (render.size() + photo.size()) * sizeof(uint16_t) + mask.size();
}

RefitProblem::RefitProblem(Renderer& renderer, const GaussianModel& model,
                           std::vector<RefitTarget> targets, const ColorEdit& edit,
                           std::vector<float> shares, const RefitOptions& options, Targets form,
                           Monitor& monitor, const GaussianPaint* paint)
    : renderer_(renderer),
      targets_(std::move(targets)),
      edit_(renderer.backend(), CompiledEdit(edit)),
      options_(options),
      form_(form),
      num_coeffs_(model.NumShCoeffs()),
      reserved_(renderer.Reserve()) {
  const size_t count = model.NumGaussians();
  const size_t per_gaussian = size_t(num_coeffs_) * 3;
  bool photos = false;
  for (const auto& target : targets_) photos = photos || target.photo || target.edited;
  target_unit_ = LargestChange(CompiledEdit(edit), ranks_.Any(photos)) / 32767;

  std::vector<uint8_t> flags(count);
  ParallelRanges(int64_t(count), kGaussians, [&](int64_t begin, int64_t end) {
    for (size_t g = size_t(begin); g < size_t(end); ++g) {
      flags[g] = shares[g] > options.active_threshold;
    }
  });
  active_flags_ = backend().Upload(std::span<const uint8_t>(flags));
  renderer_.SetSh(model.sh);

  const bool any = std::find(flags.begin(), flags.end(), 1) != flags.end();
  NumberActive(any ? FindViews(monitor) : std::vector<uint8_t>(count, 0));
  SplitActive();
  for (auto& slot : views_) {
    if (!slot.kept) continue;
    auto view = std::make_shared<RegionView>(*slot.kept);
    FillSlots(*view);
    slot.kept = std::move(view);
  }

  std::vector<float> active_shares(active_.size());
  original_ = std::make_unique_for_overwrite<float[]>(NumValues());
  ParallelRanges(NumActive(), 4096, [&](int64_t begin, int64_t end) {
    for (size_t i = size_t(begin); i < size_t(end); ++i) {
      const size_t g = size_t(active_[i]);
      std::copy_n(model.sh.data() + g * per_gaussian, per_gaussian, &original_[i * per_gaussian]);
      active_shares[i] = shares[g];
    }
  });
  FitStart(edit, paint, active_shares, monitor);
}

std::vector<uint8_t> RefitProblem::FindViews(Monitor& monitor) {
  const std::vector<double> areas = AreasOf(targets_);
  const std::vector<int> owners = OwnersByArea(areas);
  const std::vector<size_t> budgets = SharesOfCache(areas, options_.RegionCacheBytes());
  mask_values_ = 3 * std::accumulate(areas.begin(), areas.end(), 0.0);
  const auto marks = backend().Allocate<uint8_t>(active_flags_.size());
  std::vector<Found> found;
  std::vector<std::shared_ptr<RegionView>> prepared(targets_.size());
  size_t held = 0;
  for (size_t t = 0; t < targets_.size(); ++t) {
    if (owners[t] != ranks_.rank()) continue;
    monitor.Step("refit", 0, 1);
    auto view = std::make_shared<RegionView>(Prepare(targets_[t], budgets[t]));
    if (view->region->num_rows() == 0) continue;
    backend().refit().MarkRows(*view->region, marks.data());
    const size_t bytes = view->Bytes();
    found.push_back({t, view->region->tiles().size(), bytes});
    if (bytes > options_.RegionCacheBytes() - held) continue;
    held += bytes;
    if (reserved_) reserved_->Set(held);
    prepared[t] = std::move(view);
  }
  std::vector<uint8_t> seen = backend().Download(marks.data(), marks.size());
  if (ranks_.AreMany()) {
    AddSeen(&seen);
    found = ranks_.Gather<Found>(found);
  }
  KeepViews(found, owners, budgets, &prepared);
  return seen;
}

// active_: those that are seen, in their order.
void RefitProblem::NumberActive(const std::vector<uint8_t>& seen) {
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

// Those of all ranks, a bit a Gaussian.
void RefitProblem::AddSeen(std::vector<uint8_t>* seen) {
  constexpr int64_t kBits = 8, kGrain = 1 << 16;
  const int64_t count = int64_t(seen->size());
  std::string bits(size_t((count + kBits - 1) / kBits), '\0');
  ParallelRanges(int64_t(bits.size()), kGrain, [&](int64_t begin, int64_t end) {
    for (int64_t g = begin * kBits; g < std::min(end * kBits, count); ++g) {
      char& byte = bits[size_t(g / kBits)];
      if ((*seen)[size_t(g)]) byte = char(byte | 1 << g % kBits);
    }
  });
  for (const std::string& one : ranks_.AllGather(bits)) {
    ParallelRanges(count, kGrain, [&](int64_t begin, int64_t end) {
      for (int64_t g = begin; g < end; ++g) {
        (*seen)[size_t(g)] |= uint8_t(one[size_t(g / kBits)] >> g % kBits & 1);
      }
    });
  }
}

// As one rank keeps them that meets one view after the other: what fits into what is left.
void RefitProblem::KeepViews(const std::vector<Found>& found, const std::vector<int>& owners,
                             const std::vector<size_t>& budgets,
                             std::vector<std::shared_ptr<RegionView>>* prepared) {
  for (const auto& [t, tiles, bytes] : found) {
    target_values_ += double(tiles) * kTilePixels * 3;
    image_values_ += double(targets_[t].mask->NumPixels()) * 3;
    Slot slot{t, owners[t], bytes <= options_.RegionCacheBytes() - kept_bytes_, nullptr};
    if (slot.keeps) kept_bytes_ += bytes;
    if (slot.owner == ranks_.rank()) {
      own_views_.push_back(views_.size());
      if (slot.keeps && !(*prepared)[t]) {
        (*prepared)[t] = std::make_shared<RegionView>(Prepare(targets_[t], budgets[t]));
      }
      if (slot.keeps) slot.kept = std::move((*prepared)[t]);
    }
    (*prepared)[t].reset();
    views_.push_back(std::move(slot));
  }
}

// Parts of the active Gaussians: several a rank, so that few ranks wait, none too small.
void RefitProblem::SplitActive() {
  constexpr size_t kPartsOfRank = 4, kLeastGaussians = 256;
  const size_t parts =
      std::clamp<size_t>(active_.size() / kLeastGaussians, 1, kPartsOfRank * size_t(ranks_.size()));
  for (size_t p = 0; p <= parts; ++p) part_begins_.push_back(int32_t(p * active_.size() / parts));
  by_part_.resize(views_.size());
}

std::shared_ptr<const RowsByPart> RefitProblem::ByPart(size_t view, const RegionView& region) {
  if (by_part_[view]) return by_part_[view];
  const size_t rows = size_t(region.region->num_rows()), parts = part_begins_.size() - 1;
  const int32_t* const gaussians = region.region->rows();
  const auto part_of = [&](int32_t slot) {
    return size_t(std::upper_bound(part_begins_.begin(), part_begins_.end(), slot) -
                  part_begins_.begin()) -
           1;
  };
  auto result = std::make_shared<RowsByPart>();
  result->begin.assign(parts + 1, 0);
  for (size_t r = 0; r < rows; ++r) {
    if (region.slots.data()[r] >= 0) ++result->begin[part_of(region.slots.data()[r]) + 1];
  }
  for (size_t p = 0; p < parts; ++p) result->begin[p + 1] += result->begin[p];
  std::vector<size_t> next = result->begin;
  for (auto* list : {&result->row, &result->gaussian, &result->slot}) {
    list->resize(result->begin.back());
  }
  for (size_t r = 0; r < rows; ++r) {
    const int32_t slot = region.slots.data()[r];
    if (slot < 0) continue;
    const size_t at = next[part_of(slot)]++;
    result->row[at] = int32_t(r);
    result->gaussian[at] = gaussians[r];
    result->slot[at] = slot;
  }
  return by_part_[view] = std::move(result);
}

std::span<float> RefitProblem::HostScratch(size_t count) {
  if (host_scratch_.size() < count) {
    host_lock_.reset();
    host_scratch_.assign(count, 0.0f);
    host_lock_ = backend().LockPages(host_scratch_.data(), count * sizeof(float));
  }
  return std::span(host_scratch_).first(count);
}

size_t RefitProblem::NumKeptViews() const {
  return size_t(std::count_if(views_.begin(), views_.end(), [](auto& v) { return v.keeps; }));
}

double RefitProblem::NumTargetValues() const { return mask_values_ / kMostRowsPerRow; }

const float* RefitProblem::OriginalColors(const ViewGeometry& geometry) {
  EvalShParams eval{};
  eval.rows = geometry.rows();
  eval.count = geometry.num_rows();
  eval.sh = model().sh();
  std::copy_n(geometry.camera().center, 3, eval.center);
  eval.colors = backend().Grow(scratch_.features[0], size_t(geometry.num_rows()) * 3);
  backend().sh().EvalSh(model(), eval);
  return eval.colors;
}

void RefitProblem::RenderOriginal(const ViewGeometry& geometry, const ViewGeometry& region) {
  BlendParams blend{};
  blend.features = OriginalColors(geometry);
  blend.channels = 3;
  blend.image = scratch_.images[0].data();
  blend.pixel_rows = region.pixel_rows();
  backend().blend().Blend(geometry, blend);
}

RegionView RefitProblem::Prepare(const RefitTarget& target, size_t budget) {
  const auto geometry = renderer_.Geometry(target.camera);
  const CameraParams& camera = geometry->camera();
  const size_t pixels = size_t(camera.width) * size_t(camera.height);
  for (auto& image : scratch_.images) backend().Grow(image, pixels * 3);
  RegionView view;
  if (form_ == Targets::kRegions) {
    const RegionBlend original = {OriginalColors(*geometry), scratch_.images[0].data()};
    view.region = backend().blend().Restrict(*geometry, active_flags_.data(), budget,
                                             float(options_.mm.min_weight), &original);
  } else {
    view.region = backend().blend().Restrict(*geometry, active_flags_.data(), budget);
  }
  const size_t rows = size_t(view.region->num_rows());
  if (rows == 0) return view;
  if (form_ == Targets::kBoxes) RenderOriginal(*geometry, *view.region);  // beyond the region too
  for (auto& features : scratch_.features) backend().Grow(features, rows * 3);

  view.base_colors = backend().Allocate<float>(rows * 3);
  EvalShParams eval{};
  eval.rows = view.region->rows();
  eval.count = view.region->num_rows();
  eval.sh = model().sh();
  std::copy_n(camera.center, 3, eval.center);
  eval.colors = view.base_colors.data();
  backend().sh().EvalSh(model(), eval);

  backend().Grow(mask_, pixels);
  backend().CopyToDevice(mask_.data(), target.mask->data.data(), pixels);
  if (target.edited || target.photo) {
    const Image made = MadeFor(target, renderer_);
    const std::shared_ptr<const Image> photo = target.edited ? nullptr : PhotoOf(target, renderer_);
    const Image& source = photo ? *photo : made;
    backend().Grow(photo_, pixels * 3);
    backend().CopyToDevice(photo_.data(), source.data.data(), pixels * 3 * sizeof(float));
  }
  if (!target.edited) view.map = map();
  if (form_ == Targets::kRegions) {
    PrepareRegionTarget(target, view);
  } else {
    PrepareBoxes(target, view);
  }
  return view;
}

void RefitProblem::PrepareRegionTarget(const RefitTarget& target, RegionView& view) {
  const size_t pixels = NumRegionPixels(*view.region);
  view.target = backend().Allocate<int16_t>(pixels * 3);
  view.weights = backend().Allocate<uint8_t>(pixels);
  RegionTargetParams params{};
  params.render = scratch_.images[0].data();
  params.source = target.photo || target.edited ? photo_.data() : nullptr;
  params.mask = mask_.data();
  params.map = view.map;
  params.unit = target_unit_;
  params.target = view.target.data();
  params.weights = view.weights.data();
  // Rows that the region left out pass their weight on to the ones that stay.
  // Weights are stored up to 1: the larger of the two kinds has what the rows leave of it.
  const float largest = float(view.region->pixel_row_step() / kMostRowsPerRow);
  const float outside = float(options_.mm.outside_weight);
  params.inside_weight = largest / std::max(outside, 1.0f);
  params.outside_weight = params.inside_weight * outside;
  backend().refit().RegionTarget(*view.region, params);
}

void RefitProblem::WeightImage(const RegionView& view, float* image) {
  backend().refit().RegionWeightImage(*view.region, view.weights.data(), image);
}

void RefitProblem::PrepareBoxes(const RefitTarget& target, RegionView& view) {
  const CameraParams& camera = view.region->camera();
  view.roi = TileBounds(*view.region);
  view.box = {std::max(view.roi[0] - kLossHalo, 0), std::max(view.roi[1] - kLossHalo, 0),
              std::min(view.roi[2] + kLossHalo, camera.width),
              std::min(view.roi[3] + kLossHalo, camera.height)};
  const auto pack = [&](float* image, Buffer<uint16_t>& packed) {
    packed = backend().Allocate<uint16_t>(BoxValues(view.box));
    PackBoxParams params{};
    params.image = image;
    params.width = camera.width;
    params.height = camera.height;
    std::copy_n(view.box.begin(), 4, params.box);
    params.packed = packed.data();
    params.unit = kBoxUnit;
    backend().refit().PackBox(params);
  };
  pack(scratch_.images[0].data(), view.render);
  if (target.photo || target.edited) pack(photo_.data(), view.photo);
  const size_t pixels = target.mask->NumPixels();
  view.mask = backend().Allocate<uint8_t>(pixels);
  backend().CopyToDevice(view.mask.data(), target.mask->data.data(), pixels);
}

void RefitProblem::FillSlots(RegionView& view) {
  view.slots = backend().Allocate<int32_t>(size_t(view.region->num_rows()));
  backend().refit().NumberRows(*view.region, slot_of_.data(), view.slots.data());
}

std::shared_ptr<const RegionView> RefitProblem::Visit(size_t index) {
  const Slot& slot = views_[index];
  if (slot.kept) return slot.kept;
  auto view = std::make_shared<RegionView>(Prepare(targets_[slot.target], 0));
  FillSlots(*view);
  return view;
}

void RefitProblem::EvalColors(const RegionView& view, const float* sh, float* colors) {
  EvalShParams eval{};
  eval.rows = view.region->rows();
  eval.slots = view.slots.data();
  eval.count = view.region->num_rows();
  eval.sh = sh;
  std::copy_n(view.region->camera().center, 3, eval.center);
  eval.colors = colors;
  backend().sh().EvalSh(model(), eval);
}

void RefitProblem::FindChange(const RegionView& view, const float* sh, float* colors,
                              float* change) {
  EvalColors(view, sh, colors);
  LinearCombinationParams difference{};
  difference.x = colors;
  difference.y = view.base_colors.data();
  difference.a = 1;
  difference.b = -1;
  difference.out = change;
  difference.count = view.region->num_rows() * 3;
  backend().solve().LinearCombination(difference);
}

void RefitProblem::BlendChange(const RegionView& view, const float* sh, float* colors,
                               float* change, float* image) {
  FindChange(view, sh, colors, change);
  backend().blend().Blend(
      *view.region, {.features = change, .channels = 3, .image = image, .keep_outside = true});
}

void RefitProblem::BlendBack(const RegionView& view, const float* residual, float* change) {
  backend().blend().BlendTranspose(*view.region,
                                   {.residual = residual, .channels = 3, .result = change});
}

void RefitProblem::AddGradient(const RegionView& view, const float* color_gradients,
                               const float* colors, float* gradient) {
  EvalShTransposeParams params{};
  params.rows = view.region->rows();
  params.slots = view.slots.data();
  params.count = view.region->num_rows();
  params.color_gradients = color_gradients;
  params.colors = colors;
  std::copy_n(view.region->camera().center, 3, params.center);
  params.gradient = gradient;
  backend().sh().EvalShTranspose(model(), params);
}

}  // namespace retint
