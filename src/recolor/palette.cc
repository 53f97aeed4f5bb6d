// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/palette.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "base/error.h"
#include "kernels/common/color_spaces.h"

namespace retint {
namespace {

constexpr size_t kMostSamples = 20000;
constexpr int kStarts = 4;
constexpr int kRounds = 40;
constexpr float kSameColor = 1e-3f;  // squared distance of what no one tells apart, 0.03 in OKLab

using Point = std::array<float, 3>;  // OKLab, lightness times its weight

float SquaredDistance(const Point& x, const Point& y) {
  const float d[3] = {x[0] - y[0], x[1] - y[1], x[2] - y[2]};
  return d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
}

std::vector<Point> PointsOf(std::span<const float> pixels) {
  const size_t count = pixels.size() / 3, step = count / kMostSamples + 1;
  std::vector<Point> points;
  for (size_t i = 0; i < count; i += step) {
    float rgb[3];
    for (size_t c = 0; c < 3; ++c) rgb[c] = std::clamp(pixels[3 * i + c], 0.0f, 1.0f);
    const OkLab lab = OkLabFromSrgb(rgb);
    points.push_back({lab.lightness * kPaletteLightnessWeight, lab.a, lab.b});
  }
  return points;
}

size_t Nearest(const std::vector<Point>& centers, const Point& point) {
  size_t best = 0;
  float least = std::numeric_limits<float>::max();
  for (size_t i = 0; i < centers.size(); ++i) {
    const float distance = SquaredDistance(centers[i], point);
    if (distance < least) least = distance, best = i;
  }
  return best;
}

// [0, 1) from 53 random bits: the same everywhere, which the standard's distributions are not.
double Uniform(std::mt19937_64& random) { return double(random() >> 11) * 0x1p-53; }

// k-means++: each center is a point drawn by its squared distance from those before it.
std::vector<Point> FirstCenters(const std::vector<Point>& points, size_t count,
                                std::mt19937_64& random) {
  std::vector<Point> centers = {points[size_t(Uniform(random) * double(points.size()))]};
  std::vector<double> distances(points.size(), std::numeric_limits<double>::max());
  while (centers.size() < count) {
    double sum = 0, most = 0;
    for (size_t i = 0; i < points.size(); ++i) {
      distances[i] = std::min(distances[i], double(SquaredDistance(points[i], centers.back())));
      sum += distances[i];
      most = std::max(most, distances[i]);
    }
    if (most <= double(kSameColor)) break;  // the pixels have no other color
    double rest = Uniform(random) * sum;
    size_t next = 0;
    while (next + 1 < points.size() && rest >= distances[next]) rest -= distances[next++];
    centers.push_back(points[next]);
  }
  return centers;
}

struct Clusters {
  std::vector<Point> centers;
  std::vector<size_t> of;  // by point
  double error = 0;        // sum of squared distances
};

void Assign(const std::vector<Point>& points, Clusters& clusters) {
  clusters.of.resize(points.size());
  clusters.error = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    clusters.of[i] = Nearest(clusters.centers, points[i]);
    clusters.error += double(SquaredDistance(points[i], clusters.centers[clusters.of[i]]));
  }
}

Clusters Improve(const std::vector<Point>& points, std::vector<Point> centers) {
  Clusters clusters{std::move(centers), {}, 0};
  Assign(points, clusters);
  for (int round = 0; round < kRounds; ++round) {
    std::vector<std::array<double, 4>> sums(clusters.centers.size(), {0, 0, 0, 0});
    for (size_t i = 0; i < points.size(); ++i) {
      auto& sum = sums[clusters.of[i]];
      for (size_t c = 0; c < 3; ++c) sum[c] += double(points[i][c]);
      sum[3] += 1;
    }
    for (size_t k = 0; k < sums.size(); ++k) {
      if (sums[k][3] == 0) continue;
      for (size_t c = 0; c < 3; ++c) clusters.centers[k][c] = float(sums[k][c] / sums[k][3]);
    }
    const double before = clusters.error;
    Assign(points, clusters);
    if (before - clusters.error <= 1e-4 * before) break;
  }
  return clusters;
}

PaletteColor MedianOf(const std::vector<Point>& points, const Clusters& clusters, size_t k) {
  std::vector<float> values[3];
  for (size_t i = 0; i < points.size(); ++i) {
    if (clusters.of[i] != k) continue;
    for (size_t c = 0; c < 3; ++c) values[c].push_back(points[i][c]);
  }
  PaletteColor color;
  if (values[0].empty()) return color;
  float median[3];
  for (size_t c = 0; c < 3; ++c) {
    const auto middle = values[c].begin() + ptrdiff_t(values[c].size() / 2);
    std::nth_element(values[c].begin(), middle, values[c].end());
    median[c] = *middle;
  }
  SrgbFromOkLab({median[0] / kPaletteLightnessWeight, median[1], median[2]}, color.rgb.data());
  for (float& value : color.rgb) value = std::clamp(value, 0.0f, 1.0f);
  color.share = float(double(values[0].size()) / double(points.size()));
  return color;
}

}  // namespace

std::vector<PaletteColor> FindPalette(std::span<const float> pixels, int count, uint64_t seed) {
  CheckOption(count >= 1 && count <= kMaxPaletteColors,
              "palette: the number of colors must be from 1 to " +
                  std::to_string(kMaxPaletteColors) + ", not " + std::to_string(count));
  const std::vector<Point> points = PointsOf(pixels);
  if (points.empty()) return {};
  std::mt19937_64 random(seed);
  Clusters best;
  for (int start = 0; start < kStarts; ++start) {
    Clusters found = Improve(points, FirstCenters(points, size_t(count), random));
    if (start == 0 || found.error < best.error) best = std::move(found);
  }
  std::vector<PaletteColor> palette;
  for (size_t k = 0; k < best.centers.size(); ++k) {
    palette.push_back(MedianOf(points, best, k));
  }
  std::erase_if(palette, [](const PaletteColor& color) { return color.share == 0; });
  std::stable_sort(palette.begin(), palette.end(),
                   [](const auto& x, const auto& y) { return x.share > y.share; });
  return palette;
}

}  // namespace retint
