// SPDX-License-Identifier: BSD-3-Clause
// Refit of the spherical harmonics of the active Gaussians to edited views. Geometry never changes.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "recolor/color_edit.h"
#include "recolor/gaussian_paint.h"
#include "recolor/refit_options.h"
#include "render/renderer.h"
#include "render/view_reducer.h"
#include "scene/gaussian_model.h"
#include "scene/image.h"
#include "scene/reconstruction.h"

namespace retint {

struct RefitTarget {
  std::string name;
  PosedCamera camera;
  const Mask* mask = nullptr;  // soft, the view's size
  // The target photo, wherever it is; empty: the render of the original scene is the target. If the
  // renderer has a background, photos, and the pictures that `edited` makes, show it between the
  // Gaussians.
  std::function<std::shared_ptr<const Image>()> photo = nullptr;
  // Makes the target itself, if that is more than a map of the colors of render or photo
  // (PaintCarrier). It has the view's size; the renderer shows the original scene. `leaves`, if not
  // null, gets 255 in pixels whose edited color, before it is brought into the range, cannot be
  // shown on a screen.
  std::function<Image(Renderer&, Mask* leaves)> edited = nullptr;
};

// Shares targets so that each process prepares and evaluates masks of about the same area. Only the
// owner needs a target's photo.
ViewReducer ShareTargets(Backend& backend, const std::vector<RefitTarget>& targets);

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
  // must keep them. Both, and the targets' masks and photos, must outlive the refitter. With
  // `paint`, the edit's on each Gaussian, the fit starts from that too.
  ShRefitter(Renderer& renderer, const GaussianModel& model, std::vector<RefitTarget> targets,
             const ColorEdit& edit, std::vector<float> shares, const RefitOptions& options,
             Monitor& monitor, const GaussianPaint* paint = nullptr);
  ~ShRefitter();

  // One sweep or step; false when converged or out of iterations. InputError, which names the
  // Gaussian of the largest coefficient, if the loss is not finite or beyond 1e12.
  bool Step(Monitor& monitor);
  RefitSummary Run(Monitor& monitor);
  RefitSummary Summary() const;
  RefitSummary Summary(std::span<const float> active_sh) const;  // ActiveSh(), already at hand

  const std::vector<double>& losses() const;  // so far, as in the summary

  // The coefficients of the active Gaussians, [active, K, 3].
  FloatArray ActiveSh() const;
  // The whole model's, [N, K, 3], with the active ones replaced. Inactive ones bit for bit.
  FloatArray Sh() const;
  std::span<const int32_t> active() const;  // indices of the active Gaussians, ascending

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// The instant preview, without painted layers (PaintChange), of coefficients `sh` [N, K, 3] in host
// memory, K = num_coeffs. It applies ShOps::EditSh to each Gaussian of a share above the threshold,
// on `backend`. OptionError unless there is one share a Gaussian.
void ApplyClosedForm(Backend& backend, std::span<float> sh, int num_coeffs,
                     std::span<const float> shares, const ColorEdit& edit, double active_threshold);

// m_g = sum_v W^T M_v / sum_v W^T 1, [N].
std::vector<float> MaskShares(Renderer& renderer, const std::vector<RefitTarget>& targets,
                              Monitor& monitor);
// Both sums, [N, 2]: adds those of `targets` to `sums`, one after the other as MaskShares() does.
// For a splat that is opened in parts, in one process.
void AddMaskSums(Renderer& renderer, const std::vector<RefitTarget>& targets, Monitor& monitor,
                 std::vector<double>* sums);
// The share that a Gaussian's two sums stand for.
float ShareOf(const double* sums);

}  // namespace retint
