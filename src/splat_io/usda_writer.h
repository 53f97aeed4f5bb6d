// SPDX-License-Identifier: BSD-3-Clause
// A stage with one prim of Gaussians, as text.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "base/monitor.h"
#include "scene/gaussian_model.h"

namespace retint {

inline constexpr const char* kUsdSplatName = "Gaussians";  // of the prim that Retint writes

// Writes the text in pieces: y up, one unit a meter, the shortest digits that give the same floats.
void WriteUsda(const GaussianModel& model, Monitor& monitor,
               const std::function<void(std::string_view)>& write);

// A number, or a tuple in parentheses.
void AppendUsdaElement(std::span<const float> numbers, std::string& text);

// The smallest and largest corner of all Gaussians, to three standard deviations, right-up-back.
std::array<std::array<float, 3>, 2> UsdExtent(const GaussianModel& model);

}  // namespace retint
