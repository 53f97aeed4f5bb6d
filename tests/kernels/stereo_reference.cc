// SPDX-License-Identifier: BSD-3-Clause
#include "tests/kernels/stereo_reference.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace retint {
namespace {

// The numbers that the stages are defined by, written out once more.
constexpr double kAgree = 1, kCostCap = 60, kBetter = 0.8, kMargin = 1, kEdgeJump = 3;
constexpr double kSameSurface = 0.5;
constexpr int kCostSide = 5, kEdgeSide = 33, kMaxGrowth = 40;
constexpr double kMaxStep = 0.5, kMaxMove = 1, kSmooth = 1.5, kGradientFloor = 2e-3, kRobust = 0.05;
constexpr int kWindowSide = 7, kBlurSide = 5, kIterations = 2;

struct Map {
  int width, height;
  std::vector<double> data;
  Map(int w, int h) : width(w), height(h), data(size_t(w) * size_t(h)) {}
  Map(int w, int h, const float* from) : width(w), height(h), data(from, from + w * h) {}
  double& At(int x, int y) { return data[size_t(y) * size_t(width) + size_t(x)]; }
  double At(int x, int y) const { return data[size_t(y) * size_t(width) + size_t(x)]; }
  // ... 0 0 0 1 2 ...
  double Clamped(int x, int y) const {
    return At(std::clamp(x, 0, width - 1), std::clamp(y, 0, height - 1));
  }
  // ... 2 1 0 1 2 ...
  double Reflected(int x, int y) const {
    const auto back = [](int i, int size) {
      while (i < 0 || i >= size) i = i < 0 ? -i : 2 * size - 2 - i;
      return i;
    };
    return At(back(x, width), back(y, height));
  }
};

// out(x, y) = value(x, y).
Map Made(int width, int height, const std::function<double(int, int)>& value) {
  Map out(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) out.At(x, y) = value(x, y);
  }
  return out;
}

Map WindowMean(const Map& of, int side, bool reflected) {
  return Made(of.width, of.height, [&](int x, int y) {
    double sum = 0;
    for (int j = -side / 2; j <= side / 2; ++j) {
      for (int i = -side / 2; i <= side / 2; ++i) {
        sum += reflected ? of.Reflected(x + i, y + j) : of.Clamped(x + i, y + j);
      }
    }
    return sum / (side * side);
  });
}

struct Range {
  double low, high;
};
Range WindowRange(const Map& of, int side, int x, int y) {
  Range range{of.At(x, y), of.At(x, y)};
  for (int j = -side / 2; j <= side / 2; ++j) {
    for (int i = -side / 2; i <= side / 2; ++i) {
      const double value = of.Clamped(x + i, y + j);
      range = {std::min(range.low, value), std::max(range.high, value)};
    }
  }
  return range;
}

Map ColorCost(const StereoView& own, const StereoView& view, const Map& disparity) {
  const auto level = [](const StereoView& of, int x, int y, int c) {
    x = std::clamp(x, 0, of.width - 1), y = std::clamp(y, 0, of.height - 1);
    const double value = double(of.rgb[(int64_t(y) * of.width + x) * 3 + c]);
    return 255 * std::clamp(value, 0.0, 1.0);
  };
  return Made(disparity.width, disparity.height, [&](int x, int y) {
    const double s = std::max(disparity.At(x, y), 0.0);
    const double at_x = x - view.x + view.dx * s, at_y = y - view.y + view.dy * s;
    const int x0 = int(std::floor(at_x)), y0 = int(std::floor(at_y));
    double sum = 0;
    for (int c = 0; c < 3; ++c) {
      double seen = 0;
      for (int corner = 0; corner < 4; ++corner) {
        const double wx = corner & 1 ? at_x - x0 : 1 - (at_x - x0);
        const double wy = corner & 2 ? at_y - y0 : 1 - (at_y - y0);
        seen += wx * wy * level(view, x0 + (corner & 1), y0 + (corner >> 1), c);
      }
      sum += std::fabs(level(own, x - own.x, y - own.y, c) - seen);
    }
    return std::min(sum, kCostCap);
  });
}

// The mean over the two shifted views that agree best.
Map PhotoCost(const StereoArbitrateParams& params, const Map& disparity) {
  std::vector<Map> costs;
  for (int k = 0; k < params.num_shifted; ++k) {
    costs.push_back(
        WindowMean(ColorCost(params.reference, params.shifted[k], disparity), kCostSide, true));
  }
  return Made(disparity.width, disparity.height, [&](int x, int y) {
    std::vector<double> found = {kCostCap, kCostCap};
    for (const Map& cost : costs) found.push_back(cost.At(x, y));
    std::sort(found.begin(), found.end());
    return (found[0] + found[1]) / 2;
  });
}

// Cubic convolution with a = -0.75 (Keys 1981) along the motion.
double Sample(const StereoView& view, int x, int y, double s) {
  const double at = view.dx ? x - view.x + view.dx * s : y - view.y + view.dy * s;
  const double a = -0.75;
  const int base = int(std::floor(at));
  double sum = 0;
  for (int n = base - 1; n <= base + 2; ++n) {
    const double t = std::fabs(at - n);
    const double weight =
        t <= 1 ? ((a + 2) * t - (a + 3)) * t * t + 1 : ((a * t - 5 * a) * t + 8 * a) * t - 4 * a;
    const int px = view.dx ? std::clamp(n, 0, view.width - 1) : x - view.x;
    const int py = view.dx ? y - view.y : std::clamp(n, 0, view.height - 1);
    sum += weight * double(view.gray[int64_t(py) * view.width + px]);
  }
  return sum;
}

// Adds weight * gradient * residual and weight * gradient^2 of one shifted view.
void AddEquations(const StereoView& own, const StereoView& view, const Map& disparity,
                  Map* numerator, Map* denominator) {
  const int width = disparity.width, height = disparity.height;
  const auto gray = [&](int x, int y) {
    return double(own.gray[int64_t(y - own.y) * own.width + (x - own.x)]);
  };
  const Map warped = Made(width, height, [&](int x, int y) {
    return Sample(view, x, y, std::max(disparity.At(x, y), 0.0));
  });
  const Map mean =
      Made(width, height, [&](int x, int y) { return (gray(x, y) + warped.At(x, y)) / 2; });
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (!(disparity.At(x, y) > 0)) continue;
      double gradient = 0;  // Sobel's, along the motion
      for (int i = -1; i <= 1; ++i) {
        const double across = view.dx ? mean.Clamped(x + 1, y + i) - mean.Clamped(x - 1, y + i)
                                      : mean.Clamped(x + i, y + 1) - mean.Clamped(x + i, y - 1);
        gradient += (i == 0 ? 2 : 1) * across * (view.dx + view.dy) / 8;
      }
      const double residual = gray(x, y) - warped.At(x, y);
      const double weight = std::pow(1 + std::pow(residual / kRobust, 2), -2);
      numerator->At(x, y) += weight * gradient * residual;
      denominator->At(x, y) += weight * gradient * gradient;
    }
  }
}

}  // namespace

double ReferenceFused(std::vector<double> values, double tolerance, bool nearest) {
  std::erase_if(values, [](double value) { return !(value > 0); });
  std::sort(values.begin(), values.end(), std::greater<>());
  if (values.empty()) return -1;
  if (nearest) return values[0];
  double best_sum = 0;
  size_t best_count = 0;
  for (size_t first = 0; first < values.size(); ++first) {
    double sum = 0;
    size_t last = first;
    for (; last < values.size() && values[first] - values[last] <= tolerance; ++last) {
      sum += values[last];
    }
    if (last - first > best_count) best_count = last - first, best_sum = sum;
  }
  return best_sum / double(best_count);
}

ReferenceArbitration ReferenceArbitrate(const StereoArbitrateParams& params) {
  const int width = params.width, height = params.height;
  const Map stereo(width, height, params.disparity), rough(width, height, params.rough);
  const Map of_stereo = PhotoCost(params, stereo), of_rough = PhotoCost(params, rough);
  constexpr double kStereo = 0, kRough = 1, kTie = 2, kBoth = 3, kContinued = 4;
  Map verdicts = Made(width, height, [&](int x, int y) {
    const double s = stereo.At(x, y), r = rough.At(x, y);
    if (!(r > 0)) return kStereo;
    if (!(s > 0)) return kTie;
    if (std::fabs(s - r) <= kAgree) return kBoth;
    if (of_rough.At(x, y) < kBetter * of_stereo.At(x, y) - kMargin) return kRough;
    if (of_stereo.At(x, y) < kBetter * of_rough.At(x, y) - kMargin) return kStereo;
    const Range range = WindowRange(stereo, kEdgeSide, x, y);
    return range.high - range.low > kEdgeJump ? kTie : kStereo;
  });
  for (int round = 0; round < kMaxGrowth; ++round) {
    const Map before = verdicts;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        if (before.At(x, y) != kTie) continue;
        for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
          const int nx = x + dx, ny = y + dy;
          if (nx < 0 || ny < 0 || nx >= width || ny >= height) continue;
          const double beside = before.At(nx, ny);
          if (beside != kRough && beside != kBoth && beside != kContinued) continue;
          if (std::fabs(rough.At(x, y) - rough.At(nx, ny)) > kSameSurface) continue;
          verdicts.At(x, y) = kContinued;
        }
      }
    }
  }
  ReferenceArbitration out;
  for (size_t i = 0; i < verdicts.data.size(); ++i) {
    const double s = stereo.data[i], r = rough.data[i], verdict = verdicts.data[i];
    out.measured.push_back(s > 0 && verdict != kContinued ? 255 : 0);
    out.disparity.push_back(verdict == kBoth                             ? (s + r) / 2
                            : verdict == kRough || verdict == kContinued ? r
                                                                         : s);
  }
  return out;
}

std::vector<double> ReferenceRefine(const StereoRefineParams& params) {
  const int width = params.width, height = params.height;
  const Map start(width, height, params.disparity);
  const Map smooth = Made(width, height, [&](int x, int y) {
    const Range range = WindowRange(start, kWindowSide, x, y);
    return range.high - range.low < kSmooth && range.low > 0 ? 1 : 0;
  });
  Map disparity = start;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const Map blurred = WindowMean(disparity, kBlurSide, false);
    for (size_t i = 0; i < disparity.data.size(); ++i) {
      if (smooth.data[i] != 0) disparity.data[i] = blurred.data[i];
    }
    Map numerator(width, height), denominator(width, height);
    for (int k = 0; k < params.num_shifted; ++k) {
      AddEquations(params.reference, params.shifted[k], disparity, &numerator, &denominator);
    }
    numerator = WindowMean(numerator, kWindowSide, true);
    denominator = WindowMean(denominator, kWindowSide, true);
    for (size_t i = 0; i < disparity.data.size(); ++i) {
      if (smooth.data[i] == 0) continue;
      const double step = numerator.data[i] / (denominator.data[i] + kGradientFloor);
      disparity.data[i] += std::clamp(step, -kMaxStep, kMaxStep);
      disparity.data[i] =
          std::clamp(disparity.data[i], start.data[i] - kMaxMove, start.data[i] + kMaxMove);
    }
  }
  return disparity.data;
}

}  // namespace retint
