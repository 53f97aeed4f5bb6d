// SPDX-License-Identifier: BSD-3-Clause
// Blending on the CPU: tiles over threads, inner loops from TileKernels.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "kernels/cpu/geometry.h"
#include "kernels/cpu/tile_kernels.h"

namespace retint {

// Large float arrays reused between calls: fresh pages would cost as much as the blending.
class ScratchPool {
 public:
  class Lease {
   public:
    Lease(ScratchPool* pool, LargeVector<float> array) : pool_(pool), array_(std::move(array)) {}
    ~Lease() { pool_->Return(std::move(array_)); }
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    float* data() { return array_.data(); }

   private:
    ScratchPool* pool_;
    LargeVector<float> array_;
  };
  // At least `count` floats of unspecified value.
  Lease Take(size_t count);

 private:
  void Return(LargeVector<float> array);
  std::mutex mutex_;
  std::vector<LargeVector<float>> free_;
};

void BlendOnCpu(const TileKernels& kernels, const CpuViewGeometry& view, const BlendParams& params);
void BlendSharesOnCpu(const TileKernels& kernels, const CpuViewGeometry& view,
                      const BlendSharesParams& params);
void BlendTransposeOnCpu(const TileKernels& kernels, ScratchPool* scratch,
                         const CpuViewGeometry& view, const BlendTransposeParams& params);
void DepthOnCpu(const TileKernels& kernels, const CpuViewGeometry& view, const DepthParams& params);
std::shared_ptr<const ViewGeometry> RestrictOnCpu(const TileKernels& kernels,
                                                  const CpuViewGeometry& view,
                                                  const uint8_t* active, size_t budget_bytes,
                                                  float min_weight,
                                                  const RegionBlend* blend = nullptr);
std::vector<int32_t> TouchedTilesOnCpu(const CpuViewGeometry& view, const uint8_t* active);

// result = the sums of each row's partials, [slots, channels], see CpuViewGeometry::slots.
void SumPartials(const CpuViewGeometry& view, const float* partials, int channels, float* result);
// The pixel rows that are wanted of a whole view's or a region's i-th tile, planar, into an
// interleaved image.
void StoreTile(const CpuViewGeometry& view, size_t i, uint16_t pixel_rows, const float* planes,
               int channels, float* image);

// The list of the geometry's i-th tile.
TileList TileListOf(const CpuViewGeometry& view, size_t i);
// 1 inside the image, -1 beyond its edge and in rows that are not wanted, for the tile whose first
// pixel is (x0, y0).
void InitTransmittance(const CameraParams& camera, int x0, int y0, uint16_t pixel_rows,
                       float* transmittance);

}  // namespace retint
