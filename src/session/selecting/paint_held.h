// SPDX-License-Identifier: BSD-3-Clause
// Whether a selection holds what was painted.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "scene/image.h"
#include "selection/mask_projector.h"

namespace retint {

struct Workspace;

// A line for each view that is painted, or that shows a photo that is, whose mask among `masks`
// holds less than half of its paint: where depth is wrong there, or what is painted is no surface.
// Views without a mask say nothing.
std::vector<std::string> WarningsOfPaint(const Workspace& workspace,
                                         const std::vector<PaintedView>& painted,
                                         const std::map<std::string, Mask>& masks);

}  // namespace retint
