// SPDX-License-Identifier: BSD-3-Clause
#include "opening/virtual_views.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <numbers>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/option_name.h"
#include "base/stage_cache.h"
#include "colmap_io/sparse.h"
#include "opening/scene_shape.h"
#include "render/color_encoding.h"
#include "render/renderer.h"
#include "scene/look_along.h"

namespace retint {
namespace {

using Eigen::Vector3d;

constexpr double kFov = 60, kInsideFov = 80;  // degrees, of the width
constexpr double kNearest = 0.2;              // nothing nearer is drawn (kernels/common/types.h)
constexpr int kJudgeWidth = 160;              // pixels
constexpr size_t kJudged = 40'000;            // Gaussians
constexpr uint64_t kMostKeptBytes = uint64_t{64} << 20;

struct Candidate {
  PosedCamera view;
  std::tuple<bool, int, int, int> order;  // inside, height, around, distance
  double quality = 0;                     // of the visible part; 0: of no use
  double trust = 1;                       // that it is where one would stand
  std::vector<uint8_t> seen = {};         // [judged] 255: very well
  DepthMap depth = {};
};

PosedCamera ViewAlong(const Vector3d& eye, const Vector3d& forward, const Vector3d& up,
                      double half_width, const VirtualViewOptions& options) {
  const double focal = options.width / 2.0 / half_width;
  return {Camera::Pinhole(1, options.width, options.height, focal, focal, options.width / 2.0,
                          options.height / 2.0),
          LookAlong(eye, forward, up)};
}

double HalfWidth(double fov_degrees) { return std::tan(fov_degrees * std::numbers::pi / 360); }

// Directions by height above the horizon and angle around `up`.
struct Compass {
  Vector3d up, east, north;
  explicit Compass(const Vector3d& up_direction) : up(up_direction) {
    east = up.unitOrthogonal();
    north = up.cross(east);
  }
  Vector3d Direction(double height_degrees, double turns) const {
    const double height = height_degrees * std::numbers::pi / 180;
    const double angle = turns * 2 * std::numbers::pi;
    return std::cos(height) * (std::cos(angle) * east + std::sin(angle) * north) +
           std::sin(height) * up;
  }
};

// Rings around the center. In a scene so small that the rasterizer's near plane would cut it, the
// camera steps back and narrows its view instead.
void AddOrbits(const SceneShape& shape, const Compass& compass, const VirtualViewOptions& options,
               std::vector<Candidate>& candidates) {
  constexpr double kHeights[] = {-15, 10, 35, 60};
  constexpr int kDistances = 6;
  const int around = std::max(10, (options.views + 2) / 3);
  const double nearest = 1.3 * shape.inner_radius, farthest = 3.2 * shape.outer_radius;
  for (int h = 0; h < 4; ++h) {
    for (int a = 0; a < around; ++a) {
      for (int d = 0; d < kDistances; ++d) {
        const double distance =
            nearest * std::pow(farthest / nearest, double(d) / (kDistances - 1));
        const double back = std::max(0.0, 2 * kNearest - distance / 2);
        const Vector3d side = compass.Direction(kHeights[h], (a + 0.5 * (h % 2)) / around);
        const double half_width = HalfWidth(kFov) * distance / (distance + back);
        candidates.push_back({ViewAlong(shape.center + (distance + back) * side, -side, compass.up,
                                        half_width, options),
                              {false, h, a, d}});
      }
    }
  }
}

void AddInside(const SceneShape& shape, const Compass& compass, const VirtualViewOptions& options,
               std::vector<Candidate>& candidates) {
  constexpr double kHeights[] = {-20, 10};
  constexpr int kPlaces = 5, kAround = 8;
  for (int place = 0; place < kPlaces; ++place) {
    Vector3d eye = shape.center;
    if (place > 0) eye += 0.6 * shape.inner_radius * compass.Direction(0, place / 4.0);
    for (int h = 0; h < 2; ++h) {
      for (int a = 0; a < kAround; ++a) {
        const Vector3d forward = compass.Direction(kHeights[h], double(a) / kAround);
        candidates.push_back({ViewAlong(eye, forward, compass.up, HalfWidth(kInsideFov), options),
                              {true, place, a, h}});
      }
    }
  }
}

// Fewer Gaussians, each as much larger as keeps the area that they cover together.
GaussianModel Thinned(const GaussianModel& model) {
  const size_t step = (model.NumGaussians() + kJudged - 1) / kJudged;
  if (step <= 1) return model;
  const auto grow = static_cast<float>(0.5 * std::log(double(step)));
  const size_t block = static_cast<size_t>(model.NumShCoeffs()) * 3;
  GaussianModel thin;
  thin.traits = model.traits;
  thin.Resize((model.NumGaussians() + step - 1) / step, model.sh_degree);
  for (size_t i = 0; i < thin.NumGaussians(); ++i) {
    const size_t from = i * step;
    std::copy_n(&model.means[3 * from], 3, &thin.means[3 * i]);
    std::copy_n(&model.quats_wxyz[4 * from], 4, &thin.quats_wxyz[4 * i]);
    for (size_t k = 0; k < 3; ++k) {
      thin.log_scales[3 * i + k] = model.log_scales[3 * from + k] + grow;
    }
    thin.opacity_logits[i] = model.opacity_logits[from];
    std::copy_n(&model.sh[block * from], block, &thin.sh[block * i]);
  }
  return thin;
}

Vector3d MeanOf(const GaussianModel& model, size_t i) {
  return Eigen::Map<const Eigen::Vector3f>(model.means.data() + 3 * i).cast<double>();
}

PosedCamera Small(const PosedCamera& view) {
  const double scale = double(kJudgeWidth) / view.camera.width;
  const Camera& camera = view.camera;
  const int height = std::max(1, int(std::lround(camera.height * scale)));
  return {Camera::Pinhole(1, kJudgeWidth, height, camera.fx() * scale, camera.fy() * scale,
                          kJudgeWidth / 2.0, height / 2.0),
          view.cam_from_world};
}

// Looks at thinned Gaussians through candidates.
class Judge {
 public:
  Judge(const std::shared_ptr<Backend>& backend, const GaussianModel& model,
        const SceneShape& shape)
      : model_(Thinned(model)), shape_(shape), renderer_(backend, model_, {.cache_bytes = 0}) {}

  const GaussianModel& model() const { return model_; }

  void Rate(Candidate& candidate) {
    const PosedCamera small = Small(candidate.view);
    RenderRequest request;
    request.rgb = false;
    request.depth_median = request.alpha = true;
    request.cache = false;
    RenderOutput output = renderer_.Render(small, request);
    candidate.depth = std::move(output.depth_median);
    const std::vector<float> pixels = BlendedPixels(small);

    // Blended pixels of the whole picture that make a Gaussian half seen.
    constexpr double kHalfSeen = 2;
    const double area = std::pow(double(candidate.view.camera.width) / kJudgeWidth, 2);
    candidate.seen.resize(pixels.size());
    double sum = 0, trained = 0;
    const Vector3d eye = small.Center();
    const size_t block = static_cast<size_t>(model_.NumShCoeffs()) * 3;
    for (size_t i = 0; i < pixels.size(); ++i) {
      const double seen = pixels[i] * area;
      candidate.seen[i] = static_cast<uint8_t>(std::lround(255 * seen / (seen + kHalfSeen)));
      if (!(pixels[i] > 0)) continue;
      sum += pixels[i];
      trained +=
          pixels[i] * std::min(1.0, TrainedShare(model_.sh_degree, model_.sh.data() + block * i,
                                                 (MeanOf(model_, i) - eye).normalized()));
    }
    candidate.quality = sum > 0 ? trained / sum : 0;
    // Without directional color a room's walls look like an object's surface: an object is
    // likelier.
    constexpr double kInsideUnknown = 0.2;
    candidate.trust = model_.sh_degree == 0 && std::get<0>(candidate.order) ? kInsideUnknown : 1;
    if (IsBlocked(output.alpha, candidate.depth)) candidate.quality = 0;
  }

 private:
  std::vector<float> BlendedPixels(const PosedCamera& view) {
    Backend& backend = renderer_.backend();
    const auto geometry = renderer_.Geometry(view, /*cache=*/false);
    const std::vector<float> ones(size_t(view.camera.width) * size_t(view.camera.height), 1.0F);
    const auto image = backend.Upload(std::span<const float>(ones));
    const auto by_row = backend.Allocate<float>(std::max<size_t>(1, size_t(geometry->num_rows())));
    const auto sums = backend.Allocate<float>(model_.NumGaussians());
    backend.blend().BlendTranspose(
        *geometry, {.residual = image.data(), .channels = 1, .result = by_row.data()});
    backend.blend().AddRows(*geometry, by_row.data(), 1, sums.data());
    return backend.Download(sums.data(), sums.size());
  }

  // Something stands right before the camera, or there is next to nothing to see.
  bool IsBlocked(const ScalarImage& alpha, const DepthMap& depth) const {
    constexpr double kMostNear = 0.05, kLeastFilled = 0.03;
    const double near = 0.35 * shape_.inner_radius;
    double filled = 0, close = 0;
    for (size_t p = 0; p < alpha.data.size(); ++p) {
      filled += alpha.data[p];
      close += depth.data[p] > 0 && depth.data[p] < near;
    }
    const auto all = static_cast<double>(std::max<size_t>(1, alpha.data.size()));
    return close > kMostNear * all || filled < kLeastFilled * all;
  }

  GaussianModel model_;
  SceneShape shape_;
  Renderer renderer_;
};

// Qualities in proportion to the best ones; those of less than half of that count next to nothing.
void Normalize(std::vector<Candidate>& candidates) {
  std::vector<double> sorted;
  for (const Candidate& one : candidates) {
    if (one.quality > 0) sorted.push_back(one.quality);
  }
  if (sorted.empty()) {
    for (Candidate& one : candidates) one.quality = 1;  // better than nothing
    return;
  }
  std::sort(sorted.begin(), sorted.end());
  const double best = sorted[sorted.size() * 9 / 10];
  for (Candidate& one : candidates) {
    const double share = std::clamp((one.quality / best - 0.5) / 0.4, 0.0, 1.0);
    one.quality = one.quality > 0 ? one.trust * (0.01 + share * share * (3 - 2 * share)) : 0;
  }
}

// The weight of each Gaussian: low if it is faint or far in the background.
std::vector<double> Weights(const GaussianModel& model, const SceneShape& shape) {
  std::vector<double> weights(model.NumGaussians());
  for (size_t i = 0; i < weights.size(); ++i) {
    const double far = (MeanOf(model, i) - shape.center).norm() / shape.outer_radius;
    weights[i] = 1 / (1 + std::exp(-double(model.opacity_logits[i]))) / (1 + std::pow(far, 4));
  }
  return weights;
}

// Greedy with bounds from earlier rounds. Gains only shrink (the sum is submodular), so a candidate
// whose old gain is below the best new one is skipped.
std::vector<const Candidate*> Choose(const std::vector<Candidate>& candidates, int count,
                                     const std::vector<double>& weights) {
  std::vector<double> times(weights.size(), 0.0);
  const auto gain = [&](const Candidate& one) {
    double sum = 0;
    for (size_t i = 0; i < weights.size(); ++i) {
      if (one.seen[i] == 0) continue;
      sum += weights[i] * std::log1p(one.quality * one.seen[i] / 255 / (1 + times[i]));
    }
    return sum;
  };
  struct Bound {
    double gain;
    size_t index;
    int round;
    // Greater first, then the lower index.
    bool operator<(const Bound& other) const {
      return std::pair(gain, other.index) < std::pair(other.gain, index);
    }
  };
  std::priority_queue<Bound> bounds;
  for (size_t k = 0; k < candidates.size(); ++k) bounds.push({gain(candidates[k]), k, 0});
  std::vector<const Candidate*> chosen;
  for (int round = 0; round < count && !bounds.empty();) {
    const Bound top = bounds.top();
    bounds.pop();
    const Candidate& one = candidates[top.index];
    if (top.round != round) {
      bounds.push({gain(one), top.index, round});
      continue;
    }
    if (!(top.gain > 0)) break;
    chosen.push_back(&one);
    for (size_t i = 0; i < times.size(); ++i) times[i] += one.quality * one.seen[i] / 255;
    ++round;
  }
  std::sort(chosen.begin(), chosen.end(),
            [](const Candidate* a, const Candidate* b) { return a->order < b->order; });
  return chosen;
}

void AddViews(const std::vector<const Candidate*>& chosen, Reconstruction& model) {
  std::map<double, CameraId> by_focal;
  for (size_t k = 0; k < chosen.size(); ++k) {
    const PosedCamera& posed = chosen[k]->view;
    const auto [found, is_new] =
        by_focal.emplace(posed.camera.fx(), static_cast<CameraId>(by_focal.size() + 1));
    if (is_new) {
      model.cameras[found->second] = posed.camera;
      model.cameras[found->second].id = found->second;
    }
    char name[32];
    std::snprintf(name, sizeof name, "view_%03zu.png", k + 1);
    View view;
    view.id = static_cast<ViewId>(k + 1);
    view.name = name;
    view.camera_id = found->second;
    view.cam_from_world = posed.cam_from_world;
    model.views.emplace(view.id, std::move(view));
  }
}

// Opaque, small Gaussians that at least two views see at the depth that they render there.
void AddPoints(const std::vector<const Candidate*>& chosen, const GaussianModel& gaussians,
               const SceneShape& shape, Reconstruction& model) {
  constexpr size_t kMostPoints = 8000;
  constexpr double kAgree = 0.03;  // of the depth
  std::vector<size_t> fit;
  for (size_t i = 0; i < gaussians.NumGaussians(); ++i) {
    const float* scales = gaussians.log_scales.data() + 3 * i;
    const double largest = std::exp(double(*std::max_element(scales, scales + 3)));
    if (gaussians.opacity_logits[i] > 0 && largest < 0.15 * shape.inner_radius) fit.push_back(i);
  }
  const size_t step = std::max<size_t>(1, fit.size() / kMostPoints);
  const BaseColors colors(gaussians);
  for (size_t f = 0; f < fit.size(); f += step) {
    const size_t i = fit[f];
    SparsePoint point;
    point.id = model.points.size() + 1;
    point.xyz = MeanOf(gaussians, i);
    std::vector<Observation> observations;
    for (size_t k = 0; k < chosen.size(); ++k) {
      const PosedCamera& posed = chosen[k]->view;
      const DepthMap& depth = chosen[k]->depth;
      const auto pixel = chosen[k]->seen[i] > 0 ? posed.Project(point.xyz) : std::nullopt;
      if (!pixel) continue;
      const double scale = double(depth.width) / posed.camera.width;
      const double x = pixel->x() * scale, y = pixel->y() * scale;
      if (!(x >= 0 && y >= 0 && x < depth.width && y < depth.height)) continue;
      const double rendered = depth(int(x), int(y));
      if (std::abs(rendered - pixel->z()) > kAgree * pixel->z()) continue;
      point.track.push_back({static_cast<ViewId>(k + 1), 0});
      observations.push_back({pixel->head<2>(), point.id});
    }
    if (point.track.size() < 2) continue;
    for (size_t t = 0; t < point.track.size(); ++t) {
      auto& of_view = model.views.at(point.track[t].view_id).observations;
      point.track[t].observation_idx = static_cast<uint32_t>(of_view.size());
      of_view.push_back(observations[t]);
    }
    point.color = (255 * colors.Of(i)).array().round().cast<uint8_t>();
    model.points.emplace(point.id, std::move(point));
  }
}

// Of everything that the views depend on. The number is this file's: it goes up with every change
// of where views are placed.
std::string KeyOf(const GaussianModel& model, const VirtualViewOptions& options) {
  constexpr int kVersion = 1;
  StageKey key("views");
  key.AddValue(kVersion).AddValue(options.views).AddValue(options.width).AddValue(options.height);
  key.AddValue(model.sh_degree);
  AddTraits(key, model.traits);
  for (const auto* values :
       {&model.means, &model.quats_wxyz, &model.log_scales, &model.opacity_logits, &model.sh}) {
    key.Add({reinterpret_cast<const char*>(values->data()), values->size() * sizeof(float)});
  }
  return key.Hex();
}

}  // namespace

void VirtualViewOptions::Check() const {
  CheckOption(views >= 2 && views <= 400, OptionName("views") + " must be in [2, 400]");
  CheckOption(width >= 16 && height >= 16 && width <= 16384 && height <= 16384,
              "the size of virtual views must be in [16, 16384] pixels");
}

Workspace PlaceViews(const std::shared_ptr<Backend>& backend, const GaussianModel& model,
                     const VirtualViewOptions& options, Monitor& monitor) {
  options.Check();
  const SceneShape shape = MeasureShape(model);
  const Compass compass(shape.up);
  std::vector<Candidate> candidates;
  AddOrbits(shape, compass, options, candidates);
  AddInside(shape, compass, options, candidates);
  Judge judge(backend, model, shape);
  for (size_t k = 0; k < candidates.size(); ++k) {
    monitor.Step("views", double(k), double(candidates.size()));
    judge.Rate(candidates[k]);
  }
  Normalize(candidates);
  const auto chosen = Choose(candidates, options.views, Weights(judge.model(), shape));
  if (chosen.empty()) throw InputError("the splat has no visible Gaussian");
  Workspace workspace;
  workspace.has_virtual_views = true;
  AddViews(chosen, workspace.reconstruction);
  AddPoints(chosen, judge.model(), shape, workspace.reconstruction);
  monitor.Step("views", 1, 1);
  return workspace;
}

Workspace PlaceViewsOnce(const std::shared_ptr<Backend>& backend, const GaussianModel& model,
                         const VirtualViewOptions& options, const std::filesystem::path& cache,
                         Monitor& monitor) {
  const std::string stage = "views", key = KeyOf(model, options);
  StageCache kept(cache);
  Workspace workspace;
  if (kept.Read(stage, key, [&](const auto& folder) { workspace = ReadPlacedViews(folder); })) {
    monitor.Step("views", 1, 1);
    return workspace;
  }
  workspace = PlaceViews(backend, model, options, monitor);
  try {
    kept.Write(stage, key, [&](const auto& folder) {
      WriteReconstructionBinary(folder, workspace.reconstruction);
    });
    kept.Trim(kMostKeptBytes);
  } catch (const RunError&) {  // a full disk, or one that is read only: placed again next time
  }
  return workspace;
}

std::filesystem::path CacheFolder() {
  if (const char* folder = std::getenv("RETINT_CACHE")) return folder;
  const char* cache = std::getenv("XDG_CACHE_HOME");
  if (cache && *cache) return std::filesystem::path(cache) / "retint";
  const char* home = std::getenv("HOME");
  if (home && *home) return std::filesystem::path(home) / ".cache" / "retint";
  return {};
}

Workspace ReadPlacedViews(const std::filesystem::path& folder) {
  Workspace workspace = Workspace::Open(folder);
  workspace.has_virtual_views = true;
  workspace.root.clear();
  workspace.image_folder.clear();
  return workspace;
}

}  // namespace retint
