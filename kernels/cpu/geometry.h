// SPDX-License-Identifier: BSD-3-Clause
// A model and a view in the memory of the CPU backend.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "kernels/blend_ops.h"
#include "kernels/common/projection.h"
#include "kernels/cpu/memory.h"

namespace retint {

struct CpuModel : Model {
  LargeVector<float> means;              // [N, 3]
  LargeVector<Covariance3> covariances;  // [N]
  LargeVector<float> opacities;          // [N]
  Buffer<float> coefficients;            // [N, K, 3]

  explicit CpuModel(const GaussianArrays& host) {
    count_ = host.count;
    sh_degree_ = host.sh_degree;
    compensate_ = host.compensate;
  }
  float* sh() override { return coefficients.data(); }
  const float* sh() const override { return coefficients.data(); }
};

inline constexpr int kTilePixels = kTileSize * kTileSize;
inline constexpr uint32_t kNoSlot = UINT32_MAX;

// Explicit weights of one tile. Bit 2 y + x / 8 of half_rows says that this half row (8 pixels) of
// the tile holds a weight. Only such half rows are stored, in units of the entry's `scale`.
struct WeightEntry {
  int32_t row;
  uint32_t half_rows;
  uint32_t slot;  // see CpuViewGeometry::slots
  float scale;
};
struct WeightTile {
  std::vector<WeightEntry> entries;
  LargeVector<uint16_t> weights;  // 8 a half row
  LargeVector<uint8_t> compact;   // or these instead
  size_t bytes() const {
    return sizeof(*this) + entries.capacity() * sizeof(WeightEntry) +
           weights.capacity() * sizeof(uint16_t) + compact.capacity();
  }
};

// Tile lists in CSR form: the entries of tile tiles()[i] are [tile_begin[i], tile_begin[i + 1]), in
// order of (depth, index).
struct CpuViewGeometry : ViewGeometry {
  LargeVector<int32_t> row_gaussians;  // [rows]
  LargeVector<Splat> splats;           // whole view: one a row; region: those of its tile lists
  LargeVector<int32_t> splat_rows;     // region only: row of each splat, -1 for an inactive one
  std::vector<int32_t> tile_ids;       // ascending
  std::vector<int64_t> tile_begin;     // [tiles + 1]
  LargeVector<int32_t> entries;        // [E] index into splats
  // The slot for entry e's partial sums. Slots of one row lie side by side, in tile order: row r
  // owns [row_begin[r], row_begin[r + 1]). kNoSlot for an inactive entry.
  LargeVector<uint32_t> slots;      // [E]
  LargeVector<int64_t> row_begin;   // [rows + 1]
  std::vector<WeightTile> weights;  // region with explicit weights: replaces splats and entries

  const int32_t* rows() const override { return row_gaussians.data(); }
  size_t bytes() const override;
  std::span<const int32_t> tiles() const override { return tile_ids; }
  int64_t num_slots() const { return row_begin.empty() ? 0 : row_begin.back(); }

  void SetShape(const CameraParams& view_camera, int64_t rows) {
    camera_ = view_camera;
    num_rows_ = rows;
  }
  void SetRegion() { is_region_ = true; }
  void SetPixelRows(uint16_t pixel_rows) { pixel_rows_ = pixel_rows; }
};

inline const CpuModel& CpuModelOf(const Model& model) {
  return dynamic_cast<const CpuModel&>(model);
}

std::shared_ptr<const ViewGeometry> PrepareViewOnCpu(const CpuModel& model,
                                                     const CameraParams& camera);

}  // namespace retint
