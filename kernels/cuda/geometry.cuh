// SPDX-License-Identifier: BSD-3-Clause
// A model and a view in the device memory of the CUDA backend.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "kernels/blend_ops.h"
#include "kernels/common/projection.h"
#include "kernels/cuda/device.cuh"

namespace retint::cuda {

// Of a view that is prepared: visible Gaussians, and entries of lists; `told` on the host only.
struct ViewTotals {
  unsigned rows, told;
  unsigned long long entries;

  // Adds those of all threads of the block.
  __device__ void AddFromBlock(unsigned of_rows, unsigned of_entries) {
    __shared__ unsigned sum_rows;
    __shared__ unsigned long long sum_entries;
    if (threadIdx.x == 0) sum_rows = 0, sum_entries = 0;
    __syncthreads();
    of_rows = WarpSum(of_rows);
    of_entries = WarpSum(of_entries);
    if (threadIdx.x % 32 == 0) {
      atomicAdd(&sum_rows, of_rows);
      atomicAdd(&sum_entries, static_cast<unsigned long long>(of_entries));
    }
    __syncthreads();
    if (threadIdx.x > 0) return;
    if (sum_rows) atomicAdd(&rows, sum_rows);
    if (sum_entries) atomicAdd(&entries, sum_entries);
  }
};

// View-independent attributes; the 3D covariance is computed once, at upload.
struct CudaModel : Model {
  explicit CudaModel(const GaussianArrays& host) {
    count_ = host.count;
    sh_degree_ = host.sh_degree;
    compensate_ = host.compensate;
  }
  float* sh() override { return coefficients.data(); }
  const float* sh() const override { return coefficients.data(); }

  Scratch<float> means;              // [N, 3]
  Scratch<float4> mean_opacity;      // [N] the same mean, and the activated opacity
  Scratch<Covariance3> covariances;  // [N]
  Scratch<float> coefficients;       // [N, K, 3]
};

// Explicit weights of a region: entries by tile and quarter of 8x8 pixels (4 tile + quarter), front
// to back within; each holds those of every row_step-th pixel row. With a step of 1 the two pixels
// (x, y) and (x, y + 4) of a lane lie side by side, else they are in order.
struct ExplicitWeights {
  bool compact = false;     // bytes in units of `scales`; else 16 bits
  int row_step = 1;         // 1, 2, 4 or 8
  Scratch<uint32_t> ends;   // [4 tiles] end of each quarter's entries; empty: no explicit weights
  Scratch<int32_t> rows;    // [E]
  Scratch<float> scales;    // [E]
  Scratch<uint8_t> values;  // [E, 64 / row_step] of one or two bytes
  size_t bytes() const { return ends.bytes() + rows.bytes() + scales.bytes() + values.bytes(); }
};

// Tile lists: tile t's entries are [ranges[t].x, ranges[t].y), in order of (depth, index). A whole
// view has a range for every tile of the grid; a region only for those in tile_ids, and a compact
// copy of the splats that its lists name.
class CudaViewGeometry : public ViewGeometry {
 public:
  explicit CudaViewGeometry(cudaStream_t stream) : stream_(stream) {}
  void SetShape(const CameraParams& view_camera, int64_t rows) {
    camera_ = view_camera;
    num_rows_ = rows;
  }
  void SetRegion() { is_region_ = true; }
  void SetPixelRows(uint16_t pixel_rows) { pixel_rows_ = pixel_rows; }
  const int32_t* rows() const override { return gaussians.data(); }
  std::span<const int32_t> tiles() const override;
  size_t bytes() const override {
    return gaussians.bytes() + splats.bytes() + splat_rows.bytes() + tile_ids.bytes() +
           ranges.bytes() + order.bytes() + entries.bytes() + weights.bytes();
  }

  Scratch<int32_t> gaussians;   // [rows]
  Scratch<Splat> splats;        // whole view: one a row
  Scratch<int32_t> splat_rows;  // region: row of each splat, -1 for an inactive one
  Scratch<int32_t> tile_ids;    // region: [tiles] ascending
  Scratch<int2> ranges;         // [tiles of the grid], region: [tiles]
  Scratch<int32_t> order;       // whole view: [tiles] indices of the ranges, long ones first
  Scratch<int32_t> entries;     // [E] index into splats
  ExplicitWeights weights;      // region: replaces splats, splat_rows, ranges and entries
  bool has_weights() const { return weights.ends.size() > 0; }

 private:
  cudaStream_t stream_;
  mutable std::once_flag tiles_once_;
  mutable std::vector<int32_t> host_tiles_;
};

inline const CudaModel& Own(const Model& model) { return dynamic_cast<const CudaModel&>(model); }
inline const CudaViewGeometry& Own(const ViewGeometry& view) {
  return dynamic_cast<const CudaViewGeometry&>(view);
}

std::unique_ptr<CudaModel> Upload(const GaussianArrays& host, cudaStream_t stream);
std::shared_ptr<CudaViewGeometry> Prepare(const CudaModel& model, const CameraParams& camera,
                                          cudaStream_t stream);
// `min_weight` 0: explicit weights are exact to half floats; else they are compact (see
// BlendOps::Restrict), and tiles left without a weight are dropped.
std::shared_ptr<CudaViewGeometry> RestrictTo(const CudaViewGeometry& view, const uint8_t* active,
                                             size_t budget_bytes, float min_weight,
                                             cudaStream_t stream);

}  // namespace retint::cuda
