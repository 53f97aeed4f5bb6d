// SPDX-License-Identifier: BSD-3-Clause
// Gaussians of a synthetic world: flat discs on every surface that a view sees, as small as the
// texture there demands. Internal to the synthetic scenes.
#pragma once

#include <vector>

#include "synthetic/views.h"

namespace retint::synthetic {

GaussianModel MakeGaussians(const World& world, const Lighting& lighting,
                            const std::vector<TracedView>& views, const SyntheticOptions& options,
                            Monitor& monitor);

}  // namespace retint::synthetic
