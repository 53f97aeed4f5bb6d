// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/tone.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "kernels/common/color_spaces.h"
#include "recolor/color_operation.h"

namespace retint {
namespace {

constexpr int kNodes = 33;  // a side of the table
constexpr int kBins = 64;
constexpr double kLeastGamma = 0.1, kMostGamma = 10;

double Rounded(double value) { return std::round(value * 1e5) / 1e5; }

}  // namespace

Tone Tone::Neutral(Kind kind) {
  if (kind == Kind::kCurve) return {kind, {{0, 0}, {1, 1}}};
  return {kind, {{0, 0}, {0.5, 0.5}, {1, 1}}};
}

std::optional<Tone> Tone::Of(const ColorOperation& operation) {
  return operation.table ? operation.table->tone : std::nullopt;
}

void Tone::Check() const {
  constexpr double kRounding = 1e-9;
  const bool levels = kind == Kind::kLevels;
  if (levels) {
    CheckOption(points.size() == 3, "levels need 3 points: black, middle and white");
    CheckOption(points[2].in - points[0].in >= 2 * kLeastGap - kRounding,
                "black and white of levels must be at least 0.02 apart");
  } else {
    CheckOption(points.size() >= 2 && points.size() <= kMostPoints, "a curve needs 2 to 16 points");
  }
  const auto inside = [](double value) { return value >= 0 && value <= 1; };
  for (size_t i = 0; i < points.size(); ++i) {
    CheckOption(inside(points[i].in) && inside(points[i].out), "a point is not from 0 to 1");
    if (i == 0) continue;
    const double gap = points[i].in - points[i - 1].in;
    CheckOption(levels ? gap > 0 : gap >= kLeastGap - kRounding,
                levels ? "levels must ascend from black to white"
                       : "points of a curve must ascend, at least 0.01 apart");
  }
}

std::shared_ptr<const ColorTable> Tone::Table() const {
  Tone tone = *this;
  for (TonePoint& point : tone.points) point = {Rounded(point.in), Rounded(point.out)};
  tone.Check();
  std::vector<float> out;
  for (int i = 0; i < kNodes; ++i) out.push_back(float(tone.At(i / (kNodes - 1.0))));
  auto table = std::make_shared<ColorTable>();
  table->size = kNodes;
  table->values.reserve(size_t(3) * kNodes * kNodes * kNodes);
  for (const float blue : out) {
    for (const float green : out) {
      for (const float red : out) table->values.insert(table->values.end(), {red, green, blue});
    }
  }
  table->tone = std::move(tone);
  return table;
}

double Tone::gamma() const {
  const double share = (points[1].in - points[0].in) / (points[2].in - points[0].in);
  return std::clamp(std::log(share) / std::log(0.5), kLeastGamma, kMostGamma);
}

void Tone::SetGamma(double gamma) {
  const double share = std::pow(0.5, std::clamp(gamma, kLeastGamma, kMostGamma));
  points[1] = {points[0].in + share * (points[2].in - points[0].in),
               (points[0].out + points[2].out) / 2};
}

void Tone::Move(size_t point, TonePoint to) {
  const bool levels = kind == Kind::kLevels;
  const double old_gamma = levels ? gamma() : 1;
  // The middle of levels goes with black and white.
  const size_t step = levels && point != 1 ? 2 : 1;
  const double gap = double(step) * kLeastGap;
  const double low = point >= step ? points[point - step].in + gap : 0;
  const double high = point + step < points.size() ? points[point + step].in - gap : 1;
  if (low <= high) points[point].in = std::clamp(to.in, low, high);
  points[point].out = std::clamp(to.out, 0.0, 1.0);
  if (levels) SetGamma(point == 1 ? gamma() : old_gamma);
}

double Tone::At(double in) const {
  if (in <= points.front().in) return points.front().out;
  if (in >= points.back().in) return points.back().out;
  if (kind == Kind::kCurve) return CurveAt(in);
  const double share = (in - points[0].in) / (points[2].in - points[0].in);
  return points[0].out + (points[2].out - points[0].out) * std::pow(share, 1 / gamma());
}

double Tone::CurveAt(double in) const {
  const size_t count = points.size();
  const auto slope = [&](size_t i) {
    return (points[i + 1].out - points[i].out) / (points[i + 1].in - points[i].in);
  };
  // The harmonic mean of the slopes to both sides; 0 at an extreme. At the ends the slope there.
  const auto tangent = [&](size_t i) {
    if (i == 0) return slope(0);
    if (i + 1 == count) return slope(count - 2);
    const double before = slope(i - 1), after = slope(i);
    return before * after <= 0 ? 0.0 : 2 * before * after / (before + after);
  };
  size_t i = 0;
  while (i + 2 < count && in > points[i + 1].in) ++i;
  const double width = points[i + 1].in - points[i].in, t = (in - points[i].in) / width;
  const double t2 = t * t, t3 = t2 * t;
  const double out = (2 * t3 - 3 * t2 + 1) * points[i].out + (3 * t2 - 2 * t3) * points[i + 1].out +
                     width * ((t3 - 2 * t2 + t) * tangent(i) + (t3 - t2) * tangent(i + 1));
  return std::clamp(out, 0.0, 1.0);
}

std::vector<float> LumaHistogram(const std::vector<float>& pixels) {
  if (pixels.size() < 3) return {};
  std::vector<float> bins(kBins, 0);
  for (size_t i = 0; i + 2 < pixels.size(); i += 3) {
    const float luma = Luminance(&pixels[i]);
    ++bins[size_t(std::clamp(int(luma * kBins), 0, kBins - 1))];
  }
  const float most = *std::max_element(bins.begin(), bins.end());
  for (float& bin : bins) bin /= most;
  return bins;
}

}  // namespace retint
