// SPDX-License-Identifier: BSD-3-Clause
// The refit's steps on the pixels of a region or of a box.
#include <stdexcept>

#include "kernels/common/loss.h"
#include "kernels/cuda/blend.cuh"
#include "kernels/cuda/launch.cuh"
#include "kernels/cuda/ops.cuh"

namespace retint::cuda {
namespace {

constexpr int kTilePixels = kTileSize * kTileSize;

// mask * (delta y + offset): what the edit adds to a colour.
__device__ void EditChange(const ColorMap& map, float mask, const float* color, float* change) {
#pragma unroll
  for (int c = 0; c < 3; ++c) {
    change[c] = mask * (map.delta[3 * c] * color[0] + map.delta[3 * c + 1] * color[1] +
                        map.delta[3 * c + 2] * color[2] + map.offset[c]);
  }
}

// Pixels of a region, numbered tile by tile; -1 past the image's edge.
struct RegionPixels {
  const int32_t* tile_ids;
  int tiles_x, width, height;
  uint16_t pixel_rows;

  // Whether pixel i lies in a row that the region left out.
  __device__ bool IsLeftOut(int64_t i) const {
    return !(pixel_rows >> (i % kTilePixels / kTileSize) & 1);
  }

  __device__ int64_t Pixel(int64_t i) const {
    const int tile = tile_ids[i / kTilePixels], within = int(i % kTilePixels);
    const int x = tile % tiles_x * kTileSize + within % kTileSize;
    const int y = tile / tiles_x * kTileSize + within / kTileSize;
    return x < width && y < height ? int64_t(y) * width + x : -1;
  }
};

RegionPixels PixelsOf(const CudaViewGeometry& view) {
  if (!view.is_region) throw std::invalid_argument("needs a region");
  return {view.tile_ids.data(), view.tiles_x(), view.camera().width, view.camera().height,
          view.pixel_rows()};
}

int64_t CountOf(const CudaViewGeometry& view) {
  return int64_t(view.tile_ids.size()) * kTilePixels;
}

__global__ void ResidualKernel(int64_t count, RegionPixels pixels, RegionResidualParams params) {
  double sum = 0;
  for (int64_t i = int64_t(blockIdx.x) * blockDim.x + threadIdx.x; i < count;
       i += int64_t(gridDim.x) * blockDim.x) {
    const int64_t pixel = pixels.Pixel(i);
    if (pixel < 0 || pixels.IsLeftOut(i)) continue;
    const float weight = params.weights ? float(params.weights[i]) * (1.0f / 255) : 1.0f;
    for (int c = 0; c < 3; ++c) {
      const float r = float(params.target[3 * i + c]) * params.unit - params.image[3 * pixel + c];
      params.residual[3 * pixel + c] = weight * r;
      sum += double(weight * r * r);
    }
  }
  AddOverBlock(sum, params.loss);
}

// body(x, y, number in the box) for the pixels of `box`.
template <typename Body>
void ForBox(const int32_t* box, cudaStream_t stream, const char* name, const Body& body) {
  const int x0 = box[0], y0 = box[1], width = box[2] - box[0], height = box[3] - box[1];
  if (width <= 0 || height <= 0) return;
  ForEach(int64_t(width) * height, stream, name,
          [=] __device__(int64_t i) { body(x0 + int(i % width), y0 + int(i / width), i); });
}

}  // namespace

void RegionTarget(const CudaViewGeometry& view, const RegionTargetParams& params,
                  cudaStream_t stream) {
  const RegionPixels pixels = PixelsOf(view);
  const float* source = params.source ? params.source : params.render;
  const float scale = 1 / params.unit;
  ForEach(CountOf(view), stream, "RegionTarget", [=] __device__(int64_t i) {
    const int64_t p = pixels.Pixel(i);
    float change[3] = {};
    if (params.weights) {
      const bool counts = p >= 0 && !pixels.IsLeftOut(i);
      params.weights[i] =
          counts ? PixelWeight(params.mask[p], params.inside_weight, params.outside_weight) : 0;
    }
    if (p >= 0) {
      EditChange(params.map, float(params.mask[p]) * (1.0f / 255), source + 3 * p, change);
      for (int c = 0; c < 3; ++c) change[c] += source[3 * p + c] - params.render[3 * p + c];
    }
    for (int c = 0; c < 3; ++c) {
      const float steps = fminf(fmaxf(change[c] * scale, -32767.0f), 32767.0f);
      params.target[3 * i + c] = int16_t(__float2int_rn(steps));
    }
  });
}

void RegionResidual(const CudaViewGeometry& view, const RegionResidualParams& params,
                    cudaStream_t stream) {
  const RegionPixels pixels = PixelsOf(view);
  const int64_t count = CountOf(view);
  if (count == 0) return;
  const unsigned blocks = BlocksUpTo(2048, count, 256);
  ResidualKernel<<<blocks, 256, 0, stream>>>(count, pixels, params);
  Check(cudaGetLastError(), "RegionResidual");
}

void RegionAdd(const CudaViewGeometry& view, float* image, const float* delta,
               cudaStream_t stream) {
  const RegionPixels pixels = PixelsOf(view);
  ForEach(CountOf(view), stream, "RegionAdd", [=] __device__(int64_t i) {
    const int64_t p = pixels.Pixel(i);
    if (p < 0) return;
    for (int c = 0; c < 3; ++c) image[3 * p + c] += delta[3 * p + c];
  });
}

void RegionWeightImage(const CudaViewGeometry& view, const uint8_t* weights, float* image,
                       cudaStream_t stream) {
  const RegionPixels pixels = PixelsOf(view);
  const size_t bytes = size_t(view.camera().width) * size_t(view.camera().height) * sizeof(float);
  Check(cudaMemsetAsync(image, 0, bytes, stream), "cudaMemsetAsync");
  ForEach(CountOf(view), stream, "RegionWeightImage", [=] __device__(int64_t i) {
    const int64_t p = pixels.Pixel(i);
    if (p >= 0) image[p] = float(weights[i]) * (1.0f / 255);
  });
}

void AccumulateShares(const CudaViewGeometry& view, const uint8_t* mask, double* sums,
                      cudaStream_t stream) {
  if (view.is_region) throw std::invalid_argument("shares need a whole view");
  const int64_t pixels = int64_t(view.camera().width) * view.camera().height;
  const int64_t rows = view.num_rows();
  if (rows == 0) return;
  Scratch<float2> residual(stream, size_t(pixels)), of_rows(stream, size_t(rows));
  float2* to = residual.data();
  ForEach(pixels, stream, "AccumulateShares", [=] __device__(int64_t p) {
    to[p] = {float(mask[p]) / 255.0f, 1.0f};
  });
  BlendTranspose(view, {&residual.data()->x, 2, &of_rows.data()->x}, stream);
  const int32_t* gaussians = view.rows();
  const float2* from = of_rows.data();
  ForEach(rows, stream, "AccumulateShares", [=] __device__(int64_t r) {
    double* sum = sums + 2 * int64_t(gaussians[r]);  // rows are distinct
    sum[0] += double(from[r].x);
    sum[1] += double(from[r].y);
  });
}

void PackBox(const PackBoxParams& params, cudaStream_t stream) {
  const float scale = 1 / params.unit;
  ForBox(params.box, stream, "PackBox", [=] __device__(int x, int y, int64_t i) {
    const float* from = params.image + (int64_t(y) * params.width + x) * 3;
    for (int c = 0; c < 3; ++c) {
      params.packed[3 * i + c] = uint16_t(fminf(fmaxf(from[c] * scale + 0.5f, 0.0f), 65535.0f));
    }
  });
}

void UnpackBox(const PackBoxParams& params, cudaStream_t stream) {
  ForBox(params.box, stream, "UnpackBox", [=] __device__(int x, int y, int64_t i) {
    float* to = params.image + (int64_t(y) * params.width + x) * 3;
    for (int c = 0; c < 3; ++c) to[c] = float(params.packed[3 * i + c]) * params.unit;
  });
}

void EditImage(const EditImageParams& params, cudaStream_t stream) {
  ForBox(params.box, stream, "EditImage", [=] __device__(int x, int y, int64_t) {
    const int64_t p = int64_t(y) * params.width + x;
    float change[3];
    EditChange(params.map, float(params.mask[p]) * (1.0f / 255), params.image + 3 * p, change);
    for (int c = 0; c < 3; ++c) params.out[3 * p + c] = params.image[3 * p + c] + change[c];
  });
}

}  // namespace retint::cuda
