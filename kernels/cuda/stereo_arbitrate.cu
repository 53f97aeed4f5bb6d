// SPDX-License-Identifier: BSD-3-Clause
// Arbitration on the device, by the rules of kernels/common/stereo.h.
#include "kernels/common/stereo.h"
#include "kernels/cuda/launch.cuh"
#include "kernels/cuda/stereo.cuh"

namespace retint::cuda {
namespace {

using namespace arbitration;

// Least and largest disparity of a row within reach, [height, width].
__global__ void RowRangeKernel(const float* disparity, int width, float2* range) {
  constexpr int kSpan = 256 + 2 * kEdgeReach;
  __shared__ float row[kSpan];
  const int x0 = int(blockIdx.x) * 256, y = blockIdx.y;
  for (int i = threadIdx.x; i < kSpan; i += 256) {
    row[i] = disparity[int64_t(y) * width + Clamped(x0 + i - kEdgeReach, width)];
  }
  __syncthreads();
  const int x = x0 + threadIdx.x;
  if (x >= width) return;
  float low = row[threadIdx.x], high = low;
  for (int i = 1; i <= 2 * kEdgeReach; ++i) {
    low = fminf(low, row[threadIdx.x + i]);
    high = fmaxf(high, row[threadIdx.x + i]);
  }
  range[int64_t(y) * width + x] = {low, high};
}

// 1 where a jump of disparity lies within reach.
__global__ void NearEdgesKernel(const float2* range, int width, int height, uint8_t* near_edges) {
  constexpr int kRows = 64, kSpan = kRows + 2 * kEdgeReach;
  __shared__ float2 tile[kSpan][kBlockX];
  const int x = int(blockIdx.x) * kBlockX + int(threadIdx.x), y0 = int(blockIdx.y) * kRows;
  const int column = x < width ? x : width - 1;
  for (int i = threadIdx.y; i < kSpan; i += kBlockY) {
    tile[i][threadIdx.x] = range[int64_t(Clamped(y0 + i - kEdgeReach, height)) * width + column];
  }
  __syncthreads();
  if (x >= width) return;
  for (int i = threadIdx.y; i < kRows && y0 + i < height; i += kBlockY) {
    float2 all = tile[i][threadIdx.x];
    for (int j = 1; j <= 2 * kEdgeReach; ++j) {
      const float2 other = tile[i + j][threadIdx.x];
      all = {fminf(all.x, other.x), fmaxf(all.y, other.y)};
    }
    near_edges[int64_t(y0 + i) * width + x] = all.y - all.x > kEdgeJump;
  }
}

__device__ float Level(float value) { return 255 * fminf(fmaxf(value, 0.0f), 1.0f); }

// Color difference when pixel (x, y) has disparity s, capped.
__device__ float ColorCost(const StereoView& reference, const StereoView& view, int x, int y,
                           float s) {
  s = fmaxf(s, 0.0f);
  const float at_x = float(x - view.x) + float(view.dx) * s;
  const float at_y = float(y - view.y) + float(view.dy) * s;
  const float fx = floorf(at_x), fy = floorf(at_y);
  const int x0 = Clamped(int(fx), view.width), x1 = Clamped(int(fx) + 1, view.width);
  const int y0 = Clamped(int(fy), view.height), y1 = Clamped(int(fy) + 1, view.height);
  // The motion is along one axis: two pixels, not four.
  const float* first = view.rgb + 3 * (int64_t(y0) * view.width + x0);
  const float* second =
      view.rgb + 3 * (view.dx ? int64_t(y0) * view.width + x1 : int64_t(y1) * view.width + x0);
  const float share = view.dx ? at_x - fx : at_y - fy;
  const float* own =
      reference.rgb + 3 * (int64_t(y - reference.y) * reference.width + (x - reference.x));
  float sum = 0;
#pragma unroll
  for (int c = 0; c < 3; ++c) {
    const float a = Level(first[c]), b = Level(second[c]);
    sum += fabsf(Level(own[c]) - (a + share * (b - a)));
  }
  return fminf(sum, kCostCap);
}

__global__ void __launch_bounds__(kBlockX* kBlockY)
    VerdictKernel(StereoArbitrateParams in, const uint8_t* near_edges, uint8_t* verdicts) {
  constexpr int kTileX = kBlockX + 2 * kCostRadius, kTileY = kBlockY + 2 * kCostRadius;
  __shared__ float costs[2 * kMaxStereoViews][kTileY][kTileX];
  const int x0 = int(blockIdx.x) * kBlockX, y0 = int(blockIdx.y) * kBlockY;
  const int thread = threadIdx.y * kBlockX + threadIdx.x;
  for (int i = thread; i < kTileX * kTileY; i += kBlockX * kBlockY) {
    const int x = Reflected(x0 + i % kTileX - kCostRadius, in.width);
    const int y = Reflected(y0 + i / kTileX - kCostRadius, in.height);
    const float s = in.disparity[int64_t(y) * in.width + x];
    const float r = in.rough[int64_t(y) * in.width + x];
    for (int k = 0; k < in.num_shifted; ++k) {
      costs[2 * k][i / kTileX][i % kTileX] = ColorCost(in.reference, in.shifted[k], x, y, s);
      costs[2 * k + 1][i / kTileX][i % kTileX] = ColorCost(in.reference, in.shifted[k], x, y, r);
    }
  }
  __syncthreads();
  const int x = x0 + threadIdx.x, y = y0 + threadIdx.y;
  if (x >= in.width || y >= in.height) return;
  // Of stereo and of the rough depth: the mean over the two views that agree best.
  float of[2];
  for (int which = 0; which < 2; ++which) {
    BestTwo two;
    for (int k = 0; k < in.num_shifted; ++k) {
      float sum = 0;
#pragma unroll
      for (int j = 0; j <= 2 * kCostRadius; ++j) {
#pragma unroll
        for (int i = 0; i <= 2 * kCostRadius; ++i) {
          sum += costs[2 * k + which][threadIdx.y + j][threadIdx.x + i];
        }
      }
      two.Add(sum / float((2 * kCostRadius + 1) * (2 * kCostRadius + 1)));
    }
    of[which] = two.Mean();
  }
  const int64_t pixel = int64_t(y) * in.width + x;
  verdicts[pixel] =
      VerdictOf(in.disparity[pixel], in.rough[pixel], of[0], of[1], near_edges[pixel] != 0);
}

// `rounds` steps of growth of confirmed rough depth into ties, a pixel a step, along surfaces
// without a jump. A block's square has a margin as wide as it can grow.
constexpr int kGrowBlock = 32, kGrowRounds = 8;
__global__ void __launch_bounds__(256)
    ContinueKernel(const float* rough, int width, int height, const uint8_t* from, uint8_t* to) {
  constexpr int kSide = kGrowBlock + 2 * kGrowRounds, kEach = kSide * kSide / 256;
  static_assert(kSide * kSide % 256 == 0);
  __shared__ uint8_t verdicts[kSide][kSide];
  __shared__ float depths[kSide][kSide];
  const int x0 = int(blockIdx.x) * kGrowBlock - kGrowRounds;
  const int y0 = int(blockIdx.y) * kGrowBlock - kGrowRounds;
  for (int i = threadIdx.x; i < kSide * kSide; i += 256) {
    const int x = x0 + i % kSide, y = y0 + i / kSide;
    const bool inside = x >= 0 && y >= 0 && x < width && y < height;
    const int64_t pixel = int64_t(y) * width + x;
    verdicts[i / kSide][i % kSide] = inside ? from[pixel] : uint8_t(kStereo);
    depths[i / kSide][i % kSide] = inside ? rough[pixel] : 0.0f;
  }
  __syncthreads();
  const auto continues = [&](int x, int y, int nx, int ny) {
    if (nx < 0 || ny < 0 || nx >= kSide || ny >= kSide) return false;
    return Confirms(Verdict(verdicts[ny][nx])) && IsSameSurface(depths[y][x], depths[ny][nx]);
  };
  for (int round = 0; round < kGrowRounds; ++round) {
    unsigned grown = 0;
#pragma unroll
    for (int n = 0; n < kEach; ++n) {
      const int i = n * 256 + int(threadIdx.x), x = i % kSide, y = i / kSide;
      if (verdicts[y][x] == kTie && (continues(x, y, x + 1, y) || continues(x, y, x - 1, y) ||
                                     continues(x, y, x, y + 1) || continues(x, y, x, y - 1))) {
        grown |= 1u << n;
      }
    }
    if (!__syncthreads_or(int(grown))) break;
#pragma unroll
    for (int n = 0; n < kEach; ++n) {
      const int i = n * 256 + int(threadIdx.x);
      if (grown >> n & 1) verdicts[i / kSide][i % kSide] = kContinued;
    }
    __syncthreads();
  }
  for (int i = threadIdx.x; i < kGrowBlock * kGrowBlock; i += 256) {
    const int sx = kGrowRounds + i % kGrowBlock, sy = kGrowRounds + i / kGrowBlock;
    const int x = x0 + sx, y = y0 + sy;
    if (x < width && y < height) to[int64_t(y) * width + x] = verdicts[sy][sx];
  }
}

}  // namespace

void ArbitrateStereo(const StereoArbitrateParams& in, cudaStream_t stream) {
  const int width = in.width, height = in.height;
  const size_t pixels = size_t(width) * size_t(height);
  Scratch<float2> range(stream, pixels);
  Scratch<uint8_t> near_edges(stream, pixels), verdicts(stream, pixels), grown(stream, pixels);
  RowRangeKernel<<<dim3(Blocks(width, 256), unsigned(height)), 256, 0, stream>>>(
      in.disparity, width, range.data());
  Check(cudaGetLastError(), "RowRangeKernel");
  NearEdgesKernel<<<dim3(Blocks(width, kBlockX), Blocks(height, 64)), PixelThreads(), 0, stream>>>(
      range.data(), width, height, near_edges.data());
  Check(cudaGetLastError(), "NearEdgesKernel");
  VerdictKernel<<<PixelBlocks(width, height), PixelThreads(), 0, stream>>>(in, near_edges.data(),
                                                                           verdicts.data());
  Check(cudaGetLastError(), "VerdictKernel");
  static_assert(kMaxGrowth % kGrowRounds == 0);
  uint8_t *from = verdicts.data(), *to = grown.data();
  for (int round = 0; round < kMaxGrowth; round += kGrowRounds) {
    ContinueKernel<<<dim3(Blocks(width, kGrowBlock), Blocks(height, kGrowBlock)), 256, 0, stream>>>(
        in.rough, width, height, from, to);
    Check(cudaGetLastError(), "ContinueKernel");
    uint8_t* const written = to;
    to = from, from = written;
  }
  ForEach(int64_t(pixels), stream, "Settle", [=] __device__(int64_t i) {
    const float s = in.disparity[i], r = in.rough[i];
    const auto verdict = Verdict(from[i]);
    in.measured[i] = IsMeasured(verdict, s) ? 255 : 0;
    in.disparity[i] = Settled(verdict, s, r);
  });
}

}  // namespace retint::cuda
