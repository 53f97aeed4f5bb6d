// SPDX-License-Identifier: BSD-3-Clause
// Zoom and pan of an image in a widget: widget = scale * image + offset, both continuous.
#pragma once

#include <algorithm>

#include <Eigen/Core>

namespace retint {

struct ImageTransform {
  double scale = 1;
  Eigen::Vector2d offset = Eigen::Vector2d::Zero();

  Eigen::Vector2d ToWidget(const Eigen::Vector2d& image) const { return scale * image + offset; }
  Eigen::Vector2d ToImage(const Eigen::Vector2d& widget) const { return (widget - offset) / scale; }

  // Centered, and as large as possible.
  static ImageTransform Fit(const Eigen::Vector2d& image, const Eigen::Vector2d& widget) {
    ImageTransform fit;
    fit.scale = std::max(1e-3, (widget.array() / image.array().max(1)).minCoeff());
    fit.offset = (widget - fit.scale * image) / 2;
    return fit;
  }

  // Keeps the point at `at` (widget) in place.
  void ZoomAt(const Eigen::Vector2d& at, double new_scale) {
    const Eigen::Vector2d fixed = ToImage(at);
    scale = new_scale;
    offset = at - scale * fixed;
  }

  // Keeps the image in sight: at least `margin` of it (widget pixels) stays in the widget.
  void KeepVisible(const Eigen::Vector2d& image, const Eigen::Vector2d& widget, double margin) {
    for (int i = 0; i < 2; ++i) {
      const double size = scale * image[i], keep = std::min({margin, size, widget[i]});
      offset[i] = std::clamp(offset[i], keep - size, widget[i] - keep);
    }
  }
};

}  // namespace retint
