// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/palette.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "base/error.h"
#include "base/median.h"
#include "kernels/common/color_ops.h"

namespace retint {
namespace {

constexpr size_t kMostSamples = 20000;
constexpr int kStarts = 4;
constexpr int kRounds = 40;
constexpr float kSameColor = 1e-3f;  // squared distance of colors that nobody tells apart
constexpr size_t kParts = 24;        // that the pixels are split into before these are merged

constexpr double kRare = 0.02;  // of the points: fewer, such as a highlight's, are no main color

using Point = std::array<float, 3>;  // PaletteCoordinates

float SquaredDistance(const Point& x, const Point& y) {
  const float d[3] = {x[0] - y[0], x[1] - y[1], x[2] - y[2]};
  return d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
}

struct Samples {
  std::vector<OkLab> colors;
  std::vector<Point> points;
};

Samples SamplesOf(std::span<const float> pixels) {
  const size_t count = pixels.size() / 3, step = count / kMostSamples + 1;
  Samples samples;
  for (size_t i = 0; i < count; i += step) {
    float rgb[3];
    for (size_t c = 0; c < 3; ++c) rgb[c] = std::clamp(pixels[3 * i + c], 0.0f, 1.0f);
    samples.colors.push_back(OkLabFromSrgb(rgb));
    samples.points.emplace_back();
    PaletteCoordinates(samples.colors.back(), kPaletteLightnessWeight,
                       samples.points.back().data());
  }
  return samples;
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

struct Part {
  Point center = {};
  double count = 0;  // of its points
  double error = 0;  // sum of their squared distances from the center
};

// The samples that count as one color so far.
struct Group : Part {
  std::vector<Part> parts;
};

// By how much the squared error rises where two become one.
double Rise(const Part& x, const Part& y) {
  return double(SquaredDistance(x.center, y.center)) * x.count * y.count / (x.count + y.count);
}

Group Union(const Group& x, const Group& y) {
  Group both = x;
  both.count += y.count;
  both.error += y.error + Rise(x, y);
  for (size_t c = 0; c < 3; ++c) {
    both.center[c] =
        float((x.count * double(x.center[c]) + y.count * double(y.center[c])) / both.count);
  }
  both.parts.insert(both.parts.end(), y.parts.begin(), y.parts.end());
  return both;
}

// The mean distance of its points from its center; those of a part count as equally far. Unlike a
// mean square, it lets a surface have a highlight.
double SpreadOf(const Group& group) {
  double sum = 0;
  for (const Part& part : group.parts) {
    const double off = double(SquaredDistance(part.center, group.center));
    sum += part.count * std::sqrt(off + part.error / part.count);
  }
  return sum / group.count;
}

bool AreShades(const Group& x, const Group& y) {
  return SquaredDistance(x.center, y.center) < kPaletteSeparation * kPaletteSeparation &&
         SpreadOf(Union(x, y)) < double(kPaletteSpread);
}

struct Pairs {
  double nearest = std::numeric_limits<double>::max();  // squared distance of two shades
  double cheapest = nearest;                            // rise of the squared error
  std::array<size_t, 2> near = {}, cheap = {};
};

Pairs PairsOf(const std::vector<Group>& groups) {
  Pairs pairs;
  for (size_t i = 1; i < groups.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      const double distance = double(SquaredDistance(groups[i].center, groups[j].center));
      const double rise = Rise(groups[i], groups[j]);
      if (distance < pairs.nearest && AreShades(groups[i], groups[j])) {
        pairs.nearest = distance, pairs.near = {j, i};
      }
      if (rise < pairs.cheapest) pairs.cheapest = rise, pairs.cheap = {j, i};
    }
  }
  return pairs;
}

// k-means splits the shades of one surface as soon as it has parts to spare. An edit that tells
// them apart would turn so suddenly that no fit follows it. So the two nearest of many parts become
// one for as long as they are shades: near each other, and together no wider than a surface is.
// Without that limit, blends would chain orange to white. Then, while there are more than `most` or
// a rare one, it is the two whose union raises the squared error least (Ward 1963).
std::vector<Point> MergedCenters(const std::vector<Point>& points, const Clusters& clusters,
                                 size_t most) {
  std::vector<Group> groups(clusters.centers.size());
  for (size_t k = 0; k < groups.size(); ++k) groups[k].center = clusters.centers[k];
  for (size_t i = 0; i < points.size(); ++i) {
    Group& group = groups[clusters.of[i]];
    group.count += 1;
    group.error += double(SquaredDistance(points[i], group.center));
  }
  std::erase_if(groups, [](const Group& group) { return group.count == 0; });
  for (Group& group : groups) group.parts = {group};
  const auto is_rare = [&](const Group& group) {
    return group.count < kRare * double(points.size());
  };
  while (groups.size() > 1) {
    const Pairs pairs = PairsOf(groups);
    const bool alike = pairs.near[1] != 0;
    const bool rare = std::any_of(groups.begin(), groups.end(), is_rare);
    if (!alike && !rare && groups.size() <= most) break;
    const auto [to, from] = alike ? pairs.near : pairs.cheap;
    groups[to] = Union(groups[to], groups[from]);
    groups.erase(groups.begin() + ptrdiff_t(from));
  }
  std::vector<Point> centers;
  for (const Group& group : groups) centers.push_back(group.center);
  return centers;
}

PaletteColor MedianOf(const Samples& samples, const Clusters& clusters, size_t k) {
  std::vector<float> values[3];
  for (size_t i = 0; i < clusters.of.size(); ++i) {
    if (clusters.of[i] != k) continue;
    const OkLab& lab = samples.colors[i];
    values[0].push_back(lab.lightness);
    values[1].push_back(lab.a);
    values[2].push_back(lab.b);
  }
  PaletteColor color;
  if (values[0].empty()) return color;
  float median[3];
  for (size_t c = 0; c < 3; ++c) median[c] = Median(values[c]);
  SrgbFromOkLab({median[0], median[1], median[2]}, color.rgb.data());
  for (float& value : color.rgb) value = std::clamp(value, 0.0f, 1.0f);
  color.share = float(double(values[0].size()) / double(clusters.of.size()));
  return color;
}

}  // namespace

std::vector<PaletteColor> FindPalette(std::span<const float> pixels, int count, uint64_t seed) {
  CheckOption(count >= 1 && count <= kMaxPaletteColors,
              "palette: the number of colors must be from 1 to " +
                  std::to_string(kMaxPaletteColors) + ", not " + std::to_string(count));
  const Samples samples = SamplesOf(pixels);
  const std::vector<Point>& points = samples.points;
  if (points.empty()) return {};
  std::mt19937_64 random(seed);
  Clusters best;
  for (int start = 0; start < kStarts; ++start) {
    Clusters found = Improve(points, FirstCenters(points, kParts, random));
    if (start == 0 || found.error < best.error) best = std::move(found);
  }
  best.centers = MergedCenters(points, best, size_t(count));
  Assign(points, best);
  std::vector<PaletteColor> palette;
  for (size_t k = 0; k < best.centers.size(); ++k) {
    palette.push_back(MedianOf(samples, best, k));
  }
  std::erase_if(palette, [](const PaletteColor& color) { return color.share == 0; });
  std::stable_sort(palette.begin(), palette.end(),
                   [](const auto& x, const auto& y) { return x.share > y.share; });
  return palette;
}

}  // namespace retint
