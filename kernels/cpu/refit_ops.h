// SPDX-License-Identifier: BSD-3-Clause
// The refit's steps on the CPU; see backend.h for what each computes. `means` is [N, 3].
#pragma once

#include "kernels/backend.h"

namespace retint::cpu {

void RegionTarget(const ViewGeometry& region, const RegionTargetParams& params);
void RegionResidual(const ViewGeometry& region, const RegionResidualParams& params);
void RegionAdd(const ViewGeometry& region, float* image, const float* delta);
void ShTangent(const float* means, int num_coeffs, const ShTangentParams& params);
void AddRidge(const AddRidgeParams& params);
void ApplyRidge(const ApplyRidgeParams& params);
void LinearCombination(const LinearCombinationParams& params);
double Dot(const float* x, const float* y, int64_t count);
void PackBox(const PackBoxParams& params);
void UnpackBox(const PackBoxParams& params);
void EditImage(const EditImageParams& params);

}  // namespace retint::cpu
