// SPDX-License-Identifier: BSD-3-Clause
// The mask projection's formulas: a depth sample, a cloud's point in a view, a look-up of paint.
#pragma once

#include <cmath>
#include <cstdint>

#include <glm/geometric.hpp>

#include "kernels/common/camera.h"

namespace retint {

RETINT_HD bool IsWantedRow(uint16_t pixel_rows, int64_t y) {
  return pixel_rows >> (y % kTileSize) & 1;
}

// Row y where it is wanted, else the nearest one above that is (bit 0 of `pixel_rows` is set).
RETINT_HD int WantedRow(uint16_t pixel_rows, int y) {
  while (!IsWantedRow(pixel_rows, y)) --y;
  return y;
}

RETINT_HD bool HasDepth(float z) { return z > 0 && z < INFINITY; }

// Depth at a continuous pixel: bilinear in 1/z, exact on planes. 0 outside the image, or where the
// four pixels around lack depth or disagree by more than `max_spread` of the nearest.
RETINT_HD double SampleDepthAt(const float* depth, int width, int height, uint16_t pixel_rows,
                               double px, double py, double max_spread) {
  if (!(px >= 0 && py >= 0 && px < width && py < height)) return 0;
  const double x = fmin(fmax(px - 0.5, 0.0), width - 1.0);
  const double y = fmin(fmax(py - 0.5, 0.0), height - 1.0);
  const int x0 = int(x), y0 = int(y);
  const int x1 = x0 + 1 < width ? x0 + 1 : x0, y1 = y0 + 1 < height ? y0 + 1 : y0;
  double low = INFINITY, high = 0, inverse = 0;
  for (int corner = 0; corner < 4; ++corner) {
    const int i = corner & 1 ? x1 : x0, j = WantedRow(pixel_rows, corner & 2 ? y1 : y0);
    const float value = depth[int64_t(j) * width + i];
    if (!HasDepth(value)) return 0;
    const double z = double(value);
    low = fmin(low, z);
    high = fmax(high, z);
    inverse += (corner & 1 ? x - x0 : 1 - (x - x0)) * (corner & 2 ? y - y0 : 1 - (y - y0)) / z;
  }
  return high - low > max_spread * low ? 0 : 1 / inverse;
}

// 1 / z' = a / z + b; 0 where that would be near 0.
RETINT_HD float CorrectedDepth(float z, float a, float b) {
  const float divisor = a + b * z;
  return z > 0 && divisor > 0.1f ? z / divisor : 0;
}

// Compares, because fmin and fmax are calls on a host. NaN becomes 0.
RETINT_HD uint8_t ToByte(double value) {
  return value > 0 ? uint8_t((value < 1 ? value : 1) * 255 + 0.5) : uint8_t(0);
}

// Half the width of a disc of `radius` pixels, `dy` rows from its middle.
RETINT_HD int DiscReach(int radius, int dy) {
  return int(sqrtf(float(radius * radius - dy * dy)) + 0.5f);
}

// Rays (u, v, 1) through the pixels' centres.
struct PixelRays {
  float u_step, u_first, v_step, v_first;
  RETINT_HD glm::vec3 At(int x, int y) const {
    return {u_step * float(x) + u_first, v_step * float(y) + v_first, 1};
  }
};

RETINT_HD PixelRays RaysOf(const CameraParams& camera) {
  return {1 / camera.fx, (0.5f - camera.cx) / camera.fx, 1 / camera.fy,
          (0.5f - camera.cy) / camera.fy};
}

// A point of the cloud in a view: a disc, or a square where `radius` is 0.
struct CloudSplat {
  int32_t x0, y0, x1, y1;  // pixels that it may cover, half-open
  glm::vec3 center;        // in the camera's frame
  glm::vec3 normal;        // of the disc's plane, normal . x = offset
  float offset;
  float radius, footprint;  // world
  float coverage;
};

// Pixels whose centres lie within `reach` of (x, y), clipped to the image; false if there is none.
RETINT_HD bool SetBox(const CameraParams& camera, const glm::vec2& at, float reach_x, float reach_y,
                      CloudSplat* splat) {
  const float w = float(camera.width), h = float(camera.height);
  splat->x0 = int(fminf(fmaxf(ceilf(at.x - reach_x - 0.5f), 0.0f), w));
  splat->y0 = int(fminf(fmaxf(ceilf(at.y - reach_y - 0.5f), 0.0f), h));
  splat->x1 = int(fminf(fmaxf(floorf(at.x + reach_x - 0.5f) + 1, 0.0f), w));
  splat->y1 = int(fminf(fmaxf(floorf(at.y + reach_y - 0.5f) + 1, 0.0f), h));
  return splat->x0 < splat->x1 && splat->y0 < splat->y1;
}

// False where the point covers no pixel. `side`: of the square in pixels, or 0 for a disc across
// the point's normal (facing the viewer where it has none) of radius `scale` footprints.
RETINT_HD bool ProjectCloudPoint(const CameraParams& camera, const CloudPoint& point, float side,
                                 float scale, CloudSplat* splat) {
  const glm::vec3 center =
      CamFromWorld(camera, {point.position[0], point.position[1], point.position[2]});
  if (!(center.z > 0)) return false;
  const glm::vec2 at = ImgFromCam(camera, center);
  splat->center = center;
  splat->footprint = point.footprint;
  splat->coverage = point.coverage;
  splat->radius = 0;
  if (side > 0) return SetBox(camera, at, side / 2, side / 2, splat);
  // A disc that reaches the camera's plane has no bounded box: leave it out.
  splat->radius = scale * point.footprint;
  const float reach = splat->radius + 0.5f * point.footprint;
  if (!(center.z > reach) || !(splat->radius > 0)) return false;
  const float nearest = center.z - reach;
  if (!SetBox(camera, at, fmaxf(0.5f, camera.fx * reach / nearest),
              fmaxf(0.5f, camera.fy * reach / nearest), splat)) {
    return false;
  }
  const glm::vec3 normal(point.normal[0], point.normal[1], point.normal[2]);
  splat->normal =
      normal == glm::vec3(0) ? -center / glm::length(center) : RotationOf(camera) * normal;
  splat->offset = glm::dot(splat->normal, center);
  return true;
}

// Of pixel (x, y), whose depth is `front` (0: hides nothing). A disc is full within the radius less
// half a footprint and fades to 0 half a footprint outside.
RETINT_HD float CoverageAt(const PixelRays& rays, const CloudSplat& splat, int x, int y,
                           float front, float depth_tolerance) {
  const float limit = front > 0 ? front * (1 + depth_tolerance) : INFINITY;
  if (!(splat.radius > 0)) return splat.center.z > limit ? 0 : splat.coverage;
  const glm::vec3 ray = rays.At(x, y);
  const float z = splat.offset / glm::dot(splat.normal, ray);
  if (!(z <= limit)) return 0;
  const glm::vec3 away = z * ray - splat.center;
  const float squared = glm::dot(away, away), reach = splat.radius + 0.5f * splat.footprint;
  if (!(squared < reach * reach)) return 0;
  const float fade = (splat.radius - sqrtf(squared)) / splat.footprint + 0.5f;
  return fade > 0 ? splat.coverage * (fade < 1 ? fade : 1) : 0;
}

// Whether MarkSilhouette marks pixel (x, y).
RETINT_HD bool IsBesideSilhouette(const uint8_t* mask, const float* depth, int width, int height,
                                  float jump, int x, int y) {
  constexpr uint8_t kPainted = 128;
  const int64_t pixel = int64_t(y) * width + x;
  if (mask[pixel] >= kPainted) return false;
  const float z = depth[pixel];
  for (int j = y > 0 ? y - 1 : 0; j <= y + 1 && j < height; ++j) {
    for (int i = x > 0 ? x - 1 : 0; i <= x + 1 && i < width; ++i) {
      const int64_t beside = int64_t(j) * width + i;
      if (mask[beside] < kPainted || !HasDepth(depth[beside])) continue;
      if (!HasDepth(z) || z > depth[beside] * (1 + jump)) return true;
    }
  }
  return false;
}

// The mask, 0 to 255, on the surface at `point`, which is in the frame of painted.camera's pose. It
// is -1 if the view does not see the point: its depth there differs by more than `tolerance`.
RETINT_HD int PaintAt(const PaintedImage& painted, const glm::vec3& point, float tolerance) {
  const CameraParams& camera = painted.camera;
  const glm::vec3 moved = CamFromWorld(camera, point);
  if (!(moved.z > 0)) return -1;
  const glm::vec2 at = ImgFromCam(camera, moved);
  if (!(at.x >= 0 && at.y >= 0 && at.x < float(camera.width) && at.y < float(camera.height))) {
    return -1;
  }
  const int64_t pixel = int64_t(at.y) * camera.width + int(at.x);
  const float seen = painted.depth[pixel];
  if (!(seen > 0) || !(fabsf(moved.z - seen) <= tolerance * seen)) return -1;
  return painted.mask[pixel];
}

// K M and K of a pixel before scaling, for a surface of depth z: from the `count` painted views, or
// from `coverage` if none of them sees the surface.
RETINT_HD glm::vec2 EvidenceAt(const PixelRays& rays, int x, int y, float z,
                               const PaintedImage* painted, int count, float tolerance,
                               float unknown_weight, uint8_t coverage) {
  if (z == kNoEvidence) return {0, 0};
  if (HasDepth(z)) {
    const glm::vec3 point = z * rays.At(x, y);
    int sum = 0, seen = 0;
    for (int i = 0; i < count; ++i) {
      const int paint = PaintAt(painted[i], point, tolerance);
      sum += paint < 0 ? 0 : paint;
      seen += paint < 0 ? 0 : 1;
    }
    if (seen > 0) return {float(sum) / (255.0f * float(seen)), 1};
  }
  const float covered = float(coverage) / 255.0f;
  const float weight = unknown_weight < covered ? covered : unknown_weight;
  return {weight * covered, weight};
}

}  // namespace retint
