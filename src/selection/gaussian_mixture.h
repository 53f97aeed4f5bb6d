// SPDX-License-Identifier: BSD-3-Clause
// Densities of colors and other small vectors as mixtures of Gaussians.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <random>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>

#include "base/parallel.h"

namespace retint {

// A mixture of D-dimensional Gaussians with full covariances, learned by expectation maximization
// (Dempster et al. 1977) from a k-means++ start (Arthur and Vassilvitskii 2007), in single
// precision. The same samples and seed give the same mixture.
template <int D>
class GaussianMixture {
 public:
  using Points = Eigen::Array<float, Eigen::Dynamic, D>;  // one a row
  using Values = Eigen::ArrayXf;

  GaussianMixture() = default;  // no components
  // `spread`: standard deviation that is added to each component's own, as a lower limit. Fewer
  // samples than `components` give fewer components; no samples give none.
  GaussianMixture(const Points& samples, int components, double spread, uint64_t seed = 0) {
    if (samples.rows() == 0) return;
    std::mt19937_64 random(seed);
    const Points chosen = Choose(samples, random);
    const std::vector<Vector> means = Cluster(chosen, components, random);
    Eigen::ArrayXXf belongs = Eigen::ArrayXXf::Zero(chosen.rows(), Eigen::Index(means.size()));
    for (Eigen::Index i = 0; i < chosen.rows(); ++i) {
      belongs(i, Eigen::Index(Nearest(means, At(chosen, i)))) = 1;
    }
    for (int round = 0; round < kRounds; ++round) {
      Maximize(chosen, belongs, float(spread));
      if (round + 1 < kRounds) belongs = Expect(chosen);
    }
  }

  // Of each point, without the constant -D/2 log(2 pi). Never below -690, even without components.
  // The bits of a value do not depend on the other points.
  Values LogLikelihoods(const Points& at) const {
    // Eigen computes the rest of an array after its last whole vector by other functions.
    constexpr Eigen::Index kVector = 16;
    Points padded = Points::Zero((at.rows() + kVector - 1) / kVector * kVector, D);
    padded.topRows(at.rows()) = at;
    const Eigen::ArrayXXf logs = LogDensities(padded);
    Values largest = Values::Constant(padded.rows(), kLeastLog);
    for (const auto& column : logs.colwise()) largest = largest.max(column);
    Values sum = Exp(kLeastLog - largest);
    for (const auto& column : logs.colwise()) sum += Exp(column - largest);
    largest += sum.log();
    return largest.head(at.rows());
  }

  size_t NumComponents() const { return components_.size(); }

 private:
  using Vector = Eigen::Matrix<float, D, 1>;

  static constexpr size_t kMaxSamples = 2000;
  static constexpr int kRounds = 20, kClusterRounds = 8;
  static constexpr float kLeastLog = -690;

  struct Component {
    Vector mean;
    Eigen::Matrix<float, D, D> whiten;  // inverse of the covariance's Cholesky factor
    float log_scale = 0;                // of the weight and the determinant
  };

  // exp(log) for logs up to 0. Never so small that floats become denormal, which some processors
  // compute a hundred times slower.
  static Values Exp(const Values& log) {
    constexpr float kSmallest = -60;
    return log.max(kSmallest).exp();
  }

  static Vector At(const Points& points, Eigen::Index i) { return points.row(i).transpose(); }

  // At most kMaxSamples of them, by Fisher and Yates. The shuffles of standard libraries
  // differ.
  static Points Choose(const Points& samples, std::mt19937_64& random) {
    std::vector<Eigen::Index> order(size_t(samples.rows()));
    std::iota(order.begin(), order.end(), Eigen::Index(0));
    for (size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[size_t(random() % i)]);
    order.resize(std::min(order.size(), kMaxSamples));
    return samples(order, Eigen::all);
  }

  static size_t Nearest(const std::vector<Vector>& means, const Vector& at) {
    size_t best = 0;
    float least = std::numeric_limits<float>::infinity();
    for (size_t k = 0; k < means.size(); ++k) {
      const float squared = (means[k] - at).squaredNorm();
      if (squared < least) least = squared, best = k;
    }
    return best;
  }

  static std::vector<Vector> Cluster(const Points& samples, int components,
                                     std::mt19937_64& random) {
    const auto count = size_t(samples.rows());
    std::vector<Vector> means = {At(samples, Eigen::Index(random() % count))};
    std::vector<double> least(count, std::numeric_limits<double>::infinity()), sums(count);
    while (means.size() < size_t(components)) {
      double sum = 0;
      for (size_t i = 0; i < count; ++i) {
        const Vector away = means.back() - At(samples, Eigen::Index(i));
        least[i] = std::min(least[i], double(away.squaredNorm()));
        sums[i] = sum += least[i];
      }
      if (!(sum > 0)) break;  // no more different samples
      const double chosen = double(random() >> 11) * 0x1p-53 * sum;
      const auto at = std::upper_bound(sums.begin(), sums.end(), chosen) - sums.begin();
      means.push_back(At(samples, Eigen::Index(std::min(size_t(at), count - 1))));
    }
    for (int round = 0; round < kClusterRounds; ++round) {
      std::vector<Vector> totals(means.size(), Vector::Zero());
      std::vector<int> counts(means.size(), 0);
      for (Eigen::Index i = 0; i < samples.rows(); ++i) {
        const Vector sample = At(samples, i);
        const size_t k = Nearest(means, sample);
        totals[k] += sample;
        ++counts[k];
      }
      for (size_t k = 0; k < means.size(); ++k) {
        if (counts[k] > 0) means[k] = totals[k] / float(counts[k]);
      }
    }
    return means;
  }

  void Maximize(const Points& samples, const Eigen::ArrayXXf& belongs, float spread) {
    std::vector<std::optional<Component>> found(size_t(belongs.cols()));
    ParallelTasks(belongs.cols(), [&](int64_t k) {
      found[size_t(k)] = ComponentOf(samples, belongs.col(k), spread);
    });
    components_.clear();
    for (const auto& component : found) {
      if (component) components_.push_back(*component);
    }
  }

  // nullopt if `part` selects too little of the samples.
  static std::optional<Component> ComponentOf(const Points& samples, const Values& part,
                                              float spread) {
    const float weight = part.sum();
    if (!(weight > 1e-6f)) return std::nullopt;
    Component component;
    Points away = samples;
    for (int i = 0; i < D; ++i) {
      component.mean[i] = (part * samples.col(i)).sum() / weight;
      away.col(i) -= component.mean[i];
    }
    Eigen::Matrix<float, D, D> covariance;
    for (int i = 0; i < D; ++i) {
      for (int j = 0; j <= i; ++j) {
        covariance(i, j) = covariance(j, i) = (part * away.col(i) * away.col(j)).sum() / weight;
      }
    }
    covariance.diagonal().array() += spread * spread;
    const Eigen::LLT<Eigen::Matrix<float, D, D>> factor(covariance);
    if (factor.info() != Eigen::Success) return std::nullopt;
    const Eigen::Matrix<float, D, D> lower = factor.matrixL();
    component.whiten = lower.inverse();
    component.log_scale =
        std::log(weight / float(samples.rows())) - lower.diagonal().array().log().sum();
    return component;
  }

  // [points, components]
  Eigen::ArrayXXf LogDensities(const Points& at) const {
    Eigen::ArrayXXf logs(at.rows(), Eigen::Index(components_.size()));
    ParallelTasks(logs.cols(), [&](int64_t k) {
      const Component& component = components_[size_t(k)];
      auto log = logs.col(k);
      log = component.log_scale;
      for (int row = 0; row < D; ++row) {
        Values whitened = component.whiten(row, 0) * (at.col(0) - component.mean[0]);
        for (int i = 1; i <= row; ++i) {
          whitened += component.whiten(row, i) * (at.col(i) - component.mean[i]);
        }
        log -= 0.5f * whitened.square();
      }
    });
    return logs;
  }

  // The part of each component in each sample: [samples, components].
  Eigen::ArrayXXf Expect(const Points& samples) const {
    Eigen::ArrayXXf belongs = LogDensities(samples);
    const Values largest = belongs.rowwise().maxCoeff();
    Values sum = Values::Zero(samples.rows());
    ParallelTasks(belongs.cols(), [&](int64_t k) {
      auto column = belongs.col(k);
      column = Exp(column - largest);
    });
    for (const auto& column : belongs.colwise()) sum += column;
    for (auto column : belongs.colwise()) column /= sum;
    return belongs;
  }

  std::vector<Component> components_;
};

}  // namespace retint
