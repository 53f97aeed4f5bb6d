// SPDX-License-Identifier: BSD-3-Clause
// Objects in another color: the truth that recoloring is measured against. Internal to the
// synthetic scenes.
#pragma once

#include <vector>

#include "scene/camera.h"
#include "scene/image.h"
#include "synthetic/world.h"

namespace retint::synthetic {

// Paints an object of `world`: where its surface had the mean luminance of what `cameras` see of
// it, it gets `albedo` (linear RGB); a pattern stays, as lighter and darker shades. Light that was
// baked before, gloss and shape stay as they are, so nothing else in a picture changes.
void Repaint(World& world, int object, const Vec3& albedo, const std::vector<PosedCamera>& cameras);

// Pastes a picture (display-encoded) on every chart of the object's first part, its body: u runs to
// the right, v down.
void Paste(World& world, int object, const Image8& picture);

}  // namespace retint::synthetic
