// SPDX-License-Identifier: BSD-3-Clause
// Semi-global matching: census transforms, a byte of cost for each pixel and disparity, one volume
// of aggregated costs a path, then the best disparity both ways. Done in matcher pixels (u, v), see
// kernels/common/stereo_match.h, which has the rules that all backends share.
//
// Aggregation follows Hirschmueller (2008): L(p, d) = C(p, d) + min(L(q, d), L(q, d +- 1) + P1,
// min_k L(q, k) + P2) - min_k L(q, k), q the pixel before p on the path. L is at most the largest
// cost plus P2, which is kept below 256, so that a byte holds it.
#include "kernels/common/stereo_match.h"
#include "kernels/cuda/stereo.cuh"

namespace retint::cuda {
namespace {

constexpr uint64_t kFlat = uint64_t{1} << 63;

// A pixel's costs are bytes, four to a word. Eight lanes of a warp share a pixel. Lane l has the W
// = count / 32 words of the disparities from 4 W l on. Word w of them is at [w * kLanes + l], so
// that the lanes lie side by side.
constexpr int kLanes = 8;

// census [v, u]: a bit for each other pixel of the window, set if it is darker than the middle;
// kFlat if none is darker or brighter. `image` holds the oriented image from (offset_x, offset_y)
// on, rows of `stride`.
__global__ void CensusKernel(MatcherAxes at, const float* image, int offset_x, int offset_y,
                             int stride, uint64_t* census) {
  constexpr int kTileU = kBlockX + 2 * kCensusU, kTileV = kBlockY + 2 * kCensusV;
  __shared__ float tile[kTileV][kTileU];
  const int u0 = int(blockIdx.x) * kBlockX, v0 = int(blockIdx.y) * kBlockY;
  for (int i = threadIdx.y * kBlockX + threadIdx.x; i < kTileU * kTileV; i += kBlockX * kBlockY) {
    const MatcherAxes::Pixel pixel = at.At(Clamped(u0 + i % kTileU - kCensusU, at.width),
                                           Clamped(v0 + i / kTileU - kCensusV, at.height));
    tile[i / kTileU][i % kTileU] = image[int64_t(pixel.y + offset_y) * stride + pixel.x + offset_x];
  }
  __syncthreads();
  const int u = u0 + threadIdx.x, v = v0 + threadIdx.y;
  if (u >= at.width || v >= at.height) return;
  const float middle = tile[threadIdx.y + kCensusV][threadIdx.x + kCensusU];
  uint64_t bits = 0;
  bool flat = true;
#pragma unroll
  for (int j = 0; j <= 2 * kCensusV; ++j) {
#pragma unroll
    for (int i = 0; i <= 2 * kCensusU; ++i) {
      if (i == kCensusU && j == kCensusV) continue;
      const float other = tile[threadIdx.y + j][threadIdx.x + i];
      bits = bits << 1 | uint64_t(other < middle);
      flat = flat && other == middle;
    }
  }
  census[int64_t(v) * at.width + u] = flat ? kFlat : bits;
}

// costs [v, u, count]. A thread has four disparities and walks along u, so that each step needs one
// new census of the shifted view. Flat windows of the reference say nothing: every disparity costs
// the same there.
constexpr int kSegment = 32;  // pixels a thread
__global__ void CostKernel(int width, int height, int lowest, int count, const uint64_t* reference,
                           const uint64_t* shifted, uint32_t* costs) {
  const int v = blockIdx.y, first = (int(blockIdx.x) * blockDim.y + threadIdx.y) * kSegment;
  if (first >= width) return;
  const int d = lowest + 4 * int(threadIdx.x);
  const int words = count / kStereoCountStep;  // a lane
  const int slot = int(threadIdx.x) % words * kLanes + int(threadIdx.x) / words;
  const uint64_t* from = shifted + int64_t(v) * width;
  const auto census_at = [&](int u) { return u >= 0 ? from[u] : 0; };
  uint64_t window[4];  // of disparities d ... d + 3
#pragma unroll
  for (int i = 1; i < 4; ++i) window[i - 1] = census_at(first - d - i);
  const int end = first + kSegment < width ? first + kSegment : width;
  for (int u = first; u < end; ++u) {
    const uint64_t own = reference[int64_t(v) * width + u];
#pragma unroll
    for (int i = 3; i > 0; --i) window[i] = window[i - 1];
    window[0] = census_at(u - d);
    uint32_t word = 0;
#pragma unroll
    for (int i = 0; i < 4; ++i) {
      const uint32_t cost = u - d - i >= 0 ? uint32_t(__popcll(own ^ window[i])) : kMaxCensusCost;
      word |= cost << 8 * i;
    }
    if (own == kFlat) word = 0;
    costs[(int64_t(v) * width + u) * (count / 4) + slot] = word;
  }
}

// The `W` words of a lane.
template <int W>
__device__ void LoadWords(const uint32_t* from, uint32_t (&words)[W]) {
#pragma unroll
  for (int w = 0; w < W; ++w) words[w] = __ldg(from + w * kLanes);
}

// Four bytes as two pairs of 16 bits, and back.
__device__ uint32_t LowPair(uint32_t word) { return __byte_perm(word, 0, 0x4140); }
__device__ uint32_t HighPair(uint32_t word) { return __byte_perm(word, 0, 0x4342); }
__device__ uint32_t Bytes(uint32_t low, uint32_t high) { return __byte_perm(low, high, 0x6420); }
// The last of `a` and the first of `b`.
__device__ uint32_t Between(uint32_t a, uint32_t b) { return __byte_perm(a, b, 0x5432); }

struct Volumes {
  int width, height;
  uint32_t penalty1, penalty2;  // in both halves
  const uint32_t* costs;        // [height, width, count] bytes
  uint32_t* paths;              // [paths, height, width, count] bytes
};

constexpr int kPaths = 4;
constexpr int kPathThreads = 128;

// Eight lanes a line; a lane has 4 W neighbouring disparities, in pairs of 16 bits.
template <int W>
__global__ void __launch_bounds__(kPathThreads) PathKernel(Volumes in) {
  constexpr int kPixelWords = kLanes * W;
  const bool along_u = blockIdx.y < 2, forward = blockIdx.y % 2 == 0;
  const int lines = along_u ? in.height : in.width, steps = along_u ? in.width : in.height;
  int line = (int(blockIdx.x) * kPathThreads + int(threadIdx.x)) / kLanes;
  const int lane = threadIdx.x % kLanes;
  if (line / 4 * 4 >= lines) return;  // the whole warp
  const bool stores = line < lines;
  if (!stores) line = lines - 1;
  // Words from one pixel of the line to the next.
  const int64_t step = int64_t(along_u ? 1 : in.width) * kPixelWords * (forward ? 1 : -1);
  int64_t at = int64_t(along_u ? line * in.width : line) * kPixelWords + lane;
  if (!forward) at -= step * (steps - 1);
  const uint32_t* ahead = in.costs + at;
  uint32_t* out = in.paths + int64_t(blockIdx.y) * in.width * in.height * kPixelWords + at;

  // Costs come a group of steps at a time while the group before is worked on: loads that were
  // issued one by one would be waited for one by one.
  constexpr int kGroup = W <= 4 ? 8 : 4;
  uint32_t next[kGroup][W];
  const auto load = [&](int from) {
#pragma unroll
    for (int i = 0; i < kGroup; ++i) {
      if (from + i < steps) LoadWords<W>(ahead, next[i]);
      ahead += step;
    }
  };
  load(0);
  uint32_t state[2 * W] = {};  // L of the pixel before
  uint32_t least = 0;          // their minimum, in both halves
  for (int first = 0; first < steps; first += kGroup) {
    uint32_t group[kGroup][W];
#pragma unroll
    for (int i = 0; i < kGroup; ++i) {
#pragma unroll
      for (int w = 0; w < W; ++w) group[i][w] = next[i][w];
    }
    load(first + kGroup);
#pragma unroll
    for (int i = 0; i < kGroup; ++i) {
      if (first + i >= steps) break;
      constexpr uint32_t kFar = 0x3fff3fff;
      uint32_t before = __shfl_up_sync(kFullWarp, state[2 * W - 1], 1, kLanes);
      uint32_t after = __shfl_down_sync(kFullWarp, state[0], 1, kLanes);
      if (lane == 0) before = kFar;
      if (lane == kLanes - 1) after = kFar;
      const uint32_t jump = least + in.penalty2;
      uint32_t lowest = 0xffffffff;
#pragma unroll
      for (int j = 0; j < 2 * W; ++j) {
        const uint32_t own = state[j];
        const uint32_t right = j + 1 < 2 * W ? state[j + 1] : after;
        const uint32_t near = __vminu2(Between(before, own), Between(own, right)) + in.penalty1;
        const uint32_t cost = j % 2 ? HighPair(group[i][j / 2]) : LowPair(group[i][j / 2]);
        state[j] = cost + __vminu2(__vminu2(own, near), jump) - least;
        lowest = __vminu2(lowest, state[j]);
        before = own;
      }
      if (stores) {
#pragma unroll
        for (int w = 0; w < W; ++w) {
          out[w * kLanes] = Bytes(state[2 * w], state[2 * w + 1]);
        }
      }
      out += step;
      lowest = __vminu2(lowest, lowest >> 16 | lowest << 16);
#pragma unroll
      for (int offset = 1; offset < kLanes; offset *= 2) {
        lowest = __vminu2(lowest, __shfl_xor_sync(kFullWarp, lowest, offset));
      }
      least = lowest;
    }
  }
}

template <typename T, typename Op>
__device__ T ReduceLanes(T value, const Op& op) {
#pragma unroll
  for (int offset = 1; offset < kLanes; offset *= 2) {
    value = op(value, __shfl_xor_sync(kFullWarp, value, offset));
  }
  return value;
}

struct Selection {
  MatcherAxes at;
  int2 to_grid;  // adds to an image pixel of the shifted view
  int grid_width, grid_height;
  int lowest, uniqueness_percent;
  float tolerance;
  const uint32_t* volumes;  // [paths, height, width, count] bytes
  float* disparity;         // [grid_height, grid_width]
};

constexpr int kSelectThreads = 256;

// A block a row. The best disparity of each pixel, and by the same sums that of each pixel of the
// shifted view; those that lead to each other are kept.
template <int W>
__global__ void __launch_bounds__(kSelectThreads) SelectKernel(Selection in) {
  extern __shared__ uint32_t shared[];
  const int width = in.at.width, v = blockIdx.x;
  uint32_t* other = shared;                               // [width] sum << 16 | index
  float* own = reinterpret_cast<float*>(shared + width);  // [width]
  for (int u = threadIdx.x; u < width; u += kSelectThreads) other[u] = UINT32_MAX;
  __syncthreads();

  constexpr int kPixelWords = kLanes * W, kCount = 4 * kPixelWords;
  const int lane = threadIdx.x % kLanes, warp = threadIdx.x / 32;
  // Pixels of a warp lie 8 apart: their minima land in different banks.
  const int within = (threadIdx.x % 32) / kLanes * 8 + warp;
  static_assert(kSelectThreads == 256);
  const int64_t volume = int64_t(in.at.height) * width * kPixelWords;
  const auto min_of = [](uint32_t a, uint32_t b) { return a < b ? a : b; };
  for (int first = 0; first < width; first += 32) {
    const int u = first + within;
    const bool inside = u < width;
    const uint32_t* from =
        in.volumes + (int64_t(v) * width + (inside ? u : width - 1)) * kPixelWords + lane;
    uint32_t sums[2 * W] = {};
#pragma unroll
    for (int path = 0; path < kPaths; ++path) {
      uint32_t words[W];
      LoadWords<W>(from + path * volume, words);
#pragma unroll
      for (int w = 0; w < W; ++w) {
        sums[2 * w] += LowPair(words[w]);
        sums[2 * w + 1] += HighPair(words[w]);
      }
    }
    uint32_t best = UINT32_MAX;
#pragma unroll
    for (int j = 0; j < 4 * W; ++j) {
      const int index = 4 * W * lane + j;
      const uint32_t sum = j % 2 ? sums[j / 2] >> 16 : sums[j / 2] & 0xffff;
      const uint32_t key = sum << 16 | uint32_t(index);
      best = min_of(best, key);
      const int there = u - in.lowest - index;
      if (inside && there >= 0) atomicMin(&other[there], key);
    }
    best = ReduceLanes(best, min_of);
    const int index = int(best & 0xffff);
    uint32_t second = UINT32_MAX, neighbours = 0;  // sums at index - 1 and, above, index + 1
#pragma unroll
    for (int j = 0; j < 4 * W; ++j) {
      const int away = 4 * W * lane + j - index;
      const uint32_t sum = j % 2 ? sums[j / 2] >> 16 : sums[j / 2] & 0xffff;
      if (away < -1 || away > 1) second = min_of(second, sum);
      if (away == -1) neighbours |= sum;
      if (away == 1) neighbours |= sum << 16;
    }
    second = ReduceLanes(second, min_of);
    neighbours = ReduceLanes(neighbours, [](uint32_t a, uint32_t b) { return a | b; });
    if (!inside || lane != 0) continue;
    const int least = int(best >> 16);
    float s = float(in.lowest + index);
    if (index > 0 && index < kCount - 1) {
      const int below = int(neighbours & 0xffff), above = int(neighbours >> 16);
      s += SubPixelOffset(below, least, above);
    }
    own[u] = IsUnique(least, int(second), in.uniqueness_percent) && u - in.lowest - index >= 0
                 ? s
                 : -1.0f;
  }
  __syncthreads();
  for (int u = threadIdx.x; u < width; u += kSelectThreads) {
    float s = own[u];
    if (s >= 0) {
      const int there = u - int(s + 0.5f);
      const uint32_t key = there >= 0 ? other[there] : UINT32_MAX;
      const float back = float(in.lowest + int(key & 0xffff));
      if (key == UINT32_MAX || fabsf(back - s) > in.tolerance) s = -1.0f;
    }
    const MatcherAxes::Pixel pixel = in.at.At(u, v);
    const int x = pixel.x + in.to_grid.x, y = pixel.y + in.to_grid.y;
    if (x >= 0 && y >= 0 && x < in.grid_width && y < in.grid_height) {
      in.disparity[int64_t(y) * in.grid_width + x] = s;
    }
  }
}

template <int W>
void Aggregate(const Volumes& volumes, const Selection& selection, cudaStream_t stream) {
  const int lines = volumes.width > volumes.height ? volumes.width : volumes.height;
  PathKernel<W>
      <<<dim3(Blocks(int64_t(lines) * kLanes, kPathThreads), kPaths), kPathThreads, 0, stream>>>(
          volumes);
  Check(cudaGetLastError(), "PathKernel");
  const size_t shared = size_t(volumes.width) * 8;
  if (shared > 48 * 1024) {
    Check(cudaFuncSetAttribute(SelectKernel<W>, cudaFuncAttributeMaxDynamicSharedMemorySize,
                               int(shared)),
          "cudaFuncSetAttribute");
  }
  SelectKernel<W><<<unsigned(volumes.height), kSelectThreads, shared, stream>>>(selection);
  Check(cudaGetLastError(), "SelectKernel");
}

void Census(const MatcherAxes& at, const StereoView& view, int offset_x, int offset_y,
            uint64_t* census, cudaStream_t stream) {
  CensusKernel<<<PixelBlocks(at.width, at.height), PixelThreads(), 0, stream>>>(
      at, view.gray, offset_x, offset_y, view.width, census);
  Check(cudaGetLastError(), "CensusKernel");
}

}  // namespace

void MatchStereo(const StereoMatchParams& params, cudaStream_t stream) {
  const StereoView& shifted = params.shifted;
  const MatcherAxes at = AxesOf(shifted);
  const size_t pixels = size_t(at.width) * size_t(at.height);
  const int words = params.count / kStereoCountStep;
  Scratch<uint64_t> own(stream, pixels), other(stream, pixels);
  Census(at, params.reference, shifted.x - params.reference.x, shifted.y - params.reference.y,
         own.data(), stream);
  Census(at, shifted, 0, 0, other.data(), stream);
  Scratch<uint32_t> costs(stream, pixels * size_t(params.count / 4));
  const dim3 threads(unsigned(params.count / 4), unsigned(128 / (params.count / 4)));
  CostKernel<<<dim3(Blocks(at.width, kSegment * int(threads.y)), unsigned(at.height)), threads, 0,
               stream>>>(at.width, at.height, params.lowest, params.count, own.data(), other.data(),
                         costs.data());
  Check(cudaGetLastError(), "CostKernel");

  Scratch<uint32_t> paths(stream, costs.size() * kPaths);
  const auto both = [](int value) { return uint32_t(value) | uint32_t(value) << 16; };
  const Volumes volumes{at.width,        at.height,    both(params.p1),
                        both(params.p2), costs.data(), paths.data()};
  const Selection selection{at,
                            {shifted.x, shifted.y},
                            params.width,
                            params.height,
                            params.lowest,
                            params.uniqueness_percent,
                            params.tolerance,
                            paths.data(),
                            params.disparity};
  switch (words) {
    case 1:
      return Aggregate<1>(volumes, selection, stream);
    case 2:
      return Aggregate<2>(volumes, selection, stream);
    case 3:
      return Aggregate<3>(volumes, selection, stream);
    case 4:
      return Aggregate<4>(volumes, selection, stream);
    case 5:
      return Aggregate<5>(volumes, selection, stream);
    case 6:
      return Aggregate<6>(volumes, selection, stream);
    case 7:
      return Aggregate<7>(volumes, selection, stream);
    default:
      return Aggregate<8>(volumes, selection, stream);
  }
}

}  // namespace retint::cuda
