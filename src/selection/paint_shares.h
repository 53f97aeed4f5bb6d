// SPDX-License-Identifier: BSD-3-Clause
// The shares of Gaussians from the paint on one view only, at the speed of a brush: without depth,
// cloud, registration, the other views and completion. A look ahead at the result of
// ProjectMasks().
#pragma once

#include <span>
#include <vector>

#include "render/renderer.h"
#include "scene/image.h"
#include "scene/reconstruction.h"

namespace retint {

// m_g = (W^T M + d b_g) / (W^T 1 + d) of each Gaussian g, [N], where W blends the painted view, M
// is the paint in [0, 1], `base` b [N] the selection before (empty: nothing) and d a tenth of what
// a Gaussian that the view sees has on average: what it hardly shows, such as what lies hidden
// behind the surface, stays as it was. OptionError where `base` or `mask` has another size.
std::vector<float> PaintShares(Renderer& renderer, const PosedCamera& view, const Mask& mask,
                               std::span<const float> base);

}  // namespace retint
