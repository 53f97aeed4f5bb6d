// SPDX-License-Identifier: BSD-3-Clause
// Refit of the spherical harmonics of the active Gaussians to edited views. Geometry never changes.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "recolor/color_edit.h"
#include "render/renderer.h"
#include "scene/image.h"
#include "scene/reconstruction.h"

namespace retint {

enum class Solver { kMm, kAdam };
// How mm's sweeps are sped up; kNone is the plain majoriser, one unit step a sweep.
enum class MmAcceleration { kNone, kNesterov, kLbfgs };

struct RefitOptions {
  Solver solver = Solver::kMm;
  int iterations = 0;  // sweeps (mm, default 12) or steps (adam, default 3000); 0 takes the default
  bool closed_form_start = true;  // mm always starts there
  MmAcceleration acceleration = MmAcceleration::kLbfgs;
  double learning_rate = 2.5e-4;  // adam
  double lambda_dssim = 0.2;      // adam: weight of D-SSIM in the loss
  double ridge_dc = 1e-2;       // mm: lambda_l of the DC term, relative to the sum of visibilities
  double ridge_rest = 1e-3;     // mm: of the higher bands, pulling towards the closed-form start
  double outside_weight = 0.8;  // mm: weight of a pixel's squared error at mask 0; 1 at mask 255
  double active_threshold = 5e-2;  // m_g above which a Gaussian is active
  double min_weight = 1e-3;        // mm: blending weights below are left out of the regions
  double tolerance = 3e-3;  // mm: stop when a sweep gains less than this share of the first loss
  uint64_t seed = 0;        // adam: order of the cameras
  size_t region_cache_bytes = size_t{1000} << 20;  // of weights and targets, all views together
  void Check() const;
};

struct RefitTarget {
  std::string name;
  PosedCamera camera;
  const Mask* mask = nullptr;    // soft, the view's size
  const Image* photo = nullptr;  // target photo; null: the render of the original scene
};

struct RefitSummary {
  std::string solver;
  int iterations = 0;
  int64_t active_gaussians = 0, changed_gaussians = 0;
  int views = 0, views_kept = 0;  // that see an active Gaussian; of these, kept in the region cache
  size_t region_bytes = 0;        // of the region cache
  double region_fraction = 0;     // of those views' pixels that lie in a region
  bool converged = false;
  std::vector<double> losses;  // one a sweep, or a running mean every 50 steps
  std::string reason;
  std::string BriefReport() const;
};

// Owns a working copy of the active coefficients; the model's others are never touched.
class ShRefitter {
 public:
  // `shares` is m_g, [N]; empty: computed from the masks as sum_v W^T M / sum_v W^T 1.
  // `model` are the original coefficients that the edit starts from; the renderer is given them and
  // must keep them. Both, and the targets' masks and photos, must outlive the refitter.
  ShRefitter(Renderer& renderer, const GaussianModel& model, std::vector<RefitTarget> targets,
             const ColorEdit& edit, std::vector<float> shares, const RefitOptions& options,
             Monitor& monitor);
  ~ShRefitter();

  bool Step(Monitor& monitor);  // one sweep or step; false when converged or out of iterations
  RefitSummary Run(Monitor& monitor);
  RefitSummary Summary() const;

  // The whole model's coefficients [N, K, 3] with the active ones replaced. Inactive ones bit for
  // bit.
  std::vector<float> Sh() const;
  std::span<const int32_t> active() const;  // indices of the active Gaussians, ascending

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// The instant preview: C <- C (1 + m (t - 1)) and the DC term's 0.5 offset, for each Gaussian of
// share m. [N, K, 3].
std::vector<float> ClosedFormSh(const GaussianModel& model, std::span<const float> shares,
                                const ColorEdit& edit, double active_threshold = 5e-2);

// m_g = sum_v W^T M_v / sum_v W^T 1, [N].
std::vector<float> MaskShares(Renderer& renderer, const std::vector<RefitTarget>& targets,
                              Monitor& monitor);

}  // namespace retint
