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
  float quarter_x, quarter_y;          // centre of the quarter's first pixel
  float from_middle_x, from_middle_y;  // from the quarter's middle to the first pixel's centre
};

inline constexpr float kToMiddle = 0.5f * (kQuarter - 1);  // from quarter_x to the middle

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
  out.from_middle_x = float(out.x - x0) - kToMiddle;
  out.from_middle_y = float(out.y0 - y0) - kToMiddle;
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

// A splat about the middle of a quarter: SplatExponent() at (x, y) from there is
//   constant + x (of_x + a x) + y (of_y + b x + c y).
struct QuarterSplat {
  float constant, of_x, of_y, a, b, c;
};

__device__ inline QuarterSplat AboutMiddle(const Splat& s, float quarter_x, float quarter_y) {
  const float dx = quarter_x - s.x + kToMiddle, dy = quarter_y - s.y + kToMiddle;
  const float along_x = s.a * dx + s.b * dy, along_y = s.c * dy;
  return {along_x * dx + (along_y * dy + s.log2_opacity),
          along_x + s.a * dx,
          s.b * dx + (along_y + along_y),
          s.a,
          s.b,
          s.c};
}

// SplatExponent() at a lane's two pixels.
__device__ inline float2 ExponentsOf(const QuarterSplat& s, const Lane& lane) {
  constexpr float kApart = kQuarter / 2;
  const float x = lane.from_middle_x, y0 = lane.from_middle_y, y1 = y0 + kApart;
  const float of_row = s.constant + x * s.of_x + x * x * s.a, slope = s.of_y + x * s.b;
  return {of_row + y0 * (slope + y0 * s.c), of_row + y1 * (slope + y1 * s.c)};
}

// A pixel on its way through a list. BlendStep() with fewer operations: `transmittance` goes on
// falling behind the pixel's end, and is then below kMinTransmittance for good.
struct Pixel {
  float transmittance;
  float left = 1;  // the transmittance before the end

  __device__ explicit Pixel(bool inside) : transmittance(inside ? 1.0f : 0.0f) {}
  __device__ bool IsOpen() const { return transmittance >= kMinTransmittance; }
  __device__ void End() { transmittance = 0; }

  // Whether a splat is blended, and its weight then. In PTX: the compiler would select values
  // instead of skipping operations, and selections run at half the rate.
  __device__ unsigned Blends(float exponent, float* weight) {
    *weight = fminf(kMaxAlpha, PowerOfTwo(exponent)) * transmittance;
    unsigned blends;
    asm("{\n"
        ".reg .pred reaches, blends;\n"
        "setp.ge.f32 reaches, %3, %5;\n"
        "@reaches sub.f32 %0, %0, %4;\n"
        "setp.ge.and.f32 blends, %0, %6, reaches;\n"
        "@blends mov.f32 %1, %0;\n"
        "selp.u32 %2, 1, 0, blends;\n"
        "}"
        : "+f"(transmittance), "+f"(left), "=r"(blends)
        : "f"(exponent), "f"(*weight), "f"(kLog2MinAlpha), "f"(kMinTransmittance));
    return blends;
  }
  // The weight of a splat, 0 if it is not blended.
  __device__ float Blend(float exponent) {
    float weight;
    return Blends(exponent, &weight) ? weight : 0.0f;
  }
  // Adds the weighted values of a splat to the sums.
  template <int C>
  __device__ void Add(float exponent, const float* values, float* sums) {
    float weight;
    const unsigned blends = Blends(exponent, &weight);
#pragma unroll
    for (int c = 0; c < C; ++c) {
      asm("{\n"
          ".reg .pred blends;\n"
          "setp.ne.u32 blends, %1, 0;\n"
          "@blends fma.rn.f32 %0, %2, %3, %0;\n"
          "}"
          : "+f"(sums[c])
          : "r"(blends), "f"(weight), "f"(values[c]));
    }
  }
};

// The splats of one batch that reach a quarter, per warp.
template <typename Payload>
struct Batch {
  struct __align__(16) Item {
    QuarterSplat splat;
    Payload payload;
  };
  Item items[32];
};

// Walks the list of `tile` for this warp, front to back. `visit` gets (batch, count): batches of
// the splats that reach the quarter. `load`, called as (row, splat, payload*) on the lane that read
// the entry, fills the payload. The walk stops when no pixel of the warp is open.
template <typename Payload, typename Load, typename Visit, typename IsOpen>
__device__ void WalkTile(const TileLists& lists, int index, const Lane& lane, Batch<Payload>* batch,
                         const Load& load, const Visit& visit, const IsOpen& is_open) {
  const int2 range = lists.ranges[index];
  const int lane_id = threadIdx.x % 32;
  int next = range.x + lane_id < range.y ? lists.entries[range.x + lane_id] : 0;
  for (int first = range.x; first < range.y; first += 32) {
    if (!__any_sync(kFullWarp, is_open())) return;
    const int e = first + lane_id, source = next;
    bool reaches = false;
    Splat splat;
    if (e < range.y) {
      const float4* from = reinterpret_cast<const float4*>(lists.splats + source);
      *reinterpret_cast<float4*>(&splat) = __ldg(from);
      *(reinterpret_cast<float4*>(&splat) + 1) = __ldg(from + 1);
      if (e + 32 < range.y) next = lists.entries[e + 32];
      reaches = ReachesQuarter(splat, lane.quarter_x, lane.quarter_y);
    }
    const unsigned kept = __ballot_sync(kFullWarp, reaches);
    if (reaches) {
      auto& item = batch->items[__popc(kept & ((1u << lane_id) - 1))];
      item.splat = AboutMiddle(splat, lane.quarter_x, lane.quarter_y);
      load(lists.splat_rows ? lists.splat_rows[source] : source, splat, &item.payload);
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
