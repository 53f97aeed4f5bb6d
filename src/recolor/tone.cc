// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/tone.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <QString>
#include <QStringList>

namespace retint {
namespace {

constexpr int kNodes = 33;  // a side of the table
constexpr int kBins = 64;
constexpr double kLeastGamma = 0.1, kMostGamma = 10;
constexpr double kRounding = 1e-4;  // of a table that was written as a text
constexpr size_t kMostPoints = 32;

const char* NameOf(Tone::Kind kind) { return kind == Tone::Kind::kCurve ? "curve" : "levels"; }

// "curve 0 0 0.5 0.6 1 1"
QString TextOf(const Tone& tone) {
  QStringList parts = {NameOf(tone.kind)};
  for (const QPointF& point : tone.points) {
    parts << QString::number(point.x(), 'g', 5) << QString::number(point.y(), 'g', 5);
  }
  return parts.join(' ');
}

std::optional<Tone> Parse(const QString& text) {
  const QStringList parts = text.split(' ');
  for (const Tone::Kind kind : {Tone::Kind::kCurve, Tone::Kind::kLevels}) {
    if (parts.front() != NameOf(kind)) continue;
    Tone tone{kind, {}};
    bool fine = parts.size() % 2 == 1;
    for (qsizetype i = 1; i + 1 < parts.size(); i += 2) {
      bool number[2];
      const QPointF point(parts[i].toDouble(&number[0]), parts[i + 1].toDouble(&number[1]));
      const auto inside = [](double value) { return value >= 0 && value <= 1; };
      fine = fine && number[0] && number[1] && inside(point.x()) && inside(point.y()) &&
             (tone.points.empty() || point.x() > tone.points.back().x());
      tone.points.push_back(point);
    }
    const bool many = kind == Tone::Kind::kLevels
                          ? tone.points.size() == 3
                          : tone.points.size() >= 2 && tone.points.size() <= kMostPoints;
    if (fine && many) return tone;
  }
  return std::nullopt;
}

}  // namespace

Tone Tone::Neutral(Kind kind) {
  if (kind == Kind::kCurve) return {kind, {{0, 0}, {1, 1}}};
  return {kind, {{0, 0}, {0.5, 0.5}, {1, 1}}};
}

std::optional<Tone> Tone::Of(const ColorOperation& operation) {
  const auto& table = operation.table;
  if (operation.kind != ColorOperationKind::kLut || !table || table->size != kNodes) return {};
  const auto tone = Parse(QString::fromStdString(table->name));
  if (!tone) return {};
  // The name alone may be that of a file.
  for (int i = 0; i < kNodes; ++i) {
    const size_t gray = 3 * size_t(i) * (kNodes * kNodes + kNodes + 1);
    if (std::abs(tone->At(i / (kNodes - 1.0)) - double(table->values[gray])) > kRounding) return {};
  }
  return tone;
}

ColorOperation Tone::Operation() const {
  auto table = std::make_shared<ColorTable>();
  table->size = kNodes;
  table->name = TextOf(*this).toStdString();
  const Tone rounded = Parse(QString::fromStdString(table->name)).value_or(*this);
  std::vector<float> out;
  for (int i = 0; i < kNodes; ++i) out.push_back(float(rounded.At(i / (kNodes - 1.0))));
  table->values.reserve(size_t(3) * kNodes * kNodes * kNodes);
  for (const float blue : out) {
    for (const float green : out) {
      for (const float red : out) table->values.insert(table->values.end(), {red, green, blue});
    }
  }
  return ColorOperation::Lut(std::move(table));
}

double Tone::gamma() const {
  const double share = (points[1].x() - points[0].x()) / (points[2].x() - points[0].x());
  return std::clamp(std::log(share) / std::log(0.5), kLeastGamma, kMostGamma);
}

void Tone::SetGamma(double gamma) {
  const double share = std::pow(0.5, std::clamp(gamma, kLeastGamma, kMostGamma));
  points[1] = {points[0].x() + share * (points[2].x() - points[0].x()),
               (points[0].y() + points[2].y()) / 2};
}

void Tone::Move(size_t point, QPointF to) {
  const bool levels = kind == Kind::kLevels;
  const double old_gamma = levels ? gamma() : 1;
  // The middle of levels goes with black and white.
  const size_t step = levels && point != 1 ? 2 : 1;
  const double low = point >= step ? points[point - step].x() + step * kLeastGap : 0;
  const double high =
      point + step < points.size() ? points[point + step].x() - step * kLeastGap : 1;
  points[point] = {std::clamp(to.x(), std::min(low, high), std::max(low, high)),
                   std::clamp(to.y(), 0.0, 1.0)};
  if (levels) SetGamma(point == 1 ? gamma() : old_gamma);
}

double Tone::At(double in) const {
  if (in <= points.front().x()) return points.front().y();
  if (in >= points.back().x()) return points.back().y();
  if (kind == Kind::kCurve) return CurveAt(in);
  const double share = (in - points[0].x()) / (points[2].x() - points[0].x());
  return points[0].y() + (points[2].y() - points[0].y()) * std::pow(share, 1 / gamma());
}

double Tone::CurveAt(double in) const {
  const size_t count = points.size();
  const auto slope = [&](size_t i) {
    return (points[i + 1].y() - points[i].y()) / (points[i + 1].x() - points[i].x());
  };
  // The harmonic mean of the slopes to both sides; 0 at an extreme. At the ends the slope there.
  const auto tangent = [&](size_t i) {
    if (i == 0) return slope(0);
    if (i + 1 == count) return slope(count - 2);
    const double before = slope(i - 1), after = slope(i);
    return before * after <= 0 ? 0.0 : 2 * before * after / (before + after);
  };
  size_t i = 0;
  while (i + 2 < count && in > points[i + 1].x()) ++i;
  const double width = points[i + 1].x() - points[i].x(), t = (in - points[i].x()) / width;
  const double t2 = t * t, t3 = t2 * t;
  const double out = (2 * t3 - 3 * t2 + 1) * points[i].y() + (3 * t2 - 2 * t3) * points[i + 1].y() +
                     width * ((t3 - 2 * t2 + t) * tangent(i) + (t3 - t2) * tangent(i + 1));
  return std::clamp(out, 0.0, 1.0);
}

std::vector<float> LumaHistogram(const std::vector<float>& pixels) {
  if (pixels.size() < 3) return {};
  std::vector<float> bins(kBins, 0);
  for (size_t i = 0; i + 2 < pixels.size(); i += 3) {
    const float luma = 0.2126F * pixels[i] + 0.7152F * pixels[i + 1] + 0.0722F * pixels[i + 2];
    ++bins[size_t(std::clamp(int(luma * kBins), 0, kBins - 1))];
  }
  const float most = *std::max_element(bins.begin(), bins.end());
  for (float& bin : bins) bin /= most;
  return bins;
}

}  // namespace retint
