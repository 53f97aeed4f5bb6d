// SPDX-License-Identifier: BSD-3-Clause
// Two passes over blocks of pixels with a halo of 5 in shared memory: SSIM and its derivatives by
// the moments, then the window's transpose of those derivatives.
#include "kernels/cuda/image_loss.cuh"

#include "kernels/common/loss.h"
#include "kernels/cuda/scan.cuh"

namespace retint::cuda {
namespace {

constexpr int kWidth = 32, kHeight = 16, kR = kSsimRadius;
constexpr int kThreads = 256;
constexpr int kHaloWidth = kWidth + 2 * kR, kHaloHeight = kHeight + 2 * kR;

struct Box {
  int x0, y0, x1, y1;
};

// Over the region of interest: |y - y*| and SSIM.
struct Sums {
  double l1, ssim;
};

__constant__ float kWindow[2 * kR + 1] = {
    kSsimWindow[0], kSsimWindow[1], kSsimWindow[2], kSsimWindow[3], kSsimWindow[4], kSsimWindow[5],
    kSsimWindow[6], kSsimWindow[7], kSsimWindow[8], kSsimWindow[9], kSsimWindow[10]};

// Planar [3 channels][3 derivatives] maps of `box`.
struct Maps {
  float* data;
  Box box;
  __device__ int64_t Index(int x, int y, int plane) const {
    const int64_t width = box.x1 - box.x0, height = box.y1 - box.y0;
    return (plane * height + (y - box.y0)) * width + (x - box.x0);
  }
};

__global__ void __launch_bounds__(kThreads)
    MomentsKernel(ImageLossParams params, Box roi, Maps maps, BlockSums sums_of_blocks,
                  double* ssim_sum) {
  __shared__ float in[2][kHaloHeight][kHaloWidth];
  __shared__ float rows[5][kHaloHeight][kWidth];
  const int x0 = maps.box.x0 + int(blockIdx.x) * kWidth,
            y0 = maps.box.y0 + int(blockIdx.y) * kHeight;
  const int channel = blockIdx.z;
  for (int i = threadIdx.x; i < kHaloWidth * kHaloHeight; i += kThreads) {
    const int x = x0 - kR + i % kHaloWidth, y = y0 - kR + i / kHaloWidth;
    const bool inside = x >= 0 && y >= 0 && x < params.width && y < params.height;
    const int64_t at = (int64_t(y) * params.width + x) * 3 + channel;
    in[0][i / kHaloWidth][i % kHaloWidth] = inside ? params.image[at] : 0.0f;
    in[1][i / kHaloWidth][i % kHaloWidth] = inside ? params.target[at] : 0.0f;
  }
  __syncthreads();
  for (int i = threadIdx.x; i < kWidth * kHaloHeight; i += kThreads) {
    const int x = i % kWidth, y = i / kWidth;
    float sums[5] = {};
#pragma unroll
    for (int j = 0; j <= 2 * kR; ++j) {
      const float a = in[0][y][x + j], b = in[1][y][x + j], w = kWindow[j];
      sums[0] += w * a;
      sums[1] += w * b;
      sums[2] += w * a * a;
      sums[3] += w * b * b;
      sums[4] += w * a * b;
    }
#pragma unroll
    for (int m = 0; m < 5; ++m) rows[m][y][x] = sums[m];
  }
  __syncthreads();
  double total = 0;
  for (int i = threadIdx.x; i < kWidth * kHeight; i += kThreads) {
    const int x = i % kWidth, y = i / kWidth;
    if (x0 + x >= maps.box.x1 || y0 + y >= maps.box.y1) continue;
    float sums[5] = {};
#pragma unroll
    for (int j = 0; j <= 2 * kR; ++j) {
#pragma unroll
      for (int m = 0; m < 5; ++m) sums[m] += kWindow[j] * rows[m][y + j][x];
    }
    const SsimPoint<float> point =
        Ssim<float>({sums[0], sums[1], sums[2], sums[3], sums[4]}, 1.0f, kSsimC1, kSsimC2);
    if (x0 + x >= roi.x0 && y0 + y >= roi.y0 && x0 + x < roi.x1 && y0 + y < roi.y1) {
      total += double(point.value);
    }
    maps.data[maps.Index(x0 + x, y0 + y, 3 * channel)] = point.d_x;
    maps.data[maps.Index(x0 + x, y0 + y, 3 * channel + 1)] = point.d_xx;
    maps.data[maps.Index(x0 + x, y0 + y, 3 * channel + 2)] = point.d_xy;
  }
  sums_of_blocks.AddTo(ssim_sum, total);
}

__global__ void __launch_bounds__(kThreads)
    GradientKernel(ImageLossParams params, Box roi, Maps maps, float l1_scale, float ssim_scale,
                   BlockSums sums_of_blocks, double* l1_sum) {
  __shared__ float in[3][kHaloHeight][kHaloWidth];
  __shared__ float rows[3][kHaloHeight][kWidth];
  const int x0 = roi.x0 + int(blockIdx.x) * kWidth, y0 = roi.y0 + int(blockIdx.y) * kHeight;
  const int channel = blockIdx.z;
  for (int i = threadIdx.x; i < kHaloWidth * kHaloHeight; i += kThreads) {
    const int x = x0 - kR + i % kHaloWidth, y = y0 - kR + i / kHaloWidth;
    const Box& box = maps.box;
    const bool inside = x >= box.x0 && y >= box.y0 && x < box.x1 && y < box.y1;
    for (int m = 0; m < 3; ++m) {
      in[m][i / kHaloWidth][i % kHaloWidth] =
          inside ? maps.data[maps.Index(x, y, 3 * channel + m)] : 0.0f;
    }
  }
  __syncthreads();
  for (int i = threadIdx.x; i < kWidth * kHaloHeight; i += kThreads) {
    const int x = i % kWidth, y = i / kWidth;
    float sums[3] = {};
#pragma unroll
    for (int j = 0; j <= 2 * kR; ++j) {
#pragma unroll
      for (int m = 0; m < 3; ++m) sums[m] += kWindow[j] * in[m][y][x + j];
    }
#pragma unroll
    for (int m = 0; m < 3; ++m) rows[m][y][x] = sums[m];
  }
  __syncthreads();
  double total = 0;
  for (int i = threadIdx.x; i < kWidth * kHeight; i += kThreads) {
    const int x = i % kWidth, y = i / kWidth;
    if (x0 + x >= roi.x1 || y0 + y >= roi.y1) continue;
    float sums[3] = {};
#pragma unroll
    for (int j = 0; j <= 2 * kR; ++j) {
#pragma unroll
      for (int m = 0; m < 3; ++m) sums[m] += kWindow[j] * rows[m][y + j][x];
    }
    const int64_t at = (int64_t(y0 + y) * params.width + x0 + x) * 3 + channel;
    const float vx = params.image[at], vy = params.target[at], difference = vx - vy;
    total += double(fabsf(difference));
    const float sign = float(difference > 0) - float(difference < 0);
    params.gradient[at] =
        l1_scale * sign + ssim_scale * (sums[0] + 2 * vx * sums[1] + vy * sums[2]);
  }
  sums_of_blocks.AddTo(l1_sum, total);
}

__global__ void AddLossKernel(const Sums* sums, double l1_scale, double ssim_scale, double pixels,
                              double* loss) {
  *loss += l1_scale * sums->l1 + ssim_scale * (pixels - sums->ssim);
}

dim3 GridOf(const Box& box) {
  return dim3(Blocks(box.x1 - box.x0, kWidth), Blocks(box.y1 - box.y0, kHeight), 3);
}

}  // namespace

ImageLossValue ImageLoss(const ImageLossParams& params, BlockSumsMemory& memory,
                         cudaStream_t stream) {
  const Box roi{params.roi[0], params.roi[1], params.roi[2], params.roi[3]};
  const Box halo{roi.x0 > kR ? roi.x0 - kR : 0, roi.y0 > kR ? roi.y0 - kR : 0,
                 roi.x1 + kR < params.width ? roi.x1 + kR : params.width,
                 roi.y1 + kR < params.height ? roi.y1 + kR : params.height};
  Scratch<float> planes(stream, size_t(halo.x1 - halo.x0) * size_t(halo.y1 - halo.y0) * 9);
  Scratch<Sums> sums(stream, 1);
  Check(cudaMemsetAsync(sums.data(), 0, sums.bytes(), stream), "cudaMemsetAsync");
  const Maps maps{planes.data(), halo};
  const double count = double(params.width) * params.height * 3;
  const dim3 halo_grid = GridOf(halo);  // the larger of the two
  const BlockSums of_blocks = memory.Take(size_t(halo_grid.x) * halo_grid.y * halo_grid.z, stream);
  MomentsKernel<<<halo_grid, kThreads, 0, stream>>>(params, roi, maps, of_blocks,
                                                    &sums.data()->ssim);
  Check(cudaGetLastError(), "MomentsKernel");
  GradientKernel<<<GridOf(roi), kThreads, 0, stream>>>(
      params, roi, maps, float((1 - params.lambda) / count), float(-params.lambda / count),
      of_blocks, &sums.data()->l1);
  Check(cudaGetLastError(), "GradientKernel");

  const double pixels = double(roi.x1 - roi.x0) * (roi.y1 - roi.y0) * 3;
  const double lambda = double(params.lambda);
  if (params.loss) {
    AddLossKernel<<<1, 1, 0, stream>>>(sums.data(), (1 - lambda) / count, lambda / count, pixels,
                                       params.loss);
    Check(cudaGetLastError(), "AddLossKernel");
    return {};
  }
  const Sums found = std::get<0>(ReadBack(stream, sums.data()));
  // Pixels outside the region of interest agree: their SSIM is 1.
  const double l1 = found.l1 / count, dissimilar = (pixels - found.ssim) / count;
  return {(1 - lambda) * l1 + lambda * dissimilar, l1, 1 - dissimilar};
}

}  // namespace retint::cuda
