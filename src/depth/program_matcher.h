// SPDX-License-Identifier: BSD-3-Clause
// Internal to depth: matching by another program (network_matcher.h).
#pragma once

#include <memory>

#include "depth/stereo_matcher.h"
#include "network/network_name.h"

namespace retint {

std::unique_ptr<StereoMatcher> MakeProgramMatcher(const NetworkName& name);

}  // namespace retint
