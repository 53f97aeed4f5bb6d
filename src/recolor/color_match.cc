// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/color_match.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "base/color_difference.h"
#include "base/error.h"
#include "base/median.h"
#include "kernels/common/color_spaces.h"
#include "recolor/color_map_fit.h"

namespace retint {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector4d;

constexpr std::string_view kNames[] = {"none", "exposure", "balance", "matrix", "table"};
constexpr double kOffset = 0.055, kPower = 2.4;  // of sRGB
constexpr size_t kLeastPairs = 50;               // of a view
constexpr int kRounds = 12;
constexpr double kRidge = 1e-4;   // of a matrix, towards the balance: where colors are few
constexpr double kCounted = 0.9;  // of a view's cells, the better ones
constexpr size_t kMostTablePairs = 40000;
// A freer affine map must be better by this, DeltaE00 and a share of the least error.
constexpr double kBetter = 0.02, kBetterShare = 0.02;
constexpr double kTableBetter = 0.25;  // DeltaE00: a splat fitted to a table gets a part of it
constexpr double kDiffer = 0.06;       // stops: the spread of exposures that is more than noise

// y + kOffset = gain (x + kOffset) + offset.
struct Affine {
  Matrix3d gain = Matrix3d::Identity();
  Vector3d offset = Vector3d::Zero();
  Vector3d operator()(const Vector3d& x) const { return gain * x + offset; }
};

// Colors plus kOffset, in pairs.
struct Pairs {
  std::vector<Vector3d> from, to;
  void Add(const Pairs& other) {
    from.insert(from.end(), other.from.begin(), other.from.end());
    to.insert(to.end(), other.to.begin(), other.to.end());
  }
};

Vector3d ColorAt(const std::vector<float>& colors, size_t i) {
  return Vector3d(double(colors[3 * i]), double(colors[3 * i + 1]), double(colors[3 * i + 2])) +
         Vector3d::Constant(kOffset);
}

// The weighted sums from which every affine map is solved.
struct Sums {
  Eigen::Matrix4d squares = Eigen::Matrix4d::Zero();
  Eigen::Matrix<double, 3, 4> products = Eigen::Matrix<double, 3, 4>::Zero();
  void Add(const Vector3d& from, const Vector3d& to, double weight) {
    const Vector4d x = from.homogeneous();
    squares += weight * x * x.transpose();
    products += weight * to * x.transpose();
  }
  Affine Solve(MatchMap map) const {
    Affine solved;
    if (map == MatchMap::kExposure) {
      const double square = squares.diagonal().head<3>().sum();
      solved.gain *= products.diagonal().sum() / square;
      return solved;
    }
    for (int c = 0; c < 3; ++c) solved.gain(c, c) = products(c, c) / squares(c, c);
    if (map == MatchMap::kBalance) return solved;
    const double ridge = kRidge * squares(3, 3);
    Eigen::Matrix<double, 3, 4> prior = Eigen::Matrix<double, 3, 4>::Zero();
    prior.leftCols<3>() = solved.gain;
    const Eigen::Matrix4d normal = squares + ridge * Eigen::Matrix4d::Identity();
    const Eigen::Matrix<double, 4, 3> rows =
        normal.ldlt().solve((products + ridge * prior).transpose());
    solved.gain = rows.topRows<3>().transpose();
    solved.offset = rows.row(3).transpose();
    return solved;
  }
};

Affine FitAffine(const Pairs& pairs, MatchMap map) {
  std::vector<double> weights(pairs.from.size(), 1.0), residuals(pairs.from.size());
  Affine fitted;
  for (int round = 0; round < kRounds; ++round) {
    Sums sums;
    for (size_t i = 0; i < weights.size(); ++i) sums.Add(pairs.from[i], pairs.to[i], weights[i]);
    fitted = sums.Solve(map);
    for (size_t i = 0; i < weights.size(); ++i) {
      residuals[i] = (fitted(pairs.from[i]) - pairs.to[i]).norm();
    }
    weights = RobustWeights(residuals);
  }
  return fitted;
}

Vector3d StopsOf(const Vector3d& gains) {
  return kPower * (gains.array().max(1e-6).log() / std::log(2.0)).matrix();
}
Vector3d GainsOf(const Vector3d& stops) {
  return (stops.array() * (std::log(2.0) / kPower)).exp().matrix();
}

Vector3d MedianOf(const std::vector<Vector3d>& values) {
  Vector3d median;
  for (int c = 0; c < 3; ++c) {
    std::vector<double> one;
    for (const Vector3d& value : values) one.push_back(value[c]);
    // Of an even number the mean of the two in the middle: of two views neither is the right one.
    const double upper = Median(one);
    for (double& value : one) value = -value;
    median[c] = (upper - Median(one)) / 2;
  }
  return median;
}

Vector3d LightOf(const Vector3d& color) {  // display-encoded
  Vector3d light;
  for (int c = 0; c < 3; ++c) light[c] = double(LinearFromSrgb(float(color[c])));
  return light;
}
Vector3d DisplayOf(const Vector3d& light) {
  Vector3d color;
  for (int c = 0; c < 3; ++c) color[c] = double(SrgbFromLinear(float(light[c])));
  return color;
}

double Difference(const Vector3d& a, const Vector3d& b) {
  const auto lab = [](const Vector3d& color) {
    const Eigen::Vector3f shown = color.cast<float>().cwiseMax(0).cwiseMin(1);
    return CieLabFromSrgb(shown.data());
  };
  return ColorDifference(lab(a), lab(b));
}

class Matcher {
 public:
  Matcher(std::span<const MatchView> views, const MatchOptions& options);
  ColorMatch Match();

 private:
  struct OneView {
    const MatchView* view;
    Pairs pairs;
    Vector3d stops = Vector3d::Zero();  // beside the others'
  };
  bool IsFitted(const OneView& one) const { return !one.view->heldout || !has_train_; }
  void MeasureExposures();
  void Normalize();
  Pairs Train() const;
  ColorEdit EditOf(MatchMap map, const Pairs& train) const;
  std::vector<double> ErrorsOf(const ColorEdit& edit) const;  // of each view
  double ErrorOf(const std::vector<double>& errors) const;

  const MatchOptions& options_;
  std::vector<OneView> views_;
  bool has_train_ = false, has_heldout_ = false;
  ColorMatch match_;
};

Matcher::Matcher(std::span<const MatchView> views, const MatchOptions& options)
    : options_(options) {
  for (const MatchView& view : views) {
    const size_t count = view.from.size() / 3;
    if (count < kLeastPairs) continue;
    OneView one{&view, {}};
    for (size_t i = 0; i < count; ++i) {
      one.pairs.from.push_back(ColorAt(view.from, i));
      one.pairs.to.push_back(ColorAt(view.to, i));
    }
    views_.push_back(std::move(one));
    (view.heldout ? has_heldout_ : has_train_) = true;
    match_.views.push_back({view.name, view.heldout});
    match_.heldout += view.heldout ? 1 : 0;
  }
  if (views_.size() < 2) {
    throw InputError(
        "too few views can be compared: at least two must show the same surfaces in both");
  }
}

// Each view's gains beside the map that all have in common, and that map without them, in turn.
void Matcher::MeasureExposures() {
  Affine common;
  for (int round = 0; round < 3; ++round) {
    std::vector<Vector3d> train;
    for (OneView& one : views_) {
      Pairs pairs = one.pairs;
      for (Vector3d& color : pairs.from) color = common(color);
      one.stops = StopsOf(FitAffine(pairs, MatchMap::kBalance).gain.diagonal());
      if (IsFitted(one)) train.push_back(one.stops);
    }
    const Vector3d center = MedianOf(train);
    Pairs all;
    for (OneView& one : views_) {
      one.stops -= center;
      if (!IsFitted(one)) continue;
      Pairs pairs = one.pairs;
      const Vector3d gains = GainsOf(-one.stops);
      for (Vector3d& color : pairs.to) color = color.cwiseProduct(gains);
      all.Add(pairs);
    }
    common = FitAffine(all, MatchMap::kMatrix);
  }
  std::vector<double> off;
  for (size_t v = 0; v < views_.size(); ++v) {
    const OneView& one = views_[v];
    match_.views[v].stops = one.stops;
    if (IsFitted(one)) off.push_back(std::abs(one.stops.mean()));
  }
  match_.spread = 1.4826 * Median(off);
  match_.exposures_differ = match_.spread > kDiffer;
}

// Takes the views' own exposures off, and applies the reference's correction.
void Matcher::Normalize() {
  Vector3d center = Vector3d::Zero();
  if (options_.reference) {
    const auto found = std::find_if(views_.begin(), views_.end(), [&](const OneView& one) {
      return one.view->name == options_.reference->view;
    });
    if (found == views_.end()) {
      throw InputError(options_.reference->view +
                       ": shows too little of the splat to be the reference");
    }
    center = found->stops;
  }
  for (OneView& one : views_) {
    const Vector3d gains = GainsOf(center - one.stops);
    for (Vector3d& color : one.pairs.to) {
      if (match_.exposures_differ) color = color.cwiseProduct(gains);
      if (!options_.reference) continue;
      const Vector3d shown = color - Vector3d::Constant(kOffset);
      color =
          DisplayOf(options_.reference->correction * LightOf(shown)) + Vector3d::Constant(kOffset);
    }
  }
}

Pairs Matcher::Train() const {
  Pairs train;
  for (const OneView& one : views_) {
    if (IsFitted(one)) train.Add(one.pairs);
  }
  return train;
}

ColorEdit Matcher::EditOf(MatchMap map, const Pairs& train) const {
  if (map == MatchMap::kNone) return {};
  const Affine fitted = FitAffine(train, std::min(map, MatchMap::kMatrix));
  const Vector3d offset = Vector3d::Constant(kOffset);
  ColorEdit edit = ColorEdit::FromAffine(
      {fitted.gain.cast<float>(), (fitted.gain * offset + fitted.offset - offset).cast<float>()});
  if (map != MatchMap::kTable) return edit;
  std::vector<float> from, to;
  const size_t step = train.from.size() / kMostTablePairs + 1;
  for (size_t i = 0; i < train.from.size(); i += step) {
    const Vector3d matched = fitted(train.from[i]) - offset, wanted = train.to[i] - offset;
    for (int c = 0; c < 3; ++c) {
      from.push_back(float(matched[c]));
      to.push_back(float(wanted[c]));
    }
  }
  auto table = std::make_shared<ColorTable>(FitColorTable(from, to));
  table->name = "match";
  edit.operations.push_back(ColorOperation::Lut(std::move(table)));
  return edit;
}

std::vector<double> Matcher::ErrorsOf(const ColorEdit& edit) const {
  const CompiledEdit compiled(edit);
  const Vector3d offset = Vector3d::Constant(kOffset);
  std::vector<double> means;
  for (const OneView& one : views_) {
    std::vector<float> colors = one.view->from;
    compiled.ApplyToAll(colors);
    std::vector<double> errors;
    for (size_t i = 0; i < one.pairs.to.size(); ++i) {
      errors.push_back(Difference(ColorAt(colors, i) - offset, one.pairs.to[i] - offset));
    }
    std::sort(errors.begin(), errors.end());
    errors.resize(size_t(kCounted * double(errors.size())));  // of kLeastPairs and more
    means.push_back(std::accumulate(errors.begin(), errors.end(), 0.0) / double(errors.size()));
  }
  return means;
}

double Matcher::ErrorOf(const std::vector<double>& errors) const {
  double sum = 0;
  int count = 0;
  for (size_t v = 0; v < views_.size(); ++v) {
    if (has_heldout_ && !views_[v].view->heldout) continue;
    sum += errors[v];
    ++count;
  }
  return sum / count;
}

ColorMatch Matcher::Match() {
  MeasureExposures();
  Normalize();
  const Pairs train = Train();
  std::vector<ColorEdit> edits;
  std::vector<std::vector<double>> errors;  // of each view, by edit
  double least = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < std::size(kNames); ++i) {
    const MatchMap map = MatchMap(i);
    if (options_.map && map != MatchMap::kNone && map != *options_.map) continue;
    edits.push_back(EditOf(map, train));
    errors.push_back(ErrorsOf(edits.back()));
    match_.trials.push_back({map, ErrorOf(errors.back())});
    if (map != MatchMap::kTable) least = std::min(least, match_.trials.back().error);
  }
  const double enough = least + std::max(kBetter, kBetterShare * least);
  size_t chosen = edits.size() - 1;
  if (!options_.map && match_.trials.back().error > least - kTableBetter) {
    chosen = 0;
    while (match_.trials[chosen].error > enough) ++chosen;
  }
  match_.map = match_.trials[chosen].map;
  match_.edit = edits[chosen];
  match_.before = match_.trials.front().error;
  match_.after = match_.trials[chosen].error;
  for (size_t v = 0; v < views_.size(); ++v) {
    match_.views[v].before = errors.front()[v];
    match_.views[v].after = errors[chosen][v];
  }
  constexpr float kMidGray = 0.5F;
  const Eigen::Vector3f gray = Eigen::Vector3f::Constant(kMidGray);
  const Vector3d changed = CompiledEdit(match_.edit).Apply(gray).cast<double>();
  const Vector3d offset = Vector3d::Constant(kOffset);
  match_.gray_stops = StopsOf((changed + offset).cwiseQuotient(gray.cast<double>() + offset));
  return std::move(match_);
}

std::string StopsText(const Vector3d& stops) {
  return fmt::format("{:+.2f} stops, red {:+.1f} %, green {:+.1f} %, blue {:+.1f} % beside that",
                     stops.mean(), 100 * (std::exp2(stops[0] - stops.mean()) - 1),
                     100 * (std::exp2(stops[1] - stops.mean()) - 1),
                     100 * (std::exp2(stops[2] - stops.mean()) - 1));
}

}  // namespace

std::string_view NameOf(MatchMap map) { return kNames[size_t(map)]; }

std::optional<MatchMap> MatchMapNamed(std::string_view name) {
  for (size_t i = 0; i < std::size(kNames); ++i) {
    if (kNames[i] == name) return MatchMap(i);
  }
  return std::nullopt;
}

ColorMatch MatchColors(std::span<const MatchView> views, const MatchOptions& options) {
  Matcher matcher(views, options);
  return matcher.Match();
}

std::vector<std::string> SentencesOf(const ColorMatch& match, std::string_view target) {
  std::vector<std::string> sentences;
  const bool none = match.map == MatchMap::kNone;
  sentences.push_back(
      none ? fmt::format("the splat's colors agree with {}: no map is better than none", target)
           : fmt::format("from the splat to {}, a mid gray changes by {} ({})", target,
                         StopsText(match.gray_stops), NameOf(match.map)));
  if (match.exposures_differ) {
    sentences.push_back(fmt::format(
        "the views of {0} have a different exposure each, with a standard deviation of {1:.2f} "
        "stops; that is no drift of the splat, so each one's own difference was taken off first",
        target, match.spread));
  }
  return sentences;
}

Matrix3d CorrectionOfGray(const Vector3d& gray) {
  const Vector3d light = LightOf(gray);
  const double luminance = Vector3d(0.2126, 0.7152, 0.0722).dot(light);
  return (luminance * light.cwiseMax(1e-6).cwiseInverse()).asDiagonal();
}

std::span<const float> CheckerColors() {
  // X-Rite's own values in sRGB, 8 bits.
  constexpr int kBytes[] = {
      115, 82,  68,  194, 150, 130, 98,  122, 157, 87,  108, 67,  133, 128, 177, 103, 189, 170,
      214, 126, 44,  80,  91,  166, 193, 90,  99,  94,  60,  108, 157, 188, 64,  224, 163, 46,
      56,  61,  150, 70,  148, 73,  175, 54,  60,  231, 199, 31,  187, 86,  149, 8,   133, 161,
      243, 243, 242, 200, 200, 200, 160, 160, 160, 122, 122, 121, 85,  85,  85,  52,  52,  52};
  static const auto colors = [&] {
    std::array<float, std::size(kBytes)> values{};
    for (size_t i = 0; i < values.size(); ++i) values[i] = float(kBytes[i]) / 255;
    return values;
  }();
  return colors;
}

std::optional<CheckerFit> FitChecker(std::span<const float> patches) {
  constexpr double kClipped = 0.98, kDark = 0.05;
  constexpr int kLeast = 12;
  const auto color = [](std::span<const float> colors, size_t i) {
    return Vector3d(double(colors[3 * i]), double(colors[3 * i + 1]), double(colors[3 * i + 2]));
  };
  Matrix3d squares = Matrix3d::Zero(), products = Matrix3d::Zero();
  std::vector<size_t> used;
  for (size_t i = 0; i < CheckerColors().size() / 3; ++i) {
    const Vector3d shown = color(patches, i), truth = color(CheckerColors(), i);
    if (shown.maxCoeff() > kClipped) continue;
    used.push_back(i);
    const Vector3d from = LightOf(shown), to = LightOf(truth);
    const double weight = 1 / std::pow(to.mean() + kDark, 2);  // errors as the eye sees them
    squares += weight * from * from.transpose();
    products += weight * to * from.transpose();
  }
  if (used.size() < kLeast) return std::nullopt;
  CheckerFit fit;
  fit.correction = squares.ldlt().solve(products.transpose()).transpose();
  for (const size_t i : used) {
    const Vector3d shown = color(patches, i), truth = color(CheckerColors(), i);
    fit.before += Difference(shown, truth) / double(used.size());
    fit.after +=
        Difference(DisplayOf(fit.correction * LightOf(shown)), truth) / double(used.size());
  }
  return fit;
}

}  // namespace retint
