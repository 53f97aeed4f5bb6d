// SPDX-License-Identifier: BSD-3-Clause
// The tiny cloud of the refit's tests, as a session without files.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "editing/edit_session.h"
#include "tests/recolor/tiny_scene.h"

namespace retint {

inline std::string ViewName(size_t v) { return "view" + std::to_string(v); }

inline Workspace MakeWorkspace(const TinyScene& scene) {
  Workspace workspace;
  workspace.root = "tiny";
  for (size_t v = 0; v < scene.cameras.size(); ++v) {
    const auto id = static_cast<uint32_t>(v + 1);
    workspace.reconstruction.cameras[1] = scene.cameras[v].camera;
    View view;
    view.id = id;
    view.name = ViewName(v);
    view.camera_id = 1;
    view.cam_from_world = scene.cameras[v].cam_from_world;
    workspace.reconstruction.views[id] = view;
  }
  return workspace;
}

inline std::map<std::string, Mask> MasksOf(const TinyScene& scene) {
  std::map<std::string, Mask> masks;
  for (size_t v = 0; v < scene.masks.size(); ++v) masks[ViewName(v)] = scene.masks[v];
  return masks;
}

// The rest of the picture: the complement of MasksOf.
inline std::map<std::string, Mask> OtherMasksOf(const TinyScene& scene) {
  auto masks = MasksOf(scene);
  for (auto& [name, mask] : masks) {
    for (uint8_t& value : mask.data) value = static_cast<uint8_t>(255 - value);
  }
  return masks;
}

inline std::unique_ptr<EditSession> MakeSession(const TinyScene& scene,
                                                SessionOptions options = {}) {
  options.backend = "cpu";
  return std::make_unique<EditSession>(MakeWorkspace(scene), scene.model, options);
}

}  // namespace retint
