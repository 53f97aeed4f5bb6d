// SPDX-License-Identifier: BSD-3-Clause
// Refinement on the device, by the rules of kernels/common/stereo.h.
#include "kernels/common/stereo.h"
#include "kernels/cuda/stereo.cuh"

namespace retint::cuda {
namespace {

using namespace refinement;

// Cubic convolution with a = -0.75 (Keys 1981; OpenCV's constant) along the motion.
__device__ float Sample(const StereoView& view, int x, int y, float s) {
  const float at =
      view.dx ? float(x - view.x) + float(view.dx) * s : float(y - view.y) + float(view.dy) * s;
  const float base = floorf(at), t = at - base;
  constexpr float a = -0.75f;
  float weights[4];
  weights[0] = ((a * (t + 1) - 5 * a) * (t + 1) + 8 * a) * (t + 1) - 4 * a;
  weights[1] = ((a + 2) * t - (a + 3)) * t * t + 1;
  weights[2] = ((a + 2) * (1 - t) - (a + 3)) * (1 - t) * (1 - t) + 1;
  weights[3] = 1 - weights[0] - weights[1] - weights[2];
  float sum = 0;
#pragma unroll
  for (int i = 0; i < 4; ++i) {
    const int n = int(base) + i - 1;
    const int64_t pixel = view.dx ? int64_t(y - view.y) * view.width + Clamped(n, view.width)
                                  : int64_t(Clamped(n, view.height)) * view.width + (x - view.x);
    sum += weights[i] * view.gray[pixel];
  }
  return sum;
}

__global__ void SmoothKernel(const float* disparity, int width, int height, uint8_t* smooth) {
  const int x = int(blockIdx.x) * kBlockX + int(threadIdx.x);
  const int y = int(blockIdx.y) * kBlockY + int(threadIdx.y);
  if (x >= width || y >= height) return;
  float low = disparity[int64_t(y) * width + x], high = low;
  for (int j = -kRadius; j <= kRadius; ++j) {
    const float* row = disparity + int64_t(Clamped(y + j, height)) * width;
    for (int i = -kRadius; i <= kRadius; ++i) {
      const float s = row[Clamped(x + i, width)];
      low = fminf(low, s);
      high = fmaxf(high, s);
    }
  }
  smooth[int64_t(y) * width + x] = IsSmooth(low, high);
}

// A step moves a window as one; smoothing first removes the stairs that it would keep.
__global__ void BlurKernel(const float* disparity, const uint8_t* smooth, int width, int height,
                           float* out) {
  const int x = int(blockIdx.x) * kBlockX + int(threadIdx.x);
  const int y = int(blockIdx.y) * kBlockY + int(threadIdx.y);
  if (x >= width || y >= height) return;
  const int64_t pixel = int64_t(y) * width + x;
  float s = disparity[pixel];
  if (smooth[pixel]) {
    float sum = 0;
    for (int j = -kBlurRadius; j <= kBlurRadius; ++j) {
      const float* row = disparity + int64_t(Clamped(y + j, height)) * width;
      for (int i = -kBlurRadius; i <= kBlurRadius; ++i) sum += row[Clamped(x + i, width)];
    }
    s = sum / float((2 * kBlurRadius + 1) * (2 * kBlurRadius + 1));
  }
  out[pixel] = s;
}

// Normal equations of the disparity's increment: {sum w g r, sum w g^2} over the shifted views, r
// the difference of gray, g its derivative.
__global__ void __launch_bounds__(kBlockX* kBlockY)
    EquationsKernel(StereoRefineParams in, const float* disparity, float2* equations) {
  constexpr int kTileX = kBlockX + 2, kTileY = kBlockY + 2;
  __shared__ float means[kTileY][kTileX];  // of the reference and the warped view
  const int x0 = int(blockIdx.x) * kBlockX, y0 = int(blockIdx.y) * kBlockY;
  const int x = x0 + int(threadIdx.x), y = y0 + int(threadIdx.y);
  const bool inside = x < in.width && y < in.height;
  const auto own = [&](int px, int py) {
    return in.reference
        .gray[int64_t(py - in.reference.y) * in.reference.width + (px - in.reference.x)];
  };
  float2 sum{0, 0};
  for (int k = 0; k < in.num_shifted; ++k) {
    const StereoView& view = in.shifted[k];
    __syncthreads();
    for (int i = threadIdx.y * kBlockX + threadIdx.x; i < kTileX * kTileY; i += kBlockX * kBlockY) {
      const int px = Clamped(x0 + i % kTileX - 1, in.width);
      const int py = Clamped(y0 + i / kTileX - 1, in.height);
      const float s = fmaxf(disparity[int64_t(py) * in.width + px], 0.0f);
      means[i / kTileX][i % kTileX] = 0.5f * (own(px, py) + Sample(view, px, py, s));
    }
    __syncthreads();
    if (!inside || !(disparity[int64_t(y) * in.width + x] > 0)) continue;
    const auto mean = [&](int i, int j) { return means[threadIdx.y + 1 + j][threadIdx.x + 1 + i]; };
    // Along the motion, by Sobel.
    const float gradient = view.dx
                               ? float(view.dx) / 8 *
                                     (mean(1, -1) - mean(-1, -1) + 2 * (mean(1, 0) - mean(-1, 0)) +
                                      mean(1, 1) - mean(-1, 1))
                               : float(view.dy) / 8 *
                                     (mean(-1, 1) - mean(-1, -1) + 2 * (mean(0, 1) - mean(0, -1)) +
                                      mean(1, 1) - mean(1, -1));
    const float residual = 2 * (own(x, y) - mean(0, 0));
    const float weight = WeightOf(residual);
    sum.x += weight * gradient * residual;
    sum.y += weight * gradient * gradient;
  }
  if (inside) equations[int64_t(y) * in.width + x] = sum;
}

__global__ void __launch_bounds__(kBlockX* kBlockY)
    StepKernel(const float2* equations, const uint8_t* smooth, const float* start,
               const float* blurred, int width, int height, float* disparity) {
  constexpr int kTileX = kBlockX + 2 * kRadius, kTileY = kBlockY + 2 * kRadius;
  __shared__ float2 tile[kTileY][kTileX];
  const int x0 = int(blockIdx.x) * kBlockX, y0 = int(blockIdx.y) * kBlockY;
  for (int i = threadIdx.y * kBlockX + threadIdx.x; i < kTileX * kTileY; i += kBlockX * kBlockY) {
    const int x = Reflected(x0 + i % kTileX - kRadius, width);
    const int y = Reflected(y0 + i / kTileX - kRadius, height);
    tile[i / kTileX][i % kTileX] = equations[int64_t(y) * width + x];
  }
  __syncthreads();
  const int x = x0 + int(threadIdx.x), y = y0 + int(threadIdx.y);
  if (x >= width || y >= height) return;
  const int64_t pixel = int64_t(y) * width + x;
  float s = blurred[pixel];
  if (smooth[pixel]) {
    float2 sum{0, 0};
#pragma unroll
    for (int j = 0; j <= 2 * kRadius; ++j) {
#pragma unroll
      for (int i = 0; i <= 2 * kRadius; ++i) {
        const float2 one = tile[threadIdx.y + j][threadIdx.x + i];
        sum.x += one.x;
        sum.y += one.y;
      }
    }
    constexpr float kArea = (2 * kRadius + 1) * (2 * kRadius + 1);
    s = Stepped(s, start[pixel], sum.x / kArea, sum.y / kArea);
  }
  disparity[pixel] = s;
}

}  // namespace

void RefineStereo(const StereoRefineParams& in, cudaStream_t stream) {
  const int width = in.width, height = in.height;
  const size_t pixels = size_t(width) * size_t(height);
  Scratch<uint8_t> smooth(stream, pixels);
  Scratch<float> start(stream, pixels), blurred(stream, pixels);
  Scratch<float2> equations(stream, pixels);
  const dim3 blocks = PixelBlocks(width, height), threads = PixelThreads();
  Check(
      cudaMemcpyAsync(start.data(), in.disparity, start.bytes(), cudaMemcpyDeviceToDevice, stream),
      "cudaMemcpyAsync");
  SmoothKernel<<<blocks, threads, 0, stream>>>(start.data(), width, height, smooth.data());
  Check(cudaGetLastError(), "SmoothKernel");
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    BlurKernel<<<blocks, threads, 0, stream>>>(in.disparity, smooth.data(), width, height,
                                               blurred.data());
    Check(cudaGetLastError(), "BlurKernel");
    EquationsKernel<<<blocks, threads, 0, stream>>>(in, blurred.data(), equations.data());
    Check(cudaGetLastError(), "EquationsKernel");
    StepKernel<<<blocks, threads, 0, stream>>>(equations.data(), smooth.data(), start.data(),
                                               blurred.data(), width, height, in.disparity);
    Check(cudaGetLastError(), "StepKernel");
  }
}

}  // namespace retint::cuda
