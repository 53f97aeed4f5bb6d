// SPDX-License-Identifier: BSD-3-Clause
// EWA splatting (Zwicker et al. 2001) with the constants of the original 3DGS rasterizer, and which
// pixels a projected Gaussian reaches.
#pragma once

#include <cmath>
#include <cstdint>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "kernels/common/camera.h"
#include "kernels/common/macros.h"
#include "kernels/common/types.h"

namespace retint {

// A projected Gaussian. At pixel offset (dx, dy) from its centre
//   alpha = min(kMaxAlpha, 2^(a dx^2 + b dx dy + c dy^2 + log2_opacity)).
// The conic (inverse 2D covariance) includes the factor -log2(e) / 2, so a pixel costs one exp2.
struct Splat {
  float x, y;          // centre, pixels
  float a, b, c;       // folded conic; a, c < 0
  float log2_opacity;  // <= 0
  float depth;         // z in the camera
  float half_height;   // rows beyond y +- this have alpha < kMinAlpha
};
static_assert(sizeof(Splat) == 32);

inline constexpr float kLog2MinAlpha = -7.99435344f;  // log2(1 / 255)

// View-independent part of a Gaussian: Sigma = R S S^T R^T as xx, xy, xz, yy, yz, zz.
struct Covariance3 {
  float xx, xy, xz, yy, yz, zz;
};

RETINT_HD Covariance3 CovarianceOf(const float* quat_wxyz, const float* log_scale) {
  float w = quat_wxyz[0], x = quat_wxyz[1], y = quat_wxyz[2], z = quat_wxyz[3];
  const float norm = std::sqrt(w * w + x * x + y * y + z * z);
  const float inverse = norm > 0 ? 1 / norm : 0;
  w = norm > 0 ? w * inverse : 1;
  x *= inverse, y *= inverse, z *= inverse;
  const glm::mat3 rotation(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y),
                           2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x),
                           2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y));
  glm::mat3 m;  // R S
  for (int k = 0; k < 3; ++k) m[k] = rotation[k] * std::exp(log_scale[k]);
  const glm::mat3 s = m * glm::transpose(m);
  return {s[0][0], s[1][0], s[2][0], s[1][1], s[2][1], s[2][2]};
}

RETINT_HD float Sigmoid(float logit) { return 1 / (1 + std::exp(-logit)); }

RETINT_HD glm::vec3 Times(const Covariance3& s, const glm::vec3& v) {
  return {s.xx * v.x + s.xy * v.y + s.xz * v.z, s.xy * v.x + s.yy * v.y + s.yz * v.z,
          s.xz * v.x + s.yz * v.y + s.zz * v.z};
}

// x/z or y/z, for a camera's Jacobian. It is clamped to the image plus (kFovMargin - 1) / 2 of
// its size beyond each side, so that a crop gives the same values as the whole image. With a
// centered principal point this is kFovMargin * tan(fov / 2) on both sides, tan(fov / 2) = size /
// (2 f).
RETINT_HD float ClampedSlope(float slope, float focal, float principal, int32_t size) {
  const float reach = kFovMargin * float(size), shift = 2 * principal - float(size);
  return glm::min((reach - shift) / (2 * focal), glm::max(-(reach + shift) / (2 * focal), slope));
}

// How a pixel moves with the world at `t` in the camera: the rows of J R.
struct PixelGradients {
  glm::vec3 x, y;
};

RETINT_HD PixelGradients PixelGradientsAt(const CameraParams& camera, const glm::vec3& t) {
  const float u = ClampedSlope(t.x / t.z, camera.fx, camera.cx, camera.width);
  const float v = ClampedSlope(t.y / t.z, camera.fy, camera.cy, camera.height);
  const float jx = camera.fx / t.z, jy = camera.fy / t.z;
  const float* r = camera.rotation;
  return {{jx * (r[0] - u * r[6]), jx * (r[1] - u * r[7]), jx * (r[2] - u * r[8])},
          {jy * (r[3] - v * r[6]), jy * (r[4] - v * r[7]), jy * (r[5] - v * r[8])}};
}

// 2D covariance (xx, xy, yy; px^2, not dilated) of a Gaussian whose mean is at `t` in the camera.
RETINT_HD glm::vec3 ProjectCovariance(const CameraParams& camera, const glm::vec3& t,
                                      const Covariance3& s) {
  const PixelGradients pixel = PixelGradientsAt(camera, t);
  const glm::vec3 sp = Times(s, pixel.x), sq = Times(s, pixel.y);
  return {glm::dot(pixel.x, sp), glm::dot(pixel.x, sq), glm::dot(pixel.y, sq)};
}

// The factor of an antialiased splat's opacity, sqrt(det S / det(S + 0.3 I)), with `covariance` S
// and `dilated_det` det(S + 0.3 I). With it, dilation does not add light to a Gaussian smaller than
// a pixel (Mip-Splatting, Yu et al. 2024). The least value is gsplat's.
RETINT_HD float OpacityScale(const glm::vec3& covariance, double dilated_det) {
  constexpr double kLeast = 0.005;
  const double det = double(covariance.x) * covariance.z - double(covariance.y) * covariance.y;
  const double ratio = det / dilated_det;
  return float(std::sqrt(ratio > kLeast * kLeast ? ratio : kLeast * kLeast));
}

// False where the Gaussian is culled: behind kNearPlane, fainter than kMinAlpha, or not finite.
// `compensate`: by OpacityScale().
RETINT_HD bool ProjectGaussian(const CameraParams& camera, const glm::vec3& mean,
                               const Covariance3& covariance, float opacity, bool compensate,
                               Splat* splat) {
  const glm::vec3 t = CamFromWorld(camera, mean);
  if (!(t.z > kNearPlane) || !(opacity >= kMinAlpha)) return false;
  const glm::vec3 sharp = ProjectCovariance(camera, t, covariance);
  const glm::vec3 cov(sharp.x + kCovarianceDilation, sharp.y, sharp.z + kCovarianceDilation);
  const double det = double(cov.x) * cov.z - double(cov.y) * cov.y;
  if (!(det > 0) || !std::isfinite(det)) return false;
  if (compensate) {
    opacity *= OpacityScale(sharp, det);
    if (!(opacity >= kMinAlpha)) return false;
  }
  const glm::vec2 center = ImgFromCam(camera, t);
  if (!std::isfinite(center.x) || !std::isfinite(center.y)) return false;
  constexpr double kLog2e = 1.4426950408889634;
  splat->x = center.x;
  splat->y = center.y;
  splat->a = float(-0.5 * kLog2e * cov.z / det);
  splat->b = float(kLog2e * cov.y / det);
  splat->c = float(-0.5 * kLog2e * cov.x / det);
  // Rounding may make the conic of a needle indefinite; it must stay an ellipse.
  const float bound = 2 * std::sqrt(splat->a * splat->c) * (1 - 1e-6f);
  splat->b = glm::min(bound, glm::max(-bound, splat->b));
  splat->log2_opacity = std::log2(opacity);
  splat->depth = t.z;
  splat->half_height = 0;
  return true;
}

// A row's number plus this, as the bits of a float, is neither 0 nor slow to calculate with: so
// that a loop that finds depths finds rows.
inline constexpr uint32_t kFirstNormal = 0x00800000;

// z of a Gaussian's middle along the ray through pixel position (x, y): the mean of z given that
// position. It is linear in the position, and limited to three standard deviations of z and to
// beyond kNearPlane. On a flat Gaussian it is the intersection of the ray with its plane.
RETINT_HD float DepthAlongRay(const CameraParams& camera, const glm::vec3& mean,
                              const Covariance3& covariance, const Splat& splat, float x, float y) {
  const PixelGradients pixel = PixelGradientsAt(camera, CamFromWorld(camera, mean));
  const float* r = camera.rotation;
  const glm::vec3 sz = Times(covariance, {r[6], r[7], r[8]});
  const float zx = glm::dot(pixel.x, sz), zy = glm::dot(pixel.y, sz);
  const float dx = x - splat.x, dy = y - splat.y;
  constexpr float kLn2 = 0.69314718f;  // the conic is -log2(e) / 2 of the inverse
  const float offset =
      -kLn2 * (zx * (2 * splat.a * dx + splat.b * dy) + zy * (splat.b * dx + 2 * splat.c * dy));
  const float zz = r[6] * sz.x + r[7] * sz.y + r[8] * sz.z;
  const float most = 3 * std::sqrt(glm::max(zz, 0.0f));
  return glm::max(kNearPlane, splat.depth + glm::min(most, glm::max(-most, offset)));
}

// The ellipse alpha >= kMinAlpha of a splat, a hair enlarged so that rounding loses no pixel:
// A dx^2 + B dx dy + C dy^2 <= s.
struct Reach {
  double A, B, C, s;
  double half_width, half_height;  // pixels
  double tip;                      // dy of the ellipse's rightmost point; its leftmost is at -tip
};

RETINT_HD Reach ReachOf(const Splat& splat) {
  Reach reach{-double(splat.a), -double(splat.b), -double(splat.c), 0, 0, 0, 0};
  reach.s = double(splat.log2_opacity) - double(kLog2MinAlpha) + 1e-3;
  const double det = 4 * reach.A * reach.C - reach.B * reach.B;
  reach.half_width = std::sqrt(4 * reach.C * reach.s / det);
  reach.half_height = std::sqrt(4 * reach.A * reach.s / det);
  reach.tip = -reach.B * reach.half_width / (2 * reach.C);
  return reach;
}

// Horizontal extent, relative to the centre, of the ellipse's part with dy in [dy0, dy1]; false if
// there is none. The part is convex, so every column between its ends meets it.
RETINT_HD bool StripExtent(const Reach& reach, double dy0, double dy1, double* left,
                           double* right) {
  dy0 = dy0 > -reach.half_height ? dy0 : -reach.half_height;
  dy1 = dy1 < reach.half_height ? dy1 : reach.half_height;
  if (dy0 > dy1) return false;
  const auto end = [&](double dy, double sign) {
    dy = dy < dy0 ? dy0 : dy > dy1 ? dy1 : dy;
    const double root = reach.B * reach.B * dy * dy - 4 * reach.A * (reach.C * dy * dy - reach.s);
    return (-reach.B * dy + sign * std::sqrt(root > 0 ? root : 0)) / (2 * reach.A);
  };
  *right = end(reach.tip, 1);
  *left = end(-reach.tip, -1);
  return true;
}

}  // namespace retint
