// SPDX-License-Identifier: BSD-3-Clause
// The shares of Gaussians from the paint on one view only, at the speed of a brush. A
// preview of ProjectMasks(), without depth, cloud, registration, other views and
// completion.
#pragma once

#include <span>
#include <vector>

#include "render/renderer.h"
#include "scene/image.h"
#include "scene/reconstruction.h"

namespace retint {

// m_g = (W^T M + d b_g) / (W^T 1 + d) of each Gaussian g, [N]. W blends the painted view, and M is
// the paint in [0, 1]. The selection before is b, `base`, [N]; empty: nothing. A tenth of the mean
// W^T 1 of visible Gaussians is d. Faint Gaussians, such as hidden ones behind the surface,
// therefore keep b_g. OptionError if `base` or `mask` has another size.
std::vector<float> PaintShares(Renderer& renderer, const PosedCamera& view, const Mask& mask,
                               std::span<const float> base);

}  // namespace retint
