// SPDX-License-Identifier: BSD-3-Clause
// A stage with one prim of Gaussians, as a crate.
#pragma once

#include <functional>
#include <string_view>

#include "base/monitor.h"
#include "scene/gaussian_model.h"

namespace retint {

// The stage of WriteUsda() in version 0.8, which every OpenUSD with the schema reads, in pieces. No
// array is compressed, so that an edit can change it in its place.
void WriteUsdc(const GaussianModel& model, Monitor& monitor,
               const std::function<void(std::string_view)>& write);

}  // namespace retint
