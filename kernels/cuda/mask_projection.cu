// SPDX-License-Identifier: BSD-3-Clause
// The mask projection's steps: depth samples, clouds drawn, paint looked up, masks.
#include "kernels/common/mask_projection.h"
#include "kernels/cuda/groups.cuh"
#include "kernels/cuda/launch.cuh"

namespace retint::cuda {
namespace {

template <typename Body>
__global__ void PixelsKernel(int width, int height, Body body) {
  const int x = int(blockIdx.x * blockDim.x + threadIdx.x);
  const int y = int(blockIdx.y * blockDim.y + threadIdx.y);
  if (x < width && y < height) body(x, y, int64_t(y) * width + x);
}

// body(x, y, index) for every pixel, a thread each.
template <typename Body>
void ForPixels(int width, int height, cudaStream_t stream, const char* name, const Body& body) {
  if (width <= 0 || height <= 0) return;
  const dim3 threads(32, 8), blocks(Blocks(width, 32), Blocks(height, 8));
  PixelsKernel<<<blocks, threads, 0, stream>>>(width, height, body);
  Check(cudaGetLastError(), name);
}

// A warp a point: few have more pixels than lanes. Coverage is never negative, so that its bits
// order as integers do.
constexpr int kDrawThreads = 128;
__global__ void __launch_bounds__(kDrawThreads) DrawCloudKernel(DrawCloudParams params) {
  const int64_t i = (int64_t(blockIdx.x) * kDrawThreads + threadIdx.x) / 32;
  if (i >= params.count) return;
  CloudSplat splat;
  if (!ProjectCloudPoint(params.camera, params.points[i], params.square_pixels, params.disc_scale,
                         &splat)) {
    return;
  }
  const PixelRays rays = RaysOf(params.camera);
  const int width = splat.x1 - splat.x0, area = width * (splat.y1 - splat.y0);
  for (int p = int(threadIdx.x % 32); p < area; p += 32) {
    const int x = splat.x0 + p % width, y = splat.y0 + p / width;
    if (!IsWantedRow(params.pixel_rows, y)) continue;
    const int64_t pixel = int64_t(y) * params.camera.width + x;
    if (params.coverage[pixel] >= splat.coverage) continue;
    const float covered =
        CoverageAt(rays, splat, x, y, params.depth[pixel], params.depth_tolerance);
    if (covered > 0) {
      atomicMax(reinterpret_cast<int*>(params.coverage + pixel), __float_as_int(covered));
    }
  }
}

struct Largest {
  __device__ static uint8_t Of(uint8_t a, uint8_t b) { return a > b ? a : b; }
};
struct Smallest {
  __device__ static uint8_t Of(uint8_t a, uint8_t b) { return a < b ? a : b; }
};

// out = the extreme of `in` over a disc, inside the image.
template <typename Extreme>
void OverDisc(const uint8_t* in, int width, int height, int radius, uint8_t* out,
              cudaStream_t stream) {
  ForPixels(width, height, stream, "MakeMask", [=] __device__(int x, int y, int64_t i) {
    uint8_t value = in[i];
    for (int dy = max(-radius, -y); dy <= min(radius, height - 1 - y); ++dy) {
      const int reach = DiscReach(radius, dy);
      const uint8_t* const row = in + i + int64_t(dy) * width;
      for (int dx = max(-reach, -x); dx <= min(reach, width - 1 - x); ++dx) {
        value = Extreme::Of(value, row[dx]);
      }
    }
    out[i] = value;
  });
}

class CudaMaskOps : public MaskOps {
 public:
  explicit CudaMaskOps(cudaStream_t stream) : stream_(stream) {}
  void DoSampleDepth(const SampleDepthParams& params) override;
  void DoCorrectDepth(const CorrectDepthParams& params) override;
  void DoDrawCloud(const DrawCloudParams& params) override;
  void DoMakeMask(const MakeMaskParams& params) override;
  void DoDropFaint(const DropFaintParams& params) override;
  void DoMarkSilhouette(const MarkSilhouetteParams& params) override;
  void DoEvidence(const EvidenceParams& params) override;

 private:
  cudaStream_t stream_;
};

void CudaMaskOps::DoSampleDepth(const SampleDepthParams& params) {
  ForEach(params.count, stream_, "SampleDepth", [=] __device__(int64_t i) {
    params.samples[i] =
        SampleDepthAt(params.depth, params.width, params.height, params.pixel_rows,
                      params.pixels[2 * i], params.pixels[2 * i + 1], params.max_spread);
  });
}

void CudaMaskOps::DoCorrectDepth(const CorrectDepthParams& params) {
  ForPixels(params.width, params.height, stream_, "CorrectDepth",
            [=] __device__(int, int y, int64_t i) {
              if (!IsWantedRow(params.pixel_rows, y)) return;
              params.depth[i] = CorrectedDepth(params.depth[i], params.a, params.b);
            });
}

void CudaMaskOps::DoDrawCloud(const DrawCloudParams& params) {
  const size_t pixels = size_t(params.camera.width) * size_t(params.camera.height);
  Check(cudaMemsetAsync(params.coverage, 0, pixels * sizeof(float), stream_), "cudaMemsetAsync");
  if (params.count == 0) return;
  DrawCloudKernel<<<Blocks(params.count * 32, kDrawThreads), kDrawThreads, 0, stream_>>>(params);
  Check(cudaGetLastError(), "DrawCloudKernel");
}

void CudaMaskOps::DoMakeMask(const MakeMaskParams& params) {
  const int width = params.width, height = params.height, radius = params.close_radius;
  const int64_t pixels = int64_t(width) * height;
  ForEach(pixels, stream_, "MakeMask", [=] __device__(int64_t i) {
    params.mask[i] = ToByte(params.scale * double(params.image[i]) + params.offset);
  });
  if (radius <= 0) return;
  Scratch<uint8_t> dilated(stream_, size_t(pixels));
  OverDisc<Largest>(params.mask, width, height, radius, dilated.data(), stream_);
  OverDisc<Smallest>(dilated.data(), width, height, radius, params.mask, stream_);
}

void CudaMaskOps::DoDropFaint(const DropFaintParams& params) {
  const int width = params.width, height = params.height, reach = params.reach;
  Scratch<uint8_t> scratch(stream_, size_t(width) * size_t(height));
  uint8_t* const beside = scratch.data();  // whether a pixel has a firm one beside it in its row
  uint8_t* const mask = params.mask;
  ForPixels(width, height, stream_, "DropFaint", [=] __device__(int x, int, int64_t i) {
    bool firm = false;
    for (int dx = max(-reach, -x); dx <= min(reach, width - 1 - x) && !firm; ++dx) {
      firm = mask[i + dx] >= 128;
    }
    beside[i] = firm;
  });
  ForPixels(width, height, stream_, "DropFaint", [=] __device__(int, int y, int64_t i) {
    if (mask[i] == 0 || mask[i] >= 128) return;
    for (int dy = max(-reach, -y); dy <= min(reach, height - 1 - y); ++dy) {
      if (beside[i + int64_t(dy) * width]) return;
    }
    mask[i] = 0;
  });
}

// In place: painted pixels are read and not written, and of the others only a pixel's own.
void CudaMaskOps::DoMarkSilhouette(const MarkSilhouetteParams& params) {
  ForPixels(params.width, params.height, stream_, "MarkSilhouette",
            [=] __device__(int x, int y, int64_t i) {
              if (IsBesideSilhouette(params.mask, params.depth, params.width, params.height,
                                     params.jump, x, y)) {
                params.depth[i] = kNoEvidence;
              }
            });
}

void CudaMaskOps::DoEvidence(const EvidenceParams& params) {
  const int count = int(params.painted.size());
  Scratch<PaintedImage> painted(stream_, params.painted.size());
  if (count > 0) {
    Check(cudaMemcpyAsync(painted.data(), params.painted.data(), params.painted.size_bytes(),
                          cudaMemcpyHostToDevice, stream_),
          "cudaMemcpyAsync");
  }
  const PaintedImage* const views = painted.data();
  const PixelRays rays = RaysOf(params.camera);
  const float* const depth = params.depth;
  const uint8_t* const coverage = params.coverage;
  const float tolerance = params.tolerance, unknown = params.unknown_weight, scale = params.scale;
  const float visible = params.visible;
  const uint16_t pixel_rows = params.pixel_rows;
  float* const residual = params.residual;
  ForPixels(params.camera.width, params.camera.height, stream_, "Evidence",
            [=] __device__(int x, int y, int64_t i) {
              float2 out = {0, 0};
              float known = 0;
              const bool wanted = IsWantedRow(pixel_rows, y);
              if (wanted) {
                const glm::vec2 evidence =
                    EvidenceAt(rays, x, y, depth ? depth[i] : 0, views, count, tolerance, unknown,
                               coverage ? coverage[i] : uint8_t(0));
                out = {scale * evidence.x, scale * evidence.y};
                known = evidence.y;
              }
              if (visible > 0) {
                reinterpret_cast<float4*>(residual)[i] = {out.x, out.y, visible * known,
                                                          wanted ? visible : 0};
              } else {
                reinterpret_cast<float2*>(residual)[i] = out;
              }
            });
}

}  // namespace

std::unique_ptr<MaskOps> MakeMaskOps(cudaStream_t stream) {
  return std::make_unique<CudaMaskOps>(stream);
}

}  // namespace retint::cuda
