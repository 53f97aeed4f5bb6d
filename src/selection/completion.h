// SPDX-License-Identifier: BSD-3-Clause
// Completion: whether Gaussians that no painted view sees belong to the selection.
//
// Paint is evidence only of surfaces that a painted view sees. All other Gaussians are unknown, and
// two rules decide them. Neighbors of one color belong together (random walker, Grady 2006). Inside
// and outside have different colors (a Gaussian mixture each, as in GrabCut, Rother et al. 2004).
// The share x_g of each Gaussian, 1 if it is selected, minimizes
//   sum_edges kSmoothness w_ij (x_i - x_j)^2 + sum_g trust_g (x_g - m_g)^2 + (x_g - p_g)^2.
// The evidence gives m_g. Its trust_g grows with the part of the Gaussian's visibility that painted
// views cover. The color gives p_g, the probability of "inside". An edge has the weight w_ij, less
// if p_i and p_j differ. A crease between two things (mask_tools/surface_edges.h) multiplies it by
// exp(-kValley v), because things of one color end where they touch; v is how sure the crease is.
//
// If at least half of its visibility is known, a Gaussian keeps m_g. Below that, x_g takes over in
// proportion. It also keeps m_g if painted views cover at least a quarter of its mean visibility in
// a view. Lookups often miss a translucent surface, because its depth differs between views.
#pragma once

#include <span>
#include <vector>

#include "base/monitor.h"
#include "kernels/backend.h"
#include "selection/gaussian_graph.h"

namespace retint {

enum class Completion {
  kOff,   // parts that no painted view sees count against the selection (unknown_weight)
  kNear,  // completed if connected to the painted part, and within five times its radius
  kAll,   // also other things that look the same
};

// Of one Gaussian, sums in pixels over the views, which W blends. `inside` is W^T (K M), `known` is
// W^T K; K = 0 in unknown pixels. For `seen`, painted views count as all others. `painted` is W^T 1
// of the surely decided pixels of painted views. `visible` is W^T 1, beside its square.
struct ShareEvidence {
  std::span<const float> inside, known, seen, painted, visible, visible_squared;  // [N] each
};

struct CompletedShares {
  std::vector<float> shares;  // m_g in [0, 1], [N]
  // In [0, 1], [N]: 1 if paint decides the share. A Gaussian that paint did not see has less, the
  // closer x_g is to one half, and at most 0.75 if it is taken to be inside.
  std::vector<float> confidence;
};

// Unknown Gaussians count as outside if there is too little paint inside or outside to learn colors
// from. So do Gaussians that are not nodes of `graph`. Solved on `backend` if it can solve graphs;
// null: on the host.
CompletedShares CompleteShares(const GaussianGraph& graph, const ShareEvidence& evidence,
                               Completion completion, Monitor& monitor, Backend* backend = nullptr);

}  // namespace retint
