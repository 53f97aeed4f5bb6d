// SPDX-License-Identifier: BSD-3-Clause
// The Gaussians of a scene, or of a part of it, as a graph: which are neighbors, and how surely two
// of them are one surface.
#pragma once

#include <cstddef>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "base/monitor.h"
#include "scene/gaussian_model.h"
#include "selection/graph_solver.h"
#include "selection/lifted_surfaces.h"

namespace retint {

// One Gaussian as a piece of surface.
struct GaussianSurface {
  Eigen::Vector3f mean;    // world
  Eigen::Vector3f lab;     // OKLab of the color without view dependence
  Eigen::Vector3f normal;  // the shortest axis, world
  float extent = 0;        // mean of the two longer standard deviations, world
  float flatness = 0;      // 0 round, 1 flat
  float valley = 0;  // in [0, 1], how surely one thing ends there before another; 0 where unknown
};

// Made once for a scene, or once for each part of a large one. Memory: about 450 bytes a node, and
// 900 while it is made.
class GaussianGraph {
 public:
  // A Gaussian of which more than this hangs before surfaces is a floater (LiftedSurfaces).
  static constexpr float kFloating = 0.5f;

  // Every Gaussian and its 16 nearest by position. An edge's weight falls with the difference of
  // the colors without view dependence (OKLab) and with the distance in units of the two extents.
  // If both are flat, it also falls with the angle between them. `within`: only Gaussians whose
  // means lie in that box are nodes. `lifted` of every Gaussian; empty: unknown. OptionError where
  // it is of another number. Cancelled between its steps.
  GaussianGraph(const GaussianModel& model, Monitor& monitor,
                std::optional<Eigen::AlignedBox3f> within = std::nullopt,
                LiftedSurfaces lifted = {});

  size_t NumGaussians() const { return num_gaussians_; }  // of the scene
  size_t NumNodes() const { return surfaces_.size(); }
  // The Gaussian that node `i` is. Neighbors in space are so in memory, too (scene/morton.h).
  size_t GaussianOf(size_t i) const { return size_t(members_[i]); }
  const std::vector<GaussianSurface>& surfaces() const { return surfaces_; }
  const EdgeMatrix& edges() const { return edges_; }  // weights in (0, 1]
  // The edges in the memory of `backend`, which outlives this; it stays there from the first call
  // on, for as long as this backend is asked for. Thread-safe.
  DeviceEdges OnDevice(Backend& backend) const;
  // Of every Gaussian of the scene, [N] (LiftedSurfaces); empty: unknown.
  const std::vector<float>& floating() const { return floating_; }
  // Whether Gaussian `g` hangs before the surfaces: it is a floater and no piece of any.
  bool Floats(size_t g) const { return !floating_.empty() && floating_[g] > kFloating; }
  // Whether the graph holds all that one within `box` (nullopt: of the whole scene) would.
  bool Covers(const std::optional<Eigen::AlignedBox3f>& box) const;

 private:
  size_t num_gaussians_;
  std::optional<Eigen::AlignedBox3f> within_;
  std::vector<int> members_;  // of the nodes
  std::vector<float> floating_;
  std::vector<GaussianSurface> surfaces_;
  EdgeMatrix edges_;
  mutable std::mutex mutex_;  // of the two arrays below
  mutable const Backend* device_ = nullptr;
  mutable DeviceEdges on_device_;
};

// The region in which a thing that is seen at `points` may go on, if it is seen from one side. It
// is their box without the outermost hundredth at each of its sides, grown by twice its diagonal.
Eigen::AlignedBox3f Surroundings(const std::vector<Eigen::Vector3f>& points);

}  // namespace retint
