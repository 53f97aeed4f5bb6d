// SPDX-License-Identifier: BSD-3-Clause
// How a splat was trained, and so how it is rendered.
#pragma once

#include <filesystem>
#include <optional>

#include "scene/gaussian_model.h"

namespace retint {

// Sets model.traits.render_model and its reason. The first of these that exists decides: `chosen`,
// the splat's file, or the trainer's configuration. The latter is config.yml (nerfstudio) or
// cfg.yml (gsplat) in the splat's folder, the one above, or the workspace's. Either path may be
// empty.
void ChooseRenderModel(std::optional<RenderModel> chosen, const std::filesystem::path& splat,
                       const std::filesystem::path& workspace, GaussianModel& model);

}  // namespace retint
