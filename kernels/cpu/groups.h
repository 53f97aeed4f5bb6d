// SPDX-License-Identifier: BSD-3-Clause
// The groups of operations of the CPU backend, each made beside its kernels. The kernels given
// outlive the group.
#pragma once

#include <memory>

#include "kernels/blend_ops.h"
#include "kernels/cpu/image_loss.h"
#include "kernels/cpu/stereo_match.h"
#include "kernels/cpu/tile_kernels.h"
#include "kernels/edit_colors.h"
#include "kernels/mask_ops.h"
#include "kernels/refit_ops.h"
#include "kernels/sh_ops.h"
#include "kernels/solve_ops.h"

namespace retint {

std::unique_ptr<BlendOps> MakeCpuBlendOps(const TileKernels& kernels);
std::unique_ptr<ShOps> MakeCpuShOps(EditColorsKernel edit_colors);
std::unique_ptr<SolveOps> MakeCpuSolveOps();
std::unique_ptr<RefitOps> MakeCpuRefitOps(BlendOps& blend, const LossKernels& loss,
                                          const TileKernels& tiles, EditColorsKernel edit_colors);
std::unique_ptr<MaskOps> MakeCpuMaskOps();
std::unique_ptr<StereoOps> MakeCpuStereoOps(const StereoKernels& kernels);

}  // namespace retint
