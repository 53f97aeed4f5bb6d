// SPDX-License-Identifier: BSD-3-Clause
// The refit's steps on the pixels of a region or of a box, all in backend memory. A region's pixels
// are those of its tiles, in the order of tiles(). Each tile has the rows of pixel_rows(), of
// kTileSize pixels each, row-major. Positions outside the image hold 0.
#pragma once

#include <cstddef>
#include <cstdint>

#include "kernels/blend_ops.h"
#include "kernels/common/color_ops.h"
#include "kernels/common/loss.h"

namespace retint {

inline size_t NumRegionPixels(const ViewGeometry& region) {
  return region.tiles().size() * size_t(region.num_pixel_rows() * kTileSize);
}

// How a region's pixels should change: target = edited(source) - render, in steps of `unit`,
// saturating (common/quantize.h).
struct RegionTargetParams {
  const float* render;  // [H, W, 3]
  const float* source;  // [H, W, 3] the image to edit; null: `render`
  const uint8_t* mask;  // [H, W]
  ColorMap map;
  float unit;       // above 0
  int16_t* target;  // [pixels, 3]
  // If not null, also writes the pixels' weights m inside_weight + (1 - m) outside_weight, with m =
  // mask / 255, in steps of 1 / 255: [pixels].
  uint8_t* weights = nullptr;
  float inside_weight = 1, outside_weight = 1;
};

// r = target * unit - image on the region's pixels: residual = weight * r, loss[0] += weight * r^2.
// In pixels with a StayLoss, half the slope of its cost, and its cost, instead.
struct RegionResidualParams {
  const int16_t* target;  // [pixels, 3]
  float unit;
  const float* image;      // [H, W, 3]
  float* residual;         // [H, W, 3]; may be `image`
  double* loss;            // [1] backend memory, accumulated
  const uint8_t* weights;  // [pixels] in steps of 1 / 255, or null: all 1
  StayLoss stay{};
  // [H, W], or null: the factor of r in the residual, as the mean of the channels; 0 outside the
  // region's pixels. A parabola of this curvature that touches a pixel's cost is nowhere below it.
  float* curvature = nullptr;
};

// Blend(change) into `image`, RegionResidual there, and BlendTranspose of the residual.
struct RegionSweepParams {
  const float* change;     // [rows, 3]
  const int16_t* target;   // as of RegionResidualParams
  float unit;              // above 0
  const uint8_t* weights;  // as there, not null
  double* loss;            // [1] backend memory, accumulated
  float* image;            // [H, W, 3] scratch; afterwards undefined
  float* result;           // [rows, 3]; may be `change`; null: the loss alone
  StayLoss stay{};
};

// L = (1 - lambda) * mean|y - y*| + lambda * (1 - mean SSIM(y, y*)), per channel (Wang et al. 2004;
// 3DGS's training loss). SSIM has an 11x11 Gaussian window of sigma 1.5, zero padding, C1 = 0.01^2,
// C2 = 0.03^2. Means are over all W*H*3 values. `roi` (x0, y0, x1, y1, pixels, half-open) limits
// the pixels that get a gradient, and the pixels of the value's sum, which is still divided by
// W*H*3. This is exact if y and y* agree outside the box.
struct ImageLossParams {
  const float* image;   // y [H, W, 3]
  const float* target;  // y* [H, W, 3]
  int32_t width, height;
  float lambda;     // 0.2
  int32_t roi[4];   // all zero: the whole image
  float* gradient;  // dL/dy [H, W, 3]
  // [1] backend memory: the loss is added here and the returned value is empty, so that nobody
  // waits for it. Null: it is returned.
  double* loss = nullptr;
};

struct ImageLossValue {
  double loss, l1, ssim;
};

// A rectangle of an RGB image in 16-bit steps of `unit`, clamped to [0, 65535] of them.
struct PackBoxParams {
  float* image;  // [H, W, 3], read by PackBox, written by UnpackBox
  int32_t width, height;
  int32_t box[4];    // x0, y0, x1, y1, half-open, inside the image
  uint16_t* packed;  // [y1 - y0, x1 - x0, 3]
  float unit;        // above 0
};

// out = edited(image) inside `box`.
struct EditImageParams {
  const float* image;   // [H, W, 3]
  const uint8_t* mask;  // [H, W]; null: all of the image is edited
  ColorMap map;
  int32_t width, height;
  int32_t box[4];  // as in PackBoxParams
  float* out;      // [H, W, 3]; may be `image`
};

// Of the Region operations, a geometry that is not a region is std::invalid_argument.
class RefitOps {
 public:
  virtual ~RefitOps() = default;

  void RegionTarget(const ViewGeometry& region, const RegionTargetParams& params);
  void RegionResidual(const ViewGeometry& region, const RegionResidualParams& params);
  void RegionSweep(const ViewGeometry& region, const RegionSweepParams& params);
  // image += delta on the region's pixels, both [H, W, 3].
  void RegionAdd(const ViewGeometry& region, float* image, const float* delta);
  // The weights of RegionTarget as an image [H, W], 0 outside the region's pixels.
  void RegionWeightImage(const ViewGeometry& region, const uint8_t* weights, float* image);
  // seen[rows()[r]] = 1 for every row r, [N]: which Gaussians some view sees.
  void MarkRows(const ViewGeometry& view, uint8_t* seen);
  // numbers[r] = number_of[rows()[r]], from [N] to [rows]: the numbers of the rows' Gaussians.
  void NumberRows(const ViewGeometry& view, const int32_t* number_of, int32_t* numbers);
  ImageLossValue ImageLoss(const ImageLossParams& params);
  void PackBox(const PackBoxParams& params);
  void UnpackBox(const PackBoxParams& params);
  void EditImage(const EditImageParams& params);

 protected:
  // `blend`: the same backend's.
  explicit RefitOps(BlendOps& blend) : blend_(blend) {}

  virtual void DoRegionTarget(const ViewGeometry& region, const RegionTargetParams& params) = 0;
  virtual void DoRegionResidual(const ViewGeometry& region, const RegionResidualParams& params) = 0;
  // In three steps; a backend that is faster in one pass overrides it.
  virtual void DoRegionSweep(const ViewGeometry& region, const RegionSweepParams& params);
  virtual void DoRegionAdd(const ViewGeometry& region, float* image, const float* delta) = 0;
  virtual void DoRegionWeightImage(const ViewGeometry& region, const uint8_t* weights,
                                   float* image) = 0;
  virtual void DoMarkRows(const ViewGeometry& view, uint8_t* seen) = 0;
  virtual void DoNumberRows(const ViewGeometry& view, const int32_t* number_of,
                            int32_t* numbers) = 0;
  // The region of interest is not empty: all of the image where the caller named none.
  virtual ImageLossValue DoImageLoss(const ImageLossParams& params) = 0;
  virtual void DoPackBox(const PackBoxParams& params) = 0;
  virtual void DoUnpackBox(const PackBoxParams& params) = 0;
  virtual void DoEditImage(const EditImageParams& params) = 0;

 private:
  BlendOps& blend_;
};

}  // namespace retint
