// SPDX-License-Identifier: BSD-3-Clause
// Where one thing ends before another, of every Gaussian: what single views show, lifted.
#pragma once

#include <vector>

#include "base/monitor.h"
#include "render/renderer.h"
#include "scene/reconstruction.h"

namespace retint {

// v_g = sum_v W_v^T V_v / sum_v W_v^T 1 of each Gaussian g, [N], where W_v blends view v and V_v
// has the valleys of its depth (mask_tools/surface_edges.h), at 100,000 pixels at most. A crease
// between two things is a valley in every view that sees it. The edge of a thing before another
// shows as one too, but on other surfaces behind it in every view, so that the mean over the views
// is small there. 0 of a Gaussian that no view sees. Of many `views` two dozen are taken, spread
// evenly. Cancelled between views.
std::vector<float> LiftValleys(Renderer& renderer, const Reconstruction& reconstruction,
                               const std::vector<const View*>& views, Monitor& monitor);

}  // namespace retint
