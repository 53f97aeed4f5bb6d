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
  float valley = 0;  // in [0, 1]: how surely it lies in a crease between two things; 0 if unknown
};

// Made once for a scene, or once for each part of a large one. Memory: about 450 bytes a node, and
// 900 while it is made.
class GaussianGraph {
 public:
  // A Gaussian is a floater if more than this part of it hangs before surfaces (LiftedSurfaces).
  static constexpr float kFloating = 0.5f;

  // Joins each Gaussian with its 16 nearest. An edge weighs less, the more the colors without view
  // dependence differ (OKLab), and the longer it is in units of the two extents. Between two flat
  // Gaussians it also weighs less, the larger their angle is. `within`: only Gaussians with their
  // means in this box are nodes. `lifted` is of every Gaussian; empty: unknown. OptionError if its
  // size differs. Cancelled between its steps.
  GaussianGraph(const GaussianModel& model, Monitor& monitor,
                std::optional<Eigen::AlignedBox3f> within = std::nullopt,
                LiftedSurfaces lifted = {});

  size_t NumGaussians() const { return num_gaussians_; }  // of the scene
  size_t NumNodes() const { return surfaces_.size(); }
  // The Gaussian of node `i`. Neighbors in space are also neighbors in memory (scene/morton.h).
  size_t GaussianOf(size_t i) const { return size_t(members_[i]); }
  const std::vector<GaussianSurface>& surfaces() const { return surfaces_; }
  const EdgeMatrix& edges() const { return edges_; }  // weights in (0, 1]
  // The edges in the memory of `backend`, which must outlive this graph. The first call uploads
  // them, and a call with another backend replaces them. Thread-safe.
  DeviceEdges OnDevice(Backend& backend) const;
  // Of every Gaussian of the scene, [N] (LiftedSurfaces); empty: unknown.
  const std::vector<float>& floating() const { return floating_; }
  // Whether Gaussian `g` is a floater: it hangs before the surfaces and is not part of one.
  bool Floats(size_t g) const { return !floating_.empty() && floating_[g] > kFloating; }
  // Whether this has all nodes of a graph within `box` (nullopt: of the whole scene).
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

// The box in which the rest of an object may lie if `points` are its visible side. The box of the
// points without the outermost 1 % at each side, grown by twice its diagonal.
Eigen::AlignedBox3f Surroundings(const std::vector<Eigen::Vector3f>& points);

}  // namespace retint
