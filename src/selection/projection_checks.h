// SPDX-License-Identifier: BSD-3-Clause
// Internal to selection: checks of the arguments of a projection, and whether its result is empty.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "selection/mask_projector.h"

namespace retint {

// InputError as ProjectMasks() documents.
void CheckProjection(const SelectionCloud& cloud, const std::vector<PaintedView>& painted,
                     const std::vector<const View*>& views);

// Whether a mask of a painted view holds a pixel of its paint; true if there is none to compare.
bool HoldsPaint(const std::vector<PaintedView>& painted, const ProjectedMasks& projected);

// Whether a fit would change any. A thin stroke may cover less than half of each large Gaussian.
bool HoldsGaussians(const std::vector<float>& shares);

// The mean fraction that the masks cover, over the views. InputError if they hold no pixel.
double MeanCoverage(const std::map<std::string, Mask>& of_views);

}  // namespace retint
