// SPDX-License-Identifier: BSD-3-Clause
// Internal to splat_io: SplatTraits in the comments of files.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "scene/gaussian_model.h"

namespace retint {

// Reads comments of a .ply: brush's "SplatRenderMode: mip", Postshot's "antialiased 1", and
// "ColorSpace lin_rec709_display". The last of several counts. Notes unknown names.
void ReadTags(GaussianModel& model);
// The model's comments. Tags that contradict its traits are replaced, other bytes do not change.
std::vector<std::string> TaggedComments(const GaussianModel& model);

// Adds a sentence to the notes if renders differ from the splat's training.
void NoteRenderModel(GaussianModel& model);

// Formats with comments can name all of these.
inline constexpr std::array kAllRenderModels = {RenderModel::kMip, RenderModel::k2dgs,
                                                RenderModel::k3dgut};
inline constexpr std::array kAllColorSpaces = {ColorSpace::kLinearDisplay, ColorSpace::kSrgbScene,
                                               ColorSpace::kLinearScene};

}  // namespace retint
