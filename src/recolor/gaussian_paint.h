// SPDX-License-Identifier: BSD-3-Clause
// Paint on pictures of some views, as each Gaussian takes it by itself: the look of an edit with
// paint before any fit, and the start of its fit. PaintCarrier has the targets of the views.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "recolor/painted_edit.h"
#include "recolor/picture_edit.h"
#include "render/renderer.h"
#include "scene/camera.h"
#include "scene/gaussian_model.h"

namespace retint {

struct PaintedGaussian {
  int32_t index = 0;      // in the model
  Eigen::Vector3f color;  // that was painted on it, display-encoded
  float alpha = 0;        // the covered part of its visible weight
  Eigen::Vector3f seen;   // unit vector from the painted view to the Gaussian, world axes
};

// Depends on the layers and on the scene's geometry alone, so that nothing else in an edit makes it
// necessary to find it again.
struct GaussianPaint {
  std::shared_ptr<const PictureEdit> of;   // whose layers
  std::vector<PaintedGaussian> gaussians;  // ascending
  bool IsOf(const PictureEdit& picture) const;
  size_t Bytes() const { return gaussians.size() * sizeof(PaintedGaussian); }
};

// Of the layers of `picture`; `cameras` are of their views, in their order, else OptionError. With
// the weights W of a painted view, a Gaussian takes the mean W^T (alpha color) / W^T alpha and is
// covered by W^T alpha / W^T 1. One that is nearly hidden there takes nothing. If several views
// paint one, each counts as W^T alpha, so that the view that sees it more squarely counts more.
// Renders nothing: the renderer, of `model`, may show any colors.
GaussianPaint FindGaussianPaint(Renderer& renderer, const GaussianModel& model,
                                std::shared_ptr<const PictureEdit> picture,
                                const std::vector<PosedCamera>& cameras);

// The change by paint beyond the rest of the edit, as changes of coefficients. A color takes the
// paint times the ratio of its luminance to the one that the Gaussian has in the painted view, so
// that highlights move with the viewer.
class PaintChange {
 public:
  // `sh` [.., K, 3], K = num_coeffs, as it is before the edit, and one share for each of its
  // blocks; those not above the threshold do not change. The blocks are those of `gaussians`,
  // ascending; empty: of all. Nothing changes where `paint` is null or of other layers.
  PaintChange(std::span<const float> sh, int num_coeffs, std::span<const float> shares,
              const ColorEdit& edit, const GaussianPaint* paint, double active_threshold,
              std::span<const int32_t> gaussians = {});

  // To the same blocks, with the rest of the edit or without.
  void AddTo(std::span<float> sh) const;

 private:
  size_t block_;                // K * 3
  std::vector<size_t> at_;      // the blocks that change
  std::vector<float> changes_;  // [at_, K, 3]
};

}  // namespace retint
