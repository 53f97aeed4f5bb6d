// SPDX-License-Identifier: BSD-3-Clause
// Explicit weights W_A of a region: Blend and BlendTranspose as sparse products.
#pragma once

#include "kernels/common/thinning.h"
#include "kernels/cuda/fixed_sums.cuh"
#include "kernels/cuda/geometry.cuh"
#include "kernels/cuda/tile_walk.cuh"

namespace retint::cuda {

// Which weights are kept: half rows (8 pixels side by side in a quarter) of every row_step-th pixel
// row that hold one of min_weight or more, 0: every one.
struct WeightChoice {
  float min_weight;
  int row_step;  // 1, 2, 4 or 8
  bool compact;  // held in 8 bits of an entry's largest, else 16; faint tiles go, see thinning.h
};

// Adds up how many quarters of every kThinningStride-th tile hold weights of an active splat that
// each thinning of rows (kernels/common/thinning.h) would keep.
void SampleWeights(const TileLists& lists, float min_weight, uint32_t* quarters,
                   cudaStream_t stream);

// For each tile of `lists` and quarter (4 tile + quarter): `counts`, the active splats with a
// weight to keep. For each pixel: `factors`, by which its kept weights grow to keep the sum of all,
// in the order of ExplicitWeights::values, [4 tiles, 64 / row_step].
void CountWeights(const TileLists& lists, const WeightChoice& choice, uint32_t* counts,
                  float* factors, cudaStream_t stream);

// Fills region->weights; its `ends` are the running sums of the counts, `total` the last of them.
// Tile t's factors are those of tile kept[t].
void StoreWeights(const TileLists& lists, const WeightChoice& choice, const int32_t* kept,
                  const float* factors, Scratch<uint32_t> ends, int64_t total,
                  CudaViewGeometry* region, cudaStream_t stream);
size_t WeightBytes(int64_t tiles, int64_t total, const WeightChoice& choice);

// For regions with explicit weights, as Blend and BlendTranspose.
void BlendWeights(const CudaViewGeometry& region, const BlendParams& params, cudaStream_t stream);
void BlendWeightsTranspose(const CudaViewGeometry& region, const BlendTransposeParams& params,
                           const FixedSums& sums, cudaStream_t stream);

}  // namespace retint::cuda
