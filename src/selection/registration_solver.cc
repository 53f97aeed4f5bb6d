// SPDX-License-Identifier: BSD-3-Clause
#include "selection/registration_solver.h"

#include <algorithm>
#include <cmath>
#include <deque>

#include <ceres/ceres.h>

#include "base/median.h"

namespace retint {
namespace {

constexpr double kDepthPrior = 0.1;        // of a, and of b times the depth
constexpr double kLogScalePrior = 0.1;     // of the similarity's scale
constexpr double kAnglePrior = 0.05;       // radians
constexpr double kTranslationPrior = 0.1;  // of the depth
constexpr double kSlideFactor = 3;         // sigma along the plane over sigma along the normal

// The matrix [v] with [v] x = v x x.
Eigen::Matrix3d Cross(const Eigen::Vector3d& v) {
  Eigen::Matrix3d cross;
  cross << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return cross;
}

double MedianDepth(const std::vector<RegistrationPair>& pairs) {
  std::vector<double> depths;
  for (const auto& pair : pairs) depths.push_back(pair.sparse.z());
  return Median(std::move(depths));
}

// The residual is linear in a and b.
class DepthCost : public ceres::SizedCostFunction<1, 2> {
 public:
  DepthCost(const RegistrationPair& pair, double noise)
      : by_a_(pair.sparse.z() / (pair.cloud.z() * noise)),
        by_b_(pair.sparse.z() / noise),
        wanted_(1 / noise) {}

  bool Evaluate(const double* const* ab, double* residual, double** jacobians) const override {
    residual[0] = by_a_ * ab[0][0] + by_b_ * ab[0][1] - wanted_;
    if (jacobians && jacobians[0]) {
      jacobians[0][0] = by_a_;
      jacobians[0][1] = by_b_;
    }
    return true;
  }

 private:
  double by_a_, by_b_, wanted_;
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

// The unknowns in Ceres's layout, and the transform that follows from them at each evaluation.
class Unknowns : public ceres::EvaluationCallback {
 public:
  explicit Unknowns(const RegistrationTransform& start) : transform_(start), map_(start) {
    ab[0] = start.a;
    ab[1] = start.b;
    similarity[0] = start.log_scale;
    for (int i = 0; i < 3; ++i) {
      similarity[1 + i] = start.angle_axis[i];
      similarity[4 + i] = start.translation[i];
    }
  }

  void PrepareForEvaluation(bool, bool) override { map_ = RegistrationMap(Transform()); }

  RegistrationTransform Transform() const {
    RegistrationTransform transform = transform_;
    transform.a = ab[0];
    transform.b = ab[1];
    transform.log_scale = similarity[0];
    transform.angle_axis = Eigen::Map<const Eigen::Vector3d>(similarity + 1);
    transform.translation = Eigen::Map<const Eigen::Vector3d>(similarity + 4);
    return transform;
  }
  const RegistrationMap& map() const { return map_; }

  double ab[2], similarity[7];  // log scale, angle-axis (3), translation (3)

 private:
  RegistrationTransform transform_;  // its center does not change
  RegistrationMap map_;
};

class PairCost : public ceres::SizedCostFunction<3, 2, 7> {
 public:
  // Rows of `weight`: directions over their sigma.
  PairCost(const RegistrationPair& pair, const Eigen::Matrix3d& weight, const Unknowns& unknowns)
      : pair_(pair), weight_(weight), unknowns_(unknowns) {}

  bool Evaluate(const double* const*, double* residual, double** jacobians) const override {
    const RegistrationMap& map = unknowns_.map();
    Eigen::Map<Eigen::Vector3d>{residual} = weight_ * (map * pair_.cloud - pair_.sparse);
    if (!jacobians) return true;
    const RegistrationMap::Derivatives by = weight_ * map.DerivativesAt(pair_.cloud);
    if (jacobians[0]) Rows<2>{jacobians[0]} = by.leftCols<2>();
    if (jacobians[1]) Rows<7>{jacobians[1]} = by.rightCols<7>();
    return true;
  }

 private:
  template <int columns>
  using Rows = Eigen::Map<Eigen::Matrix<double, 3, columns, Eigen::RowMajor>>;  // in Ceres's order

  const RegistrationPair& pair_;
  Eigen::Matrix3d weight_;
  const Unknowns& unknowns_;
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

// The caller owns costs and losses, and can allocate thousands of costs at once.
ceres::Problem::Options BorrowingOptions() {
  ceres::Problem::Options options;
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  return options;
}

std::string Solve(ceres::Problem& problem) {
  ceres::Solver::Options options;
  // Nine unknowns and thousands of rows. Priors keep the normal equations well conditioned.
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.max_num_iterations = 100;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;  // fixes the order of sums, so that results do not depend on the machine
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return std::string(ceres::TerminationTypeToString(summary.termination_type)) + " after " +
         std::to_string(summary.iterations.size()) + " iterations";
}

}  // namespace

Sim3d RegistrationTransform::Similarity() const {
  Sim3d sim;
  sim.scale = std::exp(log_scale);
  const double angle = angle_axis.norm();
  if (angle > 0) sim.rotation = Eigen::AngleAxisd(angle, angle_axis / angle);
  sim.translation = center + translation - sim.scale * (sim.rotation * center);
  return sim;
}

// The rotation R by w changes as dR x = -[R x] J dw. The left Jacobian of SO(3) is
//   J = I + (1 - cos |w|) / |w|^2 [w] + (|w| - sin |w|) / |w|^3 [w]^2 with [w] y = w x y.
// Source: Sola et al. 2018, "A micro Lie theory", eq. 145.
RegistrationMap::RegistrationMap(const RegistrationTransform& transform)
    : a_(transform.a),
      b_(transform.b),
      similarity_(transform.Similarity()),
      center_(transform.center),
      scaled_rotation_(similarity_.scale * similarity_.rotation.toRotationMatrix()) {
  const Eigen::Matrix3d w = Cross(transform.angle_axis);
  const double angle = transform.angle_axis.norm();
  constexpr double kTiny = 1e-8;  // its square is below the rounding of 1 in double precision
  turn_by_angle_axis_ = Eigen::Matrix3d::Identity() + 0.5 * w;
  if (angle < kTiny) return;
  const double half = std::sin(0.5 * angle) / angle;
  turn_by_angle_axis_ = Eigen::Matrix3d::Identity() + 2 * half * half * w +
                        (angle - std::sin(angle)) / (angle * angle * angle) * w * w;
}

RegistrationMap::Derivatives RegistrationMap::DerivativesAt(
    const Eigen::Vector3d& point_in_cam) const {
  const double along = 1 / (a_ + b_ * point_in_cam.z());  // z'/z of the depth correction
  const Eigen::Vector3d turned = scaled_rotation_ * (point_in_cam * along - center_);
  Derivatives by;
  by.col(0) = scaled_rotation_ * point_in_cam * (-along * along);
  by.col(1) = by.col(0) * point_in_cam.z();
  by.col(2) = turned;
  by.middleCols<3>(3) = -Cross(turned) * turn_by_angle_axis_;
  by.rightCols<3>().setIdentity();
  return by;
}

double DepthNoise(const std::vector<RegistrationPair>& pairs, const RegistrationTransform& at) {
  constexpr double kLeast = 1e-3;
  const RegistrationMap map(at);
  std::vector<double> ratios;
  for (const auto& pair : pairs) {
    const double z = (map * pair.cloud).z();
    if (z > 0) ratios.push_back(std::log(pair.sparse.z() / z));
  }
  const double middle = Median(ratios);
  for (auto& ratio : ratios) ratio = std::abs(ratio - middle);
  return std::max(kLeast, 1.4826 * Median(std::move(ratios)));
}

std::string FitDepth(const std::vector<RegistrationPair>& pairs, double noise,
                     RegistrationTransform* transform) {
  double ab[2] = {transform->a, transform->b};
  ceres::CauchyLoss loss(1.0);
  std::deque<DepthCost> costs;
  ceres::AutoDiffCostFunction<DepthPrior, 2, 2> prior(new DepthPrior{MedianDepth(pairs)});
  ceres::Problem problem(BorrowingOptions());
  for (const auto& pair : pairs) {
    if (!pair.heldout) problem.AddResidualBlock(&costs.emplace_back(pair, noise), &loss, ab);
  }
  problem.AddResidualBlock(&prior, nullptr, ab);
  const std::string why = Solve(problem);
  transform->a = ab[0];
  transform->b = ab[1];
  return why;
}

std::string FitAll(const std::vector<RegistrationPair>& pairs, double noise,
                   RegistrationTransform* transform) {
  Unknowns unknowns(*transform);
  double *const ab = unknowns.ab, *const similarity = unknowns.similarity;
  ceres::CauchyLoss loss(1.0);
  std::deque<PairCost> costs;
  const double depth = MedianDepth(pairs);
  ceres::AutoDiffCostFunction<DepthPrior, 2, 2> depth_prior(new DepthPrior{depth});
  ceres::AutoDiffCostFunction<SimilarityPrior, 7, 7> prior(new SimilarityPrior{depth});
  ceres::Problem::Options options = BorrowingOptions();
  options.evaluation_callback = &unknowns;
  ceres::Problem problem(options);
  for (const auto& pair : pairs) {
    if (pair.heldout) continue;
    problem.AddResidualBlock(&costs.emplace_back(pair, Weight(pair, noise), unknowns), &loss, ab,
                             similarity);
  }
  problem.AddResidualBlock(&depth_prior, nullptr, ab);
  problem.AddResidualBlock(&prior, nullptr, similarity);
  const std::string why = Solve(problem);
  *transform = unknowns.Transform();
  return why;
}

}  // namespace retint
