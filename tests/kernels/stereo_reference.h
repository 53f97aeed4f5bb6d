// SPDX-License-Identifier: BSD-3-Clause
// Stages of stereo by their definitions, plain loops in double precision; views are in host memory.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/stereo_ops.h"

namespace retint {

// The mean of the largest set of positive values within `tolerance`. Of two equally large sets, the
// nearer (larger) one; -1 if there is none.
double ReferenceFused(std::vector<double> values, double tolerance, bool nearest);

struct ReferenceArbitration {
  std::vector<double> disparity;
  std::vector<uint8_t> measured;
};
ReferenceArbitration ReferenceArbitrate(const StereoArbitrateParams& params);

std::vector<double> ReferenceRefine(const StereoRefineParams& params);

}  // namespace retint
