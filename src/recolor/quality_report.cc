// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/quality_report.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "base/error.h"
#include "base/parallel.h"
#include "recolor/refit_target.h"
#include "scene/mask_pixels.h"

namespace retint {
namespace {

constexpr double kPerfectPsnr = 99;
constexpr size_t kMaxWorst = 5;

double Psnr(double squared_errors, int64_t values) {
  if (values == 0 || squared_errors <= 0) return kPerfectPsnr;
  return std::min(kPerfectPsnr, -10 * std::log10(squared_errors / double(values)));
}

float Shown(float value) { return std::clamp(value, 0.0f, 1.0f); }

double Square(float value) { return double(value) * double(value); }

// The edit, and its colors if those that no screen shows were left as they are.
class ReportedEdit {
 public:
  explicit ReportedEdit(const ColorEdit& edit)
      : edit_(edit), unclipped_(edit, OutOfRange::kLeft), clips_(edit.BringsIntoRange()) {}

  // Colors, [*, 3], become f(color), not mixed by a mask.
  void Apply(std::vector<float>* colors) const { edit_.ApplyToAll(*colors); }

  // How many of the colors, as a screen shows them, leave the gamut. `edited`: the colors after
  // Apply().
  int64_t CountLeaving(const std::vector<float>& colors, const std::vector<float>& edited) const {
    // The edit costs more than all else that is done to a pixel: mostly once is enough.
    std::vector<float> others;
    int64_t count = 0;
    for (size_t i = 0; i < colors.size(); i += 3) {
      const float shown[3] = {Shown(colors[i]), Shown(colors[i + 1]), Shown(colors[i + 2])};
      if (!clips_ && std::equal(shown, shown + 3, &colors[i])) {
        count += LeavesGamut(&edited[i]);
      } else {
        others.insert(others.end(), shown, shown + 3);
      }
    }
    unclipped_.ApplyToAll(others);
    for (size_t i = 0; i < others.size(); i += 3) count += LeavesGamut(&others[i]);
    return count;
  }

 private:
  CompiledEdit edit_, unclipped_;
  bool clips_;
};

// A view before and after. If a tile was not drawn, both are the same and nothing is masked.
struct Pair {
  std::span<const float> images;         // [H, W, 6]: before, after
  const std::vector<uint8_t>& is_drawn;  // [tiles of the view], row-major
};

size_t TilesOf(int pixels) { return size_t((pixels + kTileSize - 1) / kTileSize); }

// The colors that the pixels of one view are compared with.
struct Comparison {
  const RefitTarget& target;
  const Image* photo;  // the target's; or null
  const Image& made;   // by target.edited; or empty
  const Mask& leaves;  // its own, where it made it
  const ReportedEdit& edit;
  const Pair& pair;
};

// As a viewer shows them: values are clamped to [0, 1] before they are compared.
void ComparePixel(const float* wanted, const float* images, bool is_inside, ErrorSums* sums) {
  for (size_t c = 0; c < 3; ++c) {
    const float goal = Shown(wanted[c]), old = Shown(images[c]), now = Shown(images[3 + c]);
    if (is_inside) {
      sums->inside_before += Square(old - goal);
      sums->inside_after += Square(now - goal);
    } else {
      sums->outside += Square(now - goal);
      sums->bleed += std::abs(now - old);
    }
  }
  (is_inside ? sums->inside_values : sums->outside_values) += 3;
}

void CompareOutside(const Comparison& in, size_t p, ErrorSums* sums) {
  const float* images = &in.pair.images[6 * p];
  const bool is_made = !in.made.Empty();
  if (!in.photo && !is_made && std::equal(images, images + 3, images + 3)) {
    sums->outside_values += 3;  // most pixels of most views
    return;
  }
  const float* source = in.photo ? &in.photo->data[3 * p] : images;
  ComparePixel(is_made ? &in.made.data[3 * p] : source, images, false, sums);
}

// The edit is applied to all pixels of a row at once.
void CompareInside(const Comparison& in, const std::vector<size_t>& pixels, ErrorSums* sums) {
  std::vector<float> colors, edited;
  colors.reserve(3 * pixels.size());
  for (const size_t p : pixels) {
    const float* source = in.photo ? &in.photo->data[3 * p] : &in.pair.images[6 * p];
    colors.insert(colors.end(), source, source + 3);
  }
  if (in.made.Empty()) {
    edited = colors;
    in.edit.Apply(&edited);
    sums->out_of_gamut += in.edit.CountLeaving(colors, edited);
  } else {
    for (const size_t p : pixels) sums->out_of_gamut += IsInside(in.leaves.data[p]);
  }
  for (size_t i = 0; i < pixels.size(); ++i) {
    const size_t p = pixels[i];
    const float share = float(in.target.mask->data[p]) / 255.0f;
    for (size_t c = 3 * i; c < 3 * i + 3 && in.made.Empty(); ++c) {
      edited[c] = colors[c] + share * (edited[c] - colors[c]);
    }
    ComparePixel(in.made.Empty() ? &edited[3 * i] : &in.made.data[3 * p], &in.pair.images[6 * p],
                 true, sums);
  }
}

ErrorSums CompareRow(const Comparison& in, size_t y) {
  ErrorSums sums;
  std::vector<size_t> inside;
  const size_t width = size_t(in.target.mask->width);
  const uint8_t* is_drawn = &in.pair.is_drawn[y / kTileSize * TilesOf(in.target.mask->width)];
  for (size_t x = 0; x < width; x += kTileSize, ++is_drawn) {
    const size_t end = std::min(width, x + kTileSize);
    if (!*is_drawn) {
      sums.outside_values += int64_t(3 * (end - x));
      continue;
    }
    for (size_t p = y * width + x; p < y * width + end; ++p) {
      const uint8_t value = in.target.mask->data[p];
      if (IsInside(value)) inside.push_back(p);
      if (value == 0) CompareOutside(in, p, &sums);
    }
  }
  CompareInside(in, inside, &sums);
  return sums;
}

// The sum does not depend on the number of threads.
ErrorSums Compare(const Comparison& in, uint16_t pixel_rows) {
  std::vector<ErrorSums> rows(size_t(in.target.mask->height));
  ParallelTasks(int64_t(rows.size()), [&](size_t y) {
    if (pixel_rows >> (y % kTileSize) & 1) rows[y] = CompareRow(in, y);
  });
  ErrorSums sums;
  for (const ErrorSums& row : rows) sums += row;
  return sums;
}

QualityNumbers ToNumbers(const ErrorSums& sums, int views) {
  QualityNumbers numbers;
  numbers.views = views;
  numbers.psnr_inside_before = Psnr(sums.inside_before, sums.inside_values);
  numbers.psnr_inside_after = Psnr(sums.inside_after, sums.inside_values);
  numbers.psnr_outside = Psnr(sums.outside, sums.outside_values);
  if (sums.inside_values > 0) {
    numbers.out_of_gamut = 3 * double(sums.out_of_gamut) / double(sums.inside_values);
  }
  if (sums.outside_values > 0) numbers.bleed = sums.bleed / double(sums.outside_values);
  return numbers;
}

ShRange RangeOf(std::span<const float> sh) {
  if (sh.empty()) return {};
  const auto [low, high] = std::minmax_element(sh.begin(), sh.end());
  return {*low, *high};
}

// Renders views with two sets of coefficients in one pass: visibilities cost more than channels.
class PairRenderer {
 public:
  PairRenderer(Renderer& renderer, std::span<const float> before, std::span<const float> after)
      : renderer_(renderer), after_(renderer.backend().Upload(after)) {
    renderer_.SetSh(before);
    const size_t block = size_t(renderer.model().num_sh_coeffs()) * 3;
    std::vector<uint8_t> differs(size_t(renderer.model().count()));
    for (size_t g = 0; g < differs.size(); ++g) {
      differs[g] = std::memcmp(&before[g * block], &after[g * block], block * sizeof(float)) != 0;
    }
    differs_ = renderer.backend().Upload(std::span<const uint8_t>(differs));
  }

  // Valid until the next call.
  Pair Render(const RefitTarget& target, uint16_t pixel_rows) {
    Backend& backend = renderer_.backend();
    const auto geometry = renderer_.Geometry(target.camera);
    const CameraParams& params = geometry->camera();
    const std::vector<int32_t> tiles = TilesToDraw(target, *geometry);
    if (tiles.empty()) return {{}, is_drawn_};
    const size_t values = size_t(params.width) * size_t(params.height) * 6;
    const size_t colors = size_t(geometry->num_rows()) * 6;
    backend.Grow(colors_, colors);
    backend.Grow(images_, values);
    for (int which = 0; which < 2; ++which) {
      backend.sh().EvalSh(renderer_.model(),
                          {.rows = geometry->rows(),
                           .count = geometry->num_rows(),
                           .sh = which == 0 ? renderer_.model().sh() : after_.data(),
                           .center = {params.center[0], params.center[1], params.center[2]},
                           .colors = colors_.data() + 3 * which,
                           .stride = 6});
    }
    const bool some = tiles.size() < is_drawn_.size();
    backend.blend().Blend(
        *geometry, {.features = colors_.data(),
                    .channels = 6,
                    .image = images_.data(),
                    .pixel_rows = pixel_rows,
                    .tiles = some ? std::span<const int32_t>(tiles) : std::span<const int32_t>()});
    // Pairs of pixels are twice as many pixels.
    renderer_.ToSrgb(2 * params.width, params.height, images_.data());
    if (backend.IsHost()) return {{images_.data(), values}, is_drawn_};
    host_.resize(values);
    backend.CopyToHost(host_.data(), images_.data(), values * sizeof(float));
    return {host_, is_drawn_};
  }

 private:
  // Those where the two differ or where the mask asks for a change, or all of them where a photo
  // does; also into is_drawn_.
  std::vector<int32_t> TilesToDraw(const RefitTarget& target, const ViewGeometry& geometry) {
    const Mask& mask = *target.mask;
    const size_t tiles_x = TilesOf(mask.width);
    is_drawn_.assign(tiles_x * TilesOf(mask.height), target.photo ? 1 : 0);
    for (const int32_t tile : renderer_.backend().blend().TouchedTiles(geometry, differs_.data())) {
      is_drawn_[size_t(tile)] = 1;
    }
    for (size_t p = 0; p < mask.data.size(); ++p) {
      if (mask.data[p] == 0) continue;
      const size_t x = p % size_t(mask.width), y = p / size_t(mask.width);
      is_drawn_[y / kTileSize * tiles_x + x / kTileSize] = 1;
    }
    std::vector<int32_t> tiles;
    for (size_t t = 0; t < is_drawn_.size(); ++t) {
      if (is_drawn_[t]) tiles.push_back(int32_t(t));
    }
    return tiles;
  }

  Renderer& renderer_;
  Buffer<uint8_t> differs_;  // [N] whether a Gaussian's coefficients do
  Buffer<float> after_, colors_, images_;
  std::vector<uint8_t> is_drawn_;
  std::vector<float> host_;
};

// Of one target.
struct OwnErrors {
  size_t target = 0;
  ErrorSums sums;
};

// Those of all targets, in their order.
std::vector<OwnErrors> OfAll(ViewReducer& reducer, const std::vector<OwnErrors>& own) {
  std::vector<OwnErrors> all = reducer.Gather<OwnErrors>(own);
  std::sort(all.begin(), all.end(),
            [](const OwnErrors& a, const OwnErrors& b) { return a.target < b.target; });
  return all;
}

double Coverage(const Mask& mask) {
  double sum = 0;
  for (const uint8_t value : mask.data) sum += value;
  return mask.data.empty() ? 0 : sum / (255.0 * double(mask.data.size()));
}

// Compares targets one after the other, by renders of two sets of coefficients.
class TargetMeter {
 public:
  TargetMeter(Renderer& renderer, std::span<const float> sh_before, std::span<const float> sh_after,
              const ColorEdit& edit)
      : renderer_(renderer), reported_(edit), pair_(renderer, sh_before, sh_after) {}

  // In rows of pixels that are wanted of each tile.
  ErrorSums Measure(const RefitTarget& target, uint16_t pixel_rows = kAllPixelRows) {
    Mask leaves(target.mask->width, target.mask->height);
    const Image made = MadeFor(target, renderer_, &leaves);
    const std::shared_ptr<const Image> photo = PhotoOf(target, renderer_);
    return Compare({target, photo.get(), made, leaves, reported_, pair_.Render(target, pixel_rows)},
                   pixel_rows);
  }

 private:
  Renderer& renderer_;
  ReportedEdit reported_;
  PairRenderer pair_;
};

// Every `step`-th row of a tile, other ones in every view.
uint16_t PixelRows(int step, size_t view) {
  uint16_t rows = 0;
  for (size_t y = view % size_t(step); y < kTileSize; y += size_t(step)) rows |= uint16_t(1 << y);
  return rows;
}

void CheckCoefficients(Renderer& renderer, std::span<const float> sh_before,
                       std::span<const float> sh_after) {
  const size_t values =
      size_t(renderer.model().count()) * size_t(renderer.model().num_sh_coeffs()) * 3;
  CheckOption(sh_before.size() == values && sh_after.size() == values,
              "evaluation: the coefficients are not of the renderer's model");
}

ViewErrors ErrorsOf(const RefitTarget& target, const ErrorSums& sums) {
  return {target.name, sums.inside_values > 0 ? Coverage(*target.mask) : 0, sums};
}

QualityNumbers Pool(const std::vector<ViewErrors>& views, bool are_heldout, QualityReport* report) {
  ErrorSums all;
  // The last view first, as they are measured.
  for (size_t v = views.size(); v-- > 0;) {
    const ViewErrors& view = views[v];
    all += view.sums;
    if (view.sums.inside_values == 0) continue;
    const QualityNumbers numbers = ToNumbers(view.sums, 1);
    report->worst.push_back(
        {view.name, are_heldout, view.coverage, numbers.psnr_inside_after, numbers.psnr_outside});
  }
  return ToNumbers(all, int(views.size()));
}

}  // namespace

void ErrorSums::operator+=(const ErrorSums& other) {
  inside_before += other.inside_before;
  inside_after += other.inside_after;
  outside += other.outside;
  bleed += other.bleed;
  inside_values += other.inside_values;
  outside_values += other.outside_values;
  out_of_gamut += other.out_of_gamut;
}

std::vector<ViewErrors> MeasureErrors(Renderer& renderer, std::span<const float> sh_before,
                                      std::span<const float> sh_after,
                                      const std::vector<RefitTarget>& targets,
                                      const ColorEdit& edit, EvaluationProgress* progress,
                                      Monitor& monitor) {
  CheckCoefficients(renderer, sh_before, sh_after);
  TargetMeter meter(renderer, sh_before, sh_after, edit);
  std::vector<ViewErrors> errors;
  for (const RefitTarget& target : targets) {
    monitor.Step("evaluate", double(progress->done++), double(progress->total));
    CheckTarget(target);
    errors.push_back(ErrorsOf(target, meter.Measure(target)));
  }
  return errors;
}

QualityReport ReportOn(const std::vector<ViewErrors>& train,
                       const std::vector<ViewErrors>& heldout) {
  QualityReport report;
  report.train = Pool(train, false, &report);
  report.heldout = Pool(heldout, true, &report);
  std::stable_sort(report.worst.begin(), report.worst.end(),
                   [](auto& a, auto& b) { return a.psnr_inside < b.psnr_inside; });
  report.views = report.worst;
  if (report.worst.size() > kMaxWorst) report.worst.resize(kMaxWorst);
  return report;
}

QualityReport EvaluateEdit(Renderer& renderer, std::span<const float> sh_before,
                           std::span<const float> sh_after, const std::vector<RefitTarget>& train,
                           const std::vector<RefitTarget>& heldout, const ColorEdit& edit,
                           Monitor& monitor, int row_step) {
  CheckCoefficients(renderer, sh_before, sh_after);
  TargetMeter meter(renderer, sh_before, sh_after, edit);
  const size_t total = train.size() + heldout.size();
  size_t done = 0;
  const auto measure = [&](const std::vector<RefitTarget>& targets) {
    ViewReducer reducer = ShareTargets(renderer.backend(), targets);
    std::vector<OwnErrors> own;
    // Backwards: the geometries that a fit leaves in the cache are those of the last views.
    for (size_t t = targets.size(); t-- > 0;) {
      monitor.Step("evaluate", double(done++), double(total));
      CheckTarget(targets[t]);
      if (!reducer.Owns(t)) continue;
      own.push_back({t, meter.Measure(targets[t], PixelRows(row_step, t))});
    }
    std::vector<ViewErrors> errors;
    for (const auto& [t, sums] : OfAll(reducer, own)) errors.push_back(ErrorsOf(targets[t], sums));
    return errors;
  };
  const std::vector<ViewErrors> of_train = measure(train), of_heldout = measure(heldout);
  monitor.Step("evaluate", 1, 1);
  QualityReport report = ReportOn(of_train, of_heldout);
  report.row_step = row_step;
  report.sh_before = RangeOf(sh_before);
  report.sh_after = RangeOf(sh_after);
  return report;
}

}  // namespace retint
