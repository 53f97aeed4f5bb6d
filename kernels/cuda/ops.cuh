// SPDX-License-Identifier: BSD-3-Clause
// The operations of kernels/backend.h that are not blending, on a stream.
#pragma once

#include "kernels/cuda/geometry.cuh"

namespace retint::cuda {

void EvalSh(const CudaModel& model, const EvalShParams& params, cudaStream_t stream);
void EvalShTranspose(const CudaModel& model, const EvalShTransposeParams& params,
                     cudaStream_t stream);
void ShTangent(const CudaModel& model, const ShTangentParams& params, cudaStream_t stream);
void AccumulateBlocks(const CudaModel& model, const AccumulateBlocksParams& params,
                      cudaStream_t stream);

void Adam(const AdamParams& params, cudaStream_t stream);
void FactorBlocks(const FactorBlocksParams& params, cudaStream_t stream);
void SolveBlocks(const SolveBlocksParams& params, cudaStream_t stream);
void AddRidge(const AddRidgeParams& params, cudaStream_t stream);
void ApplyRidge(const ApplyRidgeParams& params, cudaStream_t stream);
void LinearCombination(const LinearCombinationParams& params, cudaStream_t stream);
void Dot(const float* x, const float* y, int64_t count, double* sum, cudaStream_t stream);

// sums: [2] |y - y*| and SSIM over the region of interest, accumulated.
void ImageLoss(const ImageLossParams& params, double* sums, cudaStream_t stream);

// Adds the loss of `sums` over `pixels` values to *params.loss.
void AddImageLoss(const ImageLossParams& params, const double* sums, double pixels,
                  cudaStream_t stream);

void RegionTarget(const CudaViewGeometry& view, const RegionTargetParams& params,
                  cudaStream_t stream);
void RegionResidual(const CudaViewGeometry& view, const RegionResidualParams& params,
                    cudaStream_t stream);
void RegionAdd(const CudaViewGeometry& view, float* image, const float* delta, cudaStream_t stream);
void RegionWeightImage(const CudaViewGeometry& view, const uint8_t* weights, float* image,
                       cudaStream_t stream);
void AccumulateShares(const CudaViewGeometry& view, const uint8_t* mask, double* sums,
                      cudaStream_t stream);
void PackBox(const PackBoxParams& params, cudaStream_t stream);
void UnpackBox(const PackBoxParams& params, cudaStream_t stream);
void EditImage(const EditImageParams& params, cudaStream_t stream);

void NeighborDistances(const NeighborDistancesParams& params, cudaStream_t stream);

}  // namespace retint::cuda
