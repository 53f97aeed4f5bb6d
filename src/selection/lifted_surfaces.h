// SPDX-License-Identifier: BSD-3-Clause
// Two measures of every Gaussian over the views of a scene. Does it lie in a crease between two
// things? How much of it floats in the air before the surfaces?
#pragma once

#include <vector>

#include "base/monitor.h"
#include "render/renderer.h"
#include "scene/gaussian_model.h"
#include "scene/reconstruction.h"

namespace retint {

// [N] each, in [0, 1]; 0 of a Gaussian that no view sees.
struct LiftedSurfaces {
  std::vector<float> valleys;
  std::vector<float> floating;
};

// For each Gaussian g of `model`, which is the renderer's model; W_v blends view v.
//
// Crease: valley_g = sum_v W_v^T V_v / sum_v W_v^T 1, where V_v are the creases of the depth of v
// (mask_tools/surface_edges.h). A crease between two things shows in every view that sees it. An
// occluding edge shows as one too, but on another surface behind it in every view. So its mean over
// the views is small.
//
// Floating: the part of g's visible weight that hangs before surfaces. D_v is the depth at which
// 0.3 of a pixel's light is left, h_v is 1 in pixels that have one, and d = ln(D_v / z_g). Mean and
// mean square of d are weighted by W_v h_v. If g itself is the surface (d = 0) for a part q of the
// weight, mean(d)^2 / mean(d^2) <= 1 - q (Cauchy-Schwarz). Hence, with s_gv = 0 if mean(d) < 0,
//   s_gv = mean(d)^2 / (mean(d^2) + 0.03^2),
//   floating_g = sum_v (W_v^T h_v) s_gv / sum_v W_v^T h_v.
// Edges of surfaces have small values, floaters before them values near 1.
//
// Renders at most 24 of `views`, spread evenly, at 100,000 pixels or fewer. Cancelled between
// views.
LiftedSurfaces LiftSurfaces(Renderer& renderer, const GaussianModel& model,
                            const Reconstruction& reconstruction,
                            const std::vector<const View*>& views, Monitor& monitor);

}  // namespace retint
