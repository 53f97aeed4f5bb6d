// SPDX-License-Identifier: BSD-3-Clause
// Plain-data parameters and views of memory shared by host and device code. Pointers belong to the
// backend that the struct is given to: host memory for "cpu", device memory for "cuda".
#pragma once

#include <cstdint>

namespace retint {

inline constexpr int kTileSize = 16;     // pixels, both ways
inline constexpr int kMaxShCoeffs = 16;  // degree 3
inline constexpr int kMaxChannels = 8;   // of Blend and BlendTranspose

// `pixel_rows` of an operation: bit y % kTileSize selects rows y. Backends may skip the other rows
// to save time; their pixels in an image are then unspecified.
inline constexpr uint16_t kAllPixelRows = 0xffff;

// Constants of the original 3DGS rasterizer (Kerbl et al. 2023, diff-gaussian-rasterization).
inline constexpr float kCovarianceDilation = 0.3f;  // px^2 added to the 2D covariance's diagonal
inline constexpr float kMaxAlpha = 0.99f;
inline constexpr float kMinAlpha = 1.0f / 255.0f;  // pairs below are skipped
inline constexpr float kMinTransmittance = 1e-4f;  // blending stops when T would fall below
inline constexpr float kNearPlane = 0.2f;          // Gaussians with z <= this are culled
inline constexpr float kFovMargin = 1.3f;  // Jacobian's x/z, y/z clamped to this times tan(fov/2)

// A posed pinhole camera. x_in_cam = rotation * x_in_world + translation; pixel centres at + 0.5
// (COLMAP).
struct CameraParams {
  float fx, fy, cx, cy;   // pixels
  int32_t width, height;  // pixels
  float rotation[9];      // row-major, cam_from_world
  float translation[3];
  float center[3];  // camera centre in the world
};
static_assert(sizeof(CameraParams) == 84);

// A 3DGS model, raw values as in GaussianModel.
struct GaussianArrays {
  const float* means;           // [N, 3]
  const float* quats_wxyz;      // [N, 4]
  const float* log_scales;      // [N, 3]
  const float* opacity_logits;  // [N]
  const float* sh;              // [N, K, 3]
  int64_t count;                // N
  int32_t sh_degree;            // 0-3, K = (sh_degree + 1)^2
  bool compensate = false;      // see OpacityScale() in projection.h
};

// A point of a selection's cloud, in the world.
struct CloudPoint {
  float position[3];
  float normal[3];  // zero: unknown
  float footprint;  // size of the pixel that it was seen in
  float coverage;   // in (0, 1]
};

inline constexpr int kMaxNeighbors = 32;

// Depth of a pixel that says nothing of the surfaces about it.
inline constexpr float kNoEvidence = -1;

// A painted view: its depth and its mask. `camera` is posed in the frame of the view that is looked
// up in it.
struct PaintedImage {
  CameraParams camera;
  const float* depth;   // [H, W]
  const uint8_t* mask;  // [H, W]
};

inline constexpr int kMaxStereoViews = 4;

// An image of stereo; the grid and the motion are those of kernels/stereo_ops.h.
struct StereoView {
  const float* rgb;       // [height, width, 3]
  const float* gray;      // [height, width], of StereoOps::Gray
  int32_t x, y;           // of the first pixel, on the grid
  int32_t width, height;  // pixels
  int32_t dx, dy;         // motion of the content; 0, 0 for the reference
};

}  // namespace retint
