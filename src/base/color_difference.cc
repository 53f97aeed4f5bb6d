// SPDX-License-Identifier: BSD-3-Clause
#include "base/color_difference.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace retint {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

double Linear(double x) { return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4); }

// CIE 15: the cube root, continued by a line near 0.
double LabCurve(double x) {
  constexpr double kEpsilon = 216.0 / 24389, kKappa = 24389.0 / 27;
  return x > kEpsilon ? std::cbrt(x) : (kKappa * x + 16) / 116;
}

double Pow7(double x) { return std::pow(x, 7); }

// Degrees in [0, 360); 0 for a gray.
double Hue(double a, double b) {
  if (a == 0 && b == 0) return 0;
  const double hue = std::atan2(b, a) / kDegree;
  return hue < 0 ? hue + 360 : hue;
}

}  // namespace

CieLab CieLabFromSrgb(const float* rgb) {
  const double r = Linear(rgb[0]), g = Linear(rgb[1]), b = Linear(rgb[2]);
  // The rows sum to D65's x, y, z; divided by them, gray has a = b = 0.
  const double x = (0.4124564 * r + 0.3575761 * g + 0.1804375 * b) / 0.9504700;
  const double y = 0.2126729 * r + 0.7151522 * g + 0.0721750 * b;
  const double z = (0.0193339 * r + 0.1191920 * g + 0.9503041 * b) / 1.0888300;
  const double fx = LabCurve(x), fy = LabCurve(y), fz = LabCurve(z);
  return {116 * fy - 16, 500 * (fx - fy), 200 * (fy - fz)};
}

double ColorDifference(const CieLab& x, const CieLab& y) {
  // Names as in the paper, equations (2) to (22).
  const double mean_chroma = (std::hypot(x.a, x.b) + std::hypot(y.a, y.b)) / 2;
  const double g = 0.5 * (1 - std::sqrt(Pow7(mean_chroma) / (Pow7(mean_chroma) + Pow7(25))));
  const double a1 = (1 + g) * x.a, a2 = (1 + g) * y.a;
  const double c1 = std::hypot(a1, x.b), c2 = std::hypot(a2, y.b);
  const double h1 = Hue(a1, x.b), h2 = Hue(a2, y.b);
  const bool gray = c1 * c2 == 0;

  double dh = gray ? 0 : h2 - h1;
  if (dh > 180) dh -= 360;
  if (dh < -180) dh += 360;
  const double delta_l = y.lightness - x.lightness, delta_c = c2 - c1;
  const double delta_h = 2 * std::sqrt(c1 * c2) * std::sin(dh / 2 * kDegree);

  const double l = (x.lightness + y.lightness) / 2, c = (c1 + c2) / 2;
  double h = h1 + h2;
  if (!gray) {
    if (std::abs(h1 - h2) > 180) h += h < 360 ? 360 : -360;
    h /= 2;
  }
  const double t = 1 - 0.17 * std::cos((h - 30) * kDegree) + 0.24 * std::cos(2 * h * kDegree) +
                   0.32 * std::cos((3 * h + 6) * kDegree) - 0.20 * std::cos((4 * h - 63) * kDegree);
  const double theta = 30 * std::exp(-std::pow((h - 275) / 25, 2));
  const double rc = 2 * std::sqrt(Pow7(c) / (Pow7(c) + Pow7(25)));
  const double off = (l - 50) * (l - 50);
  const double sl = 1 + 0.015 * off / std::sqrt(20 + off);
  const double sc = 1 + 0.045 * c, sh = 1 + 0.015 * c * t;
  const double rt = -std::sin(2 * theta * kDegree) * rc;
  const double dl = delta_l / sl, dc = delta_c / sc, dhh = delta_h / sh;
  return std::sqrt(std::max(0.0, dl * dl + dc * dc + dhh * dhh + rt * dc * dhh));
}

}  // namespace retint
