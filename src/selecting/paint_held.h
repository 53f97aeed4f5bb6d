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

// A line for each view that is painted, or that shows a photo that is, whose mask among `masks`
// holds less than half of its paint: where depth is wrong there, or what is painted is no surface.
// Views without a mask say nothing.
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
