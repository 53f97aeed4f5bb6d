// SPDX-License-Identifier: BSD-3-Clause
// Internal to selection: what a projection needs, and whether it holds anything.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "selection/mask_projector.h"

namespace retint {

// InputError as ProjectMasks() says.
void CheckProjection(const SelectionCloud& cloud, const std::vector<PaintedView>& painted,
                     const std::vector<const View*>& views);

// Whether a mask of a painted view holds a pixel of its paint; true where there is none to compare.
bool HoldsPaint(const std::vector<PaintedView>& painted, const ProjectedMasks& projected);

// Whether a fit would change any. A thin stroke may take less than half of each large Gaussian.
bool HoldsGaussians(const std::vector<float>& shares);

// The mean over views of the share that the masks cover. InputError if they hold no pixel.
double MeanCoverage(const std::map<std::string, Mask>& of_views);

}  // namespace retint
