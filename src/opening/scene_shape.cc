// SPDX-License-Identifier: BSD-3-Clause
#include "opening/scene_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "base/error.h"
#include "kernels/common/sh.h"

namespace retint {
namespace {

constexpr size_t kMaxSamples = 100'000;
constexpr double kMinOpacity = 0.1;

struct Sample {
  size_t index;
  Eigen::Vector3d mean;
  double opacity;
};

// The Gaussians that can be seen, evenly thinned.
std::vector<Sample> TakeSamples(const GaussianModel& model) {
  std::vector<Sample> samples;
  const size_t step = std::max<size_t>(1, model.NumGaussians() / kMaxSamples);
  for (double least = kMinOpacity; samples.empty() && least > 1e-4; least /= 5) {
    for (size_t i = 0; i < model.NumGaussians(); i += samples.empty() ? 1 : step) {
      const double opacity = 1 / (1 + std::exp(-double(model.opacity_logits[i])));
      if (opacity < least) continue;
      const Eigen::Map<const Eigen::Vector3f> mean(model.means.data() + 3 * i);
      samples.push_back({i, mean.cast<double>(), opacity});
    }
  }
  if (samples.empty()) throw InputError("the splat has no visible Gaussian");
  return samples;
}

// The value below which `share` of the weight lies; `values` are (value, weight).
double Quantile(std::vector<std::pair<double, double>>& values, double share) {
  std::sort(values.begin(), values.end());
  double total = 0, sum = 0;
  for (const auto& [value, weight] : values) total += weight;
  for (const auto& [value, weight] : values) {
    if ((sum += weight) >= share * total) return value;
  }
  return values.back().first;
}

double Radius(const std::vector<Sample>& samples, const Eigen::Vector3d& center, double share) {
  std::vector<std::pair<double, double>> distances;
  for (const Sample& one : samples) {
    distances.emplace_back((one.mean - center).norm(), one.opacity);
  }
  return Quantile(distances, share);
}

// The median by axis, then again of the near Gaussians, so that a one-sided background does not
// pull it.
Eigen::Vector3d Center(const std::vector<Sample>& samples) {
  constexpr int kRounds = 4;
  constexpr double kNear = 2;  // times the distance within which half lies
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double near = std::numeric_limits<double>::infinity();
  for (int round = 0; round < kRounds; ++round) {
    std::array<std::vector<std::pair<double, double>>, 3> values;
    for (const Sample& one : samples) {
      if (!((one.mean - center).norm() <= near)) continue;
      for (size_t k = 0; k < 3; ++k) {
        values[k].emplace_back(one.mean[Eigen::Index(k)], one.opacity);
      }
    }
    for (size_t k = 0; k < 3; ++k) center[Eigen::Index(k)] = Quantile(values[k], 0.5);
    near = kNear * Radius(samples, center, 0.5);
  }
  return center;
}

// The axis across which a Gaussian is thinnest, and how flat it is, 0 to 1.
std::pair<Eigen::Vector3d, double> Normal(const GaussianModel& model, size_t i) {
  const float* scales = model.log_scales.data() + 3 * i;
  const auto thin = std::min_element(scales, scales + 3) - scales;
  float middle = scales[(thin + 1) % 3];
  middle = std::min(middle, scales[(thin + 2) % 3]);
  const float* q = model.quats_wxyz.data() + 4 * i;
  Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
  if (rotation.squaredNorm() == 0) rotation.setIdentity();
  return {rotation.normalized() * Eigen::Vector3d::Unit(thin),
          1 - std::exp(double(scales[thin]) - double(middle))};
}

// The mean direction from the center to where the scene was seen from; up to 1 long, 0 when
// nothing is known.
Eigen::Vector3d SeenFrom(const GaussianModel& model, const std::vector<Sample>& samples,
                         const SceneShape& shape) {
  constexpr int kDirections = 60;
  constexpr size_t kGaussians = 1500;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double total = 0;
  const size_t step = std::max<size_t>(1, samples.size() / kGaussians);
  for (int k = 0; k < kDirections; ++k) {
    const double z = 1 - (2 * k + 1.0) / kDirections;
    const double angle = k * std::numbers::pi * (3 - std::sqrt(5.0));  // golden: even on the sphere
    const Eigen::Vector3d from(std::sqrt(1 - z * z) * std::cos(angle),
                               std::sqrt(1 - z * z) * std::sin(angle), z);
    double trained = 0;
    for (size_t s = 0; s < samples.size(); s += step) {
      const Sample& one = samples[s];
      const Eigen::Vector3d eye = shape.center + 2 * shape.outer_radius * from;
      const size_t block = static_cast<size_t>(model.NumShCoeffs()) * 3;
      trained += std::min(1.0, TrainedShare(model.sh_degree, model.sh.data() + block * one.index,
                                            (one.mean - eye).normalized()));
    }
    mean += trained * from;
    total += trained;
  }
  return total > 0 ? Eigen::Vector3d(mean / total) : mean;
}

Eigen::Vector3d Up(const GaussianModel& model, const std::vector<Sample>& samples,
                   const SceneShape& shape) {
  Eigen::Matrix3d flat = Eigen::Matrix3d::Zero();
  std::vector<std::pair<Eigen::Vector3d, double>> normals;
  for (const Sample& one : samples) {
    if ((one.mean - shape.center).norm() > 2 * shape.outer_radius) continue;
    auto [normal, weight] = Normal(model, one.index);
    weight *= one.opacity;
    flat += weight * normal * normal.transpose();
    normals.emplace_back(normal, weight);
  }
  if (flat.trace() > 0) flat /= flat.trace();
  const Eigen::Vector3d seen_from = SeenFrom(model, samples, shape);
  // Another axis than COLMAP's takes a large surface across it that was seen from its side.
  constexpr double kSurface = 0.42, kMore = 0.1, kSide = 0.04;
  const auto is_up = [&](int axis) {
    return flat(axis, axis) > kSurface && seen_from[axis] > kSide;
  };
  Eigen::Vector3d up = -Eigen::Vector3d::UnitY();
  if (is_up(2) && flat(2, 2) > flat(1, 1) + kMore) {
    up = Eigen::Vector3d::UnitZ();
  } else if (is_up(1)) {
    up = Eigen::Vector3d::UnitY();
  }
  // Lean to the surface that is nearly level: the mean of the normals within 25 degrees, three
  // times narrowed.
  for (const double degrees : {25.0, 18.0, 12.0}) {
    const double cosine = std::cos(degrees * std::numbers::pi / 180);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double inside = 0, total = 0;
    for (const auto& [normal, weight] : normals) {
      const double along = normal.dot(up);
      total += weight;
      if (std::abs(along) < cosine) continue;
      sum += (along < 0 ? -weight : weight) * normal;
      inside += weight;
    }
    // By chance it would be 1 - cos of them.
    if (inside > 2 * (1 - cosine) * total && sum.norm() > 0) up = sum.normalized();
  }
  return up;
}

}  // namespace

double TrainedShare(int sh_degree, const float* sh, const Eigen::Vector3d& d) {
  constexpr int kMaxDegree = 3;
  const int degree = std::min(sh_degree, kMaxDegree), count = (degree + 1) * (degree + 1);
  if (degree < 1) return 1;
  double basis[(kMaxDegree + 1) * (kMaxDegree + 1)];
  ShBasis(degree, d.x(), d.y(), d.z(), basis);
  double here = 0, everywhere = 0;
  for (int c = 0; c < 3; ++c) {
    double value = 0;
    for (int k = 1; k < count; ++k) {
      const double coefficient = sh[3 * k + c];
      value += basis[k] * coefficient;
      everywhere += coefficient * coefficient;
    }
    here += value * value;
  }
  // An orthonormal basis: the mean square on the sphere is the squared norm over 4 pi.
  everywhere /= 4 * std::numbers::pi;
  return everywhere > 1e-9 ? here / everywhere : 1;
}

SceneShape MeasureShape(const GaussianModel& model) {
  const std::vector<Sample> samples = TakeSamples(model);
  SceneShape shape;
  shape.center = Center(samples);
  // One Gaussian has its own size.
  double size = 0;
  for (int k = 0; k < 3; ++k) {
    size =
        std::max(size, std::exp(double(model.log_scales[3 * samples.front().index + size_t(k)])));
  }
  const double least = std::clamp(size, 1e-6, 1e6);
  shape.inner_radius = std::max(Radius(samples, shape.center, 0.5), least);
  shape.outer_radius = std::max(Radius(samples, shape.center, 0.85), shape.inner_radius);
  shape.up = Up(model, samples, shape);
  return shape;
}

}  // namespace retint
