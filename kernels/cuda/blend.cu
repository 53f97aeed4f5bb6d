// SPDX-License-Identifier: BSD-3-Clause
// Blend, BlendTranspose and Depth. A warp owns an 8x8 quarter of a tile, two pixels a lane. It
// reads the tile's list 32 splats at a time, one a lane, keeps those that reach its quarter, and
// walks them front to back from shared memory.
#include "kernels/common/blend.h"
#include "kernels/cuda/blend.cuh"

namespace retint::cuda {
namespace {

constexpr int kQuarter = kTileSize / 2;
constexpr int kWarps = 4;  // a block is a tile
constexpr int kThreads = 32 * kWarps;

// What a tile kernel reads of a view.
struct TileLists {
  const Splat* splats;
  const int32_t* entries;
  const int2* ranges;
  const int32_t* tile_ids;    // null: every tile of the grid
  const int32_t* splat_rows;  // null: splat is row
  int width, height, tiles_x, tiles;
};

TileLists ListsOf(const CudaViewGeometry& view) {
  return {view.splats.data(),
          view.entries.data(),
          view.ranges.data(),
          view.is_region ? view.tile_ids.data() : nullptr,
          view.is_region ? view.splat_rows.data() : nullptr,
          view.camera().width,
          view.camera().height,
          view.tiles_x(),
          int(view.ranges.size())};
}

// The lane's two pixels: (x, y) and (x, y + 4).
struct Lane {
  int x, y0, y1;
  bool inside0, inside1;
  float quarter_x, quarter_y;  // centre of the quarter's first pixel
};

__device__ Lane LaneOf(const TileLists& lists, int tile) {
  const int warp = threadIdx.x / 32, lane = threadIdx.x % 32;
  const int x0 = tile % lists.tiles_x * kTileSize + (warp & 1) * kQuarter;
  const int y0 = tile / lists.tiles_x * kTileSize + (warp >> 1) * kQuarter;
  Lane out;
  out.x = x0 + lane % kQuarter;
  out.y0 = y0 + lane / kQuarter;
  out.y1 = out.y0 + kQuarter / 2;
  out.inside0 = out.x < lists.width && out.y0 < lists.height;
  out.inside1 = out.x < lists.width && out.y1 < lists.height;
  out.quarter_x = float(x0) + 0.5f;
  out.quarter_y = float(y0) + 0.5f;
  return out;
}

// The largest exponent of the splat over the quarter's pixel centres is at its centre when that
// lies inside, else on one of the two sides that face it (the exponent is concave).
__device__ bool ReachesQuarter(const Splat& s, float quarter_x, float quarter_y) {
  constexpr float kSide = kQuarter - 1;
  constexpr float kSlack = 1e-3f;
  const float left = quarter_x - s.x, top = quarter_y - s.y;
  const float right = left + kSide, bottom = top + kSide;
  const float dx = fminf(fmaxf(0.0f, left), right), dy = fminf(fmaxf(0.0f, top), bottom);
  float best = -INFINITY;
  if (dx == 0 && dy == 0) best = 0;
  if (dx != 0) {
    const float along = fminf(fmaxf(-0.5f * s.b * dx / s.c, top), bottom);
    best = s.a * dx * dx + along * (s.b * dx + s.c * along);
  }
  if (dy != 0) {
    const float along = fminf(fmaxf(-0.5f * s.b * dy / s.a, left), right);
    best = fmaxf(best, s.c * dy * dy + along * (s.b * dy + s.a * along));
  }
  return best + s.log2_opacity >= kLog2MinAlpha - kSlack;
}

// The splats of one batch that reach a quarter, per warp.
template <typename Payload>
struct Batch {
  Splat splats[32];
  Payload payloads[32];
};

// Walks the list of `tile` for this warp: visit(splat, payload) for each splat that reaches the
// quarter, front to back, in batches; load(row index, payload*) fills the payload by the lane that
// read the entry; after(count) ends a batch. Stops when no pixel of the warp is open.
template <typename Payload, typename Load, typename Visit, typename IsOpen>
__device__ void WalkTile(const TileLists& lists, int index, const Lane& lane, Batch<Payload>* batch,
                         const Load& load, const Visit& visit, const IsOpen& is_open) {
  const int2 range = lists.ranges[index];
  const int lane_id = threadIdx.x % 32;
  for (int first = range.x; first < range.y; first += 32) {
    if (!__any_sync(kFullWarp, is_open())) return;
    const int e = first + lane_id;
    bool reaches = false;
    Splat splat;
    int source = 0;
    if (e < range.y) {
      source = lists.entries[e];
      const float4* from = reinterpret_cast<const float4*>(lists.splats + source);
      *reinterpret_cast<float4*>(&splat) = __ldg(from);
      *(reinterpret_cast<float4*>(&splat) + 1) = __ldg(from + 1);
      reaches = ReachesQuarter(splat, lane.quarter_x, lane.quarter_y);
    }
    const unsigned kept = __ballot_sync(kFullWarp, reaches);
    if (reaches) {
      const int slot = __popc(kept & ((1u << lane_id) - 1));
      batch->splats[slot] = splat;
      load(lists.splat_rows ? lists.splat_rows[source] : source, &batch->payloads[slot]);
    }
    __syncwarp();
    visit(*batch, __popc(kept));
    __syncwarp();
  }
}

template <int C>
struct Features {
  float value[C];
  float active;
};

template <int C>
__global__ void __launch_bounds__(kThreads) BlendKernel(TileLists lists, BlendParams params) {
  __shared__ __align__(16) Batch<Features<C>> batches[kWarps];
  const int index = blockIdx.x;
  if (params.keep_outside && lists.ranges[index].x == lists.ranges[index].y) return;
  const Lane lane = LaneOf(lists, lists.tile_ids ? lists.tile_ids[index] : index);
  float t0 = lane.inside0 ? 1.0f : -1.0f, t1 = lane.inside1 ? 1.0f : -1.0f;
  float sum0[C] = {}, sum1[C] = {};
  float share0 = 0, share1 = 0;  // of the active splats of a region
  WalkTile(
      lists, index, lane, &batches[threadIdx.x / 32],
      [&](int row, Features<C>* out) {
        out->active = row < 0 ? 0.0f : 1.0f;
#pragma unroll
        for (int c = 0; c < C; ++c) {
          out->value[c] = row < 0 ? 0.0f : params.features[int64_t(row) * C + c];
        }
      },
      [&](const Batch<Features<C>>& batch, int count) {
        for (int i = 0; i < count; ++i) {
          const Splat s = batch.splats[i];
          const float dx = float(lane.x) + 0.5f - s.x, dy = float(lane.y0) + 0.5f - s.y;
          const float w0 = BlendStep(SplatExponent(s, dx, dy), &t0);
          const float w1 = BlendStep(SplatExponent(s, dx, dy + kQuarter / 2), &t1);
#pragma unroll
          for (int c = 0; c < C; ++c) {
            const float f = batch.payloads[i].value[c];
            sum0[c] += w0 * f;
            sum1[c] += w1 * f;
          }
          share0 += w0 * batch.payloads[i].active;
          share1 += w1 * batch.payloads[i].active;
        }
      },
      [&] { return t0 > 0 || t1 > 0; });
  const auto store = [&](int y, float transmittance, float share, const float* sum) {
    const int64_t pixel = int64_t(y) * lists.width + lane.x;
    const float left = fabsf(transmittance);
#pragma unroll
    for (int c = 0; c < C; ++c) {
      params.image[pixel * C + c] = sum[c] + (params.background ? left * params.background[c] : 0);
    }
    if (params.alpha) params.alpha[pixel] = lists.tile_ids ? share : 1 - left;
  };
  if (lane.inside0) store(lane.y0, t0, share0, sum0);
  if (lane.inside1) store(lane.y1, t1, share1, sum1);
}

// Sums each of `values[8]` over the warp with 9 shuffles: afterwards every lane holds the sum of
// value number (bit 4, bit 3, bit 2 of its index).
__device__ float ReduceEight(float* values) {
  const int lane = threadIdx.x % 32;
#pragma unroll
  for (int half = 4, bit = 16; half >= 1; half /= 2, bit /= 2) {
    const bool upper = lane & bit;
#pragma unroll
    for (int i = 0; i < 4; ++i) {
      if (i >= half) break;
      const float send = upper ? values[i] : values[i + half];
      const float keep = upper ? values[i + half] : values[i];
      values[i] = keep + __shfl_xor_sync(kFullWarp, send, bit);
    }
  }
  float sum = values[0];
  sum += __shfl_xor_sync(kFullWarp, sum, 2);
  sum += __shfl_xor_sync(kFullWarp, sum, 1);
  return sum;
}

template <int C>
__global__ void __launch_bounds__(kThreads)
    BlendTransposeKernel(TileLists lists, BlendTransposeParams params) {
  __shared__ __align__(16) Batch<int> batches[kWarps];
  const int index = blockIdx.x, lane_id = threadIdx.x % 32;
  const Lane lane = LaneOf(lists, lists.tile_ids ? lists.tile_ids[index] : index);
  float t0 = lane.inside0 ? 1.0f : -1.0f, t1 = lane.inside1 ? 1.0f : -1.0f;
  float residual0[C] = {}, residual1[C] = {};
  const auto read = [&](int y, float* residual) {
    const float* from = params.residual + (int64_t(y) * lists.width + lane.x) * C;
#pragma unroll
    for (int c = 0; c < C; ++c) residual[c] = from[c];
  };
  if (lane.inside0) read(lane.y0, residual0);
  if (lane.inside1) read(lane.y1, residual1);
  WalkTile(
      lists, index, lane, &batches[threadIdx.x / 32], [&](int row, int* out) { *out = row; },
      [&](const Batch<int>& batch, int count) {
        for (int first = 0; first < count; first += 8) {
          float sums[C][8];
          bool any = false;
#pragma unroll
          for (int i = 0; i < 8; ++i) {
            float w0 = 0, w1 = 0;
            if (first + i < count) {
              const Splat s = batch.splats[first + i];
              const float dx = float(lane.x) + 0.5f - s.x, dy = float(lane.y0) + 0.5f - s.y;
              w0 = BlendStep(SplatExponent(s, dx, dy), &t0);
              w1 = BlendStep(SplatExponent(s, dx, dy + kQuarter / 2), &t1);
            }
            any |= w0 > 0 || w1 > 0;
#pragma unroll
            for (int c = 0; c < C; ++c) sums[c][i] = w0 * residual0[c] + w1 * residual1[c];
          }
          if (!__any_sync(kFullWarp, any)) continue;
          const int mine = first + (lane_id >> 2);
          const int row = mine < count ? batch.payloads[mine] : -1;
#pragma unroll
          for (int c = 0; c < C; ++c) {
            const float sum = ReduceEight(sums[c]);
            if ((lane_id & 3) == (c & 3) && row >= 0 && sum != 0) {
              atomicAdd(&params.result[int64_t(row) * C + c], sum);
            }
          }
        }
      },
      [&] { return t0 > 0 || t1 > 0; });
}

__global__ void __launch_bounds__(kThreads) DepthKernel(TileLists lists, DepthParams params) {
  struct Nothing {};
  __shared__ __align__(16) Batch<Nothing> batches[kWarps];
  const int index = blockIdx.x;
  const Lane lane = LaneOf(lists, index);
  float t0 = lane.inside0 ? 1.0f : -1.0f, t1 = lane.inside1 ? 1.0f : -1.0f;
  float sum0 = 0, sum1 = 0, median0 = 0, median1 = 0;
  const auto step = [&](const Splat& s, float exponent, float* t, float* sum, float* median) {
    const float before = *t;
    const float weight = BlendStep(exponent, t);
    *sum += weight * s.depth;
    if (weight > 0 && before >= params.threshold && *t < params.threshold) *median = s.depth;
  };
  WalkTile(
      lists, index, lane, &batches[threadIdx.x / 32], [](int, Nothing*) {},
      [&](const Batch<Nothing>& batch, int count) {
        for (int i = 0; i < count; ++i) {
          const Splat s = batch.splats[i];
          const float dx = float(lane.x) + 0.5f - s.x, dy = float(lane.y0) + 0.5f - s.y;
          step(s, SplatExponent(s, dx, dy), &t0, &sum0, &median0);
          step(s, SplatExponent(s, dx, dy + kQuarter / 2), &t1, &sum1, &median1);
        }
      },
      [&] { return t0 > 0 || t1 > 0; });
  const auto store = [&](int y, float t, float sum, float median) {
    const int64_t pixel = int64_t(y) * lists.width + lane.x;
    const float alpha = 1 - fabsf(t);
    if (params.median) params.median[pixel] = median;
    if (params.expected) params.expected[pixel] = alpha > 0 ? sum / alpha : 0;
    if (params.alpha) params.alpha[pixel] = alpha;
  };
  if (lane.inside0) store(lane.y0, t0, sum0, median0);
  if (lane.inside1) store(lane.y1, t1, sum1, median1);
}

// Calls function(std::integral_constant<int, C>) for the run-time channel count.
template <typename Function>
void WithChannels(int channels, const Function& function) {
  switch (channels) {
    case 1:
      return function(std::integral_constant<int, 1>());
    case 2:
      return function(std::integral_constant<int, 2>());
    case 3:
      return function(std::integral_constant<int, 3>());
    case 4:
      return function(std::integral_constant<int, 4>());
    case 5:
      return function(std::integral_constant<int, 5>());
    case 6:
      return function(std::integral_constant<int, 6>());
    case 7:
      return function(std::integral_constant<int, 7>());
    case 8:
      return function(std::integral_constant<int, 8>());
    default:
      throw std::invalid_argument("channels must be 1 to 8");
  }
}

}  // namespace

void Blend(const CudaViewGeometry& view, BlendParams params, cudaStream_t stream) {
  const int64_t pixels = int64_t(view.camera().width) * view.camera().height;
  if (view.is_region) {
    params.background = nullptr;
    if (!params.keep_outside) {
      Check(cudaMemsetAsync(params.image, 0, size_t(pixels) * params.channels * sizeof(float),
                            stream),
            "cudaMemsetAsync");
    }
    if (params.alpha && !params.keep_outside) {
      Check(cudaMemsetAsync(params.alpha, 0, size_t(pixels) * sizeof(float), stream),
            "cudaMemsetAsync");
    }
  }
  const TileLists lists = ListsOf(view);
  WithChannels(params.channels, [&](auto c) {
    if (lists.tiles == 0) return;
    BlendKernel<c()><<<lists.tiles, kThreads, 0, stream>>>(lists, params);
    Check(cudaGetLastError(), "BlendKernel");
  });
}

void BlendTranspose(const CudaViewGeometry& view, const BlendTransposeParams& params,
                    cudaStream_t stream) {
  if (view.num_rows() > 0) {
    Check(cudaMemsetAsync(params.result, 0,
                          size_t(view.num_rows()) * params.channels * sizeof(float), stream),
          "cudaMemsetAsync");
  }
  const TileLists lists = ListsOf(view);
  WithChannels(params.channels, [&](auto c) {
    if (lists.tiles == 0) return;
    BlendTransposeKernel<c()><<<lists.tiles, kThreads, 0, stream>>>(lists, params);
    Check(cudaGetLastError(), "BlendTransposeKernel");
  });
}

void Depth(const CudaViewGeometry& view, const DepthParams& params, cudaStream_t stream) {
  if (view.is_region) throw std::invalid_argument("depth needs a whole view");
  const TileLists lists = ListsOf(view);
  DepthKernel<<<lists.tiles, kThreads, 0, stream>>>(lists, params);
  Check(cudaGetLastError(), "DepthKernel");
}

}  // namespace retint::cuda
