// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/finer_gaussians.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "base/error.h"
#include "base/parallel.h"
#include "recolor/refit_target.h"
#include "scene/mask_pixels.h"

namespace retint {
namespace {

constexpr double kSpacing = 1.8;        // of parts, in their deviations
constexpr double kReach = 2.7;          // deviations of a parent's middle that parts cover
constexpr double kWhole = 1.3;          // an axis at most so many times the wanted size stays whole
constexpr double kLeastOpacity = 0.05;  // of a Gaussian that is split
constexpr double kLeastPart = 0.006;    // of a part: renderers leave out weights below 1 / 255
constexpr double kMostOpacity = 0.99;   // as renderers have it
constexpr double kRendererBlur = 0.5477;  // pixels: renderers widen a Gaussian by 0.3 px^2
constexpr int kRounds = 40;
constexpr size_t kMostParts = 4096;  // of one Gaussian; where it would have more, they are larger
constexpr double kLeastCoarser = 1.02;  // a step of the parts' size if there are too many

// The parts along one axis of a Gaussian, whose own deviation is 1.
struct Axis {
  std::vector<double> places = {0}, weights = {1};
  double deviation = 1;  // of a part
  double spacing = 1;    // of parts; any of a single one
  double drawn = 1,
         parent_drawn = 1;  // deviations of a part and of the parent as renderers draw them
};

// `length`: the axis' deviation, in that of `size` and `blur`.
Axis SplitAxis(double length, double size, double blur) {
  Axis axis;
  const double ratio = length / size;
  if (!(ratio > kWhole)) return axis;
  axis.deviation = 1 / ratio;
  axis.spacing = kSpacing * axis.deviation;
  const double variance = 1 - axis.deviation * axis.deviation;
  const int reach = int(std::ceil(kReach * std::sqrt(variance) / axis.spacing));
  axis.places.clear();
  axis.weights.clear();
  for (int i = -reach; i <= reach; ++i) {
    const double place = i * axis.spacing;
    axis.places.push_back(place);
    // A part's peak over the peak of the parent's.
    axis.weights.push_back(axis.spacing / std::sqrt(2 * M_PI * variance) *
                           std::exp(-place * place / (2 * variance)) / axis.deviation);
  }
  axis.drawn = std::hypot(axis.deviation, blur / length);
  axis.parent_drawn = std::hypot(1.0, blur / length);
  return axis;
}

double OpticalDepth(double alpha) { return -std::log1p(-std::min(alpha, kMostOpacity)); }

double Bell(double distance, double deviation) {
  const double t = distance / deviation;
  return std::exp(-t * t / 2);
}

// The parts' opacities, row by row of the second axis.
class Opacities {
 public:
  Opacities(const Axis& x, const Axis& y, double opacity)
      : x_(x), y_(y), opacity_(opacity), values_(x.places.size() * y.places.size()) {
    for (size_t j = 0; j < y.places.size(); ++j) {
      for (size_t i = 0; i < x.places.size(); ++i) {
        values_[j * x.places.size() + i] =
            std::min(opacity * x.weights[i] * y.weights[j], kMostOpacity);
      }
    }
    for (int round = 0; round < kRounds; ++round) Update();
  }

  const std::vector<double>& values() const { return values_; }

 private:
  // Twice as many samples as parts along an axis that is split.
  static size_t NumSamples(const Axis& axis) {
    return axis.places.size() == 1 ? 1 : 2 * axis.places.size() + 1;
  }
  static double SampleAt(const Axis& axis, size_t k) {
    if (axis.places.size() == 1) return 0;
    return axis.places.front() + (double(k) - 1) * axis.spacing / 2;
  }
  // The parts that reach a sample.
  static std::pair<size_t, size_t> Near(const Axis& axis, double at) {
    if (axis.places.size() == 1) return {0, 1};
    const double middle = (at - axis.places.front()) / axis.spacing;
    const double far = 3.5 * axis.drawn / axis.spacing;  // parts
    const double last = double(axis.places.size());
    return {size_t(std::clamp(std::ceil(middle - far), 0.0, last)),
            size_t(std::clamp(std::floor(middle + far) + 1, 0.0, last))};
  }

  // Each part by the mean of the optical depth that is missing at its place, weighted by the light
  // that comes through: opaque places do not matter.
  void Update() {
    std::vector<double> wanted_sums(values_.size(), 0.0), sums = wanted_sums;
    const size_t width = x_.places.size();
    for (size_t sy = 0; sy < NumSamples(y_); ++sy) {
      const double v = SampleAt(y_, sy);
      const auto [top, bottom] = Near(y_, v);
      for (size_t sx = 0; sx < NumSamples(x_); ++sx) {
        const double u = SampleAt(x_, sx);
        const auto [left, right] = Near(x_, u);
        const double wanted =
            OpticalDepth(opacity_ * Bell(u, x_.parent_drawn) * Bell(v, y_.parent_drawn));
        double found = 0;
        std::vector<double>& bells = scratch_;
        bells.clear();
        for (size_t j = top; j < bottom; ++j) {
          const double down = Bell(v - y_.places[j], y_.drawn);
          for (size_t i = left; i < right; ++i) {
            bells.push_back(down * Bell(u - x_.places[i], x_.drawn));
            found += OpticalDepth(values_[j * width + i] * bells.back());
          }
        }
        const double through = std::exp(-std::min(wanted, found));
        size_t next = 0;
        for (size_t j = top; j < bottom; ++j) {
          for (size_t i = left; i < right; ++i) {
            const double weight = bells[next++] * through;
            wanted_sums[j * width + i] += weight * wanted;
            sums[j * width + i] += weight * found;
          }
        }
      }
    }
    for (size_t k = 0; k < values_.size(); ++k) {
      if (sums[k] <= 0) continue;
      values_[k] = std::clamp(values_[k] * wanted_sums[k] / sums[k], 1e-6, kMostOpacity);
    }
  }

  const Axis &x_, &y_;
  double opacity_;
  std::vector<double> values_, scratch_;
};

struct Part {
  Eigen::Vector3f mean, log_scales;
  float opacity_logit;
};

// A Gaussian's axes from the longest on, and the parts along the first two.
struct Plan {
  std::array<Eigen::Index, 3> order = {0, 1, 2};
  double deviations[2] = {0, 0}, opacity = 0;
  Axis axes[2];
  size_t count = 1;  // 1: it stays
};

Plan PlanOf(const GaussianModel& model, size_t g, const PartSize& wanted) {
  Plan plan;
  // The opacity of an antialiased Gaussian compensates for its blur.
  const bool is_mip = model.traits.render_model == RenderModel::kMip;
  const double blur = is_mip ? 0 : double(wanted.blur);
  double size = double(wanted.deviation);
  plan.opacity = 1 / (1 + std::exp(-double(model.opacity_logits[g])));
  if (!(size > 0) || plan.opacity < kLeastOpacity) return plan;
  const Eigen::Vector3f log_scales(&model.log_scales[3 * g]);
  std::ranges::sort(plan.order, [&](auto a, auto b) { return log_scales[a] > log_scales[b]; });
  for (size_t i = 0; i < 2; ++i) {
    plan.deviations[i] = std::exp(double(log_scales[plan.order[i]]));
    if (!std::isfinite(plan.deviations[i])) return plan;
    size = std::max(size, plan.deviations[i] / double(kMostParts));
  }
  for (;; size *= std::max(kLeastCoarser, std::sqrt(double(plan.count) / double(kMostParts)))) {
    for (size_t i = 0; i < 2; ++i) {
      plan.axes[i] = SplitAxis(plan.deviations[i], size, blur);
    }
    plan.count = plan.axes[0].places.size() * plan.axes[1].places.size();
    if (plan.count <= kMostParts) return plan;
  }
}

// None: it stays.
std::vector<Part> PartsOf(const GaussianModel& model, size_t g, const PartSize& wanted) {
  const Plan plan = PlanOf(model, g, wanted);
  if (plan.count < 2) return {};
  const auto& [x, y] = plan.axes;
  const Eigen::Vector3f log_scales(&model.log_scales[3 * g]), mean(&model.means[3 * g]);
  const Opacities opacities(x, y, plan.opacity);
  const float* q = &model.quats_wxyz[4 * g];
  const Eigen::Matrix3d axes =
      Eigen::Quaterniond(double(q[0]), double(q[1]), double(q[2]), double(q[3]))
          .normalized()
          .toRotationMatrix();
  std::vector<Part> parts;
  for (size_t k = 0; k < plan.count; ++k) {
    const double value = opacities.values()[k];
    if (value < kLeastPart) continue;
    const size_t width = x.places.size();
    const Eigen::Vector3d offset =
        axes.col(plan.order[0]) * (x.places[k % width] * plan.deviations[0]) +
        axes.col(plan.order[1]) * (y.places[k / width] * plan.deviations[1]);
    Part part{mean + offset.cast<float>(), log_scales, float(std::log(value / (1 - value)))};
    part.log_scales[plan.order[0]] += float(std::log(x.deviation));
    part.log_scales[plan.order[1]] += float(std::log(y.deviation));
    parts.push_back(part);
  }
  return parts.size() < 2 ? std::vector<Part>() : parts;
}

// Row `from` of one model as row `to` of another.
void CopyGaussian(const GaussianModel& from, size_t g, GaussianModel& to, size_t row) {
  const size_t block = size_t(from.NumShCoeffs()) * 3;
  std::copy_n(&from.means[3 * g], 3, &to.means[3 * row]);
  std::copy_n(&from.quats_wxyz[4 * g], 4, &to.quats_wxyz[4 * row]);
  std::copy_n(&from.log_scales[3 * g], 3, &to.log_scales[3 * row]);
  to.opacity_logits[row] = from.opacity_logits[g];
  std::copy_n(&from.sh[block * g], block, &to.sh[block * row]);
}

// The layout of a file that has other rows.
SourceLayout LayoutFor(const SourceLayout& source, const std::vector<int32_t>& parents) {
  SourceLayout layout;
  layout.comments = source.comments;
  layout.property_order = source.property_order;
  layout.trailing_header = source.trailing_header;
  layout.trailing_bytes = source.trailing_bytes;
  layout.notes = source.notes;
  for (const ExtraColumn& extra : source.extras) {
    ExtraColumn rows{extra.name, extra.type, extra.bytes_per_value, {}};
    const auto bytes = size_t(extra.bytes_per_value);
    for (const int32_t g : parents) {
      const auto row = extra.bytes.begin() + ptrdiff_t(size_t(g) * bytes);
      rows.bytes.insert(rows.bytes.end(), row, row + ptrdiff_t(bytes));
    }
    layout.extras.push_back(std::move(rows));
  }
  return layout;
}

// For each Gaussian inside: the size of a pixel times options.pixels, in the closest of the views
// that show its middle inside their masks, and the mean of the blur in these views.
std::vector<PartSize> SizesOf(const GaussianModel& model, const std::vector<RefitTarget>& targets,
                              const std::vector<float>& shares, const RefineOptions& options) {
  std::vector<PartSize> sizes(model.NumGaussians());
  ParallelRanges(int64_t(sizes.size()), 1024, [&](int64_t begin, int64_t end) {
    for (auto g = size_t(begin); g < size_t(end); ++g) {
      if (!(double(shares[g]) > options.share)) continue;
      const Eigen::Vector3d mean = Eigen::Vector3f(&model.means[3 * g]).cast<double>();
      double least = 0, sum = 0;  // of a pixel's size there
      int count = 0;
      for (const RefitTarget& target : targets) {
        const auto at = target.camera.Project(mean);
        if (!at) continue;
        const int x = int(std::floor((*at)[0])), y = int(std::floor((*at)[1]));
        if (!target.mask->Contains(x, y) || !IsInside((*target.mask)(x, y))) continue;
        const Camera& camera = target.camera.camera;
        const double pixel = (*at)[2] / std::max(camera.fx(), camera.fy());
        least = count == 0 ? pixel : std::min(least, pixel);
        sum += pixel;
        ++count;
      }
      if (count == 0) continue;
      sizes[g] = {float(options.pixels * least), float(kRendererBlur * sum / count)};
    }
  });
  return sizes;
}

// About how many parts a Gaussian has, before their opacities are found. Of one that stays 0.
size_t CountParts(const Plan& plan) {
  if (plan.count < 2) return 0;
  size_t count = 0;
  for (const double y : plan.axes[1].weights) {
    for (const double x : plan.axes[0].weights) {
      if (plan.opacity * x * y >= kLeastPart) ++count;
    }
  }
  return count;
}

// Makes parts larger if there would be more than `most`; returns the factor.
double Coarsen(const GaussianModel& model, std::vector<PartSize>& sizes, int most) {
  double factor = 1;
  for (;;) {
    const double count = OrderedSum(int64_t(sizes.size()), 1024, [&](int64_t begin, int64_t end) {
      double sum = 0;
      for (auto g = size_t(begin); g < size_t(end); ++g) {
        sum += double(CountParts(PlanOf(model, g, {float(factor) * sizes[g].deviation, 0})));
      }
      return sum;
    });
    if (count <= most) break;
    // Their number falls with the square of their size at most.
    factor *= std::max(kLeastCoarser, std::sqrt(count / most));
  }
  for (PartSize& size : sizes) size.deviation *= float(factor);
  return factor;
}

// The mean squared difference of both renderers' views inside the masks, as dB; 99 at most.
double PsnrInside(Renderer& one, Renderer& other, const std::vector<RefitTarget>& targets,
                  Monitor& monitor) {
  double sum = 0, count = 0;
  for (const RefitTarget& target : targets) {
    monitor.ThrowIfCancelled();
    const Image a = one.Render(target.camera).rgb, b = other.Render(target.camera).rgb;
    for (size_t i = 0; i < a.data.size(); ++i) {
      if (!IsInside(target.mask->data[i / 3])) continue;
      const double difference =
          std::clamp(double(a.data[i]), 0.0, 1.0) - std::clamp(double(b.data[i]), 0.0, 1.0);
      sum += difference * difference;
      count += 1;
    }
  }
  return sum > 0 ? std::min(-10 * std::log10(sum / count), 99.0) : 99;
}

}  // namespace

FinerGaussians CopyParents(const GaussianModel& model, std::vector<int32_t> parents,
                           size_t stayed) {
  FinerGaussians finer;
  finer.parents = std::move(parents);
  finer.stayed = stayed;
  finer.model.ResizeUnset(finer.parents.size(), model.sh_degree);
  for (size_t row = 0; row < finer.parents.size(); ++row) {
    CopyGaussian(model, size_t(finer.parents[row]), finer.model, row);
  }
  finer.model.traits = model.traits;
  finer.model.source = LayoutFor(model.source, finer.parents);
  return finer;
}

FinerGaussians SplitGaussians(const GaussianModel& model, std::span<const PartSize> sizes) {
  const size_t before = model.NumGaussians();
  CheckOption(sizes.size() == before, "refine: one size a Gaussian is needed");
  std::vector<std::vector<Part>> parts(before);
  ParallelRanges(int64_t(before), 16, [&](int64_t begin, int64_t end) {
    for (auto g = size_t(begin); g < size_t(end); ++g) {
      parts[g] = PartsOf(model, g, sizes[g]);
    }
  });
  std::vector<int32_t> parents;
  for (size_t g = 0; g < before; ++g) {
    if (parts[g].empty()) parents.push_back(int32_t(g));
  }
  const size_t stayed = parents.size();
  for (size_t g = 0; g < before; ++g) parents.insert(parents.end(), parts[g].size(), int32_t(g));
  FinerGaussians finer = CopyParents(model, std::move(parents), stayed);
  size_t row = stayed;
  for (const std::vector<Part>& of_one : parts) {
    for (const Part& part : of_one) {
      std::copy_n(part.mean.data(), 3, &finer.model.means[3 * row]);
      std::copy_n(part.log_scales.data(), 3, &finer.model.log_scales[3 * row]);
      finer.model.opacity_logits[row++] = part.opacity_logit;
    }
  }
  return finer;
}

void RefineOptions::Describe(OptionList& list) {
  list.push_back({.name = "pixels",
                  .member = &pixels,
                  .range = OptionRange::Closed(0.3, 100),
                  .help = "how large the parts are: their standard deviation, in pixels of the "
                          "closest view",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "most",
                  .member = &most,
                  .range = OptionRange::Closed(2, 20000000),
                  .help = "the largest number of parts; if more are needed, parts are larger",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "share",
                  .member = &share,
                  .range = OptionRange::UpTo(0, 1),
                  .help = "share inside the masks above which a Gaussian is split",
                  .tier = OptionTier::kExpert});
}

void RefineOptions::Check() const { CheckRanges(*this); }

std::string RefineSummary::BriefReport() const {
  std::string text = fmt::format("{} of {} Gaussians split into {} of {:.1f} pixels", split, before,
                                 parts, pixels);
  if (split == 0) return text;
  return text + fmt::format(
                    "; views inside are {:.1f} dB from the splat as it was, {:.1f} dB "
                    "before the parts' colors were fitted",
                    psnr, psnr_split);
}

std::string RefineSummary::Warning(const RefineOptions& asked) const {
  if (split == 0 && pixels <= asked.pixels) {
    return fmt::format(
        "no Gaussian inside the masks is larger than {:.1f} pixels: the splat is as it was",
        asked.pixels);
  }
  if (!(pixels > asked.pixels)) return {};
  return fmt::format(
      "parts of {:.1f} pixels would be more than {}, so {}: mask less, or allow more parts",
      asked.pixels, asked.most,
      split == 0 ? "the splat is as it was" : fmt::format("they have {:.1f}", pixels));
}

Refinement RefineGaussians(Renderer& renderer, const GaussianModel& model,
                           std::vector<RefitTarget> targets, std::vector<float> shares,
                           const RefineOptions& options, Monitor& monitor) {
  options.Check();
  CheckOption(!targets.empty(), "refine: there is no view with a mask");
  for (const RefitTarget& target : targets) CheckTarget(target);
  if (shares.empty()) shares = MaskShares(renderer, targets, monitor);
  CheckOption(shares.size() == model.NumGaussians(),
              "refine: one share a Gaussian is needed, got " + std::to_string(shares.size()));
  monitor.Step("refine", 0, 1);
  Refinement refinement;
  RefineSummary& summary = refinement.summary;
  std::vector<PartSize> sizes = SizesOf(model, targets, shares, options);
  summary.before = model.NumGaussians();
  summary.pixels = options.pixels * Coarsen(model, sizes, options.most);
  refinement.finer = SplitGaussians(model, sizes);
  FinerGaussians& finer = refinement.finer;
  monitor.Step("refine", 1, 1);
  summary.split = summary.before - finer.stayed;
  summary.parts = finer.parents.size() - finer.stayed;
  if (summary.split == 0) return refinement;

  // Each view is rendered a few times only: its geometry is not worth the memory.
  Renderer split(renderer.shared_backend(), finer.model,
                 {.cache_bytes = 0, .background = renderer.background()});
  summary.psnr_split = PsnrInside(renderer, split, targets, monitor);
  std::vector<float> parts(finer.parents.size(), 0.0f);
  std::fill(parts.begin() + ptrdiff_t(finer.stayed), parts.end(), 1.0f);
  // Everywhere: beside the masks, too, a part must change nothing.
  std::map<std::pair<int, int>, Mask> whole;
  std::vector<RefitTarget> as_it_was = targets;
  for (RefitTarget& target : as_it_was) {
    const Mask& mask = *target.mask;
    const auto [at, is_new] = whole.try_emplace({mask.width, mask.height});
    if (is_new) at->second = Mask(mask.width, mask.height, 255);
    target.mask = &at->second;
    target.edited = nullptr;
    target.photo = [&renderer, camera = target.camera] {
      return std::make_shared<const Image>(renderer.Render(camera).rgb);
    };
  }
  ShRefitter refitter(split, finer.model, std::move(as_it_was), ColorEdit::Tint({1, 1, 1}),
                      std::move(parts), RefitOptions(), monitor);
  refitter.Run(monitor);
  finer.model.sh = refitter.Sh();
  split.SetSh(finer.model.sh);
  summary.psnr = PsnrInside(renderer, split, targets, monitor);
  return refinement;
}

}  // namespace retint
