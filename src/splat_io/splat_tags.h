// SPDX-License-Identifier: BSD-3-Clause
// Internal to splat_io: what files say of SplatTraits.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "scene/gaussian_model.h"

namespace retint {

// Comments of a .ply: brush's "SplatRenderMode: mip", Postshot's "antialiased 1", and
// "ColorSpace lin_rec709_display". The last of several counts. Unknown names are noted.
void ReadTags(GaussianModel& model);
// The model's comments. Tags that contradict its traits are replaced, the rest keeps its bytes.
std::vector<std::string> TaggedComments(const GaussianModel& model);

// Adds a sentence to the notes if renders are not as the splat was trained.
void NoteRenderModel(GaussianModel& model);

// Of formats with comments.
inline constexpr std::array kAllRenderModels = {RenderModel::kMip, RenderModel::k2dgs,
                                                RenderModel::k3dgut};
inline constexpr std::array kAllColorSpaces = {ColorSpace::kLinearDisplay, ColorSpace::kSrgbScene,
                                               ColorSpace::kLinearScene};

}  // namespace retint
