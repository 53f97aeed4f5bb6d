// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/cuda/weights.cuh"

#include <type_traits>

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

constexpr int kQuarterPixels = kQuarter * kQuarter;

// Every lane's share of a quarter's pixels.
template <int row_step>
constexpr int kPixelsOfLane = row_step == 1 ? 2 : 1;
// The others share pixels with these.
template <int row_step>
constexpr int kLanes = row_step == 1 ? 32 : 64 / row_step;

// Walks the tile with visit(row, w0, w1), the lane's weights, for every active splat that the
// warp's quarter may see.
template <int row_step, typename Visit>
__device__ void WalkWeights(const TileLists& lists, int tile, Batch<int>* batches,
                            const Visit& visit) {
  const Lane lane = QuarterLane<row_step>(lists.width, lists.height, lists.tiles_x,
                                          lists.tile_ids[tile], int(threadIdx.x) / 32);
  const bool is_first = threadIdx.x % 32 < kLanes<row_step>;
  Pixel pixel0(lane.inside0 && is_first), pixel1(lane.inside1);
  WalkTile(
      lists, tile, lane, &batches[threadIdx.x / 32],
      [](int row, const Splat&, int* out) { *out = row; },
      [&](const Batch<int>& batch, int count) {
#pragma unroll 4
        for (int i = 0; i < count; ++i) {
          const auto item = batch.items[i];
          const float2 exponents = ExponentsOf(item.splat, lane);
          const float w0 = pixel0.Blend(exponents.x);
          const float w1 = row_step == 1 ? pixel1.Blend(exponents.y) : 0.0f;
          if (item.payload >= 0) visit(item.payload, w0, w1);  // the same for the whole warp
        }
      },
      [&] { return pixel0.IsOpen() || pixel1.IsOpen(); });
}

// Which of the lanes' weights are large; a half row is eight lanes side by side.
struct LargeWeights {
  unsigned first, second;  // a bit a lane

  __device__ LargeWeights(float w0, float w1, float min_weight)
      : first(__ballot_sync(kFullWarp, w0 > 0 && w0 >= min_weight)),
        second(__ballot_sync(kFullWarp, w1 > 0 && w1 >= min_weight)) {}
  __device__ bool Any() const { return (first | second) != 0; }
  // Whether the lane's half row has one.
  __device__ static bool Keeps(unsigned large) {
    return (large & 0xffu << (threadIdx.x & 24)) != 0;
  }
};

// Bit y: pixel row y of the quarter has one.
__device__ unsigned HalfRows(const LargeWeights& large) {
  unsigned rows = 0;
  for (int y = 0; y < 4; ++y) {
    if (large.first >> 8 * y & 0xff) rows |= 1u << y;
    if (large.second >> 8 * y & 0xff) rows |= 16u << y;
  }
  return rows;
}

// Whether no pixel of the tile sums to kFaint. `sum`: the lane's larger.
__device__ bool IsFaint(float sum) {
  __shared__ float largest[kWarps];
  const float of_warp = WarpMax(sum);
  if (threadIdx.x % 32 == 0) largest[threadIdx.x / 32] = of_warp;
  __syncthreads();
  float all = 0;
  for (const float one : largest) all = fmaxf(all, one);
  return all < kFaint;
}

__global__ void __launch_bounds__(kTileThreads)
    SampleWeightsKernel(TileLists lists, float min_weight, uint32_t* quarters) {
  constexpr unsigned kRows[] = {0xff, 0x55, 0x11, 0x01};
  static_assert(sizeof(kRows) / sizeof(kRows[0]) == kNumRowThinnings);
  __shared__ Batch<int> batches[kWarps];
  unsigned counts[kNumRowThinnings] = {};
  float sum0 = 0, sum1 = 0;
  WalkWeights<1>(lists, int(blockIdx.x) * kThinningStride, batches, [&](int, float w0, float w1) {
    sum0 += w0;
    sum1 += w1;
    const unsigned rows = HalfRows(LargeWeights(w0, w1, min_weight));
#pragma unroll
    for (size_t level = 0; level < kNumRowThinnings; ++level) {
      counts[level] += (rows & kRows[level]) != 0;
    }
  });
  if (IsFaint(fmaxf(sum0, sum1)) || threadIdx.x % 32 != 0) return;
  for (size_t level = 0; level < kNumRowThinnings; ++level) {
    atomicAdd(quarters + level, counts[level]);
  }
}

template <int row_step>
__global__ void __launch_bounds__(kTileThreads)
    CountWeightsKernel(TileLists lists, float min_weight, bool drop_faint, uint32_t* counts,
                       float* factors) {
  __shared__ Batch<int> batches[kWarps];
  uint32_t count = 0;
  float kept0 = 0, kept1 = 0, sum0 = 0, sum1 = 0;
  WalkWeights<row_step>(lists, int(blockIdx.x), batches, [&](int, float w0, float w1) {
    const LargeWeights large(w0, w1, min_weight);
    count += large.Any();
    sum0 += w0;
    sum1 += w1;
    if (LargeWeights::Keeps(large.first)) kept0 += w0;
    if (LargeWeights::Keeps(large.second)) kept1 += w1;
  });
  if (drop_faint && IsFaint(fmaxf(sum0, sum1))) count = 0;
  const int quarter = int(kWarps * blockIdx.x + threadIdx.x / 32), lane = threadIdx.x % 32;
  if (lane == 0) counts[quarter] = count;
  float* const to = factors + int64_t(quarter) * (kQuarterPixels / row_step);
  const auto factor = [](float sum, float kept) {
    return fminf(sum / fmaxf(kept, 1e-12f), kMostTakenOver);
  };
  if (row_step == 1) {
    to[2 * lane] = factor(sum0, kept0);
    to[2 * lane + 1] = factor(sum1, kept1);
  } else if (lane < kLanes<row_step>) {
    to[lane] = factor(sum0, kept0);
  }
}

template <typename Step>
constexpr int kSteps = sizeof(Step) == 1 ? 255 : 65535;

template <typename Step, int row_step>
__global__ void __launch_bounds__(kTileThreads)
    StoreWeightsKernel(TileLists lists, float min_weight, const int32_t* kept, const float* factors,
                       const uint32_t* ends, int32_t* rows, float* scales, Step* values) {
  constexpr int kValues = kQuarterPixels / row_step;
  __shared__ Batch<int> batches[kWarps];
  const int warp = int(threadIdx.x) / 32, lane = threadIdx.x % 32;
  const int quarter = int(kWarps * blockIdx.x) + warp;
  const unsigned first = quarter ? ends[quarter - 1] : 0;
  int64_t at = first;
  const bool is_dropped = ends[quarter] == first;
  const float* const from =
      factors + (int64_t(kWarps) * (kept ? kept[blockIdx.x] : int(blockIdx.x)) + warp) * kValues;
  float factor0, factor1 = 0;
  if (row_step == 1) {
    factor0 = from[2 * lane];
    factor1 = from[2 * lane + 1];
  } else {
    factor0 = from[lane % kLanes<row_step>];
  }
  WalkWeights<row_step>(lists, int(blockIdx.x), batches, [&](int row, float w0, float w1) {
    const LargeWeights large(w0, w1, min_weight);
    if (!large.Any() || is_dropped) return;
    w0 = LargeWeights::Keeps(large.first) ? w0 * factor0 : 0;
    w1 = LargeWeights::Keeps(large.second) ? w1 * factor1 : 0;
    const float largest = WarpMax(fmaxf(w0, w1));
    if (lane == 0) {
      rows[at] = row;
      scales[at] = largest * (1.0f / kSteps<Step>);
    }
    const float steps = kSteps<Step> / largest;
    Step* const to = values + at * kValues;
    if (row_step == 1) {
      to[2 * lane] = Step(__float2int_rn(w0 * steps));
      to[2 * lane + 1] = Step(__float2int_rn(w1 * steps));
    } else if (lane < kLanes<row_step>) {
      to[lane] = Step(__float2int_rn(w0 * steps));
    }
    ++at;
  });
}

// The part of a region that its products read.
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
constexpr int kShares = 4;
template <int row_step>
constexpr int kDeal = row_step == 8 ? 32 : 16;
constexpr int kSharedThreads = kTileThreads * kShares;

struct Deal {
  int quarter, share;   // of this warp
  unsigned first, end;  // entries of the quarter: first + kDeal * (share + kShares * i)
};

template <int row_step>
__device__ Deal DealOf(const Weights& weights) {
  const int warp = threadIdx.x / 32;
  Deal deal;
  deal.quarter = warp % kWarps;
  deal.share = warp / kWarps;
  const unsigned at = kWarps * blockIdx.x + deal.quarter;
  deal.first = (at ? weights.ends[at - 1] : 0) + kDeal<row_step> * deal.share;
  deal.end = weights.ends[at];
  return deal;
}

// The pixels of this warp's quarter.
template <int row_step>
__device__ Lane LaneOf(const Weights& weights, const Deal& deal) {
  return QuarterLane<row_step>(weights.width, weights.height, weights.tiles_x,
                               weights.tile_ids[blockIdx.x], deal.quarter);
}

// A lane's weights of one entry.
template <typename Step, int row_step>
struct LaneWeights {
  Step first, second;
};
template <typename Step>
struct LaneWeights<Step, 2> {
  Step first;
  static constexpr Step second = 0;
};
template <typename Step>
struct LaneWeights<Step, 4> : LaneWeights<Step, 2> {};
template <typename Step>
struct LaneWeights<Step, 8> : LaneWeights<Step, 2> {};

// How a warp reads the entries dealt to it: every load brings one weight or two a lane, of one
// entry or more.
template <typename Step, int row_step>
struct Loads {
  using Values = LaneWeights<Step, row_step>;
  static constexpr int kEntries = 32 / kLanes<row_step>;  // a load
  static constexpr int kCount = kDeal<row_step> / kEntries;
  Values of_lane[kCount];

  __device__ void Read(const Step* values, unsigned first, unsigned end) {
    const Values* const from = reinterpret_cast<const Values*>(values);
#pragma unroll
    for (int i = 0; i < kCount; ++i) {
      of_lane[i] = {};
      if (Entry(first, i) < end) {
        of_lane[i] = from[int64_t(first + kEntries * i) * kLanes<row_step> + threadIdx.x % 32];
      }
    }
  }
  __device__ static unsigned Entry(unsigned first, int load) {
    return first + kEntries * load + threadIdx.x % 32 / kLanes<row_step>;
  }
};

template <int C, typename Step, int row_step>
__global__ void __launch_bounds__(kSharedThreads)
    BlendWeightsKernel(Weights weights, const Step* values, BlendParams params) {
  // Features in the weights' steps, and the step.
  __shared__ float staged[kWarps * kShares][kDeal<row_step>][C + 1];
  __shared__ float partial[kShares - 1][kWarps][2][C + 1][32];
  const Deal deal = DealOf<row_step>(weights);
  float(*features)[C + 1] = staged[threadIdx.x / 32];
  const unsigned lane_id = threadIdx.x % 32;
  float sum0[C + 1] = {}, sum1[C + 1] = {};  // the last is the active Gaussians' share
  using LoadsOf = Loads<Step, row_step>;
  for (unsigned first = deal.first; first < deal.end; first += kDeal<row_step> * kShares) {
    LoadsOf loads;
    loads.Read(values, first, deal.end);
    const unsigned mine = first + lane_id;
    if (lane_id < kDeal<row_step>) {
      const bool live = mine < deal.end;
      const float scale = live ? weights.scales[mine] : 0.0f;
      const float* from = params.features + int64_t(live ? weights.rows[mine] : 0) * C;
#pragma unroll
      for (int c = 0; c < C; ++c) features[lane_id][c] = live ? scale * from[c] : 0.0f;
      features[lane_id][C] = scale;
    }
    __syncwarp();
#pragma unroll
    for (int i = 0; i < LoadsOf::kCount; ++i) {
      const float w0 = loads.of_lane[i].first, w1 = loads.of_lane[i].second;
      const float* const feature = features[LoadsOf::Entry(0, i)];
#pragma unroll
      for (int c = 0; c <= C; ++c) {
        sum0[c] += w0 * feature[c];
        if (row_step == 1) sum1[c] += w1 * feature[c];
      }
    }
    __syncwarp();
  }
#pragma unroll
  for (int other = kLanes<row_step>; other < 32; other *= 2) {
#pragma unroll
    for (int c = 0; c <= C; ++c) sum0[c] += __shfl_xor_sync(kFullWarp, sum0[c], other);
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
  const Lane lane = LaneOf<row_step>(weights, deal);
  const auto store = [&](int y, const float* sum) {
    const int64_t pixel = int64_t(y) * weights.width + lane.x;
#pragma unroll
    for (int c = 0; c < C; ++c) params.image[pixel * C + c] = sum[c];
    if (params.alpha) params.alpha[pixel] = sum[C];
  };
  if (lane.inside0 && lane_id < kLanes<row_step>) {
    store(lane.y0, sum0);
    const float nothing[C + 1] = {};
    for (int y = lane.y0 + 1; y < min(lane.y0 + row_step, weights.height); ++y) store(y, nothing);
  }
  if (lane.inside1) store(lane.y1, sum1);
}

template <int C, typename Step, int row_step>
__global__ void __launch_bounds__(kSharedThreads)
    TransposeWeightsKernel(Weights weights, const Step* values, BlendTransposeParams params,
                           FixedSums to) {
  const Deal deal = DealOf<row_step>(weights);
  if (deal.first >= deal.end) return;
  const float per_unit = to.Load().per_unit;
  const Lane lane = LaneOf<row_step>(weights, deal);
  const unsigned lane_id = threadIdx.x % 32;
  float residual0[C] = {}, residual1[C] = {};
  const auto read = [&](int y, float* residual) {
    const float* from = params.residual + (int64_t(y) * weights.width + lane.x) * C;
#pragma unroll
    for (int c = 0; c < C; ++c) residual[c] = from[c];
  };
  if (lane.inside0) read(lane.y0, residual0);
  if (lane.inside1) read(lane.y1, residual1);
  using LoadsOf = Loads<Step, row_step>;
  constexpr int kSumLanes = kLanes<row_step> / 8;  // hold the same sum
  for (unsigned first = deal.first; first < deal.end; first += kDeal<row_step> * kShares) {
    LoadsOf loads;
    loads.Read(values, first, deal.end);
#pragma unroll
    for (int eight = 0; eight < LoadsOf::kCount; eight += 8) {
      const unsigned mine =
          LoadsOf::Entry(first, eight + int(lane_id % kLanes<row_step> / kSumLanes));
      const bool live = mine < deal.end;
      const int64_t row = live ? weights.rows[mine] : -1;
      const float scale = live ? weights.scales[mine] : 0.0f;
      to.Add<C, kSumLanes>(per_unit, row, [&](int c) {
        float sums[8];
#pragma unroll
        for (int i = 0; i < 8; ++i) {
          const auto& weight = loads.of_lane[eight + i];
          sums[i] = float(weight.first) * residual0[c];
          if (row_step == 1) sums[i] += float(weight.second) * residual1[c];
        }
        return scale * ReduceEight<kLanes<row_step>>(sums);
      });
    }
  }
}

// function(a value of the weights' type, std::integral_constant<int, row step>).
template <typename Function>
void WithKind(bool compact, int row_step, const Function& function) {
  const auto with_step = [&](auto value) {
    switch (row_step) {
      case 1:
        return function(value, std::integral_constant<int, 1>());
      case 2:
        return function(value, std::integral_constant<int, 2>());
      case 4:
        return function(value, std::integral_constant<int, 4>());
      default:
        return function(value, std::integral_constant<int, 8>());
    }
  };
  if (compact) {
    with_step(uint8_t{});
  } else {
    function(uint16_t{}, std::integral_constant<int, 1>());
  }
}

}  // namespace

size_t WeightBytes(int64_t tiles, int64_t total, const WeightChoice& choice) {
  const size_t values = size_t(kQuarterPixels / choice.row_step) * (choice.compact ? 1 : 2);
  return size_t(tiles) * kWarps * sizeof(uint32_t) +
         size_t(total) * (sizeof(int32_t) + sizeof(float) + values);
}

void SampleWeights(const TileLists& lists, float min_weight, uint32_t* quarters,
                   cudaStream_t stream) {
  if (lists.tiles == 0) return;
  SampleWeightsKernel<<<Blocks(lists.tiles, kThinningStride), kTileThreads, 0, stream>>>(
      lists, min_weight, quarters);
  Check(cudaGetLastError(), "SampleWeightsKernel");
}

void CountWeights(const TileLists& lists, const WeightChoice& choice, uint32_t* counts,
                  float* factors, cudaStream_t stream) {
  if (lists.tiles == 0) return;
  WithKind(choice.compact, choice.row_step, [&](auto, auto row_step) {
    CountWeightsKernel<row_step()><<<lists.tiles, kTileThreads, 0, stream>>>(
        lists, choice.min_weight, choice.compact, counts, factors);
  });
  Check(cudaGetLastError(), "CountWeightsKernel");
}

void StoreWeights(const TileLists& lists, const WeightChoice& choice, const int32_t* kept,
                  const float* factors, Scratch<uint32_t> ends, int64_t total,
                  CudaViewGeometry* region, cudaStream_t stream) {
  ExplicitWeights& weights = region->weights;
  weights.compact = choice.compact;
  weights.row_step = choice.row_step;
  weights.ends = static_cast<Scratch<uint32_t>&&>(ends);
  weights.rows = Scratch<int32_t>(stream, size_t(total));
  weights.scales = Scratch<float>(stream, size_t(total));
  const size_t values = size_t(total) * size_t(kQuarterPixels / choice.row_step);
  weights.values = Scratch<uint8_t>(stream, values * (choice.compact ? 1 : 2));
  if (lists.tiles == 0) return;
  WithKind(choice.compact, choice.row_step, [&](auto value, auto row_step) {
    using Step = decltype(value);
    StoreWeightsKernel<Step, row_step()><<<lists.tiles, kTileThreads, 0, stream>>>(
        lists, choice.min_weight, kept, factors, weights.ends.data(), weights.rows.data(),
        weights.scales.data(), reinterpret_cast<Step*>(weights.values.data()));
  });
  Check(cudaGetLastError(), "StoreWeightsKernel");
}

void BlendWeights(const CudaViewGeometry& region, const BlendParams& params, cudaStream_t stream) {
  const Weights weights = WeightsOf(region);
  if (weights.tiles == 0) return;
  WithChannels(params.channels, [&](auto c) {
    WithKind(region.weights.compact, region.weights.row_step, [&](auto value, auto row_step) {
      using Step = decltype(value);
      BlendWeightsKernel<c(), Step, row_step()><<<weights.tiles, kSharedThreads, 0, stream>>>(
          weights, reinterpret_cast<const Step*>(region.weights.values.data()), params);
    });
  });
  Check(cudaGetLastError(), "BlendWeightsKernel");
}

void BlendWeightsTranspose(const CudaViewGeometry& region, const BlendTransposeParams& params,
                           const FixedSums& sums, cudaStream_t stream) {
  const Weights weights = WeightsOf(region);
  if (weights.tiles == 0) return;
  WithChannels(params.channels, [&](auto c) {
    WithKind(region.weights.compact, region.weights.row_step, [&](auto value, auto row_step) {
      using Step = decltype(value);
      TransposeWeightsKernel<c(), Step, row_step()><<<weights.tiles, kSharedThreads, 0, stream>>>(
          weights, reinterpret_cast<const Step*>(region.weights.values.data()), params, sums);
    });
  });
  Check(cudaGetLastError(), "TransposeWeightsKernel");
}

}  // namespace retint::cuda
