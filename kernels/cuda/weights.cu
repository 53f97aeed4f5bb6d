// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/cuda/weights.cuh"

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
#pragma unroll 4
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

// The weights of one entry, two a lane, in steps of its largest.
template <typename Step, int kSteps>
struct Pair {
  static constexpr int kLargest = kSteps;
  Step first, second;
  __device__ static Pair Of(float w0, float w1, float steps) {
    return {Step(__float2int_rn(w0 * steps)), Step(__float2int_rn(w1 * steps))};
  }
};
using FinePair = Pair<uint16_t, 65535>;
using CompactPair = Pair<uint8_t, 255>;

template <typename Pair>
__global__ void __launch_bounds__(kTileThreads)
    StoreWeightsKernel(TileLists lists, float min_weight, const uint32_t* ends, int32_t* rows,
                       float* scales, Pair* pairs) {
  __shared__ __align__(16) Batch<int> batches[kWarps];
  const int quarter = int(kWarps * blockIdx.x + threadIdx.x / 32), lane = threadIdx.x % 32;
  int64_t at = quarter ? ends[quarter - 1] : 0;
  WalkWeights(lists, min_weight, batches, [&](int row, float w0, float w1) {
    const float largest = WarpMax(fmaxf(w0, w1));
    if (lane == 0) {
      rows[at] = row;
      scales[at] = largest * (1.0f / Pair::kLargest);
    }
    pairs[32 * at + lane] = Pair::Of(w0, w1, Pair::kLargest / largest);
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
  return {weights.ends.data(),    weights.rows.data(),        weights.scales.data(),
          region.tile_ids.data(), region.camera().width,      region.camera().height,
          region.tiles_x(),       int(region.tile_ids.size())};
}

// A quarter's entries one after the other would take long: they are dealt to kShares warps, kDeal
// at a time.
constexpr int kShares = 4, kDeal = 16;
constexpr int kSharedThreads = kTileThreads * kShares;

struct Deal {
  int quarter, share;   // of this warp
  unsigned first, end;  // entries of the quarter: first + kDeal * (share + kShares * i)
};

__device__ Deal DealOf(const Weights& weights) {
  const int warp = threadIdx.x / 32;
  Deal deal;
  deal.quarter = warp % kWarps;
  deal.share = warp / kWarps;
  const unsigned at = kWarps * blockIdx.x + deal.quarter;
  deal.first = (at ? weights.ends[at - 1] : 0) + kDeal * deal.share;
  deal.end = weights.ends[at];
  return deal;
}

// The pixels of this warp's quarter.
__device__ Lane LaneOf(const Weights& weights, const Deal& deal) {
  return QuarterLane(weights.width, weights.height, weights.tiles_x, weights.tile_ids[blockIdx.x],
                     deal.quarter);
}

template <int C, typename Pair>
__global__ void __launch_bounds__(kSharedThreads)
    BlendWeightsKernel(Weights weights, Pair* pairs, BlendParams params) {
  // Features in the weights' steps, and the step.
  __shared__ float staged[kWarps * kShares][kDeal][C + 1];
  __shared__ float partial[kShares - 1][kWarps][2][C + 1][32];
  const Deal deal = DealOf(weights);
  float(*features)[C + 1] = staged[threadIdx.x / 32];
  const unsigned lane_id = threadIdx.x % 32;
  float sum0[C + 1] = {}, sum1[C + 1] = {};  // the last is the active Gaussians' share
  for (unsigned first = deal.first; first < deal.end; first += kDeal * kShares) {
    Pair loaded[kDeal];
#pragma unroll
    for (int i = 0; i < kDeal; ++i) {
      loaded[i] = {};
      if (first + i < deal.end) loaded[i] = pairs[int64_t(first + i) * 32 + lane_id];
    }
    const unsigned mine = first + lane_id;
    if (lane_id < kDeal) {
      const bool live = mine < deal.end;
      const float scale = live ? weights.scales[mine] : 0.0f;
      const float* from = params.features + int64_t(live ? weights.rows[mine] : 0) * C;
#pragma unroll
      for (int c = 0; c < C; ++c) features[lane_id][c] = live ? scale * from[c] : 0.0f;
      features[lane_id][C] = scale;
    }
    __syncwarp();
#pragma unroll
    for (int i = 0; i < kDeal; ++i) {
      const float w0 = loaded[i].first, w1 = loaded[i].second;
#pragma unroll
      for (int c = 0; c <= C; ++c) {
        sum0[c] += w0 * features[i][c];
        sum1[c] += w1 * features[i][c];
      }
    }
    __syncwarp();
  }
  if (deal.share > 0) {
#pragma unroll
    for (int c = 0; c <= C; ++c) {
      partial[deal.share - 1][deal.quarter][0][c][lane_id] = sum0[c];
      partial[deal.share - 1][deal.quarter][1][c][lane_id] = sum1[c];
    }
  }
  __syncthreads();
  if (deal.share > 0) return;
  for (int share = 0; share < kShares - 1; ++share) {
#pragma unroll
    for (int c = 0; c <= C; ++c) {
      sum0[c] += partial[share][deal.quarter][0][c][lane_id];
      sum1[c] += partial[share][deal.quarter][1][c][lane_id];
    }
  }
  const Lane lane = LaneOf(weights, deal);
  const auto store = [&](int y, const float* sum) {
    const int64_t pixel = int64_t(y) * weights.width + lane.x;
#pragma unroll
    for (int c = 0; c < C; ++c) params.image[pixel * C + c] = sum[c];
    if (params.alpha) params.alpha[pixel] = sum[C];
  };
  if (lane.inside0) store(lane.y0, sum0);
  if (lane.inside1) store(lane.y1, sum1);
}

template <int C, typename Pair>
__global__ void __launch_bounds__(kSharedThreads)
    TransposeWeightsKernel(Weights weights, Pair* pairs, BlendTransposeParams params) {
  const Deal deal = DealOf(weights);
  if (deal.first >= deal.end) return;
  const Lane lane = LaneOf(weights, deal);
  const unsigned lane_id = threadIdx.x % 32;
  float residual0[C] = {}, residual1[C] = {};
  const auto read = [&](int y, float* residual) {
    const float* from = params.residual + (int64_t(y) * weights.width + lane.x) * C;
#pragma unroll
    for (int c = 0; c < C; ++c) residual[c] = from[c];
  };
  if (lane.inside0) read(lane.y0, residual0);
  if (lane.inside1) read(lane.y1, residual1);
  for (unsigned first = deal.first; first < deal.end; first += kDeal * kShares) {
    Pair loaded[kDeal];
#pragma unroll
    for (int i = 0; i < kDeal; ++i) {
      loaded[i] = {};
      if (first + i < deal.end) loaded[i] = pairs[int64_t(first + i) * 32 + lane_id];
    }
#pragma unroll
    for (int half = 0; half < kDeal; half += 8) {
      const unsigned mine = first + half + (lane_id >> 2);
      const bool live = mine < deal.end;
      const int64_t row = live ? weights.rows[mine] : 0;
      const float scale = live ? weights.scales[mine] : 0.0f;
#pragma unroll
      for (int c = 0; c < C; ++c) {
        float sums[8];
#pragma unroll
        for (int i = 0; i < 8; ++i) {
          sums[i] = float(loaded[half + i].first) * residual0[c] +
                    float(loaded[half + i].second) * residual1[c];
        }
        const float sum = scale * ReduceEight(sums);
        if ((lane_id & 3) == (c & 3) && live && sum != 0) {
          atomicAdd(&params.result[row * C + c], sum);
        }
      }
    }
  }
}

}  // namespace

size_t WeightBytes(int64_t tiles, int64_t total, bool compact) {
  const size_t pair = compact ? sizeof(CompactPair) : sizeof(FinePair);
  const size_t entry = sizeof(int32_t) + sizeof(float) + 32 * pair;
  return size_t(tiles) * kWarps * sizeof(uint32_t) + size_t(total) * entry;
}

// function(null pointer to the kind of pair) for the region's.
template <typename Function>
void WithPair(bool compact, const Function& function) {
  if (compact) {
    function(static_cast<CompactPair*>(nullptr));
  } else {
    function(static_cast<FinePair*>(nullptr));
  }
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
  weights.scales = Scratch<float>(stream, size_t(total));
  const size_t pair = compact ? sizeof(CompactPair) : sizeof(FinePair);
  weights.values = Scratch<uint8_t>(stream, size_t(total) * 32 * pair);
  if (lists.tiles == 0) return;
  WithPair(compact, [&](auto* kind) {
    StoreWeightsKernel<<<lists.tiles, kTileThreads, 0, stream>>>(
        lists, min_weight, weights.ends.data(), weights.rows.data(), weights.scales.data(),
        reinterpret_cast<decltype(kind)>(weights.values.data()));
  });
  Check(cudaGetLastError(), "StoreWeightsKernel");
}

void BlendWeights(const CudaViewGeometry& region, const BlendParams& params, cudaStream_t stream) {
  const Weights weights = WeightsOf(region);
  WithChannels(params.channels, [&](auto c) {
    if (weights.tiles == 0) return;
    WithPair(region.weights.compact, [&](auto* kind) {
      auto* values = reinterpret_cast<decltype(kind)>(region.weights.values.data());
      BlendWeightsKernel<c()>
          <<<weights.tiles, kSharedThreads, 0, stream>>>(weights, values, params);
    });
    Check(cudaGetLastError(), "BlendWeightsKernel");
  });
}

void BlendWeightsTranspose(const CudaViewGeometry& region, const BlendTransposeParams& params,
                           cudaStream_t stream) {
  const Weights weights = WeightsOf(region);
  WithChannels(params.channels, [&](auto c) {
    if (weights.tiles == 0) return;
    WithPair(region.weights.compact, [&](auto* kind) {
      auto* values = reinterpret_cast<decltype(kind)>(region.weights.values.data());
      TransposeWeightsKernel<c()>
          <<<weights.tiles, kSharedThreads, 0, stream>>>(weights, values, params);
    });
    Check(cudaGetLastError(), "TransposeWeightsKernel");
  });
}

}  // namespace retint::cuda
