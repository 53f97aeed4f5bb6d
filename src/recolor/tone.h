// SPDX-License-Identifier: BSD-3-Clause
// Curves and levels: how bright a channel comes out, by how bright it goes in, the same for red,
// green and blue. An edit keeps them as a lookup table (kLut) whose name holds the points, so that
// they can be changed again; every reader of such tables can carry them out.
#pragma once

#include <optional>
#include <vector>

#include <QPointF>

#include "recolor/color_operation.h"

namespace retint {

struct Tone {
  enum class Kind { kCurve, kLevels };
  Kind kind = Kind::kCurve;
  // In and out, display-referred sRGB in [0, 1], the first ascending by kLeastGap or more. At least
  // two; of levels three: black, the middle, whose second follows from the others, and white.
  std::vector<QPointF> points;

  static constexpr double kLeastGap = 0.01;

  static Tone Neutral(Kind kind);
  // Of an operation that Operation() made; none: of any other.
  static std::optional<Tone> Of(const ColorOperation& operation);
  ColorOperation Operation() const;
  // Beyond the first and last point the curve is flat. Between them a curve is the monotone cubic
  // of Fritsch and Carlson (SIAM J. Numer. Anal. 17, 1980), levels are a power.
  double At(double in) const;
  // Of levels: above 1 the middle becomes brighter, the exponent is its inverse.
  double gamma() const;
  void SetGamma(double gamma);
  // A point goes as near to a place as its neighbors let it.
  void Move(size_t point, QPointF to);
  bool IsNeutral() const { return points == Neutral(kind).points; }

 private:
  double CurveAt(double in) const;
};

// How many of the pixels [P, 3] are how bright, by luma (Rec. 709) in equal steps from 0 to 1; the
// most frequent counts 1. Empty without pixels.
std::vector<float> LumaHistogram(const std::vector<float>& pixels);

}  // namespace retint
