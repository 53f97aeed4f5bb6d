// SPDX-License-Identifier: BSD-3-Clause
// Internal to depth: Stereo-HV by the operations of kernels/stereo_ops.h, from the renders to the
// depth map in backend memory. The stages are those of stereo_pairs.h.
#pragma once

#include <optional>

#include "depth/stereo_hv.h"

namespace retint {

// As StereoHvEstimator::Estimate. The renderer's backend must have Stereo(). Nothing where the
// search is longer than the operations allow; std::bad_alloc where the device has no room.
std::optional<DepthEstimate> EstimateStereoOnDevice(Renderer& renderer, const PosedCamera& view,
                                                    const StereoHvOptions& options,
                                                    Monitor& monitor);

}  // namespace retint
