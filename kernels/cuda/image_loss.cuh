// SPDX-License-Identifier: BSD-3-Clause
// L1 and SSIM with their gradient on the device, for RefitOps.
#pragma once

#include "kernels/cuda/launch.cuh"
#include "kernels/refit_ops.h"

namespace retint::cuda {

// RefitOps::ImageLoss, whose region of interest is not empty.
ImageLossValue ImageLoss(const ImageLossParams& params, BlockSumsMemory& memory,
                         cudaStream_t stream);

}  // namespace retint::cuda
