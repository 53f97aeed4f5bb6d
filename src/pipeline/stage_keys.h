// SPDX-License-Identifier: BSD-3-Clause
// Internal to pipeline: the parts of a stage's key (base/stage_cache.h). Whatever changes a stage's
// result must change its key.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "base/stage_cache.h"
#include "opening/open_scene.h"
#include "recolor/color_edit.h"
#include "scene/image.h"
#include "selecting/select_options.h"

namespace retint {

// Of the splat's bytes, the cameras, poses and points, the program's version and the backend.
std::string SceneKey(const OpenScene& scene);

// InputError for a file that cannot be read.
void AddMasks(StageKey& key, const std::map<std::string, Mask>& masks);
// The network that matches, if one does. Of a program, no more than its command is known.
void AddNetwork(StageKey& key, const SelectOptions& options);
void AddFile(StageKey& key, const std::filesystem::path& file);
// The files that the edit compares with views of the workspace.
void AddPictures(StageKey& key, const ColorEdit& edit, const Workspace& workspace);

}  // namespace retint
