// SPDX-License-Identifier: BSD-3-Clause
// The mask projection's steps (src/selection), so that a view's images never leave backend memory.
// In depth maps, [H, W], 0 is no depth. Rows outside `pixel_rows` (bit 0 is set) are not read.
#pragma once

#include <cstdint>
#include <span>

#include "kernels/common/types.h"

namespace retint {

// Depth at continuous pixels (x, y), bilinear in 1/z, exact on planes. 0 outside the image, or
// where the four pixels around lack depth or disagree by more than `max_spread` of the nearest. A
// row that is not wanted is taken to be as the wanted one above.
struct SampleDepthParams {
  const float* depth;  // [H, W]
  int32_t width, height;
  const double* pixels;  // [count, 2]
  int64_t count;
  double max_spread;  // 0.03
  double* samples;    // [count]
  uint16_t pixel_rows = kAllPixelRows;
};

// 1 / z' = a / z + b, in place; 0 where that is near or below 0.
struct CorrectDepthParams {
  float* depth;  // [H, W]
  int32_t width, height;
  float a, b;
  uint16_t pixel_rows = kAllPixelRows;
};

// Coverage in [0, 1]: the largest of the points that cover a pixel and are not hidden. A point is
// hidden if it is further than depth * (1 + depth_tolerance). It is a disc across its normal (or
// facing the viewer), of radius `disc_scale` footprints: 1 up to half a footprint inside the rim, 0
// from half a footprint outside. The depth of the disc's plane is tested at every pixel. With
// square_pixels > 0 it is a square of that side about its projection, as deep as the point.
struct DrawCloudParams {
  CameraParams camera;
  const CloudPoint* points;  // [count]
  int64_t count;
  float square_pixels, disc_scale;
  const float* depth;  // [H, W]
  float depth_tolerance;
  float* coverage;  // [H, W], overwritten; 0 outside `pixel_rows`
  uint16_t pixel_rows = kAllPixelRows;
};

// mask = 255 clamp(scale * image + offset, 0, 1), rounded; then closed: the maximum over a disc of
// close_radius pixels, then the minimum, inside the image.
struct MakeMaskParams {
  const float* image;  // [H, W]
  int32_t width, height;
  double scale, offset;
  int32_t close_radius;  // 0: not closed
  uint8_t* mask;         // [H, W]
};

// In place: pixels below 128 become 0 unless a pixel of 128 or more lies within `reach` rows and
// columns. A border may be that soft; faint pixels farther away are not part of the mask.
struct DropFaintParams {
  uint8_t* mask;  // [H, W]
  int32_t width, height;
  int32_t reach;  // pixels
};

// Sets depth = kNoEvidence just outside the silhouette of a painted shape. There, one of the eight
// neighbors of an unpainted pixel is painted, and nearer by more than `jump` of the pixel's depth.
// Such a pixel still shows the fringe of the shape's Gaussians. Of those behind its silhouette the
// view shows nothing else. Pixels of 128 and more are painted.
struct MarkSilhouetteParams {
  const uint8_t* mask;  // [H, W]
  int32_t width, height;
  float jump;
  float* depth;  // [H, W]
};

// The evidence of each pixel: mask value M and weight K. A painted view sees the pixel's surface if
// their depths differ by at most `tolerance`. M is then that view's mask, the mean of several, and
// K = 1; else M = 0 and K = unknown_weight. `coverage` raises both to its value. If the depth is
// kNoEvidence, M = K = 0. residual = scale * (K M, K); a `visible` above 0 is a third channel. Zero
// outside `pixel_rows`.
struct EvidenceParams {
  CameraParams camera;  // its pose is not read
  const float* depth;   // [H, W]; null: none
  // In host memory, its images in backend memory.
  std::span<const PaintedImage> painted = {};
  float tolerance = 0, unknown_weight;
  const uint8_t* coverage = nullptr;  // [H, W], steps of 1 / 255; null: none
  float scale;
  // [H, W, 2]: scale K M, scale K. With a `visible` above 0 [H, W, 4]: then visible K and visible.
  float* residual;
  uint16_t pixel_rows = kAllPixelRows;
  float visible = 0;
};

class MaskOps {
 public:
  virtual ~MaskOps() = default;

  void SampleDepth(const SampleDepthParams& params);
  void CorrectDepth(const CorrectDepthParams& params);
  void DrawCloud(const DrawCloudParams& params);
  void MakeMask(const MakeMaskParams& params);
  void DropFaint(const DropFaintParams& params);
  void MarkSilhouette(const MarkSilhouetteParams& params);
  void Evidence(const EvidenceParams& params);

 protected:
  virtual void DoSampleDepth(const SampleDepthParams& params) = 0;
  virtual void DoCorrectDepth(const CorrectDepthParams& params) = 0;
  virtual void DoDrawCloud(const DrawCloudParams& params) = 0;
  virtual void DoMakeMask(const MakeMaskParams& params) = 0;
  virtual void DoDropFaint(const DropFaintParams& params) = 0;
  virtual void DoMarkSilhouette(const MarkSilhouetteParams& params) = 0;
  virtual void DoEvidence(const EvidenceParams& params) = 0;
};

}  // namespace retint
