// SPDX-License-Identifier: BSD-3-Clause
// How kernels walk the list of a tile. A block is a tile; a warp owns an 8x8 quarter of it, two
// pixels a lane. It reads the tile's list 32 splats at a time, one a lane, keeps those that reach
// its quarter, and walks them front to back from shared memory.
#pragma once

#include <stdexcept>
#include <type_traits>

#include "kernels/common/blend.h"
#include "kernels/cuda/geometry.cuh"

namespace retint::cuda {

inline constexpr int kQuarter = kTileSize / 2;
inline constexpr int kWarps = 4;  // a block is a tile
inline constexpr int kTileThreads = 32 * kWarps;

// The inputs of a tile kernel from a view.
struct TileLists {
  const Splat* splats;
  const int32_t* entries;
  const int2* ranges;
  const int32_t* tile_ids;    // null: every tile of the grid
  const int32_t* splat_rows;  // null: splat is row
  int width, height, tiles_x, tiles;
  const int32_t* order;  // of the tiles over the blocks; null: as they come

  // The tile that this block walks.
  __device__ int Index() const { return order ? order[blockIdx.x] : int(blockIdx.x); }
};

// The lane's two pixels: (x, y0) and (x, y1). With a `row_step` of 2, 4 or 8 only every such row is
// visited. Then the lane has one pixel, (x, y0), and one, two or four lanes share it.
struct Lane {
  int x, y0, y1;
  bool inside0, inside1;
  float quarter_x, quarter_y;  // centre of the quarter's first pixel
};

template <int row_step = 1>
__device__ Lane QuarterLane(int width, int height, int tiles_x, int tile, int quarter) {
  const int lane = threadIdx.x % 32;
  const int x0 = tile % tiles_x * kTileSize + (quarter & 1) * kQuarter;
  const int y0 = tile / tiles_x * kTileSize + (quarter >> 1) * kQuarter;
  Lane out;
  out.x = x0 + lane % kQuarter;
  out.y0 = y0 + row_step * (lane / kQuarter) % kQuarter;
  out.y1 = out.y0 + kQuarter / 2;
  out.inside0 = out.x < width && out.y0 < height;
  out.inside1 = row_step == 1 && out.x < width && out.y1 < height;
  out.quarter_x = float(x0) + 0.5f;
  out.quarter_y = float(y0) + 0.5f;
  return out;
}

template <int row_step = 1>
__device__ Lane LaneOf(const TileLists& lists, int tile) {
  return QuarterLane<row_step>(lists.width, lists.height, lists.tiles_x, tile,
                               int(threadIdx.x) / 32);
}

// Tests the splat's largest exponent over the quarter's pixel centres. It is at the splat's centre
// if that lies inside, else on one of the two sides that face it (the exponent is concave).
__device__ inline bool ReachesQuarter(const Splat& s, float quarter_x, float quarter_y) {
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

// Walks the list of `tile` for this warp, front to back. `visit` gets (batch, count): batches of
// the splats that reach the quarter. `load`, called as (row, payload*) on the lane that read the
// entry, fills the payload. The walk stops when no pixel of the warp is open.
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

// Sums each of `values[8]` over every `width` lanes (32, 16 or 8), with 9, 8 or 7 shuffles. Every
// lane then holds the sum of value number lane % width / (width / 8).
template <int width = 32>
__device__ float ReduceEight(float* values) {
  const int lane = threadIdx.x % 32;
#pragma unroll
  for (int half = 4, bit = width / 2; half >= 1; half /= 2, bit /= 2) {
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
#pragma unroll
  for (int bit = width / 16; bit >= 1; bit /= 2) sum += __shfl_xor_sync(kFullWarp, sum, bit);
  return sum;
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

}  // namespace retint::cuda
