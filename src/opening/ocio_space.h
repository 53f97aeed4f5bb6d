// SPDX-License-Identifier: BSD-3-Clause
// Color spaces of OpenColorIO configs (ACES, cameras' logarithms) for splats whose colors are in
// one.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "scene/gaussian_model.h"

namespace retint {

// How the colors of a space become light in Rec. 709: sampled from the config's own conversion to
// its sRGB space, without a view's tone curve. InputError for a config that cannot be read, a space
// that it does not have, or one that differs from sRGB by more than one curve for all channels and
// a matrix: those two must give OpenColorIO's colors within CIEDE2000 1. OptionError if there is no
// config.
std::shared_ptr<const LightMap> ReadOcioSpace(const OcioSpace& space);

// Of a config, as it orders them. InputError and OptionError as above.
std::vector<std::string> OcioSpaceNames(const std::string& config);

// Sets model.traits.chosen_space, unless `space` has no name. Errors as ReadOcioSpace().
void ChooseSpace(const OcioSpace& space, GaussianModel& model);

}  // namespace retint
