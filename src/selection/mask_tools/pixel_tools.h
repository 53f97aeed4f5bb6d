// SPDX-License-Identifier: BSD-3-Clause
// Tools that decide pixel by pixel: magic wand, like a color, within a sphere or a box.
#pragma once

#include <array>

#include <Eigen/Core>

#include "selection/mask_tools/view_layers.h"

namespace retint {

struct WandOptions {
  int x = 0, y = 0;     // where it is held, pixels
  double color = 0.08;  // OKLab distance to the color there
  double depth = 0.02;  // relative step in depth from one pixel to the next
  double normal = 90;   // degrees between the surface and the one there
};

// The connected pixels (of four) that are like the one the wand is held at: of its color (the mean
// of the 3 x 3 about it), on a surface without a step, which faces nearly the same way. Pixels
// without depth are judged only by their color. OptionError for a pixel outside the view and a
// tolerance below 0.
Mask MagicWand(const ViewLayers& layers, const WandOptions& options);

// Pixels whose color is at most `tolerance` from `rgb` in OKLab.
Mask LikeColor(const ViewLayers& layers, const std::array<float, 3>& rgb, double tolerance);
// The mean color of the 3 x 3 pixels about (x, y).
std::array<float, 3> ColorAt(const ViewLayers& layers, int x, int y);

// Pixels whose surface lies in a sphere or in a box along the world's axes, both in the world. A
// pixel without depth does not.
Mask InSphere(const ViewLayers& layers, const Eigen::Vector3d& center, double radius);
Mask InBox(const ViewLayers& layers, const Eigen::Vector3d& min, const Eigen::Vector3d& max);

// The lesser of both, pixel by pixel; they have one size.
Mask Intersection(const Mask& a, const Mask& b);

}  // namespace retint
