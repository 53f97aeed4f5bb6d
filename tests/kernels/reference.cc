// SPDX-License-Identifier: BSD-3-Clause
#include "tests/kernels/reference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include <Eigen/Dense>

namespace retint {
namespace {

struct Projected {
  int gaussian;
  double x, y, z, opacity;
  Eigen::Matrix2d covariance, conic;
  Eigen::Vector2d depth_slope;  // of the mean of z with the pixel
  double depth_deviation;       // standard, of z
  double DepthAlongRay(const Eigen::Vector2d& offset) const {
    const double most = 3 * depth_deviation;
    return std::max(0.2, z + std::clamp(depth_slope.dot(offset), -most, most));
  }
};

std::optional<Projected> Project(const TestModel& model, const CameraParams& camera, int g) {
  using Eigen::Map;
  using RowMatrix = Eigen::Matrix<float, 3, 3, Eigen::RowMajor>;
  const Eigen::Matrix3d rotation = Map<const RowMatrix>(camera.rotation).cast<double>();
  const Eigen::Vector3d mean =
      Map<const Eigen::Vector3f>(&model.means[size_t(3 * g)]).cast<double>();
  const Eigen::Vector3d t =
      rotation * mean + Map<const Eigen::Vector3f>(camera.translation).cast<double>();
  if (t.z() <= 0.2) return std::nullopt;
  const float* q = &model.quats[size_t(4 * g)];
  const Eigen::Matrix3d axes =
      Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
  const Eigen::Vector3d scales =
      Map<const Eigen::Vector3f>(&model.log_scales[size_t(3 * g)]).cast<double>().array().exp();
  const Eigen::Matrix3d sigma =
      axes * scales.array().square().matrix().asDiagonal() * axes.transpose();
  // Inside the picture, and 0.3 of half its size beyond its sides.
  const auto clamped = [](double slope, double focal, double principal, int size) {
    const double margin = 0.15 * size;
    return std::clamp(slope, -(principal + margin) / focal, (size - principal + margin) / focal);
  };
  const double u = clamped(t.x() / t.z(), camera.fx, camera.cx, camera.width);
  const double v = clamped(t.y() / t.z(), camera.fy, camera.cy, camera.height);
  Eigen::Matrix<double, 2, 3> jacobian;
  jacobian << camera.fx / t.z(), 0, -camera.fx * u / t.z(), 0, camera.fy / t.z(),
      -camera.fy * v / t.z();
  const Eigen::Matrix<double, 2, 3> j = jacobian * rotation;
  Projected out;
  const Eigen::Matrix2d sharp = j * sigma * j.transpose();
  out.covariance = sharp + 0.3 * Eigen::Matrix2d::Identity();
  out.gaussian = g;
  out.x = camera.fx * t.x() / t.z() + camera.cx;
  out.y = camera.fy * t.y() / t.z() + camera.cy;
  out.z = t.z();
  out.opacity = 1 / (1 + std::exp(-double(model.logits[size_t(g)])));
  if (model.compensate) {
    const double ratio = sharp.determinant() / out.covariance.determinant();
    out.opacity *= std::sqrt(std::max(ratio, 0.005 * 0.005));
  }
  out.conic = out.covariance.inverse();
  out.depth_slope = out.conic * (j * sigma * rotation.row(2).transpose());
  out.depth_deviation = std::sqrt(rotation.row(2).dot(sigma * rotation.row(2).transpose()));
  return out;
}

}  // namespace

std::vector<ReferenceWeight> ReferenceWeights(const TestModel& model, const CameraParams& camera) {
  std::vector<Projected> visible;
  for (int g = 0; g < model.count(); ++g) {
    if (auto projected = Project(model, camera, g)) visible.push_back(*projected);
  }
  std::stable_sort(visible.begin(), visible.end(),
                   [](const Projected& a, const Projected& b) { return a.z < b.z; });
  std::vector<double> transmittance(size_t(camera.width) * size_t(camera.height), 1.0);
  std::vector<bool> done(transmittance.size(), false);
  std::vector<ReferenceWeight> weights;
  for (const Projected& g : visible) {
    // alpha >= 1 / 255 needs an offset below 3.33 standard deviations; 4 leaves room to spare.
    const double rx = 4 * std::sqrt(g.covariance(0, 0)), ry = 4 * std::sqrt(g.covariance(1, 1));
    const int x0 = int(std::clamp(g.x - rx, 0.0, double(camera.width)));
    const int x1 = int(std::clamp(g.x + rx + 1, 0.0, double(camera.width)));
    const int y0 = int(std::clamp(g.y - ry, 0.0, double(camera.height)));
    const int y1 = int(std::clamp(g.y + ry + 1, 0.0, double(camera.height)));
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) {
        const size_t pixel = size_t(y) * size_t(camera.width) + size_t(x);
        if (done[pixel]) continue;
        const Eigen::Vector2d offset(x + 0.5 - g.x, y + 0.5 - g.y);
        const double power = -0.5 * offset.dot(g.conic * offset);
        const double alpha = std::min(0.99, g.opacity * std::exp(power));
        if (alpha < 1.0 / 255) continue;
        const double after = transmittance[pixel] * (1 - alpha);
        if (after < 1e-4) {
          done[pixel] = true;
          continue;
        }
        weights.push_back({g.gaussian, int(pixel), alpha * transmittance[pixel],
                           transmittance[pixel], g.z, g.DepthAlongRay(offset)});
        transmittance[pixel] = after;
      }
    }
  }
  return weights;
}

std::vector<double> ReferenceShBasis(int degree, double x, double y, double z) {
  const double theta = std::acos(std::clamp(z, -1.0, 1.0)), phi = std::atan2(y, x);
  std::vector<double> basis;
  for (int l = 0; l <= degree; ++l) {
    for (int m = -l; m <= l; ++m) {
      const int n = std::abs(m);
      const double ratio = std::tgamma(l - n + 1) / std::tgamma(l + n + 1);
      const double norm = std::sqrt((2 * l + 1) / (4 * M_PI) * ratio);
      // 3DGS's functions carry the Condon-Shortley phase; std::assoc_legendre does not.
      const double phase = n % 2 == 0 ? 1 : -1;
      const double p = phase * std::assoc_legendre(unsigned(l), unsigned(n), std::cos(theta));
      const double azimuth = m == 0  ? 1
                             : m > 0 ? std::sqrt(2.0) * std::cos(n * phi)
                                     : std::sqrt(2.0) * std::sin(n * phi);
      basis.push_back(norm * p * azimuth);
    }
  }
  return basis;
}

std::vector<double> ReferenceColor(const TestModel& model, const std::vector<double>& sh, int g,
                                   const CameraParams& camera) {
  Eigen::Vector3d direction;
  for (int i = 0; i < 3; ++i)
    direction[i] = double(model.means[size_t(3 * g + i)]) - camera.center[i];
  direction.normalize();
  const auto basis = ReferenceShBasis(model.sh_degree, direction.x(), direction.y(), direction.z());
  std::vector<double> color(3, 0.5);
  for (size_t k = 0; k < basis.size(); ++k) {
    for (size_t c = 0; c < 3; ++c) color[c] += basis[k] * sh[3 * k + c];
  }
  for (double& c : color) c = std::max(0.0, c);
  return color;
}

ReferenceLoss ReferenceImageLoss(const std::vector<double>& image,
                                 const std::vector<double>& target, int width, int height,
                                 double lambda) {
  std::array<double, 11> window;
  for (int i = 0; i < 11; ++i) window[size_t(i)] = std::exp(-(i - 5) * (i - 5) / (2 * 1.5 * 1.5));
  const double sum = std::accumulate(window.begin(), window.end(), 0.0);
  for (double& w : window) w /= sum;
  const auto at = [&](const std::vector<double>& v, int x, int y, int c) {
    const bool inside = x >= 0 && y >= 0 && x < width && y < height;
    return inside ? v[size_t((y * width + x) * 3 + c)] : 0.0;
  };
  ReferenceLoss loss{0, 0, 0};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) {
        double ma = 0, mb = 0, aa = 0, bb = 0, ab = 0;
        for (int j = -5; j <= 5; ++j) {
          for (int i = -5; i <= 5; ++i) {
            const double w = window[size_t(i + 5)] * window[size_t(j + 5)];
            const double a = at(image, x + i, y + j, c), b = at(target, x + i, y + j, c);
            ma += w * a, mb += w * b, aa += w * a * a, bb += w * b * b, ab += w * a * b;
          }
        }
        const double c1 = 0.0001, c2 = 0.0009;
        loss.ssim += (2 * ma * mb + c1) * (2 * (ab - ma * mb) + c2) /
                     ((ma * ma + mb * mb + c1) * (aa - ma * ma + bb - mb * mb + c2));
        loss.l1 += std::fabs(at(image, x, y, c) - at(target, x, y, c));
      }
    }
  }
  loss.ssim /= width * height * 3.0;
  loss.l1 /= width * height * 3.0;
  loss.loss = (1 - lambda) * loss.l1 + lambda * (1 - loss.ssim);
  return loss;
}

}  // namespace retint
