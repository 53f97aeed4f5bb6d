// SPDX-License-Identifier: BSD-3-Clause
#include "selection/completion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <string_view>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <opencv2/ml.hpp>

#include "base/error.h"
#include "base/parallel.h"
#include "kernels/common/color_spaces.h"
#include "selection/neighbors.h"

namespace retint {
namespace {

constexpr std::string_view kStage = "completion";

// Chosen on two captures, cape and flower; docs/notebook.md says what else was tried.
constexpr int kNeighbors = 16;
constexpr double kColorSigma = 0.05;    // OKLab, lightness at half weight
constexpr double kDistanceScale = 2;    // of the two extents
constexpr double kBend = 0.8;           // what a right angle between flat Gaussians takes away
constexpr double kLeastWeight = 1e-6;   // so that the graph never falls apart
constexpr double kSmoothness = 1000;    // of the edges against one unit of color evidence
constexpr double kTrust = 10;           // of full evidence
constexpr double kKnownFraction = 0.5;  // of the visibility from which on evidence is full
constexpr double kKnownPixels = 16;     // pixels from which on it is
constexpr double kLogPrior = -1;        // log odds of "inside" before the color is seen
constexpr double kLogLimit = 6;         // of the log odds by color
constexpr double kInside = 0.8, kOutside = 0.2;  // shares that colors are learned from
constexpr int kInsideColors = 5, kOutsideColors = 8;
constexpr int kMaxSamples = 2000;
constexpr int kMixtureRounds = 20;
constexpr int kLeastSamples = 50;
// Standard deviation, OKLab, added to the samples: no component gets narrower.
constexpr double kSampleNoise = 0.014;
constexpr double kConnected = 1e-3;  // weight of an edge that connects
// Solved shares below are outside, and above inside: what is merely likely must not be half edited.
constexpr double kSurelyOutside = 0.25, kSurelyInside = 0.75;
constexpr double kLeastVisible = 1e-6;  // pixels
constexpr double kTolerance = 1e-3;     // of the residual, relative to the right-hand side
constexpr int kMaxIterations = 300;
constexpr int64_t kGrain = 4096;

struct Surface {
  Eigen::Vector3f lab;     // OKLab of the color without view dependence
  Eigen::Vector3f normal;  // the shortest axis, world
  float extent = 0;        // mean of the two longer standard deviations, world
  float flatness = 0;      // 0 round, 1 flat
};

Surface SurfaceOf(const GaussianModel& model, size_t g) {
  constexpr float kY00 = 0.28209479177387814f;
  Surface surface;
  float rgb[3];
  const float* const dc = &model.sh[g * size_t(model.NumShCoeffs()) * 3];
  for (int c = 0; c < 3; ++c) rgb[c] = std::clamp(0.5f + kY00 * dc[c], 0.0f, 1.0f);
  const OkLab lab = OkLabFromSrgb(rgb);
  surface.lab = {lab.lightness, lab.a, lab.b};

  std::array<int, 3> axes = {0, 1, 2};
  const float* const scale = &model.log_scales[3 * g];
  std::sort(axes.begin(), axes.end(), [&](int a, int b) { return scale[a] < scale[b]; });
  surface.extent = std::exp(0.5f * (scale[axes[1]] + scale[axes[2]]));
  surface.flatness = 1 - std::exp(scale[axes[0]] - scale[axes[1]]);
  const float* const q = &model.quats_wxyz[4 * g];
  const Eigen::Quaternionf rotation(q[0], q[1], q[2], q[3]);
  const bool turned = rotation.squaredNorm() > 0;
  surface.normal = turned ? rotation.normalized() * Eigen::Vector3f::Unit(axes[0])
                          : Eigen::Vector3f::Unit(axes[0]).eval();
  return surface;
}

double EdgeWeight(const Surface& a, const Surface& b, double distance) {
  Eigen::Vector3d color = (a.lab - b.lab).cast<double>();
  color[0] *= 0.5;
  const double alike = std::exp(-color.squaredNorm() / (2 * kColorSigma * kColorSigma));
  const double extents = std::max(1e-30, double(a.extent) + b.extent);
  const double apart = distance / (kDistanceScale * extents);
  const double angle = 1 - std::min(1.0, double(std::abs(a.normal.dot(b.normal))));
  const double bend = 1 - kBend * a.flatness * b.flatness * angle;
  return std::max(kLeastWeight, alike * bend / (1 + apart * apart));
}

double Ratio(double part, double whole) { return whole > kLeastVisible ? part / whole : 0; }

// Log likelihood of colors under a Gaussian mixture of some of them.
class ColorModel {
 public:
  ColorModel(const std::vector<Surface>& surfaces, std::vector<int> members, int components) {
    std::mt19937_64 random(0);
    if (members.size() > size_t(kMaxSamples)) {
      std::shuffle(members.begin(), members.end(), random);
      members.resize(size_t(kMaxSamples));
    }
    std::normal_distribution<double> noise(0, kSampleNoise);
    cv::Mat samples(int(members.size()), 3, CV_64F);
    for (int i = 0; i < samples.rows; ++i) {
      const Eigen::Vector3f& lab = surfaces[size_t(members[size_t(i)])].lab;
      for (int c = 0; c < 3; ++c) samples.at<double>(i, c) = lab[c] + noise(random);
    }
    const auto model = cv::ml::EM::create();
    model->setClustersNumber(components);
    model->setCovarianceMatrixType(cv::ml::EM::COV_MAT_GENERIC);
    model->setTermCriteria({cv::TermCriteria::COUNT + cv::TermCriteria::EPS, kMixtureRounds, 1e-4});
    cv::theRNG().state = 1;  // its k-means starts from random centers
    model->trainEM(samples);

    std::vector<cv::Mat> covariances;
    model->getCovs(covariances);
    const cv::Mat means = model->getMeans(), weights = model->getWeights();
    for (int i = 0; i < components; ++i) {
      Eigen::Matrix3d covariance;
      Component component;
      for (int r = 0; r < 3; ++r) {
        component.mean[r] = means.at<double>(i, r);
        for (int c = 0; c < 3; ++c) covariance(r, c) = covariances[size_t(i)].at<double>(r, c);
      }
      const double weight = weights.at<double>(i);
      const Eigen::LLT<Eigen::Matrix3d> factor(covariance);
      if (!(weight > 0) || factor.info() != Eigen::Success) continue;  // it holds no sample
      const Eigen::Matrix3d lower = factor.matrixL();
      component.whiten = lower.inverse();
      component.log_scale = std::log(weight) - lower.diagonal().array().log().sum();
      components_.push_back(component);
    }
  }

  // But for a constant that all models share.
  double LogLikelihood(const Eigen::Vector3f& lab) const {
    double sum = 1e-300;
    for (const Component& component : components_) {
      const Eigen::Vector3d away = component.whiten * (lab.cast<double>() - component.mean);
      sum += std::exp(component.log_scale - 0.5 * away.squaredNorm());
    }
    return std::log(sum);
  }

 private:
  struct Component {
    Eigen::Vector3d mean;
    Eigen::Matrix3d whiten;  // inverse of the covariance's Cholesky factor
    double log_scale;
  };
  std::vector<Component> components_;
};

// The edges of a graph as a symmetric matrix without diagonal, row by row.
struct EdgeMatrix {
  std::vector<size_t> begin;  // [N + 1] into what follows
  std::vector<int> other;     // ascending within a row
  std::vector<float> weight;
};

// Joins every Gaussian with its nearest, and so with those whose nearest it is.
EdgeMatrix Connect(const std::vector<Neighbor>& nearest, const std::vector<Surface>& surfaces) {
  const size_t count = surfaces.size();
  struct Edge {
    int other;
    float distance;
  };
  std::vector<size_t> begin(count + 1, 0);
  for (size_t i = 0; i < nearest.size(); ++i) {
    if (nearest[i].idx < 0) continue;
    ++begin[i / kNeighbors + 1];
    ++begin[size_t(nearest[i].idx) + 1];
  }
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<Edge> edges(begin.back());
  std::vector<size_t> next(begin.begin(), begin.end() - 1);
  for (size_t i = 0; i < nearest.size(); ++i) {
    if (nearest[i].idx < 0) continue;
    const auto a = int(i / kNeighbors);
    edges[next[size_t(a)]++] = {nearest[i].idx, nearest[i].distance};
    edges[next[size_t(nearest[i].idx)]++] = {a, nearest[i].distance};
  }
  // Two that are among each other's nearest were joined twice.
  std::vector<size_t> kept(count, 0);
  ParallelRanges(int64_t(count), kGrain, [&](int64_t first, int64_t last) {
    for (auto g = size_t(first); g < size_t(last); ++g) {
      Edge* const row = edges.data() + begin[g];
      Edge* const end = edges.data() + begin[g + 1];
      std::sort(row, end, [](const Edge& a, const Edge& b) { return a.other < b.other; });
      kept[g] = size_t(
          std::unique(row, end, [](const Edge& a, const Edge& b) { return a.other == b.other; }) -
          row);
    }
  });
  EdgeMatrix matrix;
  matrix.begin.assign(count + 1, 0);
  std::partial_sum(kept.begin(), kept.end(), matrix.begin.begin() + 1);
  matrix.other.resize(matrix.begin.back());
  matrix.weight.resize(matrix.begin.back());
  ParallelRanges(int64_t(count), kGrain, [&](int64_t first, int64_t last) {
    for (auto g = size_t(first); g < size_t(last); ++g) {
      for (size_t k = 0; k < kept[g]; ++k) {
        const Edge& edge = edges[begin[g] + k];
        matrix.other[matrix.begin[g] + k] = edge.other;
        matrix.weight[matrix.begin[g] + k] =
            float(EdgeWeight(surfaces[g], surfaces[size_t(edge.other)], edge.distance));
      }
    }
  });
  return matrix;
}

// sum_i a_i b_i, the same on any number of threads.
double Dot(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> parts((a.size() + kGrain - 1) / kGrain, 0.0);
  ParallelTasks(int64_t(parts.size()), [&](size_t part) {
    const size_t end = std::min(a.size(), (part + 1) * kGrain);
    for (size_t i = part * kGrain; i < end; ++i) parts[part] += a[i] * b[i];
  });
  return std::accumulate(parts.begin(), parts.end(), 0.0);
}

// x with (diagonal - kSmoothness edges) x = right by conjugate gradients, preconditioned by the
// diagonal (Saad 2003, algorithm 9.1), from x as it is.
void SolveGraph(const EdgeMatrix& edges, const std::vector<float>& weights,
                const std::vector<double>& diagonal, const std::vector<double>& right,
                std::vector<double>* x, Monitor& monitor) {
  const auto count = int64_t(right.size());
  std::vector<double> residual(right.size()), direction(right.size()), applied(right.size()),
      scaled(right.size());
  const auto apply = [&](const std::vector<double>& in, std::vector<double>* out) {
    ParallelRanges(count, kGrain, [&](int64_t first, int64_t last) {
      for (auto g = size_t(first); g < size_t(last); ++g) {
        double sum = 0;
        for (size_t e = edges.begin[g]; e < edges.begin[g + 1]; ++e) {
          sum += double(weights[e]) * in[size_t(edges.other[e])];
        }
        (*out)[g] = diagonal[g] * in[g] - kSmoothness * sum;
      }
    });
  };
  const auto each = [&](const auto& body) {
    ParallelRanges(count, kGrain, [&](int64_t first, int64_t last) {
      for (auto g = size_t(first); g < size_t(last); ++g) body(g);
    });
  };
  apply(*x, &applied);
  each([&](size_t g) {
    residual[g] = right[g] - applied[g];
    direction[g] = scaled[g] = residual[g] / diagonal[g];
  });
  const double limit = kTolerance * kTolerance * Dot(right, right);
  double product = Dot(residual, scaled);
  for (int i = 0; i < kMaxIterations && Dot(residual, residual) > limit; ++i) {
    monitor.ThrowIfCancelled();
    apply(direction, &applied);
    const double step = product / Dot(direction, applied);
    each([&](size_t g) {
      (*x)[g] += step * direction[g];
      residual[g] -= step * applied[g];
      scaled[g] = residual[g] / diagonal[g];
    });
    const double before = std::exchange(product, Dot(residual, scaled));
    each([&](size_t g) { direction[g] = scaled[g] + product / before * direction[g]; });
  }
}

}  // namespace

struct GaussianGraph::Impl {
  std::vector<Surface> surfaces;
  EdgeMatrix edges;
};

GaussianGraph::GaussianGraph(const GaussianModel& model, Monitor& monitor) : impl_(new Impl) {
  const size_t count = model.NumGaussians();
  impl_->surfaces.resize(count);
  monitor.Step(kStage, 0, 3);
  std::vector<Eigen::Vector3f> positions(count);
  ParallelRanges(int64_t(count), 1024, [&](int64_t begin, int64_t end) {
    for (auto g = size_t(begin); g < size_t(end); ++g) {
      impl_->surfaces[g] = SurfaceOf(model, g);
      positions[g] = Eigen::Map<const Eigen::Vector3f>(&model.means[3 * g]);
    }
  });
  monitor.Step(kStage, 1, 3);
  const std::vector<Neighbor> nearest = NearestNeighbors(positions, kNeighbors);
  monitor.Step(kStage, 2, 3);
  impl_->edges = Connect(nearest, impl_->surfaces);
  monitor.Step(kStage, 3, 3);
}

GaussianGraph::~GaussianGraph() = default;

size_t GaussianGraph::NumGaussians() const { return impl_->surfaces.size(); }

// One completion over the graph.
class Completer {
 public:
  Completer(const GaussianGraph& graph, const ShareEvidence& evidence)
      : surfaces_(graph.impl_->surfaces), edges_(graph.impl_->edges), count_(surfaces_.size()) {
    share_.resize(count_);
    known_.resize(count_);
    trust_.resize(count_);
    for (size_t g = 0; g < count_; ++g) {
      const double known = evidence.known[g];
      share_[g] = std::clamp(Ratio(evidence.inside[g], known), 0.0, 1.0);
      known_[g] = std::min(1.0, Ratio(known, evidence.visible[g]) / kKnownFraction);
      trust_[g] = kTrust * known_[g] * std::min(1.0, known / kKnownPixels);
    }
  }

  std::vector<float> Run(Completion completion, Monitor& monitor) {
    std::vector<double> prior(count_);
    monitor.Step(kStage, 0, 2);
    const bool learned = Prior(&prior);
    monitor.Step(kStage, 1, 2);
    std::vector<double> solved(count_, 0.0);
    if (learned) {
      Solve(prior, &solved, monitor);
      if (completion == Completion::kNear) DropUnconnected(&solved);
    }
    std::vector<float> result(count_);
    for (size_t g = 0; g < count_; ++g) {
      const double share = known_[g] * share_[g] + (1 - known_[g]) * solved[g];
      result[g] = float(std::clamp(share, 0.0, 1.0));
    }
    monitor.Step(kStage, 2, 2);
    return result;
  }

 private:
  std::vector<int> Members(bool inside) const {
    std::vector<int> members;
    for (size_t g = 0; g < count_; ++g) {
      constexpr double kLeastTrust = 0.01 * kTrust;
      if (trust_[g] < kLeastTrust) continue;
      if (inside ? share_[g] > kInside : share_[g] < kOutside) members.push_back(int(g));
    }
    return members;
  }

  // Probability of "inside" by color; false where there is too little to learn it from.
  bool Prior(std::vector<double>* prior) const {
    std::vector<int> inside = Members(true), outside = Members(false);
    if (inside.size() < size_t(kLeastSamples) || outside.size() < size_t(kLeastSamples)) {
      return false;
    }
    const ColorModel in(surfaces_, std::move(inside), kInsideColors);
    const ColorModel out(surfaces_, std::move(outside), kOutsideColors);
    ParallelRanges(int64_t(count_), 1024, [&](int64_t begin, int64_t end) {
      for (auto g = size_t(begin); g < size_t(end); ++g) {
        const Eigen::Vector3f& lab = surfaces_[g].lab;
        const double odds = in.LogLikelihood(lab) - out.LogLikelihood(lab) + kLogPrior;
        (*prior)[g] = 1 / (1 + std::exp(-std::clamp(odds, -kLogLimit, kLogLimit)));
      }
    });
    return true;
  }

  void Solve(const std::vector<double>& prior, std::vector<double>* solved,
             Monitor& monitor) const {
    std::vector<float> weights(edges_.weight.size());
    std::vector<double> diagonal(count_), right(count_);
    ParallelRanges(int64_t(count_), kGrain, [&](int64_t first, int64_t last) {
      for (auto g = size_t(first); g < size_t(last); ++g) {
        double degree = 0;
        for (size_t e = edges_.begin[g]; e < edges_.begin[g + 1]; ++e) {
          // Neighbors of which one looks inside and the other outside touch, but are two things.
          const double alike = 1 - std::abs(prior[g] - prior[size_t(edges_.other[e])]);
          weights[e] = float(edges_.weight[e] * alike * alike + kLeastWeight);
          degree += double(weights[e]);
        }
        diagonal[g] = kSmoothness * degree + trust_[g] + 1;
        right[g] = trust_[g] * share_[g] + prior[g];
        (*solved)[g] = trust_[g] > 0 ? share_[g] : prior[g];
      }
    });
    SolveGraph(edges_, weights, diagonal, right, solved, monitor);
    for (double& share : *solved) {
      const double t =
          std::clamp((share - kSurelyOutside) / (kSurelyInside - kSurelyOutside), 0.0, 1.0);
      share = t * t * (3 - 2 * t);
    }
  }

  // What no chain of selected neighbors leads to from painted ones becomes outside.
  void DropUnconnected(std::vector<double>* solved) const {
    constexpr double kHalf = 0.5;
    std::vector<uint8_t> reached(count_, 0);
    std::vector<int> open = Members(true);
    for (const int g : open) reached[size_t(g)] = 1;
    while (!open.empty()) {
      const int g = open.back();
      open.pop_back();
      for (size_t e = edges_.begin[size_t(g)]; e < edges_.begin[size_t(g) + 1]; ++e) {
        const auto other = size_t(edges_.other[e]);
        if (reached[other] || edges_.weight[e] < kConnected || (*solved)[other] < kHalf) continue;
        reached[other] = 1;
        open.push_back(int(other));
      }
    }
    for (size_t g = 0; g < count_; ++g) {
      if (!reached[g] && (*solved)[g] >= kHalf) (*solved)[g] = 0;
    }
  }

  const std::vector<Surface>& surfaces_;
  const EdgeMatrix& edges_;
  size_t count_;
  std::vector<double> share_, known_, trust_;  // m_g; known part of the visibility; of m_g
};

std::vector<float> CompleteShares(const GaussianGraph& graph, const ShareEvidence& evidence,
                                  Completion completion, Monitor& monitor) {
  for (const auto& values : {evidence.inside, evidence.known, evidence.visible}) {
    CheckOption(values.size() == graph.NumGaussians(),
                "a completion needs the evidence of every Gaussian");
  }
  return Completer(graph, evidence).Run(completion, monitor);
}

}  // namespace retint
