// SPDX-License-Identifier: BSD-3-Clause
#include "selection/mask_tools/scribbles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>

#include <opencv2/imgproc.hpp>

#include "base/error.h"
#include "base/parallel.h"
#include "scene/mask_pixels.h"
#include "selection/gaussian_mixture.h"
#include "selection/mask_tools/guided_matte.h"
#include "selection/mask_tools/min_cut.h"
#include "selection/mask_tools/pixel_graph.h"
#include "selection/mask_tools/surface_edges.h"

namespace retint {
namespace {

using Features4 = PixelArray<float, 4>;
using Mixture = GaussianMixture<4>;

constexpr std::string_view kStage = "outline";
constexpr double kMaxPixels = 100'000;
constexpr double kSpread = 0.02;  // least standard deviation of a component
constexpr int kInsideParts = 5, kOutsideParts = 8;
constexpr double kLogLimit = 2;  // of the log odds by color and depth
constexpr double kReach = 3;     // log odds of a pixel much nearer to the strokes of one side
constexpr double kGiven = 1e4;   // log odds of a stroke's own pixels
constexpr int kMatteRadius = 2;  // in the small picture
constexpr double kDoubt = 2;     // log odds that may be wrong
// Factors of OKLab that take a pixel out of a shadow. Factor 2: a shadow that leaves an eighth of
// the light.
constexpr std::array<float, 3> kOutOfShadow = {1.26f, 1.59f, 2};

// How to search a border.
struct Search {
  int rounds;          // of learning the colors of inside and outside
  double valley_cost;  // PixelGraph
  bool drops_patches;  // DropPatches()
};
constexpr Search kFromStrokes = {3, 1, true};
constexpr Search kInBand = {2, 0.3, false};  // about a border, where most pixels are given

Eigen::Map<const Eigen::Vector4f> At(const Features4& features, size_t pixel) {
  return Eigen::Map<const Eigen::Vector4f>(&features.data[4 * pixel]);
}

// Log odds of "inside" of each free pixel by its place: kReach times (distance to outside strokes -
// distance to inside strokes) over their sum.
std::vector<float> ReachOdds(const FreePixels& free) {
  std::vector<float> in, out;
  ParallelTasks(2, [&](int64_t which) {
    (which == 0 ? in : out) = free.DistancesTo(which == 0 ? Seed::kInside : Seed::kOutside);
  });
  std::vector<float> odds(free.pixels.size());
  for (size_t i = 0; i < odds.size(); ++i) {
    const bool inward = std::isfinite(in[i]), outward = std::isfinite(out[i]);
    const float apart =
        inward && outward ? (out[i] - in[i]) / (out[i] + in[i]) : float(inward) - float(outward);
    odds[i] = float(kReach) * apart;
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

// Log likelihood of each point, or of the same surface out of a shadow if that is more likely. A
// shadow scales OKLab and keeps the hue.
Mixture::Values LitOrInShadow(const Mixture& mixture, const Mixture::Points& at) {
  Mixture::Values largest = mixture.LogLikelihoods(at);
  for (const float factor : kOutOfShadow) {
    Mixture::Points lit = at;
    lit.leftCols<3>() *= factor;
    largest = largest.max(mixture.LogLikelihoods(lit));
  }
  return largest;
}

// Log odds of "inside" of each free pixel by its color, from mixtures of the pixels that `take`
// selects. Only outside surfaces may be in a shadow: the shaded side of the object itself has its
// hue.
std::vector<float> LooksOdds(const Features4& features, const std::vector<int>& free,
                             const std::function<bool(size_t, Seed)>& take) {
  Mixture in, out;
  ParallelTasks(2, [&](int64_t which) {
    const Seed kind = which == 0 ? Seed::kInside : Seed::kOutside;
    (which == 0 ? in : out) = Mixture(Samples(features, [&](size_t p) { return take(p, kind); }),
                                      which == 0 ? kInsideParts : kOutsideParts, kSpread);
  });
  std::vector<float> odds(free.size());
  ParallelRanges(int64_t(free.size()), 1024, [&](int64_t begin, int64_t end) {
    Mixture::Points at(end - begin, 4);
    for (int64_t i = begin; i < end; ++i)
      at.row(i - begin) = At(features, size_t(free[size_t(i)])).transpose();
    const Mixture::Values looks = in.LogLikelihoods(at) - LitOrInShadow(out, at);
    constexpr auto kLimit = float(kLogLimit);
    for (int64_t i = begin; i < end; ++i)
      odds[size_t(i)] = std::clamp(looks[i - begin], -kLimit, kLimit);
  });
  return odds;
}

// For each of the favors, 1 in every pixel inside, else 0. `doubtful`, if wanted: 1 in every pixel
// that changes side if all log odds except those of strokes change by kDoubt.
struct Solution {
  std::vector<std::vector<uint8_t>> inside;
  std::vector<uint8_t> doubtful;
};

Solution SolveSeeds(const Features4& features, const PixelGraph& graph,
                    const std::vector<Seed>& seeds, int rounds, bool with_doubt,
                    std::span<const double> favors, Monitor& monitor) {
  const FreePixels free = graph.Free(seeds);
  const size_t count = free.pixels.size();
  std::vector<uint8_t> inside(seeds.size());
  for (size_t p = 0; p < seeds.size(); ++p) inside[p] = seeds[p] == Seed::kInside ? 1 : 0;
  const auto set_free = [&](const std::vector<uint8_t>& sides) {
    for (size_t i = 0; i < count; ++i) inside[size_t(free.pixels[i])] = sides[i];
  };
  std::vector<float> reach, odds;
  const auto cut = [&](double favored) {
    std::vector<float> all(count);
    for (size_t i = 0; i < count; ++i) all[i] = odds[i] + free.given[i] + float(favored);
    return MinCut(free.edges, all);
  };
  for (int round = 0; round < rounds; ++round) {
    monitor.Step(kStage, round, rounds);
    monitor.ThrowIfCancelled();
    const auto take = [&](size_t p, Seed kind) {
      if (seeds[p] != Seed::kNone) return seeds[p] == kind;
      // In the first round, parts without outside strokes may still look like the border of the
      // picture.
      if (round == 0) return kind == Seed::kOutside && IsBorder(features, p);
      return inside[p] == (kind == Seed::kInside ? 1 : 0);
    };
    ParallelTasks(round == 0 ? 2 : 1, [&](int64_t which) {
      if (which == 1) reach = ReachOdds(free);
      if (which == 0) odds = LooksOdds(features, free.pixels, take);
    });
    for (size_t i = 0; i < count; ++i) odds[i] += reach[i];
    if (round + 1 < rounds) set_free(cut(0));
  }
  Solution solution;
  std::vector<std::vector<uint8_t>> sides(favors.size());
  ParallelTasks(int64_t(favors.size()),
                [&](int64_t i) { sides[size_t(i)] = cut(favors[size_t(i)]); });
  for (const std::vector<uint8_t>& one : sides) {
    set_free(one);
    solution.inside.push_back(inside);
  }
  if (with_doubt) {
    std::vector<uint8_t> least, most;
    ParallelTasks(2, [&](int64_t which) {
      (which == 0 ? least : most) = cut(favors[0] + (which == 0 ? -kDoubt : kDoubt));
    });
    solution.doubtful.resize(seeds.size());
    for (size_t i = 0; i < count; ++i)
      solution.doubtful[size_t(free.pixels[i])] = least[i] != most[i] ? 1 : 0;
  }
  monitor.Step(kStage, rounds, rounds);
  return solution;
}

// Parts of 0.5 and more become outside if they contain no inside stroke.
void DropUnconnected(const std::vector<Seed>& seeds, ScalarImage* values) {
  std::vector<uint8_t> reached(seeds.size(), 0);
  std::vector<int> open;
  for (size_t p = 0; p < seeds.size(); ++p) {
    if (seeds[p] == Seed::kInside) reached[p] = 1, open.push_back(int(p));
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

// Creases divide the picture into surfaces. A surface becomes outside as a whole if it has no
// inside stroke and is mostly outside: its inside pixels only have the color of the strokes.
void DropPatches(const ScalarImage& valleys, const std::vector<Seed>& seeds, ScalarImage* values) {
  constexpr float kSure = 0.5f;  // least sureness of a crease
  cv::Mat is_surface(valleys.height, valleys.width, CV_8U), surfaces;
  for (size_t p = 0; p < seeds.size(); ++p) is_surface.data[p] = valleys.data[p] < kSure ? 1 : 0;
  struct Surface {
    int pixels = 0, inside = 0;
    bool has_stroke = false;
  };
  std::vector<Surface> found(size_t(cv::connectedComponents(is_surface, surfaces, 4)));
  const auto surface_of = [&](size_t p) { return size_t(surfaces.ptr<int>()[p]); };
  for (size_t p = 0; p < seeds.size(); ++p) {
    Surface& surface = found[surface_of(p)];
    ++surface.pixels;
    if (values->data[p] >= 0.5f) ++surface.inside;
    if (seeds[p] == Seed::kInside) surface.has_stroke = true;
  }
  for (size_t p = 0; p < seeds.size(); ++p) {
    const Surface& surface = found[surface_of(p)];
    const bool is_valley = surface_of(p) == 0;
    if (!is_valley && !surface.has_stroke && 2 * surface.inside < surface.pixels) {
      values->data[p] = 0;
    }
  }
}

// `values` as a mask; strokes keep their side.
Mask ToMask(const ScalarImage& values, const std::vector<Seed>& seeds) {
  Mask mask(values.width, values.height);
  for (size_t p = 0; p < mask.data.size(); ++p) {
    if (seeds[p] == Seed::kNone) {
      // Sharper than the solution, because mattes become gray far from strokes.
      const float sharp = std::clamp(2 * values.data[p] - 0.5f, 0.0f, 1.0f);
      mask.data[p] = uint8_t(255 * sharp + 0.5f);
    } else {
      mask.data[p] = seeds[p] == Seed::kInside ? 255 : 0;
    }
  }
  return mask;
}

// A pixel of the small picture has a seed if any of its large pixels has one.
std::vector<Seed> SmallSeeds(const std::vector<Seed>& seeds, int width, int height, int to_width,
                             int to_height) {
  std::vector<Seed> small(size_t(to_width) * size_t(to_height), Seed::kNone);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Seed seed = seeds[size_t(y) * size_t(width) + size_t(x)];
      if (seed == Seed::kNone) continue;
      const int i = int(int64_t(x) * to_width / width), j = int(int64_t(y) * to_height / height);
      small[size_t(j) * size_t(to_width) + size_t(i)] = seed;
    }
  }
  return small;
}

// The creases of the depth in `features`, in any unit. The features may be smaller than the
// view.
ScalarImage Valleys(const Features4& features, double focal) {
  ScalarImage inverse_depth(features.width, features.height);
  for (size_t p = 0; p < inverse_depth.data.size(); ++p) {
    inverse_depth.data[p] =
        float(std::exp(-double(features.data[4 * p + 3]) / kFeaturesPerLogDepth));
  }
  return SurfaceValleys(inverse_depth, focal);
}

// 255 in pixels that are doubtful, or inside but not connected, at the size of `seeds`. Strokes are
// decided.
Mask Undecided(const Solution& solution, const ScalarImage& connected,
               const std::vector<Seed>& seeds, int width, int height) {
  Mask undecided(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int i = std::min(connected.width - 1, int(int64_t(x) * connected.width / width));
      const int j = std::min(connected.height - 1, int(int64_t(y) * connected.height / height));
      const size_t p = connected.Index(i, j);
      const bool dropped = solution.inside[0][p] != 0 && connected.data[p] < 0.5f;
      const bool known = seeds[undecided.Index(x, y)] != Seed::kNone;
      undecided(x, y) = !known && (dropped || solution.doubtful[p] != 0) ? 255 : 0;
    }
  }
  return undecided;
}

// A picture at the size for solving.
struct SmallPicture {
  SmallPicture(const Features4& large, double focal, const Search& search)
      : shrink(std::min(1.0, std::sqrt(kMaxPixels / (double(large.width) * large.height)))),
        features(Resized(large, std::max(1, int(large.width * shrink)),
                         std::max(1, int(large.height * shrink)))),
        valleys(Valleys(features, focal * shrink)),
        graph(features, valleys, search.valley_cost) {}

  double shrink;
  Features4 features;
  ScalarImage valleys;
  PixelGraph graph;  // refers to both
};

// `seeds` and `features` are of the large picture.
std::vector<Mask> Solve(const Features4& features, const SmallPicture& small,
                        const std::vector<Seed>& seeds, const Search& search,
                        std::span<const double> favors, Monitor& monitor,
                        Mask* undecided = nullptr) {
  const int width = features.width, height = features.height;
  const int small_width = small.features.width, small_height = small.features.height;
  const std::vector<Seed> small_seeds = SmallSeeds(seeds, width, height, small_width, small_height);
  const Solution solution = SolveSeeds(small.features, small.graph, small_seeds, search.rounds,
                                       undecided, favors, monitor);
  std::vector<ScalarImage> connected(favors.size(), ScalarImage(small_width, small_height));
  ParallelTasks(int64_t(favors.size()), [&](int64_t i) {
    ScalarImage& values = connected[size_t(i)];
    const std::vector<uint8_t>& inside = solution.inside[size_t(i)];
    std::copy(inside.begin(), inside.end(), values.data.begin());
    if (search.drops_patches) DropPatches(small.valleys, small_seeds, &values);
    DropUnconnected(small_seeds, &values);
  });
  if (undecided) *undecided = Undecided(solution, connected.front(), seeds, width, height);
  Mask free(width, height);
  for (size_t p = 0; p < seeds.size(); ++p) free.data[p] = seeds[p] == Seed::kNone ? 255 : 0;
  const std::vector<ScalarImage> mattes =
      GuidedMattes(connected, small.features, features, free, kMatteRadius);
  std::vector<Mask> masks(mattes.size());
  ParallelTasks(int64_t(mattes.size()),
                [&](int64_t i) { masks[size_t(i)] = ToMask(mattes[size_t(i)], seeds); });
  return masks;
}

// 255 in pixels inside `mask`, else 0.
cv::Mat InsideOf(const Mask& mask) {
  cv::Mat inside(mask.height, mask.width, CV_8U);
  for (size_t p = 0; p < mask.data.size(); ++p) inside.data[p] = IsInside(mask.data[p]) ? 255 : 0;
  return inside;
}

// Seeds in all pixels farther than `radius` from the border: they keep their side of `mask`.
std::vector<Seed> SeedsBesideBand(const Mask& mask, int radius) {
  // Distances to the border from both sides.
  const cv::Mat in = InsideOf(mask);
  cv::Mat depth_in, depth_out;
  ParallelTasks(2, [&](int64_t which) {
    cv::distanceTransform(which == 0 ? in : cv::Mat(255 - in), which == 0 ? depth_in : depth_out,
                          cv::DIST_L2, cv::DIST_MASK_5);
  });
  // A part thinner than the band keeps its middle.
  double deepest = 0;
  cv::minMaxLoc(depth_in, nullptr, &deepest);
  const double band_in = std::min(double(radius), 0.5 * deepest);
  std::vector<Seed> seeds(mask.NumPixels(), Seed::kNone);
  for (size_t p = 0; p < seeds.size(); ++p) {
    if (double(depth_in.ptr<float>()[p]) > band_in) seeds[p] = Seed::kInside;
    if (double(depth_out.ptr<float>()[p]) > double(radius)) seeds[p] = Seed::kOutside;
  }
  return seeds;
}

void RequireSize(const ViewLayers& layers, const Mask& mask) {
  CheckOption(mask.width == layers.color.width && mask.height == layers.color.height,
              "strokes and their view need one size");
}

[[noreturn]] void RefuseBoth(const Mask& outside, size_t pixel) {
  const size_t width = size_t(outside.width);
  throw OptionError(2 * CountInside(outside) > outside.NumPixels()
                        ? "most of the picture has a stroke outside, and some of it one inside too"
                        : "a stroke inside and one outside cross at pixel " +
                              std::to_string(pixel % width) + "," + std::to_string(pixel / width));
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
  std::vector<Seed> seeds(inside.data.size(), Seed::kNone);
  bool any_in = false, any_out = false;
  for (size_t p = 0; p < seeds.size(); ++p) {
    const bool in = IsInside(inside.data[p]);
    const bool out = !outside.Empty() && IsInside(outside.data[p]);
    if (in && out) RefuseBoth(outside, p);
    seeds[p] = in ? Seed::kInside : out ? Seed::kOutside : Seed::kNone;
    any_in |= in;
    any_out |= out;
  }
  CheckOption(any_in, "there is no stroke inside");
  for (int y = 0; !any_out && y < inside.height; ++y) {
    for (int x = 0; x < inside.width; ++x) {
      const bool edge = x == 0 || y == 0 || x == inside.width - 1 || y == inside.height - 1;
      Seed& seed = seeds[inside.Index(x, y)];
      if (edge && seed == Seed::kNone) seed = Seed::kOutside;
    }
  }
  constexpr double kNeither = 0;
  const Features4 features = Features(layers);
  const SmallPicture small(features, PixelsPerRadian(layers), kFromStrokes);
  return Solve(features, small, seeds, kFromStrokes, {&kNeither, 1}, monitor, undecided).front();
}

GridRect PartAboutBorder(const Mask& mask, int radius) {
  const cv::Mat inside = InsideOf(mask);
  const int count = cv::countNonZero(inside);
  if (count == 0 || count == int(mask.NumPixels())) return {};
  const cv::Rect box = cv::boundingRect(inside);
  const int margin = 3 * radius + 2;
  const cv::Rect part =
      cv::Rect(box.x - margin, box.y - margin, box.width + 2 * margin, box.height + 2 * margin) &
      cv::Rect(0, 0, mask.width, mask.height);
  return {part.x, part.y, part.width, part.height};
}

std::vector<Mask> RefineEdgeOfPart(const Features4& features, double focal, const Mask& mask,
                                   int radius, std::span<const double> favors, Monitor& monitor) {
  std::vector<Seed> seeds;
  std::optional<SmallPicture> small;
  ParallelTasks(2, [&](int64_t which) {
    if (which == 0) small.emplace(features, focal, kInBand);
    if (which == 1) seeds = SeedsBesideBand(mask, radius);
  });
  std::vector<Mask> refined = Solve(features, *small, seeds, kInBand, favors, monitor);
  for (Mask& one : refined) {
    for (size_t p = 0; p < seeds.size(); ++p) {
      if (seeds[p] != Seed::kNone) one.data[p] = mask.data[p];
    }
  }
  return refined;
}

Mask RefineEdge(const ViewLayers& layers, const Mask& mask, int radius, Monitor& monitor,
                double favor) {
  CheckLayers(layers);
  RequireSize(layers, mask);
  CheckOption(radius >= 1, "the radius of an edge must be at least 1 pixel");
  const GridRect part = PartAboutBorder(mask, radius);
  if (part.width == 0) return mask;
  Mask refined = mask;
  const Mask within = RefineEdgeOfPart(Features(layers, part), PixelsPerRadian(layers),
                                       Crop(mask, part), radius, {&favor, 1}, monitor)
                          .front();
  Place(within.data.data(), part, &refined);
  return refined;
}

}  // namespace retint
