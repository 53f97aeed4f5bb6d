// SPDX-License-Identifier: BSD-3-Clause
// Sparse points of a synthetic world, as structure from motion would leave them: on corners of the
// texture, tracked through the views that see them, triangulated from noisy observations. Internal
// to the synthetic scenes.
#pragma once

#include <vector>

#include "synthetic/views.h"

namespace retint::synthetic {

// Adds points, their tracks and the views' observations; the views (ids from 1, in the order of
// `views`) and cameras are there already.
void AddSparsePoints(const World& world, const std::vector<TracedView>& views,
                     const SyntheticOptions& options, Reconstruction* reconstruction);

}  // namespace retint::synthetic
