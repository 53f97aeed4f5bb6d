// SPDX-License-Identifier: BSD-3-Clause
// In words, how masks follow the paint: whether a selection holds the painted pixels, how many
// views it reaches, and how many have no mask.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "scene/image.h"
#include "selection/mask_projector.h"

namespace retint {

class Pictures;
struct Workspace;

// A line for each view, painted or showing a painted photo, whose mask among `masks` holds less
// than half of the painted pixels. Reasons are a wrong depth there, or a painted thing without a
// clear surface. Views without a mask give no line.
std::vector<std::string> WarningsOfPaint(const Workspace& workspace,
                                         const std::vector<PaintedView>& painted,
                                         const std::map<std::string, Mask>& masks);
// "all of your paint is in, carried to 38 of 50 views": the words of all painted views together
// (selecting/paint_picture.h), and how many masks hold a pixel.
std::string VerdictOfPaint(const Workspace& workspace, const std::vector<PaintedView>& painted,
                           const std::map<std::string, Mask>& masks);
// "24 of 25 views have no mask and take no part"; empty if every picture has one.
std::string WarningOfMissingMasks(size_t with_mask, const Pictures& pictures);

}  // namespace retint
