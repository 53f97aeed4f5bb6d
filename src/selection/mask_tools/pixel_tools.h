// SPDX-License-Identifier: BSD-3-Clause
// Tools that decide each pixel by itself: magic wand, similar color, inside a sphere or a box.
#pragma once

#include <array>

#include <Eigen/Core>

#include "selection/mask_tools/view_layers.h"

namespace retint {

struct WandOptions {
  int x = 0, y = 0;     // the pixel that the user clicked
  double color = 0.08;  // OKLab distance to the color there
  double depth = 0.02;  // relative step in depth from one pixel to the next
  double normal = 90;   // largest angle to the surface there, degrees
};

// The pixels that are connected (four neighbors) to the clicked one and similar to it. They have
// nearly the mean color of the 3 x 3 pixels around it and nearly its normal, and depth makes no
// step between them. Pixels without depth are judged only by color. OptionError for a pixel outside
// the view or a tolerance below 0.
Mask MagicWand(const ViewLayers& layers, const WandOptions& options);

// Pixels whose color is at most `tolerance` from `rgb` in OKLab.
Mask LikeColor(const ViewLayers& layers, const std::array<float, 3>& rgb, double tolerance);
// The mean color of the 3 x 3 pixels about (x, y).
std::array<float, 3> ColorAt(const ViewLayers& layers, int x, int y);

// Pixels whose surface lies in a sphere or an axis-aligned box of the world. Pixels without depth
// do not.
Mask InSphere(const ViewLayers& layers, const Eigen::Vector3d& center, double radius);
Mask InBox(const ViewLayers& layers, const Eigen::Vector3d& min, const Eigen::Vector3d& max);

// The minimum of both masks, pixel by pixel; they need one size.
Mask Intersection(const Mask& a, const Mask& b);

}  // namespace retint
