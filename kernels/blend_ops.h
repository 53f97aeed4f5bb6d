// SPDX-License-Identifier: BSD-3-Clause
// Blending and its transpose. With geometry frozen, a render of view v is linear in the
// per-Gaussian features: y = W_v c, W_v[p,g] = alpha_g(p) T_g(p) (3DGS blending, front to back).
// Blend applies W_v, BlendTranspose applies W_v^T; everything else hangs on these two.
//
// Rows. A ViewGeometry lists the Gaussians that reach the image. Per-Gaussian arrays are indexed by
// *row*: entry r belongs to Gaussian rows()[r]. For a whole view, a row is a visible Gaussian. For
// a region (Restrict) it is a visible *active* Gaussian; the others only attenuate, without a
// feature. So Blend gives W_A c_A and BlendTranspose gives W_A^T r, on the region's tiles only.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "kernels/common/types.h"

namespace retint {

// An uploaded model. The SH coefficients may be rewritten (sh()), the geometry is frozen.
class Model {
 public:
  virtual ~Model() = default;
  int64_t count() const { return count_; }
  int sh_degree() const { return sh_degree_; }
  int num_sh_coeffs() const { return (sh_degree_ + 1) * (sh_degree_ + 1); }
  bool compensate() const { return compensate_; }  // see GaussianArrays
  virtual float* sh() = 0;                         // backend memory, [N, K, 3]
  virtual const float* sh() const = 0;

 protected:
  int64_t count_ = 0;
  int sh_degree_ = 0;
  bool compensate_ = false;
};

// The frozen geometry of one view (or of a region of it): rows, conics, sorted tile lists.
// Immutable; cache and share it.
class ViewGeometry {
 public:
  virtual ~ViewGeometry() = default;
  const CameraParams& camera() const { return camera_; }
  bool is_region() const { return is_region_; }
  int64_t num_rows() const { return num_rows_; }
  // Gaussian index of each row, backend memory, [num_rows]; distinct, in an order of the backend's
  // choosing.
  virtual const int32_t* rows() const = 0;
  virtual size_t bytes() const = 0;  // for cache budgets
  // Tiles this geometry visits (all tiles with Gaussians, or the region's), row-major tile index,
  // host memory.
  virtual std::span<const int32_t> tiles() const = 0;
  // Bit y: row y of every tile has its weights. Only compact regions leave rows out, and keep every
  // second, fourth or eighth; Blend writes zeros there, BlendTranspose does not read them.
  uint16_t pixel_rows() const { return pixel_rows_; }
  int num_pixel_rows() const { return std::popcount(pixel_rows_); }
  // From one of them to the next; the first is row 0.
  int pixel_row_step() const { return kTileSize / num_pixel_rows(); }
  int tiles_x() const { return (camera_.width + kTileSize - 1) / kTileSize; }
  int tiles_y() const { return (camera_.height + kTileSize - 1) / kTileSize; }

 protected:
  CameraParams camera_{};
  bool is_region_ = false;
  int64_t num_rows_ = 0;
  uint16_t pixel_rows_ = kAllPixelRows;
};

struct BlendParams {
  const float* features;  // [rows, C]
  int32_t channels;       // C, 1..kMaxChannels
  // [C] or null for zero; y += T_final * background. Ignored for regions.
  const float* background = nullptr;
  float* image;  // [H, W, C]; pixels outside tiles() are left alone when `keep_outside`, else
                 // background. Then rows that a region left out may be left alone as well.
  float* alpha = nullptr;  // [H, W] = 1 - T_final (a region: W_A 1), or null
  bool keep_outside = false;
  uint16_t pixel_rows = kAllPixelRows;
  // Of a whole view: only these tiles are blended, the others are left alone. Host memory,
  // row-major tile indices, ascending; null: all.
  std::span<const int32_t> tiles = {};
};

// y = W s of one share s in [0, 1] a row, for a mask that is cut between two limits: only values in
// (low, high) are exact. A value up to low may come back as any value up to low, and one from high
// on as any value from high on. Rows 0, 5, 10 and 15 may speak for their tile: if all their values
// are on the same side of (low, high), the whole tile may get such values.
struct BlendSharesParams {
  const float* shares;  // [rows]
  float* image;         // [H, W]
  float low, high;
  float behind;  // in [0, low]; y += T_final * behind. If no share is above 0, y may be 0.
};

struct BlendTransposeParams {
  const float* residual;  // [H, W, C]
  int32_t channels;       // C, 1..kMaxChannels
  float* result;          // [rows, C], overwritten: sum over pixels of W[p,row] * residual[p]
  uint16_t pixel_rows = kAllPixelRows;  // `residual` is zero in the others
};

// Expected depth W z / W 1 (0 if W 1 is 0) and median depth. The median is z, along the viewing
// axis, of the Gaussian at which T crosses `threshold` (0 if it never does). Whole views only.
struct DepthParams {
  float* median = nullptr;    // [H, W] or null
  float* expected = nullptr;  // [H, W] or null
  float* alpha = nullptr;     // [H, W] or null
  float threshold;            // 0.5
  uint16_t pixel_rows = kAllPixelRows;
  float min_alpha = 0;  // `expected` is 0 in pixels less opaque
  // [N] backend memory: Gaussians with a value other than 0 are skipped. Null: none is.
  const uint8_t* left_out = nullptr;
  // The view's model, or null. With a model, `median` is z of that Gaussian's middle along the
  // pixel's ray. It then lies on the surface also if the surface is seen at a slant
  // (DepthAlongRay). `expected` must be null.
  const Model* along_rays = nullptr;
};

// A blend that Restrict() may do in the same pass: a backend that searches for weights visits every
// Gaussian that a pixel shows.
struct RegionBlend {
  const float* colors;  // [rows of the whole view, 3]
  float* image;         // [H, W, 3], written in the region's tiles and rows; undefined in others
};

class BlendOps {
 public:
  virtual ~BlendOps() = default;

  std::unique_ptr<Model> UploadModel(const GaussianArrays& host);
  // Projects, culls, sorts by (depth, index) and bins: EWA splatting with the constants of
  // common/types.h, exact tile lists.
  std::shared_ptr<const ViewGeometry> PrepareView(const Model& model, const CameraParams& camera);
  // The part of a whole view that active Gaussians touch; `active` is [N] bytes of backend memory.
  // If `budget_bytes` allows, the region stores the weights W_A explicitly. Blend and
  // BlendTranspose on it are then several times cheaper, and equal to the whole view's to about
  // 1e-4 of the features. A region cannot be restricted again.
  //
  // With a `min_weight` above 0 the region is compact: explicit weights are approximate, in a
  // third of the memory. Weights below `min_weight` may be left out; the pixel's other weights
  // then grow to keep their sum. Weights are stored in 8 bits, relative to the Gaussian's largest
  // one in the tile. Tiles left without a weight are not part of the region. If the budget
  // requires it, pixel rows are left out as well (see ViewGeometry::pixel_rows), then weights up
  // to 4 min_weight.
  std::shared_ptr<const ViewGeometry> Restrict(const ViewGeometry& view, const uint8_t* active,
                                               size_t budget_bytes, float min_weight = 0,
                                               const RegionBlend* blend = nullptr);
  // The tiles of a whole view that active Gaussians touch, as Restrict finds them. The other tiles
  // look the same whatever color these Gaussians have.
  std::vector<int32_t> TouchedTiles(const ViewGeometry& view, const uint8_t* active);
  void Blend(const ViewGeometry& view, const BlendParams& params);
  void BlendShares(const ViewGeometry& view, const BlendSharesParams& params);  // of a whole view
  void BlendTranspose(const ViewGeometry& view, const BlendTransposeParams& params);
  void Depth(const ViewGeometry& view, const DepthParams& params);
  // sums[g] += {sum_p W[p,g] mask[p] / 255, sum_p W[p,g]} for the Gaussians g of a whole view; mask
  // [H, W], sums [N, 2].
  void AccumulateShares(const ViewGeometry& view, const uint8_t* mask, double* sums);
  // Between the Gaussians' order, [N, C], and a geometry's rows, [rows, C]: values[r] =
  // of[rows()[r]] and sums[rows()[r]] += values[r]. With `and_square` sums are [N, C + 1]; the
  // extra channel sums the square of the last channel of values[r].
  void GatherRows(const ViewGeometry& view, const float* of, int32_t channels, float* values);
  void AddRows(const ViewGeometry& view, const float* values, int32_t channels, float* sums,
               bool and_square = false);

 protected:
  virtual std::unique_ptr<Model> DoUploadModel(const GaussianArrays& host) = 0;
  virtual std::shared_ptr<const ViewGeometry> DoPrepareView(const Model& model,
                                                            const CameraParams& camera) = 0;
  virtual std::shared_ptr<const ViewGeometry> DoRestrict(const ViewGeometry& view,
                                                         const uint8_t* active, size_t budget_bytes,
                                                         float min_weight) = 0;
  // Restricts, then blends.
  virtual std::shared_ptr<const ViewGeometry> DoRestrictAndBlend(const ViewGeometry& view,
                                                                 const uint8_t* active,
                                                                 size_t budget_bytes,
                                                                 float min_weight,
                                                                 const RegionBlend& blend);
  void BlendRegion(const ViewGeometry& view, const ViewGeometry& region, const RegionBlend& blend);
  virtual std::vector<int32_t> DoTouchedTiles(const ViewGeometry& view, const uint8_t* active) = 0;
  virtual void DoBlend(const ViewGeometry& view, const BlendParams& params) = 0;
  virtual void DoBlendShares(const ViewGeometry& view, const BlendSharesParams& params) = 0;
  virtual void DoBlendTranspose(const ViewGeometry& view, const BlendTransposeParams& params) = 0;
  virtual void DoDepth(const ViewGeometry& view, const DepthParams& params) = 0;
  virtual void DoAccumulateShares(const ViewGeometry& view, const uint8_t* mask, double* sums) = 0;
  virtual void DoGatherRows(const ViewGeometry& view, const float* of, int32_t channels,
                            float* values) = 0;
  virtual void DoAddRows(const ViewGeometry& view, const float* values, int32_t channels,
                         float* sums, bool and_square) = 0;
};

}  // namespace retint
