// SPDX-License-Identifier: BSD-3-Clause
// Densities of colors and other small vectors as mixtures of Gaussians.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <random>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "base/parallel.h"

namespace retint {

// A mixture of D-dimensional Gaussians with full covariances, learned by expectation maximization
// (Dempster et al. 1977) from a k-means++ start (Arthur and Vassilvitskii 2007). The same samples
// and seed give the same mixture.
template <int D>
class GaussianMixture {
 public:
  using Vector = Eigen::Matrix<double, D, 1>;

  GaussianMixture() = default;  // no components
  // `spread`: a standard deviation that is added to every component's own, so that none becomes
  // narrower. Fewer samples than `components` make fewer components; no samples make none.
  GaussianMixture(std::vector<Vector> samples, int components, double spread, uint64_t seed = 0) {
    if (samples.empty()) return;
    std::mt19937_64 random(seed);
    Shuffle(&samples, random);
    if (samples.size() > kMaxSamples) samples.resize(kMaxSamples);
    const std::vector<Vector> means = Cluster(samples, components, random);
    std::vector<std::vector<double>> belongs(means.size(), std::vector<double>(samples.size(), 0));
    for (size_t i = 0; i < samples.size(); ++i) belongs[Nearest(means, samples[i])][i] = 1;
    for (int round = 0; round < kRounds; ++round) {
      Maximize(samples, belongs, spread);
      if (round + 1 < kRounds) Expect(samples, &belongs);
    }
  }

  // But for the constant -D/2 log(2 pi). Never below about -690, also where there are no
  // components.
  double LogLikelihood(const Vector& at) const {
    double sum = 1e-300;
    for (const Component& component : components_) sum += std::exp(component.LogDensity(at));
    return std::log(sum);
  }

  size_t NumComponents() const { return components_.size(); }

 private:
  static constexpr size_t kMaxSamples = 2000;
  static constexpr int kRounds = 20, kClusterRounds = 8;
  static constexpr int64_t kGrain = 256;  // samples

  struct Component {
    Vector mean;
    Eigen::Matrix<double, D, D> whiten;  // inverse of the covariance's Cholesky factor
    double log_scale = 0;                // of the weight and the determinant

    double LogDensity(const Vector& at) const {
      return log_scale -
             0.5 * (whiten.template triangularView<Eigen::Lower>() * (at - mean)).squaredNorm();
    }
  };

  // Fisher and Yates; the standard library's differs between implementations.
  static void Shuffle(std::vector<Vector>* samples, std::mt19937_64& random) {
    for (size_t i = samples->size(); i > 1; --i) {
      std::swap((*samples)[i - 1], (*samples)[size_t(random() % i)]);
    }
  }

  static size_t Nearest(const std::vector<Vector>& means, const Vector& at) {
    size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (size_t k = 0; k < means.size(); ++k) {
      const double squared = (means[k] - at).squaredNorm();
      if (squared < least) least = squared, best = k;
    }
    return best;
  }

  static std::vector<Vector> Cluster(const std::vector<Vector>& samples, int components,
                                     std::mt19937_64& random) {
    std::vector<Vector> means = {samples[size_t(random() % samples.size())]};
    std::vector<double> least(samples.size(), std::numeric_limits<double>::infinity());
    std::vector<double> sums(samples.size());
    while (means.size() < size_t(components)) {
      double sum = 0;
      for (size_t i = 0; i < samples.size(); ++i) {
        least[i] = std::min(least[i], (means.back() - samples[i]).squaredNorm());
        sums[i] = sum += least[i];
      }
      if (!(sum > 0)) break;  // no more different samples
      const double chosen = double(random() >> 11) * 0x1p-53 * sum;
      const auto at = std::upper_bound(sums.begin(), sums.end(), chosen) - sums.begin();
      means.push_back(samples[std::min(size_t(at), samples.size() - 1)]);
    }
    for (int round = 0; round < kClusterRounds; ++round) {
      std::vector<Vector> totals(means.size(), Vector::Zero());
      std::vector<int> counts(means.size(), 0);
      for (const Vector& sample : samples) {
        const size_t k = Nearest(means, sample);
        totals[k] += sample;
        ++counts[k];
      }
      for (size_t k = 0; k < means.size(); ++k) {
        if (counts[k] > 0) means[k] = totals[k] / counts[k];
      }
    }
    return means;
  }

  void Maximize(const std::vector<Vector>& samples, const std::vector<std::vector<double>>& belongs,
                double spread) {
    std::vector<std::optional<Component>> components(belongs.size());
    ParallelTasks(int64_t(belongs.size()),
                  [&](size_t k) { components[k] = ComponentOf(samples, belongs[k], spread); });
    components_.clear();
    for (const auto& component : components) {
      if (component) components_.push_back(*component);
    }
  }

  // None where `part` of the samples holds too little of them.
  static std::optional<Component> ComponentOf(const std::vector<Vector>& samples,
                                              const std::vector<double>& part, double spread) {
    double weight = 0;
    Vector mean = Vector::Zero();
    for (size_t i = 0; i < samples.size(); ++i) weight += part[i], mean += part[i] * samples[i];
    if (!(weight > 1e-6)) return std::nullopt;
    mean /= weight;
    Eigen::Matrix<double, D, D> covariance = Eigen::Matrix<double, D, D>::Zero();
    for (size_t i = 0; i < samples.size(); ++i) {
      const Vector away = samples[i] - mean;
      covariance += part[i] * away * away.transpose();
    }
    covariance /= weight;
    covariance.diagonal().array() += spread * spread;
    const Eigen::LLT<Eigen::Matrix<double, D, D>> factor(covariance);
    if (factor.info() != Eigen::Success) return std::nullopt;
    const Eigen::Matrix<double, D, D> lower = factor.matrixL();
    Component component;
    component.mean = mean;
    component.whiten = lower.inverse();
    component.log_scale =
        std::log(weight / double(samples.size())) - lower.diagonal().array().log().sum();
    return component;
  }

  void Expect(const std::vector<Vector>& samples, std::vector<std::vector<double>>* belongs) const {
    belongs->assign(components_.size(), std::vector<double>(samples.size(), 0));
    ParallelRanges(int64_t(samples.size()), kGrain, [&](int64_t first, int64_t last) {
      std::vector<double> logs(components_.size());
      for (auto i = size_t(first); i < size_t(last); ++i) {
        double largest = -std::numeric_limits<double>::infinity(), sum = 0;
        for (size_t k = 0; k < logs.size(); ++k) {
          logs[k] = components_[k].LogDensity(samples[i]);
          largest = std::max(largest, logs[k]);
        }
        for (double& value : logs) sum += value = std::exp(value - largest);
        for (size_t k = 0; k < logs.size(); ++k) (*belongs)[k][i] = logs[k] / sum;
      }
    });
  }

  std::vector<Component> components_;
};

}  // namespace retint
