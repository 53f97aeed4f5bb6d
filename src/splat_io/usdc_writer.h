// SPDX-License-Identifier: BSD-3-Clause
// Writes a stage with one prim of Gaussians as a crate.
#pragma once

#include <functional>
#include <string_view>

#include "base/monitor.h"
#include "scene/gaussian_model.h"

namespace retint {

// Writes the stage of WriteUsda() in pieces, in version 0.8, which every OpenUSD with the schema
// reads. Arrays are not compressed, so that edits can change them in place.
void WriteUsdc(const GaussianModel& model, Monitor& monitor,
               const std::function<void(std::string_view)>& write);

}  // namespace retint
