// SPDX-License-Identifier: BSD-3-Clause
// Curves and levels: how bright a channel comes out, by how bright it goes in, the same for red,
// green and blue. They are applied as a lookup table that keeps their points, so that they can be
// changed again.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

namespace retint {

struct ColorOperation;
struct ColorTable;

// Display-referred sRGB, 0 to 1.
struct TonePoint {
  double in = 0, out = 0;
  bool operator==(const TonePoint&) const = default;
};

struct Tone {
  enum class Kind { kCurve, kLevels };
  Kind kind = Kind::kCurve;
  // `in` ascending. A curve has 2 to kMostPoints points. Levels have black, the middle, whose `out`
  // follows from the others, and white.
  std::vector<TonePoint> points;

  static constexpr size_t kMostPoints = 16;
  // Between the `in` of neighbors. Black and white are twice as far apart.
  static constexpr double kLeastGap = 0.01;

  static Tone Neutral(Kind kind);
  // Of a kLut whose table Table() made; none: of any other operation.
  static std::optional<Tone> Of(const ColorOperation& operation);
  // The points are rounded to 1e-5. OptionError for points that are not as above.
  std::shared_ptr<const ColorTable> Table() const;
  // Beyond the first and last point the curve is flat. Between them a curve is the monotone cubic
  // of Fritsch and Carlson (SIAM J. Numer. Anal. 17, 1980), levels are a power.
  double At(double in) const;
  // Of levels: above 1 the middle becomes brighter, the exponent is its inverse.
  double gamma() const;
  void SetGamma(double gamma);
  // A point goes as near to a place as its neighbors let it.
  void Move(size_t point, TonePoint to);
  bool IsNeutral() const { return points == Neutral(kind).points; }
  bool operator==(const Tone&) const = default;

 private:
  void Check() const;
  double CurveAt(double in) const;
};

// How many of the pixels [P, 3] are how bright, by luma (Rec. 709) in 64 equal steps from 0 to 1;
// the most frequent counts 1. Empty without pixels.
std::vector<float> LumaHistogram(const std::vector<float>& pixels);

}  // namespace retint
