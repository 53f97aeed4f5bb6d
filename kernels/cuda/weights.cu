// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/cuda/weights.cuh"

#include <cuda_fp16.h>

namespace retint::cuda {
namespace {

__device__ float WarpMax(float value) {
#if __CUDA_ARCH__ >= 800
  return __uint_as_float(__reduce_max_sync(kFullWarp, __float_as_uint(value)));  // values >= 0
#else
  for (int offset = 16; offset > 0; offset /= 2) {
    value = fmaxf(value, __shfl_xor_sync(kFullWarp, value, offset));
  }
  return value;
#endif
}

// Walks the tiles with keep(row, w0, w1), the lane's two weights, for every active splat that has a
// weight above min_weight in the warp's quarter.
template <typename Keep>
__device__ void WalkWeights(const TileLists& lists, float min_weight, Batch<int>* batches,
                            const Keep& keep) {
  const Lane lane = LaneOf(lists, lists.tile_ids[blockIdx.x]);
  float t0 = lane.inside0 ? 1.0f : -1.0f, t1 = lane.inside1 ? 1.0f : -1.0f;
  WalkTile(
      lists, blockIdx.x, lane, &batches[threadIdx.x / 32], [](int row, int* out) { *out = row; },
      [&](const Batch<int>& batch, int count) {
        for (int i = 0; i < count; ++i) {
          const Splat s = batch.splats[i];
          const float dx = float(lane.x) + 0.5f - s.x, dy = float(lane.y0) + 0.5f - s.y;
          const float w0 = BlendStep(SplatExponent(s, dx, dy), &t0);
          const float w1 = BlendStep(SplatExponent(s, dx, dy + kQuarter / 2), &t1);
          const int row = batch.payloads[i];
          if (row < 0) continue;  // the same for the whole warp
          const float larger = fmaxf(w0, w1);
          if (__any_sync(kFullWarp, larger > 0 && larger >= min_weight)) keep(row, w0, w1);
        }
      },
      [&] { return t0 > 0 || t1 > 0; });
}

__global__ void __launch_bounds__(kTileThreads)
    CountWeightsKernel(TileLists lists, float min_weight, uint32_t* counts) {
  __shared__ __align__(16) Batch<int> batches[kWarps];
  uint32_t count = 0;
  WalkWeights(lists, min_weight, batches, [&](int, float, float) { ++count; });
  if (threadIdx.x % 32 == 0) counts[kWarps * blockIdx.x + threadIdx.x / 32] = count;
}

// The weights of one entry, two a lane.
struct HalfPair {
  __half2 pair;
  __device__ static HalfPair Of(float w0, float w1, float) { return {__floats2half2_rn(w0, w1)}; }
  __device__ float2 Values() const { return __half22float2(pair); }
};
struct BytePair {
  uchar2 pair;
  __device__ static BytePair Of(float w0, float w1, float steps) {
    return {{uint8_t(__float2int_rn(w0 * steps)), uint8_t(__float2int_rn(w1 * steps))}};
  }
  __device__ float2 Values() const { return {float(pair.x), float(pair.y)}; }
};

template <typename Pair>
__global__ void __launch_bounds__(kTileThreads)
    StoreWeightsKernel(TileLists lists, float min_weight, const uint32_t* ends, int32_t* rows,
                       float* scales, Pair* pairs) {
  __shared__ __align__(16) Batch<int> batches[kWarps];
  const int quarter = int(kWarps * blockIdx.x + threadIdx.x / 32), lane = threadIdx.x % 32;
  int64_t at = quarter ? ends[quarter - 1] : 0;
  WalkWeights(lists, min_weight, batches, [&](int row, float w0, float w1) {
    float steps = 0;
    if (scales) {
      const float largest = WarpMax(fmaxf(w0, w1));
      steps = 255 / largest;
      if (lane == 0) scales[at] = largest * (1.0f / 255);
    }
    if (lane == 0) rows[at] = row;
    pairs[32 * at + lane] = Pair::Of(w0, w1, steps);
    ++at;
  });
}

// What the products read of a region.
struct Weights {
  const uint32_t* ends;
  const int32_t* rows;
  const float* scales;
  const int32_t* tile_ids;
  int width, height, tiles_x, tiles;
};

Weights WeightsOf(const CudaViewGeometry& region) {
  const ExplicitWeights& weights = region.weights;
  return {weights.ends.data(),
          weights.rows.data(),
          weights.compact ? weights.scales.data() : nullptr,
          region.tile_ids.data(),
          region.camera().width,
          region.camera().height,
          region.tiles_x(),
          int(region.tile_ids.size())};
}

// Entries of this warp's quarter.
__device__ uint2 RangeOf(const Weights& weights) {
  const unsigned quarter = kWarps * blockIdx.x + threadIdx.x / 32;
  return {quarter ? weights.ends[quarter - 1] : 0, weights.ends[quarter]};
}

template <int C, typename Pair>
__global__ void __launch_bounds__(kTileThreads)
    BlendWeightsKernel(Weights weights, const Pair* pairs, BlendParams params) {
  __shared__ float staged[kWarps][32][C + 1];  // features in the weights' steps, and the step
  float(*features)[C + 1] = staged[threadIdx.x / 32];
  const Lane lane =
      LaneOf(weights.width, weights.height, weights.tiles_x, weights.tile_ids[blockIdx.x]);
  const uint2 range = RangeOf(weights);
  const unsigned lane_id = threadIdx.x % 32;
  float sum0[C] = {}, sum1[C] = {}, share0 = 0, share1 = 0;
  for (unsigned first = range.x; first < range.y; first += 32) {
    const unsigned mine = first + lane_id;
    if (mine < range.y) {
      const float scale = weights.scales ? weights.scales[mine] : 1.0f;
      const float* from = params.features + int64_t(weights.rows[mine]) * C;
#pragma unroll
      for (int c = 0; c < C; ++c) features[lane_id][c] = scale * from[c];
      features[lane_id][C] = scale;
    }
    __syncwarp();
    const int count = min(32u, range.y - first);
    const Pair* from = pairs + int64_t(first) * 32 + lane_id;
#pragma unroll 4
    for (int i = 0; i < count; ++i) {
      const float2 w = from[32 * i].Values();
#pragma unroll
      for (int c = 0; c < C; ++c) {
        sum0[c] += w.x * features[i][c];
        sum1[c] += w.y * features[i][c];
      }
      share0 += w.x * features[i][C];
      share1 += w.y * features[i][C];
    }
    __syncwarp();
  }
  const auto store = [&](int y, float share, const float* sum) {
    const int64_t pixel = int64_t(y) * weights.width + lane.x;
#pragma unroll
    for (int c = 0; c < C; ++c) params.image[pixel * C + c] = sum[c];
    if (params.alpha) params.alpha[pixel] = share;
  };
  if (lane.inside0) store(lane.y0, share0, sum0);
  if (lane.inside1) store(lane.y1, share1, sum1);
}

template <int C, typename Pair>
__global__ void __launch_bounds__(kTileThreads)
    TransposeWeightsKernel(Weights weights, const Pair* pairs, BlendTransposeParams params) {
  const Lane lane =
      LaneOf(weights.width, weights.height, weights.tiles_x, weights.tile_ids[blockIdx.x]);
  const uint2 range = RangeOf(weights);
  if (range.x == range.y) return;
  const unsigned lane_id = threadIdx.x % 32;
  float residual0[C] = {}, residual1[C] = {};
  const auto read = [&](int y, float* residual) {
    const float* from = params.residual + (int64_t(y) * weights.width + lane.x) * C;
#pragma unroll
    for (int c = 0; c < C; ++c) residual[c] = from[c];
  };
  if (lane.inside0) read(lane.y0, residual0);
  if (lane.inside1) read(lane.y1, residual1);
  for (unsigned first = range.x; first < range.y; first += 8) {
    const Pair* from = pairs + int64_t(first) * 32 + lane_id;
    float sums[C][8];
#pragma unroll
    for (int i = 0; i < 8; ++i) {
      float2 w = {0, 0};
      if (first + i < range.y) w = from[32 * i].Values();
#pragma unroll
      for (int c = 0; c < C; ++c) sums[c][i] = w.x * residual0[c] + w.y * residual1[c];
    }
    const unsigned mine = first + (lane_id >> 2);
    const bool live = mine < range.y;
    const int64_t row = live ? weights.rows[mine] : 0;
    const float scale = live && weights.scales ? weights.scales[mine] : 1.0f;
#pragma unroll
    for (int c = 0; c < C; ++c) {
      const float sum = scale * ReduceEight(sums[c]);
      if ((lane_id & 3) == (c & 3) && live && sum != 0) {
        atomicAdd(&params.result[row * C + c], sum);
      }
    }
  }
}

}  // namespace

size_t WeightBytes(int64_t tiles, int64_t total, bool compact) {
  const size_t entry =
      sizeof(int32_t) + (compact ? sizeof(float) + 32 * sizeof(BytePair) : 32 * sizeof(HalfPair));
  return size_t(tiles) * kWarps * sizeof(uint32_t) + size_t(total) * entry;
}

void CountWeights(const TileLists& lists, float min_weight, uint32_t* counts, cudaStream_t stream) {
  if (lists.tiles == 0) return;
  CountWeightsKernel<<<lists.tiles, kTileThreads, 0, stream>>>(lists, min_weight, counts);
  Check(cudaGetLastError(), "CountWeightsKernel");
}

void StoreWeights(const TileLists& lists, float min_weight, bool compact, Scratch<uint32_t> ends,
                  int64_t total, CudaViewGeometry* region, cudaStream_t stream) {
  ExplicitWeights& weights = region->weights;
  weights.compact = compact;
  weights.ends = static_cast<Scratch<uint32_t>&&>(ends);
  weights.rows = Scratch<int32_t>(stream, size_t(total));
  if (compact) weights.scales = Scratch<float>(stream, size_t(total));
  const size_t pair = compact ? sizeof(BytePair) : sizeof(HalfPair);
  weights.values = Scratch<uint8_t>(stream, size_t(total) * 32 * pair);
  if (lists.tiles == 0) return;
  if (compact) {
    StoreWeightsKernel<BytePair><<<lists.tiles, kTileThreads, 0, stream>>>(
        lists, min_weight, weights.ends.data(), weights.rows.data(), weights.scales.data(),
        reinterpret_cast<BytePair*>(weights.values.data()));
  } else {
    StoreWeightsKernel<HalfPair><<<lists.tiles, kTileThreads, 0, stream>>>(
        lists, min_weight, weights.ends.data(), weights.rows.data(), nullptr,
        reinterpret_cast<HalfPair*>(weights.values.data()));
  }
  Check(cudaGetLastError(), "StoreWeightsKernel");
}

void BlendWeights(const CudaViewGeometry& region, const BlendParams& params, cudaStream_t stream) {
  const Weights weights = WeightsOf(region);
  const uint8_t* values = region.weights.values.data();
  WithChannels(params.channels, [&](auto c) {
    if (weights.tiles == 0) return;
    if (region.weights.compact) {
      BlendWeightsKernel<c(), BytePair><<<weights.tiles, kTileThreads, 0, stream>>>(
          weights, reinterpret_cast<const BytePair*>(values), params);
    } else {
      BlendWeightsKernel<c(), HalfPair><<<weights.tiles, kTileThreads, 0, stream>>>(
          weights, reinterpret_cast<const HalfPair*>(values), params);
    }
    Check(cudaGetLastError(), "BlendWeightsKernel");
  });
}

void BlendWeightsTranspose(const CudaViewGeometry& region, const BlendTransposeParams& params,
                           cudaStream_t stream) {
  const Weights weights = WeightsOf(region);
  const uint8_t* values = region.weights.values.data();
  WithChannels(params.channels, [&](auto c) {
    if (weights.tiles == 0) return;
    if (region.weights.compact) {
      TransposeWeightsKernel<c(), BytePair><<<weights.tiles, kTileThreads, 0, stream>>>(
          weights, reinterpret_cast<const BytePair*>(values), params);
    } else {
      TransposeWeightsKernel<c(), HalfPair><<<weights.tiles, kTileThreads, 0, stream>>>(
          weights, reinterpret_cast<const HalfPair*>(values), params);
    }
    Check(cudaGetLastError(), "TransposeWeightsKernel");
  });
}

}  // namespace retint::cuda
