// SPDX-License-Identifier: BSD-3-Clause
#include "selection/mask_tools/scribbles.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <queue>
#include <string_view>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "base/error.h"
#include "base/median.h"
#include "base/parallel.h"
#include "selection/gaussian_mixture.h"
#include "selection/mask_tools/guided_matte.h"
#include "selection/mask_tools/min_cut.h"
#include "selection/mask_tools/surface_edges.h"

namespace retint {
namespace {

using Features4 = PixelArray<float, 4>;
using Mixture = GaussianMixture<4>;

constexpr std::string_view kStage = "outline";
constexpr uint8_t kInside = 128;
constexpr double kMaxPixels = 100'000;
constexpr double kDepthScale = 0.5;  // OKLab units for a depth e times as large
constexpr double kSpread = 0.02;     // least standard deviation of a component
constexpr int kInsideParts = 5, kOutsideParts = 8;
constexpr int kRounds = 3;
constexpr double kLogLimit = 2;      // of the log odds by color and depth
constexpr double kReach = 3;         // log odds of a pixel far nearer to one side's strokes
constexpr double kDepthRange = 1.5;  // of the logarithm of the depth, about its median
constexpr double kSmoothness = 10;   // of a border between neighbors alike, in log odds
constexpr double kLeastWeight = 0.01;
constexpr double kValley = 3;        // logarithm of what a valley takes away of it
constexpr double kGiven = 1e4;       // log odds of a stroke's own pixels
constexpr double kStepCost = 0.01;   // of a pixel's width, in the distance along surfaces
constexpr double kValleyCost = 0.3;  // of a valley
constexpr int kMatteRadius = 2;      // of the small picture
constexpr double kDoubt = 2;         // log odds that may be wrong

enum Seed : uint8_t { kNone, kIn, kOut };

Eigen::Map<const Eigen::Vector4f> At(const Features4& features, size_t pixel) {
  return Eigen::Map<const Eigen::Vector4f>(&features.data[4 * pixel]);
}

// The pixels of a picture as a graph: each with its four neighbors and the four across.
class PixelGraph {
 public:
  PixelGraph(const Features4& features, const ScalarImage& valleys) {
    const int width = features.width, height = features.height;
    const size_t count = features.NumPixels();
    edges_.begin.reserve(count + 1);
    edges_.begin.push_back(0);
    double sum = 0;
    std::vector<float> squared;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        for (int k = 0; k < 9; ++k) {  // ascending
          const int i = x + k % 3 - 1, j = y + k / 3 - 1;
          if (k == 4 || !features.Contains(i, j)) continue;
          edges_.other.push_back(j * width + i);
          squared.push_back((At(features, size_t(y) * size_t(width) + size_t(x)) -
                             At(features, size_t(j) * size_t(width) + size_t(i)))
                                .squaredNorm());
          sum += double(squared.back());
        }
        edges_.begin.push_back(edges_.other.size());
      }
    }
    // The picture's own contrast says what an edge is (Boykov and Jolly 2001).
    const double beta = squared.empty() ? 0 : double(squared.size()) / (2 * std::max(1e-9, sum));
    steps_.resize(squared.size());
    edges_.weight.resize(squared.size());
    for (size_t p = 0; p < count; ++p) {
      for (size_t e = edges_.begin[p]; e < edges_.begin[p + 1]; ++e) {
        const int apart = std::abs(edges_.other[e] - int(p));
        const double length = apart == 1 || apart == width ? 1 : std::sqrt(2.0);
        const double valley =
            double(std::max(valleys.data[p], valleys.data[size_t(edges_.other[e])]));
        const double alike = std::exp(-beta * double(squared[e]) - kValley * valley);
        edges_.weight[e] = float(kSmoothness * std::max(kLeastWeight, alike) / length);
        steps_[e] =
            float(std::sqrt(double(squared[e])) + kStepCost * length + kValleyCost * valley);
      }
    }
  }

  const EdgeMatrix& edges() const { return edges_; }

  // Least sum of changes of the features, and of steps, on a way from any seed of that kind.
  std::vector<float> DistancesFrom(const std::vector<Seed>& seeds, Seed kind) const {
    std::vector<float> distances(seeds.size(), std::numeric_limits<float>::infinity());
    using Entry = std::pair<float, int>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
    for (size_t p = 0; p < seeds.size(); ++p) {
      if (seeds[p] != kind) continue;
      distances[p] = 0;
      open.emplace(0.0f, int(p));
    }
    while (!open.empty()) {
      const auto [distance, p] = open.top();
      open.pop();
      if (distance > distances[size_t(p)]) continue;
      for (size_t e = edges_.begin[size_t(p)]; e < edges_.begin[size_t(p) + 1]; ++e) {
        const float longer = distance + steps_[e];
        float& other = distances[size_t(edges_.other[e])];
        if (longer < other) {
          other = longer;
          open.emplace(longer, edges_.other[e]);
        }
      }
    }
    return distances;
  }

 private:
  EdgeMatrix edges_;
  std::vector<float> steps_;  // of each edge
};

// Log odds of "inside" by where a pixel lies: kReach times the difference of its distances from the
// strokes over their sum.
std::vector<float> ReachOdds(const PixelGraph& graph, const std::vector<Seed>& seeds) {
  const std::vector<float> in = graph.DistancesFrom(seeds, kIn);
  const std::vector<float> out = graph.DistancesFrom(seeds, kOut);
  std::vector<float> odds(seeds.size(), 0);
  for (size_t p = 0; p < seeds.size(); ++p) {
    const float sum = in[p] + out[p];
    if (sum > 0 && std::isfinite(sum)) odds[p] = float(kReach) * (out[p] - in[p]) / sum;
  }
  return odds;
}

Mixture::Points Samples(const Features4& features, const std::function<bool(size_t)>& take) {
  std::vector<size_t> taken;
  for (size_t p = 0; p < features.NumPixels(); ++p) {
    if (take(p)) taken.push_back(p);
  }
  Mixture::Points samples(Eigen::Index(taken.size()), 4);
  for (size_t i = 0; i < taken.size(); ++i)
    samples.row(Eigen::Index(i)) = At(features, taken[i]).transpose();
  return samples;
}

bool IsBorder(const Features4& features, size_t p) {
  const int x = int(p % size_t(features.width)), y = int(p / size_t(features.width));
  return x == 0 || y == 0 || x == features.width - 1 || y == features.height - 1;
}

// 1 of every pixel that is inside, else 0; and if it is asked for, 1 of every pixel that would
// change with all log odds but the strokes' changed by kDoubt.
struct Solution {
  std::vector<uint8_t> inside, doubtful;
};

Solution SolveSeeds(const Features4& features, const ScalarImage& valleys,
                    const std::vector<Seed>& seeds, bool with_doubt, double favor,
                    Monitor& monitor) {
  const size_t count = seeds.size();
  const PixelGraph graph(features, valleys);
  const std::vector<float> reach = ReachOdds(graph, seeds);
  Solution solution;
  std::vector<uint8_t>& inside = solution.inside;
  inside.resize(count);
  std::vector<float> odds(count);
  for (int round = 0; round < kRounds; ++round) {
    monitor.Step(kStage, round, kRounds);
    monitor.ThrowIfCancelled();
    const auto take = [&](Seed kind) {
      return [&, kind](size_t p) {
        if (seeds[p] != kNone) return seeds[p] == kind;
        // First, what a stroke outside does not touch may still look like the border.
        if (round == 0) return kind == kOut && IsBorder(features, p);
        return inside[p] == (kind == kIn ? 1 : 0);
      };
    };
    const Mixture in(Samples(features, take(kIn)), kInsideParts, kSpread);
    const Mixture out(Samples(features, take(kOut)), kOutsideParts, kSpread);
    ParallelRanges(int64_t(count), 1024, [&](int64_t begin, int64_t end) {
      Mixture::Points at(end - begin, 4);
      for (int64_t p = begin; p < end; ++p) at.row(p - begin) = At(features, size_t(p)).transpose();
      const Mixture::Values looks = in.LogLikelihoods(at) - out.LogLikelihoods(at);
      constexpr auto kLimit = float(kLogLimit);
      for (auto p = size_t(begin); p < size_t(end); ++p) {
        if (seeds[p] != kNone) {
          odds[p] = float(seeds[p] == kIn ? kGiven : -kGiven);
        } else {
          odds[p] = std::clamp(looks[int64_t(p) - begin], -kLimit, kLimit) + reach[p];
        }
      }
    });
    for (size_t p = 0; round + 1 == kRounds && p < count; ++p) {
      if (seeds[p] == kNone) odds[p] += float(favor);
    }
    inside = MinCut(graph.edges(), odds);
  }
  if (with_doubt) {
    std::vector<uint8_t> least, most;
    ParallelTasks(2, [&](int64_t which) {
      std::vector<float> moved = odds;
      for (size_t p = 0; p < count; ++p) {
        if (seeds[p] == kNone) moved[p] += float(which == 0 ? -kDoubt : kDoubt);
      }
      (which == 0 ? least : most) = MinCut(graph.edges(), moved);
    });
    solution.doubtful.resize(count);
    for (size_t p = 0; p < count; ++p) solution.doubtful[p] = least[p] != most[p] ? 1 : 0;
  }
  monitor.Step(kStage, kRounds, kRounds);
  return solution;
}

// Parts of 0.5 and more that hold no seed inside become outside.
void DropUnconnected(const std::vector<Seed>& seeds, ScalarImage* values) {
  std::vector<uint8_t> reached(seeds.size(), 0);
  std::vector<int> open;
  for (size_t p = 0; p < seeds.size(); ++p) {
    if (seeds[p] == kIn) reached[p] = 1, open.push_back(int(p));
  }
  while (!open.empty()) {
    const int p = open.back(), x = p % values->width, y = p / values->width;
    open.pop_back();
    for (int k = 1; k < 9; k += 2) {
      const int i = x + k % 3 - 1, j = y + k / 3 - 1;
      if (!values->Contains(i, j)) continue;
      const size_t q = values->Index(i, j);
      if (reached[q] || values->data[q] < 0.5f) continue;
      reached[q] = 1;
      open.push_back(int(q));
    }
  }
  for (size_t p = 0; p < seeds.size(); ++p) {
    if (!reached[p] && values->data[p] >= 0.5f) values->data[p] = 0;
  }
}

Mask ToMask(const ScalarImage& values) {
  Mask mask(values.width, values.height);
  for (size_t p = 0; p < mask.data.size(); ++p) {
    // Sharper than the solution, whose values creep toward the middle far from strokes.
    const float sharp = std::clamp(2 * values.data[p] - 0.5f, 0.0f, 1.0f);
    mask.data[p] = uint8_t(std::lround(255 * sharp));
  }
  return mask;
}

// A seed of the small picture where any pixel of the large one has one.
std::vector<Seed> SmallSeeds(const std::vector<Seed>& seeds, int width, int height, int to_width,
                             int to_height) {
  std::vector<Seed> small(size_t(to_width) * size_t(to_height), kNone);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Seed seed = seeds[size_t(y) * size_t(width) + size_t(x)];
      if (seed == kNone) continue;
      const int i = int(int64_t(x) * to_width / width), j = int(int64_t(y) * to_height / height);
      small[size_t(j) * size_t(to_width) + size_t(i)] = seed;
    }
  }
  return small;
}

// Of color and depth in comparable units. Where there is no depth the surface is far.
Features4 ScaledFeatures(const ViewLayers& layers) {
  Features4 features = Features(layers);
  std::vector<double> depths;
  const auto has_depth = [&](size_t p) {
    const float z = layers.depth.Empty() ? 0 : layers.depth.data[p];
    return z > 0 && std::isfinite(z);
  };
  for (size_t p = 0; p < features.NumPixels(); ++p) {
    if (has_depth(p)) depths.push_back(double(features.data[4 * p + 3]));
  }
  const double middle = Median(std::move(depths));
  for (size_t p = 0; p < features.NumPixels(); ++p) {
    const double away = has_depth(p) ? double(features.data[4 * p + 3]) - middle : kDepthRange;
    features.data[4 * p + 3] = float(kDepthScale * std::clamp(away, -kDepthRange, kDepthRange));
  }
  return features;
}

// Where a thing ends before another; `features` are scaled and not of the view's own size.
ScalarImage Valleys(const Features4& features, double focal) {
  ScalarImage inverse_depth(features.width, features.height);
  for (size_t p = 0; p < inverse_depth.data.size(); ++p) {
    inverse_depth.data[p] = float(std::exp(-double(features.data[4 * p + 3]) / kDepthScale));
  }
  return SurfaceValleys(inverse_depth, focal);
}

// 255 of what is doubtful, or inside and not connected, at the size of `seeds`; strokes are not.
Mask Undecided(const Solution& solution, const ScalarImage& connected,
               const std::vector<Seed>& seeds, int width, int height) {
  Mask undecided(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int i = std::min(connected.width - 1, int(int64_t(x) * connected.width / width));
      const int j = std::min(connected.height - 1, int(int64_t(y) * connected.height / height));
      const size_t p = connected.Index(i, j);
      const bool dropped = solution.inside[p] != 0 && connected.data[p] < 0.5f;
      const bool known = seeds[undecided.Index(x, y)] != kNone;
      undecided(x, y) = !known && (dropped || solution.doubtful[p] != 0) ? 255 : 0;
    }
  }
  return undecided;
}

Mask Solve(const Features4& features, double focal, const std::vector<Seed>& seeds,
           Monitor& monitor, Mask* undecided = nullptr, double favor = 0) {
  const int width = features.width, height = features.height;
  const double shrink = std::min(1.0, std::sqrt(kMaxPixels / (double(width) * height)));
  const int small_width = std::max(1, int(width * shrink));
  const int small_height = std::max(1, int(height * shrink));
  const std::vector<Seed> small = SmallSeeds(seeds, width, height, small_width, small_height);
  const Features4 resized = Resized(features, small_width, small_height);
  const Solution solution =
      SolveSeeds(resized, Valleys(resized, focal * shrink), small, undecided, favor, monitor);
  ScalarImage values(small_width, small_height);
  for (size_t p = 0; p < values.data.size(); ++p) values.data[p] = solution.inside[p];
  DropUnconnected(small, &values);
  if (undecided) *undecided = Undecided(solution, values, seeds, width, height);
  ScalarImage matte = GuidedMatte(values, features, kMatteRadius);
  for (size_t p = 0; p < seeds.size(); ++p) {
    if (seeds[p] != kNone) matte.data[p] = seeds[p] == kIn ? 1 : 0;
  }
  return ToMask(matte);
}

void RequireSize(const ViewLayers& layers, const Mask& mask) {
  CheckOption(mask.width == layers.color.width && mask.height == layers.color.height,
              "strokes and their view need one size");
}

}  // namespace

void DrawStroke(const std::vector<Eigen::Vector2d>& points, double brush, Mask* mask) {
  const double radius = std::max(0.5, brush / 2);
  for (size_t k = 0; k < points.size(); ++k) {
    const Eigen::Vector2d from = points[k], to = points[std::min(k + 1, points.size() - 1)];
    const Eigen::Vector2d along = to - from;
    const Eigen::Array2d low = (from.cwiseMin(to).array() - radius - 1).floor();
    const Eigen::Array2d high = (from.cwiseMax(to).array() + radius + 1).ceil();
    const int x0 = int(std::clamp(low[0], 0.0, double(mask->width)));
    const int y0 = int(std::clamp(low[1], 0.0, double(mask->height)));
    const int x1 = int(std::clamp(high[0], 0.0, double(mask->width)));
    const int y1 = int(std::clamp(high[1], 0.0, double(mask->height)));
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) {
        const Eigen::Vector2d at = Eigen::Vector2d(x + 0.5, y + 0.5) - from;
        const double squared = along.squaredNorm();
        const double t = squared > 0 ? std::clamp(at.dot(along) / squared, 0.0, 1.0) : 0;
        if ((at - t * along).norm() <= radius) (*mask)(x, y) = 255;
      }
    }
  }
}

Mask MaskFromScribbles(const ViewLayers& layers, const Mask& inside, const Mask& outside,
                       Monitor& monitor, Mask* undecided) {
  CheckLayers(layers);
  RequireSize(layers, inside);
  if (!outside.Empty()) RequireSize(layers, outside);
  std::vector<Seed> seeds(inside.data.size(), kNone);
  bool any_in = false, any_out = false;
  for (size_t p = 0; p < seeds.size(); ++p) {
    const bool in = inside.data[p] >= kInside;
    const bool out = !outside.Empty() && outside.data[p] >= kInside;
    CheckOption(!in || !out, "a pixel has a stroke inside and one outside");
    seeds[p] = in ? kIn : out ? kOut : kNone;
    any_in |= in;
    any_out |= out;
  }
  CheckOption(any_in, "there is no stroke inside");
  for (int y = 0; !any_out && y < inside.height; ++y) {
    for (int x = 0; x < inside.width; ++x) {
      const bool edge = x == 0 || y == 0 || x == inside.width - 1 || y == inside.height - 1;
      Seed& seed = seeds[inside.Index(x, y)];
      if (edge && seed == kNone) seed = kOut;
    }
  }
  return Solve(ScaledFeatures(layers), PixelsPerRadian(layers), seeds, monitor, undecided);
}

Mask RefineEdge(const ViewLayers& layers, const Mask& mask, int radius, Monitor& monitor,
                double favor) {
  CheckLayers(layers);
  RequireSize(layers, mask);
  CheckOption(radius >= 1, "the radius of an edge must be at least 1 pixel");
  // Distances to the border from both sides.
  cv::Mat in(mask.height, mask.width, CV_8U), out, depth_in, depth_out;
  for (size_t p = 0; p < mask.data.size(); ++p) in.data[p] = mask.data[p] >= kInside ? 255 : 0;
  if (cv::countNonZero(in) == 0 || cv::countNonZero(in) == int(mask.NumPixels())) return mask;
  out = 255 - in;
  cv::distanceTransform(in, depth_in, cv::DIST_L2, cv::DIST_MASK_5);
  cv::distanceTransform(out, depth_out, cv::DIST_L2, cv::DIST_MASK_5);
  // What is thinner than the band keeps its middle.
  double deepest = 0;
  cv::minMaxLoc(depth_in, nullptr, &deepest);
  const double band_in = std::min(double(radius), 0.5 * deepest);
  // The band and as much about it as tells inside from outside.
  const cv::Rect box = cv::boundingRect(in);
  const int margin = 3 * radius + 2;
  const cv::Rect part =
      cv::Rect(box.x - margin, box.y - margin, box.width + 2 * margin, box.height + 2 * margin) &
      cv::Rect(0, 0, mask.width, mask.height);
  const Features4 all = ScaledFeatures(layers);
  Features4 features(part.width, part.height);
  std::vector<Seed> seeds(features.NumPixels(), kNone);
  for (int y = 0; y < part.height; ++y) {
    for (int x = 0; x < part.width; ++x) {
      std::copy_n(&all(part.x + x, part.y + y), 4, &features(x, y));
      const cv::Point at(part.x + x, part.y + y);
      if (depth_in.at<float>(at) > band_in) seeds[size_t(y) * size_t(part.width) + size_t(x)] = kIn;
      if (depth_out.at<float>(at) > float(radius)) {
        seeds[size_t(y) * size_t(part.width) + size_t(x)] = kOut;
      }
    }
  }
  const Mask found = Solve(features, PixelsPerRadian(layers), seeds, monitor, nullptr, favor);
  Mask refined = mask;
  for (int y = 0; y < part.height; ++y) {
    for (int x = 0; x < part.width; ++x) {
      if (seeds[size_t(y) * size_t(part.width) + size_t(x)] != kNone) continue;
      refined(part.x + x, part.y + y) = found(x, y);
    }
  }
  return refined;
}

}  // namespace retint
