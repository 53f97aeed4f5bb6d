// SPDX-License-Identifier: BSD-3-Clause
// Gauss-Newton on the disparity of every pixel against all shifted views at once, over a small
// window: src/depth/stereo_refine.cc on the device.
#include "kernels/cuda/stereo.cuh"

namespace retint::cuda {
namespace {

constexpr int kWindow = 3;               // radius of the window of the least squares, pixels
constexpr int kBlur = 2;                 // radius, pixels
constexpr int kIterations = 2;           // more follows the renders' own noise
constexpr float kMaxStep = 0.5f;         // pixels an iteration
constexpr float kMaxMove = 1.0f;         // pixels altogether: beyond, the matcher's value is kept
constexpr float kSmooth = 1.5f;          // pixels of disparity across the window: beyond, an edge
constexpr float kGradientFloor = 2e-3f;  // squared gray levels (of 1) a pixel: textureless below
constexpr float kRobust = 0.05f;         // gray levels (of 1): residuals beyond count little

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

// Windows that hold a depth edge or a hole are left alone.
__global__ void SmoothKernel(const float* disparity, int width, int height, uint8_t* smooth) {
  const int x = int(blockIdx.x) * kBlockX + int(threadIdx.x);
  const int y = int(blockIdx.y) * kBlockY + int(threadIdx.y);
  if (x >= width || y >= height) return;
  float low = disparity[int64_t(y) * width + x], high = low;
  for (int j = -kWindow; j <= kWindow; ++j) {
    const float* row = disparity + int64_t(Clamped(y + j, height)) * width;
    for (int i = -kWindow; i <= kWindow; ++i) {
      const float s = row[Clamped(x + i, width)];
      low = fminf(low, s);
      high = fmaxf(high, s);
    }
  }
  smooth[int64_t(y) * width + x] = high - low < kSmooth && low > 0;
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
    for (int j = -kBlur; j <= kBlur; ++j) {
      const float* row = disparity + int64_t(Clamped(y + j, height)) * width;
      for (int i = -kBlur; i <= kBlur; ++i) sum += row[Clamped(x + i, width)];
    }
    s = sum / float((2 * kBlur + 1) * (2 * kBlur + 1));
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
    // The derivative along the motion of both images' mean (Baker & Matthews 2004, the symmetric
    // form), by Sobel.
    const float gradient = view.dx
                               ? float(view.dx) / 8 *
                                     (mean(1, -1) - mean(-1, -1) + 2 * (mean(1, 0) - mean(-1, 0)) +
                                      mean(1, 1) - mean(-1, 1))
                               : float(view.dy) / 8 *
                                     (mean(-1, 1) - mean(-1, -1) + 2 * (mean(0, 1) - mean(0, -1)) +
                                      mean(1, 1) - mean(1, -1));
    const float residual = 2 * (own(x, y) - mean(0, 0));
    const float ratio = residual / kRobust;
    const float weight = 1 / ((1 + ratio * ratio) * (1 + ratio * ratio));  // Geman-McClure
    sum.x += weight * gradient * residual;
    sum.y += weight * gradient * gradient;
  }
  if (inside) equations[int64_t(y) * in.width + x] = sum;
}

__global__ void __launch_bounds__(kBlockX* kBlockY)
    StepKernel(const float2* equations, const uint8_t* smooth, const float* start,
               const float* blurred, int width, int height, float* disparity) {
  constexpr int kTileX = kBlockX + 2 * kWindow, kTileY = kBlockY + 2 * kWindow;
  __shared__ float2 tile[kTileY][kTileX];
  const int x0 = int(blockIdx.x) * kBlockX, y0 = int(blockIdx.y) * kBlockY;
  for (int i = threadIdx.y * kBlockX + threadIdx.x; i < kTileX * kTileY; i += kBlockX * kBlockY) {
    const int x = Reflected(x0 + i % kTileX - kWindow, width);
    const int y = Reflected(y0 + i / kTileX - kWindow, height);
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
    for (int j = 0; j <= 2 * kWindow; ++j) {
#pragma unroll
      for (int i = 0; i <= 2 * kWindow; ++i) {
        const float2 one = tile[threadIdx.y + j][threadIdx.x + i];
        sum.x += one.x;
        sum.y += one.y;
      }
    }
    constexpr float kArea = (2 * kWindow + 1) * (2 * kWindow + 1);
    // The floor damps steps where there is little texture.
    const float step = (sum.x / kArea) / (sum.y / kArea + kGradientFloor);
    s += fminf(fmaxf(step, -kMaxStep), kMaxStep);
    s = fminf(fmaxf(s, start[pixel] - kMaxMove), start[pixel] + kMaxMove);
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
