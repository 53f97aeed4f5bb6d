// SPDX-License-Identifier: BSD-3-Clause
// Gaussians in an order in which neighbors in the file are neighbors in space.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/gaussian_model.h"

namespace retint {

// Indices of the Gaussians along a Morton (Z-order) curve through the scene's bounding box, 2^21
// cells along each axis; within a cell by index.
std::vector<uint32_t> MortonOrder(const GaussianModel& model);

}  // namespace retint
