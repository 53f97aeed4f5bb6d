// SPDX-License-Identifier: BSD-3-Clause
#include "selection/registration_solver.h"

#include <algorithm>
#include <cmath>

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include "base/median.h"

namespace retint {
namespace {

constexpr double kDepthPrior = 0.1;        // of a, and of b times the depth
constexpr double kLogScalePrior = 0.1;     // of the similarity's scale
constexpr double kAnglePrior = 0.05;       // radians
constexpr double kTranslationPrior = 0.1;  // of the depth
constexpr double kSlideFactor = 3;         // sigma within the plane over sigma along the normal

double MedianDepth(const std::vector<RegistrationPair>& pairs) {
  std::vector<double> depths;
  for (const auto& pair : pairs) depths.push_back(pair.sparse.z());
  return Median(std::move(depths));
}

struct DepthResidual {
  double inverse_cloud, sparse, noise;
  template <typename T>
  bool operator()(const T* ab, T* residual) const {
    residual[0] = ((ab[0] * inverse_cloud + ab[1]) * sparse - 1.0) / noise;
    return true;
  }
};

struct DepthPrior {
  double depth;
  template <typename T>
  bool operator()(const T* ab, T* residual) const {
    residual[0] = (ab[0] - 1.0) / kDepthPrior;
    residual[1] = ab[1] * depth / kDepthPrior;
    return true;
  }
};

// sim: log scale, angle-axis (3), translation (3).
struct PairResidual {
  Eigen::Vector3d cloud, center, sparse;
  Eigen::Matrix3d weight;  // rows: directions over their sigma

  template <typename T>
  bool operator()(const T* ab, const T* sim, T* residual) const {
    using std::exp;
    const T along = 1.0 / (ab[0] + ab[1] * cloud.z());  // z'/z of the depth correction
    const T moved[3] = {cloud.x() * along - center.x(), cloud.y() * along - center.y(),
                        cloud.z() * along - center.z()};
    T rotated[3];
    ceres::AngleAxisRotatePoint(sim + 1, moved, rotated);
    const T scale = exp(sim[0]);
    T error[3];
    for (int i = 0; i < 3; ++i) error[i] = center[i] + scale * rotated[i] + sim[4 + i] - sparse[i];
    for (int i = 0; i < 3; ++i) {
      residual[i] = weight(i, 0) * error[0] + weight(i, 1) * error[1] + weight(i, 2) * error[2];
    }
    return true;
  }
};

struct SimilarityPrior {
  double depth;
  template <typename T>
  bool operator()(const T* sim, T* residual) const {
    residual[0] = sim[0] / kLogScalePrior;
    for (int i = 0; i < 3; ++i) {
      residual[1 + i] = sim[1 + i] / kAnglePrior;
      residual[4 + i] = sim[4 + i] / (kTranslationPrior * depth);
    }
    return true;
  }
};

Eigen::Matrix3d Weight(const RegistrationPair& pair, double noise) {
  const double sigma = noise * pair.sparse.z();
  if (pair.normal.isZero()) return Eigen::Matrix3d::Identity() / sigma;
  const Eigen::Vector3d tangent = pair.normal.unitOrthogonal();
  Eigen::Matrix3d weight;
  weight.row(0) = pair.normal.transpose() / sigma;
  weight.row(1) = tangent.transpose() / (kSlideFactor * sigma);
  weight.row(2) = pair.normal.cross(tangent).transpose() / (kSlideFactor * sigma);
  return weight;
}

std::string Solve(ceres::Problem& problem) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 100;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;  // the sum's order, and so the result, does not depend on the machine
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return std::string(ceres::TerminationTypeToString(summary.termination_type)) + " after " +
         std::to_string(summary.iterations.size()) + " iterations";
}

}  // namespace

Eigen::Vector3d RegistrationTransform::Corrected(const Eigen::Vector3d& point_in_cam) const {
  return point_in_cam / (a + b * point_in_cam.z());
}

Eigen::Vector3d RegistrationTransform::operator*(const Eigen::Vector3d& point_in_cam) const {
  return Similarity() * Corrected(point_in_cam);
}

Sim3d RegistrationTransform::Similarity() const {
  Sim3d sim;
  sim.scale = std::exp(log_scale);
  const double angle = angle_axis.norm();
  if (angle > 0) sim.rotation = Eigen::AngleAxisd(angle, angle_axis / angle);
  sim.translation = center + translation - sim.scale * (sim.rotation * center);
  return sim;
}

double DepthNoise(const std::vector<RegistrationPair>& pairs, const RegistrationTransform& at) {
  constexpr double kLeast = 1e-3;
  std::vector<double> ratios;
  for (const auto& pair : pairs) {
    const double z = (at * pair.cloud).z();
    if (z > 0) ratios.push_back(std::log(pair.sparse.z() / z));
  }
  const double middle = Median(ratios);
  for (auto& ratio : ratios) ratio = std::abs(ratio - middle);
  return std::max(kLeast, 1.4826 * Median(std::move(ratios)));
}

std::string FitDepth(const std::vector<RegistrationPair>& pairs, double noise,
                     RegistrationTransform* transform) {
  double ab[2] = {transform->a, transform->b};
  ceres::Problem problem;
  for (const auto& pair : pairs) {
    if (pair.heldout) continue;
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<DepthResidual, 1, 2>(
                                 new DepthResidual{1 / pair.cloud.z(), pair.sparse.z(), noise}),
                             new ceres::CauchyLoss(1.0), ab);
  }
  problem.AddResidualBlock(
      new ceres::AutoDiffCostFunction<DepthPrior, 2, 2>(new DepthPrior{MedianDepth(pairs)}),
      nullptr, ab);
  const std::string why = Solve(problem);
  transform->a = ab[0];
  transform->b = ab[1];
  return why;
}

std::string FitAll(const std::vector<RegistrationPair>& pairs, double noise,
                   RegistrationTransform* transform) {
  double ab[2] = {transform->a, transform->b};
  double sim[7] = {transform->log_scale};
  for (int i = 0; i < 3; ++i) {
    sim[1 + i] = transform->angle_axis[i];
    sim[4 + i] = transform->translation[i];
  }
  ceres::Problem problem;
  for (const auto& pair : pairs) {
    if (pair.heldout) continue;
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<PairResidual, 3, 2, 7>(
            new PairResidual{pair.cloud, transform->center, pair.sparse, Weight(pair, noise)}),
        new ceres::CauchyLoss(1.0), ab, sim);
  }
  const double depth = MedianDepth(pairs);
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<DepthPrior, 2, 2>(new DepthPrior{depth}),
                           nullptr, ab);
  problem.AddResidualBlock(
      new ceres::AutoDiffCostFunction<SimilarityPrior, 7, 7>(new SimilarityPrior{depth}), nullptr,
      sim);
  const std::string why = Solve(problem);
  transform->a = ab[0];
  transform->b = ab[1];
  transform->log_scale = sim[0];
  for (int i = 0; i < 3; ++i) {
    transform->angle_axis[i] = sim[1 + i];
    transform->translation[i] = sim[4 + i];
  }
  return why;
}

}  // namespace retint
