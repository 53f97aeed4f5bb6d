// SPDX-License-Identifier: BSD-3-Clause
// Operations on the SH basis of each Gaussian in the view's direction; see backend.h.
#pragma once

#include "kernels/backend.h"
#include "kernels/cpu/geometry.h"

namespace retint {

void EvalShOnCpu(const CpuModel& model, const EvalShParams& params);
void EvalShTransposeOnCpu(const CpuModel& model, const EvalShTransposeParams& params);
void ShTangentOnCpu(const CpuModel& model, const ShTangentParams& params);
void AccumulateBlocksOnCpu(const CpuModel& model, const AccumulateBlocksParams& params);

}  // namespace retint
