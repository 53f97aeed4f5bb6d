// SPDX-License-Identifier: BSD-3-Clause
#include "selection/registration.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

#include <fmt/format.h>
#include <Eigen/LU>

#include "base/error.h"
#include "base/median.h"
#include "base/parallel.h"
#include "scene/image_checks.h"
#include "selection/depth_sampling.h"
#include "selection/neighbors.h"
#include "selection/registration_solver.h"
#include "selection/sampling.h"

namespace retint {
namespace {

constexpr int64_t kGrain = 2048;  // points per task
constexpr int kLeastPoints = 12;  // fewer usable points: identity
// Sparse points relatively farther than this from the depth map are occluded or wrong.
constexpr double kMostRelativeDepth = 0.15;

// The values of make(i), an std::optional<T>, for i in [0, count), in order; on several threads.
template <typename T, typename Make>
std::vector<T> Collect(size_t count, const Make& make) {
  constexpr int64_t kPiece = 64;
  std::vector<std::optional<T>> made(count);
  ParallelRanges(int64_t(count), kPiece, [&](int64_t begin, int64_t end) {
    for (auto i = size_t(begin); i < size_t(end); ++i) made[i] = make(i);
  });
  std::vector<T> collected;
  for (const auto& one : made) {
    if (one) collected.push_back(*one);
  }
  return collected;
}

// A sparse point that the reference camera sees inside the dilated mask.
struct Seen {
  Eigen::Vector3d in_cam;
  Eigen::Vector2d pixel;
};

std::vector<Seen> SeenPoints(const PosedCamera& view, const View* training_view, const Mask& mask,
                             const Reconstruction& reconstruction, int margin) {
  const auto see = [&](const SparsePoint& point) -> std::optional<Seen> {
    const auto projected = view.Project(point.xyz);
    if (!projected || !(projected->x() >= 0 && projected->y() >= 0 && projected->x() < mask.width &&
                        projected->y() < mask.height)) {
      return std::nullopt;
    }
    if (!IsNearMask(mask, static_cast<int>(projected->x()), static_cast<int>(projected->y()),
                    margin)) {
      return std::nullopt;
    }
    return Seen{view.cam_from_world * point.xyz, projected->head<2>()};
  };
  if (training_view) {
    const auto& observations = training_view->observations;
    return Collect<Seen>(observations.size(), [&](size_t i) {
      const auto found = reconstruction.points.find(observations[i].point_id);
      return found == reconstruction.points.end() ? std::nullopt : see(found->second);
    });
  }
  std::vector<const SparsePoint*> points;
  for (const auto& [id, point] : reconstruction.points) points.push_back(&point);
  return Collect<Seen>(points.size(), [&](size_t i) { return see(*points[i]); });
}

// The cloud's points that belong to this view, in its camera frame, with their source pixels.
struct LocalCloud {
  std::vector<size_t> idx;  // into SelectionCloud::points
  std::vector<Eigen::Vector3d> in_cam, normals;
  bool has_pixels = false;
};

LocalCloud PointsOfView(const SelectionCloud& cloud, const PosedCamera& view,
                        const View* training_view) {
  LocalCloud local;
  local.has_pixels = !cloud.sources.empty();
  size_t source = cloud.sources.size();
  if (training_view) {
    source = static_cast<size_t>(
        std::find(cloud.sources.begin(), cloud.sources.end(), training_view->name) -
        cloud.sources.begin());
  }
  local.idx.reserve(cloud.points.size());
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    const auto& point = cloud.points[i];
    if (source < cloud.sources.size() && point.source != source) continue;
    local.idx.push_back(i);
  }
  local.in_cam.resize(local.idx.size());
  local.normals.resize(local.idx.size());
  ParallelRanges(int64_t(local.idx.size()), kGrain, [&](int64_t begin, int64_t end) {
    for (auto i = size_t(begin); i < size_t(end); ++i) {
      const auto& point = cloud.points[local.idx[i]];
      local.in_cam[i] = view.cam_from_world * point.position.cast<double>();
      local.normals[i] = view.cam_from_world.rotation * point.normal.cast<double>();
    }
  });
  return local;
}

// Whether the cloud equals the unprojected `depth`. Then the map can replace the cloud, also in the
// margin beyond the cloud.
bool FollowsDepth(const SelectionCloud& cloud, const LocalCloud& local, const Camera& camera,
                  const DepthMap& depth) {
  if (!local.has_pixels || local.idx.empty()) return false;
  constexpr double kUnknown = -1;
  std::vector<double> shifts(local.idx.size(), kUnknown);
  ParallelRanges(int64_t(shifts.size()), kGrain, [&](int64_t begin, int64_t end) {
    for (auto i = size_t(begin); i < size_t(end); ++i) {
      const auto& point = cloud.points[local.idx[i]];
      if (!depth.Contains(point.x, point.y) || !HasDepth(depth, point.x, point.y)) continue;
      const double z = depth(point.x, point.y);
      const Eigen::Vector2d ray = *camera.CamFromImg({point.x + 0.5, point.y + 0.5});
      shifts[i] = (local.in_cam[i] - Eigen::Vector3d(ray.x() * z, ray.y() * z, z)).norm() / z;
    }
  });
  std::erase(shifts, kUnknown);
  constexpr double kSame = 1e-4;  // far below any depth error, far above float rounding
  if (shifts.size() * 2 <= local.idx.size()) return false;
  // The median is below kSame if more than half of the shifts are.
  return std::ranges::count_if(shifts, [](double shift) { return shift < kSame; }) * 2 >
         std::ssize(shifts);
}

std::vector<RegistrationPair> PairsFromDepth(const std::vector<Seen>& seen, const Camera& camera,
                                             const DepthMap& depth) {
  return Collect<RegistrationPair>(seen.size(), [&](size_t i) -> std::optional<RegistrationPair> {
    const Eigen::Vector2d& pixel = seen[i].pixel;
    const auto z = SampleDepth(depth, pixel);
    if (!z) return std::nullopt;
    const Eigen::Vector2d ray = *camera.CamFromImg(pixel);
    return RegistrationPair{
        {ray.x() * *z, ray.y() * *z, *z},
        seen[i].in_cam,
        NormalFromDepth(camera, depth, static_cast<int>(pixel.x()), static_cast<int>(pixel.y())),
        false};
  });
}

// The cloud's surface seen in source pixel `pixel`: an affine fit of position over the source
// pixels around it, which works however the cloud was moved. Returns nullopt if few points are
// near, or if they do not lie on one surface.
std::optional<RegistrationPair> SurfaceAtPixel(const SelectionCloud& cloud, const LocalCloud& local,
                                               const std::vector<int>& grid, const Camera& camera,
                                               const Eigen::Vector2d& pixel) {
  constexpr int kReach = 3;          // pixels
  constexpr int kLeast = 6;          // points
  constexpr double kRoughness = 3;   // footprints: largest root mean square error of the fit
  constexpr double kAligned = 0.95;  // least length of the mean normal on one surface
  Eigen::Matrix3d normal_matrix = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();  // rows: 1, dx, dy; columns: position
  Eigen::Vector3d normal_sum = Eigen::Vector3d::Zero();
  std::vector<std::pair<Eigen::Vector3d, size_t>> used;
  const int px = static_cast<int>(pixel.x()), py = static_cast<int>(pixel.y());
  for (int y = std::max(0, py - kReach); y <= std::min(camera.height - 1, py + kReach); ++y) {
    for (int x = std::max(0, px - kReach); x <= std::min(camera.width - 1, px + kReach); ++x) {
      const int i = grid[size_t(y) * size_t(camera.width) + size_t(x)];
      if (i < 0) continue;
      const Eigen::Vector3d row(1, x + 0.5 - pixel.x(), y + 0.5 - pixel.y());
      normal_matrix += row * row.transpose();
      moments += row * local.in_cam[size_t(i)].transpose();
      normal_sum += local.normals[size_t(i)];
      used.emplace_back(row, size_t(i));
    }
  }
  if (static_cast<int>(used.size()) < kLeast) return std::nullopt;
  // A sparse point outside the mask has its neighbors on one side: that is extrapolation.
  const Eigen::Vector3d mean = normal_matrix.col(0) / double(used.size());
  if (mean.tail<2>().norm() > 1.5) return std::nullopt;
  const Eigen::Matrix3d fit = normal_matrix.ldlt().solve(moments);
  double squared = 0, footprint = 0;
  for (const auto& [row, i] : used) {
    squared += (fit.transpose() * row - local.in_cam[i]).squaredNorm();
    footprint += cloud.points[local.idx[i]].footprint;
  }
  const double count = static_cast<double>(used.size());
  if (std::sqrt(squared / count) > kRoughness * footprint / count) return std::nullopt;
  RegistrationPair pair;
  pair.cloud = fit.row(0).transpose();
  if (normal_sum.norm() > kAligned * count) pair.normal = normal_sum.normalized();
  return pair;
}

std::vector<RegistrationPair> PairsFromPixels(const SelectionCloud& cloud, const LocalCloud& local,
                                              const std::vector<Seen>& seen, const Camera& camera) {
  std::vector<int> grid(size_t(camera.width) * size_t(camera.height), -1);
  for (size_t i = 0; i < local.idx.size(); ++i) {
    const auto& point = cloud.points[local.idx[i]];
    if (point.x >= camera.width || point.y >= camera.height) continue;
    grid[size_t(point.y) * size_t(camera.width) + point.x] = static_cast<int>(i);
  }
  return Collect<RegistrationPair>(seen.size(), [&](size_t i) {
    auto pair = SurfaceAtPixel(cloud, local, grid, camera, seen[i].pixel);
    if (pair) pair->sparse = seen[i].in_cam;
    return pair;
  });
}

// After `at` is applied: replaces the cloud point of each pair by the one nearest to its sparse
// point.
void FindNearest(const LocalCloud& local, const RegistrationTransform& at,
                 std::vector<RegistrationPair>* pairs) {
  const RegistrationMap map(at);
  std::vector<Eigen::Vector3f> moved;
  for (const auto& point : local.in_cam) moved.push_back((map * point).cast<float>());
  const PointTree tree(moved);
  for (auto& pair : *pairs) {
    float distance = 0;
    const int i = tree.Nearest(pair.sparse.cast<float>(), &distance);
    if (i < 0) continue;
    pair.cloud = local.in_cam[size_t(i)];
    pair.normal = local.normals[size_t(i)];
  }
}

// For clouds without source pixels, of other tools: pairs with the nearest cloud point.
std::vector<RegistrationPair> PairsFromNearest(const LocalCloud& local,
                                               const std::vector<Seen>& seen, double max_relative,
                                               const RegistrationTransform& at) {
  std::vector<RegistrationPair> pairs;
  if (local.in_cam.empty()) return pairs;
  for (const auto& point : seen) pairs.push_back({point.in_cam, point.in_cam, {0, 0, 0}, false});
  FindNearest(local, at, &pairs);
  const RegistrationMap map(at);
  std::erase_if(pairs, [&](const RegistrationPair& pair) {
    return (map * pair.cloud - pair.sparse).norm() > max_relative * pair.sparse.z();
  });
  return pairs;
}

// Drops pairs behind the camera, and pairs with a depth ratio far from the median: the sparse point
// is on something else. Relative to the median, so that a wrong scale of the cloud drops none.
void DropOccluded(double max_relative, std::vector<RegistrationPair>* pairs) {
  std::erase_if(*pairs, [](const RegistrationPair& pair) {
    return !(pair.cloud.z() > 0) || !(pair.sparse.z() > 0);
  });
  if (pairs->empty()) return;
  std::vector<double> ratios;
  for (const auto& pair : *pairs) ratios.push_back(std::log(pair.sparse.z() / pair.cloud.z()));
  const double middle = Median(ratios);
  std::erase_if(*pairs, [&](const RegistrationPair& pair) {
    return std::abs(std::log(pair.sparse.z() / pair.cloud.z()) - middle) > max_relative;
  });
}

void HoldOut(double fraction, uint64_t seed, std::vector<RegistrationPair>* pairs) {
  const auto count = static_cast<size_t>(std::llround(fraction * double(pairs->size())));
  for (const size_t i : SampleIndices(pairs->size(), count, seed)) (*pairs)[i].heldout = true;
}

double Rms(const std::vector<RegistrationPair>& pairs, const RegistrationTransform& at,
           bool heldout) {
  const RegistrationMap map(at);
  double squared = 0;
  int count = 0;
  for (const auto& pair : pairs) {
    if (pair.heldout != heldout) continue;
    squared += (map * pair.cloud - pair.sparse).squaredNorm();
    ++count;
  }
  return count > 0 ? std::sqrt(squared / count) : 0;
}

RegistrationTransform AboutCloud(const LocalCloud& local) {
  RegistrationTransform transform;
  for (const auto& point : local.in_cam) transform.center += point;
  transform.center /= double(std::max<size_t>(1, local.in_cam.size()));
  return transform;
}

// Fits with the noise before the fit, which a disturbance inflates, then with the noise after it.
std::string FitAllTwice(const std::vector<RegistrationPair>& pairs,
                        RegistrationTransform* transform) {
  FitAll(pairs, DepthNoise(pairs, *transform), transform);
  return FitAll(pairs, DepthNoise(pairs, *transform), transform);
}

constexpr int kNearestRounds = 10;  // pairings and fits, without source pixels

struct Candidate {
  RegistrationTransform transform;
  std::string reason;
};

void Apply(const RegistrationTransform& transform, const LocalCloud& local,
           const Rigid3d& cam_from_world, SelectionCloud* cloud) {
  const Rigid3d world_from_cam = cam_from_world.Inverse();
  const RegistrationMap map(transform);
  const auto move = [&](size_t i) {
    auto& point = cloud->points[local.idx[i]];
    const Eigen::Vector3d& before = local.in_cam[i];
    const Eigen::Vector3d after = map * before;
    // The plane 1 = n.x / d becomes 1 = (a n/d + b e_z).x' under 1/z' = a/z + b.
    Eigen::Vector3d normal = local.normals[i];
    const double offset = normal.dot(before);
    if (offset < 0) {
      normal = -(transform.a * normal / offset + Eigen::Vector3d(0, 0, transform.b)).normalized();
    }
    point.position = (world_from_cam * after).cast<float>();
    point.normal = (world_from_cam.rotation * (map.similarity().rotation * normal)).cast<float>();
    point.footprint *=
        static_cast<float>(map.similarity().scale / (transform.a + transform.b * before.z()));
  };
  ParallelRanges(int64_t(local.idx.size()), kGrain, [&](int64_t begin, int64_t end) {
    for (auto i = size_t(begin); i < size_t(end); ++i) move(i);
  });
}

Sim3d InWorld(const Sim3d& in_cam, const Rigid3d& cam_from_world) {
  const Rigid3d world_from_cam = cam_from_world.Inverse();
  Sim3d sim;
  sim.scale = in_cam.scale;
  sim.rotation = world_from_cam.rotation * in_cam.rotation * cam_from_world.rotation;
  sim.translation = world_from_cam * (in_cam * cam_from_world.translation);
  return sim;
}

// Whether the depth correction keeps all points in front of the camera, at finite depths.
bool IsUsable(const RegistrationTransform& transform, const LocalCloud& local) {
  return transform.a > 0 &&
         std::all_of(local.in_cam.begin(), local.in_cam.end(), [&](const Eigen::Vector3d& point) {
           return transform.a + transform.b * point.z() > 0.1;
         });
}

}  // namespace

std::string RegistrationSummary::BriefReport() const {
  if (!accepted) return "registration: not moved, " + reason;
  return fmt::format(
      "registration: accepted, distance to {} COLMAP points held out {:.4g} -> {:.4g}",
      points_heldout, heldout_before, heldout_after);
}

RegistrationSummary Register(SelectionCloud& cloud, const PosedCamera& view,
                             const View* training_view, const Mask& mask, const DepthMap& depth,
                             const Reconstruction& reconstruction,
                             const RegistrationOptions& options) {
  options.Check();
  if (!view.camera.IsPinhole()) throw InputError("the view's camera model is not PINHOLE");
  for (const auto& [name, width, height] : {std::tuple("mask", mask.width, mask.height),
                                            std::tuple("depth map", depth.width, depth.height)}) {
    RequireSize(name, width, height, view.camera);
  }
  RegistrationSummary summary;
  const LocalCloud local = PointsOfView(cloud, view, training_view);
  const auto seen = SeenPoints(view, training_view, mask, reconstruction, kRegistrationMargin);
  const RegistrationTransform identity = AboutCloud(local);

  const bool follows = FollowsDepth(cloud, local, view.camera, depth);
  const bool by_nearest = !follows && !local.has_pixels;
  auto pairs = follows      ? PairsFromDepth(seen, view.camera, depth)
               : by_nearest ? PairsFromNearest(local, seen, kMostRelativeDepth, identity)
                            : PairsFromPixels(cloud, local, seen, view.camera);
  DropOccluded(kMostRelativeDepth, &pairs);
  HoldOut(options.heldout_fraction, options.seed, &pairs);
  summary.points_heldout = static_cast<int>(
      std::count_if(pairs.begin(), pairs.end(), [](const auto& pair) { return pair.heldout; }));
  summary.points_used = static_cast<int>(pairs.size()) - summary.points_heldout;
  if (static_cast<int>(pairs.size()) < kLeastPoints) {
    summary.reason =
        fmt::format("only {} usable sparse points, {} needed", pairs.size(), kLeastPoints);
    return summary;
  }
  summary.rms_before = summary.rms_after = Rms(pairs, identity, false);
  summary.heldout_before = summary.heldout_after = Rms(pairs, identity, true);

  Candidate candidates[] = {{identity, "depth correction alone, "},
                            {identity, "depth correction and similarity, "}};
  auto& [depth_only, all] = candidates;
  depth_only.reason += FitDepth(pairs, DepthNoise(pairs, identity), &depth_only.transform);
  all.transform = depth_only.transform;
  all.reason += FitAllTwice(pairs, &all.transform);
  for (int round = 1; by_nearest && round < kNearestRounds; ++round) {
    FindNearest(local, all.transform, &pairs);
    FitAllTwice(pairs, &all.transform);
  }
  const Candidate* best = nullptr;
  for (const auto& candidate : candidates) {
    if (by_nearest) FindNearest(local, candidate.transform, &pairs);
    const double heldout = Rms(pairs, candidate.transform, true);
    if (!IsUsable(candidate.transform, local) || !(heldout < summary.heldout_after)) continue;
    best = &candidate;
    summary.heldout_after = heldout;
    summary.rms_after = Rms(pairs, candidate.transform, false);
  }
  if (!best) {
    summary.reason = "no correction made the held-out points better";
    return summary;
  }
  summary.accepted = true;
  summary.reason = best->reason;
  summary.a = best->transform.a;
  summary.b = best->transform.b;
  summary.world_from_cloud = InWorld(best->transform.Similarity(), view.cam_from_world);
  Apply(best->transform, local, view.cam_from_world, &cloud);
  return summary;
}

}  // namespace retint
