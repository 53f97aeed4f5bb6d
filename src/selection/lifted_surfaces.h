// SPDX-License-Identifier: BSD-3-Clause
// Two measures of every Gaussian from the views of a scene: whether one thing ends there before
// another, and how far it hangs in the air before the surfaces.
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

// Of each Gaussian g of `model`, which is the renderer's, over views v, where W_v blends view v:
//
// valley_g = sum_v W_v^T V_v / sum_v W_v^T 1, V_v the valleys of its depth
// (mask_tools/surface_edges.h). A crease between two things is a valley in every view that sees it.
// The edge of a thing before another shows as one too, but on other surfaces behind it in every
// view, so that the mean over the views is small there.
//
// floating_g, the part of its visible weight that hangs before surfaces. Let D_v be the depth at
// which three tenths of a pixel's light are left, h_v 1 in pixels that have it, d = ln(D_v / z_g),
// and mean and mean square of d be weighted by W_v h_v. A part q of the weight at which g itself is
// the surface (d = 0) leaves mean(d)^2 / mean(d^2) <= 1 - q (Cauchy-Schwarz), so that with s_gv =
// mean(d)^2 / (mean(d^2) + 0.03^2), 0 where mean(d) < 0,
//   floating_g = sum_v (W_v^T h_v) s_gv / sum_v W_v^T h_v.
// Edges of surfaces have small values, floaters before them values near 1.
//
// Views are rendered at 100,000 pixels at most; of many `views` two dozen are taken, spread evenly.
// Cancelled between views.
LiftedSurfaces LiftSurfaces(Renderer& renderer, const GaussianModel& model,
                            const Reconstruction& reconstruction,
                            const std::vector<const View*>& views, Monitor& monitor);

}  // namespace retint
