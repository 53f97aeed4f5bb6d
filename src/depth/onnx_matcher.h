// SPDX-License-Identifier: BSD-3-Clause
// Internal to depth: matching by a network in an ONNX file (network_matcher.h).
#pragma once

#include <memory>

#include "depth/stereo_matcher.h"
#include "network/network_name.h"

namespace retint {

NetworkName ParseStereoName(const std::string& text);
std::unique_ptr<StereoMatcher> MakeOnnxMatcher(const NetworkName& name);

}  // namespace retint
