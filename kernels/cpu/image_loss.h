// SPDX-License-Identifier: BSD-3-Clause
// Fused L1 + D-SSIM; see ImageLossParams.
#pragma once

#include "kernels/backend.h"

namespace retint {

ImageLossValue ImageLossOnCpu(const ImageLossParams& params);

}  // namespace retint
