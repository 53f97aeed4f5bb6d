// SPDX-License-Identifier: BSD-3-Clause
// The refit's steps on the pixels of a region or of a box.
#include <mutex>

#include "kernels/common/loss.h"
#include "kernels/common/quantize.h"
#include "kernels/cuda/fixed_sums.cuh"
#include "kernels/cuda/geometry.cuh"
#include "kernels/cuda/groups.cuh"
#include "kernels/cuda/image_loss.cuh"
#include "kernels/cuda/launch.cuh"

namespace retint::cuda {
namespace {

// Where the pixels of a region lie in the image; -1 past its edge.
struct RegionPixels {
  const int32_t* tile_ids;
  int tiles_x, width, height, rows, row_step;

  __device__ int64_t Pixel(int64_t i) const {
    const int of_tile = rows * kTileSize;
    const int tile = tile_ids[i / of_tile], within = int(i % of_tile);
    const int x = tile % tiles_x * kTileSize + within % kTileSize;
    const int y = tile / tiles_x * kTileSize + within / kTileSize * row_step;
    return x < width && y < height ? int64_t(y) * width + x : -1;
  }
};

RegionPixels PixelsOf(const CudaViewGeometry& view) {
  return {view.tile_ids.data(), view.tiles_x(),        view.camera().width,
          view.camera().height, view.num_pixel_rows(), view.pixel_row_step()};
}

int64_t CountOf(const CudaViewGeometry& view) { return int64_t(NumRegionPixels(view)); }

// If `largest` is not null, raises it to the largest |residual|.
__global__ void ResidualKernel(int64_t count, RegionPixels pixels, RegionResidualParams params,
                               float* largest, BlockSums sums) {
  double sum = 0;
  float most = 0;
  for (int64_t i = int64_t(blockIdx.x) * blockDim.x + threadIdx.x; i < count;
       i += int64_t(gridDim.x) * blockDim.x) {
    const int64_t pixel = pixels.Pixel(i);
    if (pixel < 0) continue;
    const float weight = params.weights ? float(params.weights[i]) * (1.0f / 255) : 1.0f;
    const float slope = SlopeAt(params.stay, params.target + 3 * i);
    float curvature = 0;
    for (int c = 0; c < 3; ++c) {
      const float r = float(params.target[3 * i + c]) * params.unit - params.image[3 * pixel + c];
      const ResidualCost cost = CostOf(r, slope, params.stay.bend);
      const float residual = weight * cost.curvature * r;
      params.residual[3 * pixel + c] = residual;
      sum += double(weight * cost.value);
      curvature += weight * cost.curvature;
      most = LargerMagnitude(most, residual);
    }
    if (params.curvature) params.curvature[pixel] = curvature / 3;
  }
  if (largest) RaiseLargest(most, largest);
  sums.AddTo(params.loss, sum);
}

// body(x, y, number in the box) for the pixels of `box`.
template <typename Body>
void ForBox(const int32_t* box, cudaStream_t stream, const char* name, const Body& body) {
  const int x0 = box[0], y0 = box[1], width = box[2] - box[0], height = box[3] - box[1];
  if (width <= 0 || height <= 0) return;
  ForEach(int64_t(width) * height, stream, name,
          [=] __device__(int64_t i) { body(x0 + int(i % width), y0 + int(i / width), i); });
}

class CudaRefitOps : public RefitOps {
 public:
  CudaRefitOps(cudaStream_t stream, CudaBlendOps& blend)
      : RefitOps(blend), blend_(blend), stream_(stream), largest_(stream, 1) {}
  void DoRegionTarget(const ViewGeometry& view, const RegionTargetParams& params) override;
  void DoRegionResidual(const ViewGeometry& view, const RegionResidualParams& params) override;
  void DoRegionSweep(const ViewGeometry& view, const RegionSweepParams& params) override;
  void DoRegionAdd(const ViewGeometry& view, float* image, const float* delta) override;
  void DoRegionWeightImage(const ViewGeometry& view, const uint8_t* weights, float* image) override;
  void DoMarkRows(const ViewGeometry& view, uint8_t* seen) override;
  void DoNumberRows(const ViewGeometry& view, const int32_t* number_of, int32_t* numbers) override;
  ImageLossValue DoImageLoss(const ImageLossParams& params) override;
  void DoPackBox(const PackBoxParams& params) override;
  void DoUnpackBox(const PackBoxParams& params) override;
  void DoEditImage(const EditImageParams& params) override;

 private:
  void FindResidual(const CudaViewGeometry& view, const RegionResidualParams& params,
                    float* largest);
  void Clear(const ViewGeometry& view, float* image) {  // [H, W]
    const size_t bytes = size_t(view.camera().width) * size_t(view.camera().height) * sizeof(float);
    Check(cudaMemsetAsync(image, 0, bytes, stream_), "cudaMemsetAsync");
  }

  CudaBlendOps& blend_;
  cudaStream_t stream_;
  std::mutex mutex_;  // of sums_ and largest_
  BlockSumsMemory sums_;
  Scratch<float> largest_;  // of the sweep under way
};

void CudaRefitOps::DoRegionTarget(const ViewGeometry& view, const RegionTargetParams& params) {
  const RegionPixels pixels = PixelsOf(Own(view));
  const float* source = params.source ? params.source : params.render;
  const float scale = 1 / params.unit;
  ForEach(CountOf(Own(view)), stream_, "RegionTarget", [=] __device__(int64_t i) {
    const int64_t p = pixels.Pixel(i);
    if (params.weights) {
      params.weights[i] =
          p >= 0 ? PixelWeight(params.mask[p], params.inside_weight, params.outside_weight) : 0;
    }
    float edited[3] = {}, render[3] = {};
    if (p >= 0) {
      ApplyColorMap(params.map, params.mask[p], source + 3 * p, edited);
      for (int c = 0; c < 3; ++c) render[c] = params.render[3 * p + c];
    }
    for (int c = 0; c < 3; ++c) {
      params.target[3 * i + c] = ToSignedSteps(edited[c] - render[c], scale);
    }
  });
}

void CudaRefitOps::FindResidual(const CudaViewGeometry& view, const RegionResidualParams& params,
                                float* largest) {
  const int64_t count = CountOf(view);
  if (params.curvature) Clear(view, params.curvature);
  if (count == 0) return;
  const unsigned blocks = BlocksUpTo(2048, count, 256);
  ResidualKernel<<<blocks, 256, 0, stream_>>>(count, PixelsOf(view), params, largest,
                                              sums_.Take(blocks, stream_));
  Check(cudaGetLastError(), "RegionResidual");
}

void CudaRefitOps::DoRegionResidual(const ViewGeometry& view, const RegionResidualParams& params) {
  const std::lock_guard lock(mutex_);
  FindResidual(Own(view), params, nullptr);
}

// The three steps, of which the second finds the bound of the residual that the third needs.
void CudaRefitOps::DoRegionSweep(const ViewGeometry& view, const RegionSweepParams& params) {
  blend_.Blend(
      view,
      {.features = params.change, .channels = 3, .image = params.image, .keep_outside = true});
  const std::lock_guard lock(mutex_);
  Check(cudaMemsetAsync(largest_.data(), 0, sizeof(float), stream_), "cudaMemsetAsync");
  FindResidual(Own(view),
               {.target = params.target,
                .unit = params.unit,
                .image = params.image,
                .residual = params.image,
                .loss = params.loss,
                .weights = params.weights,
                .stay = params.stay},
               largest_.data());
  if (!params.result) return;
  blend_.BlendTransposeUpTo(
      view, {.residual = params.image, .channels = 3, .result = params.result}, largest_.data());
}

void CudaRefitOps::DoRegionAdd(const ViewGeometry& view, float* image, const float* delta) {
  const RegionPixels pixels = PixelsOf(Own(view));
  ForEach(CountOf(Own(view)), stream_, "RegionAdd", [=] __device__(int64_t i) {
    const int64_t p = pixels.Pixel(i);
    if (p < 0) return;
    for (int c = 0; c < 3; ++c) image[3 * p + c] += delta[3 * p + c];
  });
}

void CudaRefitOps::DoRegionWeightImage(const ViewGeometry& view, const uint8_t* weights,
                                       float* image) {
  const RegionPixels pixels = PixelsOf(Own(view));
  Clear(view, image);
  ForEach(CountOf(Own(view)), stream_, "RegionWeightImage", [=] __device__(int64_t i) {
    const int64_t p = pixels.Pixel(i);
    if (p >= 0) image[p] = float(weights[i]) * (1.0f / 255);
  });
}

void CudaRefitOps::DoMarkRows(const ViewGeometry& view, uint8_t* seen) {
  const int32_t* rows = view.rows();
  ForEach(view.num_rows(), stream_, "MarkRows", [=] __device__(int64_t r) { seen[rows[r]] = 1; });
}

void CudaRefitOps::DoNumberRows(const ViewGeometry& view, const int32_t* number_of,
                                int32_t* numbers) {
  const int32_t* rows = view.rows();
  ForEach(view.num_rows(), stream_, "NumberRows",
          [=] __device__(int64_t r) { numbers[r] = number_of[rows[r]]; });
}

ImageLossValue CudaRefitOps::DoImageLoss(const ImageLossParams& params) {
  const std::lock_guard lock(mutex_);
  return cuda::ImageLoss(params, sums_, stream_);
}

void CudaRefitOps::DoPackBox(const PackBoxParams& params) {
  const float scale = 1 / params.unit;
  ForBox(params.box, stream_, "PackBox", [=] __device__(int x, int y, int64_t i) {
    const float* from = params.image + (int64_t(y) * params.width + x) * 3;
    for (int c = 0; c < 3; ++c) params.packed[3 * i + c] = ToSteps(from[c], scale);
  });
}

void CudaRefitOps::DoUnpackBox(const PackBoxParams& params) {
  ForBox(params.box, stream_, "UnpackBox", [=] __device__(int x, int y, int64_t i) {
    float* to = params.image + (int64_t(y) * params.width + x) * 3;
    for (int c = 0; c < 3; ++c) to[c] = float(params.packed[3 * i + c]) * params.unit;
  });
}

void CudaRefitOps::DoEditImage(const EditImageParams& params) {
  ForBox(params.box, stream_, "EditImage", [=] __device__(int x, int y, int64_t) {
    const int64_t p = int64_t(y) * params.width + x;
    ApplyColorMap(params.map, params.mask ? params.mask[p] : uint8_t{255}, params.image + 3 * p,
                  params.out + 3 * p);
  });
}

}  // namespace

std::unique_ptr<RefitOps> MakeRefitOps(cudaStream_t stream, CudaBlendOps& blend) {
  return std::make_unique<CudaRefitOps>(stream, blend);
}

}  // namespace retint::cuda
