// SPDX-License-Identifier: BSD-3-Clause
// Explicit weights W_A of a region: Blend and BlendTranspose as sparse products.
#pragma once

#include "kernels/cuda/geometry.cuh"
#include "kernels/cuda/tile_walk.cuh"

namespace retint::cuda {

// Per tile of `lists` and quarter (4 tile + quarter), how many active splats have a weight above
// `min_weight` there (0: any at all).
void CountWeights(const TileLists& lists, float min_weight, uint32_t* counts, cudaStream_t stream);

// Fills region->weights; its `ends` are the running sums of the counts, `total` the last of them.
// Weights are kept in steps of their entry's largest: 1 / 255 of it
// where `compact`, else 1 / 65535.
void StoreWeights(const TileLists& lists, float min_weight, bool compact, Scratch<uint32_t> ends,
                  int64_t total, CudaViewGeometry* region, cudaStream_t stream);
size_t WeightBytes(int64_t tiles, int64_t total, bool compact);

// For regions with explicit weights, as Blend and BlendTranspose.
void BlendWeights(const CudaViewGeometry& region, const BlendParams& params, cudaStream_t stream);
void BlendWeightsTranspose(const CudaViewGeometry& region, const BlendTransposeParams& params,
                           cudaStream_t stream);

}  // namespace retint::cuda
