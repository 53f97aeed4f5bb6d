// SPDX-License-Identifier: BSD-3-Clause
// The large stages of the CPU's stereo. The matcher is in stereo_match.h.
#pragma once

#include "kernels/stereo_ops.h"

namespace retint {

void ArbitrateStereoOnCpu(const StereoArbitrateParams& params);
void RefineStereoOnCpu(const StereoRefineParams& params);

}  // namespace retint
