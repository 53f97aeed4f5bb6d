// SPDX-License-Identifier: BSD-3-Clause
// The sides of an object that no painted view sees: decided over a graph of the Gaussians.
//
// Paint is evidence of the surfaces that painted views see. Gaussians that they do not see are not
// outside but unknown, and follow from the known ones in two ways. Neighbors of one color belong
// together (random walker, Grady 2006), and the colors inside and outside the paint differ (a
// Gaussian mixture of each, as in GrabCut, Rother et al. 2004). The share x of every Gaussian
// minimizes
//   sum_edges kSmoothness w_ij (x_i - x_j)^2 + sum_g trust_g (x_g - m_g)^2 + (x_g - p_g)^2,
// w_ij the edge's weight, less where p_i and p_j differ and by exp(-kValley v) where one of the two
// lies in a valley of the surface, v how surely: things of one color end where they touch.
// m_g the share that the evidence gives, trust_g larger the more of the Gaussian's visibility the
// painted views cover, p_g the probability of "inside" by color. A Gaussian of which half or more
// of the visibility is known keeps m_g; below that x_g takes over in proportion. So does one of
// which the painted views see a quarter or more of what a view sees that sees it: where a surface
// lets light through, its depth differs from view to view, and little of it is found again.
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

// Of one Gaussian, sums over the views: W^T (K M) and W^T K of the evidence, where nothing is known
// K = 0; W^T K where a painted view's pixels count as those of all others do, and that of pixels of
// the painted views that are surely painted or not; W^T 1, and its square. All in pixels.
struct ShareEvidence {
  std::span<const float> inside, known, seen, painted, visible, visible_squared;  // [N] each
};

struct CompletedShares {
  std::vector<float> shares;  // m_g in [0, 1], [N]
  // In [0, 1], [N]: 1 where paint decides the share. A Gaussian that paint did not see has less the
  // closer x_g is to one half, and at most 0.75 if it is taken to be inside.
  std::vector<float> confidence;
};

// Where the paint leaves too little inside or outside to learn colors from, what is unknown counts
// as outside; so does what is no node of `graph`. Solved on `backend` where it can; null: on the
// host.
CompletedShares CompleteShares(const GaussianGraph& graph, const ShareEvidence& evidence,
                               Completion completion, Monitor& monitor, Backend* backend = nullptr);

}  // namespace retint
