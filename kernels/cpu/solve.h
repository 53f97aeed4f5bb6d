// SPDX-License-Identifier: BSD-3-Clause
// Block solver, Adam and the vector algebra of the refit; see backend.h.
#pragma once

#include "kernels/backend.h"

namespace retint {

void AdamOnCpu(const AdamParams& params);
void FactorBlocksOnCpu(const FactorBlocksParams& params);
void SolveBlocksOnCpu(const SolveBlocksParams& params);
void AddRidgeOnCpu(const AddRidgeParams& params);
void ApplyRidgeOnCpu(const ApplyRidgeParams& params);
void LinearCombinationOnCpu(const LinearCombinationParams& params);
double DotOnCpu(const float* x, const float* y, int64_t count);

}  // namespace retint
