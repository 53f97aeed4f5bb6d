// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <utility>

#include "editing/edit_session.h"
#include "tests/selection/tiny_gaussians.h"

namespace retint {

// The world's cameras and Gaussians as a session without files.
inline std::unique_ptr<EditSession> TinySession(const TinyWorld& world) {
  Workspace workspace;
  workspace.root = "tiny";
  workspace.reconstruction = world.reconstruction;
  SessionOptions options;
  options.backend = "cpu";
  return std::make_unique<EditSession>(std::move(workspace), TinyGaussians(world).model, options);
}

}  // namespace retint
