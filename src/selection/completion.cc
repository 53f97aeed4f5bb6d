// SPDX-License-Identifier: BSD-3-Clause
#include "selection/completion.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string_view>
#include <utility>

#include <Eigen/Core>

#include "base/error.h"
#include "base/median.h"
#include "base/parallel.h"
#include "selection/gaussian_mixture.h"
#include "selection/graph_solver.h"

namespace retint {
namespace {

constexpr std::string_view kStage = "completion";

// Chosen on two captures, cape and flower, and kValley on objects on a table; docs/decisions/0003
// says what else was tried.
constexpr float kLeastWeight = 1e-6f;      // keeps the graph connected
constexpr float kSmoothness = 1000;        // of the edges against one unit of color evidence
constexpr double kValley = 4;              // a sure crease multiplies an edge by exp(-kValley)
constexpr double kTrust = 10;              // of full evidence
constexpr double kKnownFraction = 0.5;     // of the visibility; from here on, evidence is full
constexpr double kPaintedFraction = 0.25;  // of a view's usual visibility, likewise
constexpr double kKnownPixels = 16;        // likewise
constexpr double kLogPrior = -1;           // log odds of "inside" before the color is seen
constexpr double kLogLimit = 6;            // of the log odds by color
constexpr double kInside = 0.8, kOutside = 0.2;  // learn colors from shares beyond these
constexpr int kInsideColors = 5, kOutsideColors = 8;
constexpr int kLeastSamples = 50;
constexpr int kColorSamples = 2000;     // to learn a mixture from
constexpr double kColorSpread = 0.014;  // OKLab: no component of the colors gets narrower
constexpr double kConnected = 1e-3;     // least weight of an edge that connects
constexpr double kAnchored = 0.2;       // of the median trust of painted Gaussians
constexpr float kReach = 5;             // radii of the painted part, from its middle
constexpr double kWithinRadius = 0.9;   // quantile of their distances from it
// Solved shares below are outside, and above inside: an edit must not half change a Gaussian that
// is merely likely.
constexpr double kSurelyOutside = 0.4, kSurelyInside = 0.6;
constexpr double kUnseenDoubt = 0.25;   // of Gaussians that are inside without having been seen
constexpr double kLeastVisible = 1e-6;  // pixels
constexpr int64_t kGrain = 4096;

double Ratio(double part, double whole) { return whole > kLeastVisible ? part / whole : 0; }

// The evidence of paint for one Gaussian.
struct Proof {
  double share = 0;  // m_g
  double known = 0;  // part of the visibility that is known, in [0, 1]
  double kept = 0;   // part of m_g that stays, whatever the graph says; at least `known`
  double pixels = 0;
};

Proof ProofOf(const ShareEvidence& evidence, size_t g) {
  const double pixels = evidence.known[g], visible = evidence.visible[g];
  const double known = Ratio(evidence.seen[g], visible);
  // The mean visibility in a view, weighted by itself.
  const double usual = Ratio(evidence.visible_squared[g], visible);
  const double painted = Ratio(evidence.painted[g], usual);
  Proof proof;
  proof.share = std::clamp(Ratio(evidence.inside[g], pixels), 0.0, 1.0);
  proof.known = std::min(1.0, known / kKnownFraction);
  proof.kept = std::max(proof.known, std::min(1.0, painted / kPaintedFraction));
  proof.pixels = pixels;
  return proof;
}

// body(i) for every i below `count`.
template <typename Body>
void Each(size_t count, const Body& body) {
  ParallelRanges(int64_t(count), kGrain, [&](int64_t first, int64_t last) {
    for (auto i = size_t(first); i < size_t(last); ++i) body(i);
  });
}

using Mixture = GaussianMixture<3>;

// `x` is the solution x_g, `share` the share that follows from it.
struct Solved {
  double x = 0, share = 0;
};

// One completion over the nodes of a graph.
class Completer {
 public:
  Completer(const GaussianGraph& graph, const ShareEvidence& evidence, Backend* backend)
      : backend_(backend),
        graph_(graph),
        surfaces_(graph.surfaces()),
        edges_(graph.edges()),
        count_(graph.NumNodes()) {
    share_.resize(count_);
    trust_.resize(count_);
    looks_.resize(count_);
    pixels_.resize(count_);
    Each(count_, [&](size_t i) {
      const size_t g = graph.GaussianOf(i);
      const Proof proof = ProofOf(evidence, g);
      const double solid = graph.Floats(g) ? 0 : 1;
      share_[i] = proof.share;
      pixels_[i] = proof.pixels;
      trust_[i] = solid * kTrust * proof.known * std::min(1.0, proof.pixels / kKnownPixels);
      looks_[i].open = float(solid * std::exp(-kValley * double(surfaces_[i].valley)));
    });
  }

  // For every node, as if there were no paint on it.
  std::vector<Solved> Run(Completion completion, Monitor& monitor) {
    monitor.Step(kStage, 0, 2);
    const bool learned = LearnPrior();
    monitor.Step(kStage, 1, 2);
    std::vector<Solved> result(count_);
    if (learned) {
      std::vector<double> x(count_, 0.0);
      Solve(&x, monitor);
      Each(count_, [&](size_t i) {
        const double t =
            std::clamp((x[i] - kSurelyOutside) / (kSurelyInside - kSurelyOutside), 0.0, 1.0);
        result[i] = {std::clamp(x[i], 0.0, 1.0), t * t * (3 - 2 * t)};
      });
      if (completion == Completion::kNear) DropUnconnected(&result);
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

  double PixelsOf(const std::vector<int>& members) const {
    return std::accumulate(members.begin(), members.end(), 0.0,
                           [&](double sum, int g) { return sum + pixels_[size_t(g)]; });
  }

  // Every member as often as it has known pixels. With one vote each, thousands of small
  // Gaussians at the rim of an object that was painted too small would outvote a few large ones
  // around it.
  Mixture::Points Colors(const std::vector<int>& members) const {
    std::vector<double> sums(members.size());
    double sum = 0;
    for (size_t i = 0; i < members.size(); ++i) sums[i] = sum += pixels_[size_t(members[i])];
    Mixture::Points colors(kColorSamples, 3);
    size_t member = 0;
    for (int i = 0; i < kColorSamples; ++i) {
      const double at = (i + 0.5) / kColorSamples * sum;
      while (member + 1 < members.size() && sums[member] < at) ++member;
      colors.row(i) = surfaces_[size_t(members[member])].lab.transpose();
    }
    return colors;
  }

  // Probabilities of "inside" by color. Colors count less if they would select more pixels beside
  // the paint than there are painted ones. So a stroke on a plain surface does not spread over its
  // unseen part. False if there are too few samples to learn colors from.
  bool LearnPrior() {
    const std::vector<int> inside = Members(true), outside = Members(false);
    if (inside.size() < size_t(kLeastSamples) || outside.size() < size_t(kLeastSamples)) {
      return false;
    }
    Mixture in, out;
    ParallelTasks(2, [&](size_t which) {
      if (which == 0) in = {Colors(inside), kInsideColors, kColorSpread};
      if (which == 1) out = {Colors(outside), kOutsideColors, kColorSpread};
    });
    std::vector<float> odds(count_);
    ParallelRanges(int64_t(count_), 1024, [&](int64_t begin, int64_t end) {
      Mixture::Points labs(end - begin, 3);
      for (int64_t g = begin; g < end; ++g)
        labs.row(g - begin) = surfaces_[size_t(g)].lab.transpose();
      const Mixture::Values ratio = in.LogLikelihoods(labs) - out.LogLikelihoods(labs);
      std::copy_n(ratio.data(), end - begin, &odds[size_t(begin)]);
    });
    const auto probability = [&](size_t g, double log_prior) {
      return 1 / (1 + std::exp(-std::clamp(double(odds[g]) + log_prior, -kLogLimit, kLogLimit)));
    };
    // Pixels beside the paint, within its reach, that look painted by their color.
    const Ball reach = ReachOf(Anchors());
    double mistaken = 0;
    for (const int g : outside) {
      if (!reach.Holds(surfaces_[size_t(g)].mean)) continue;
      mistaken += pixels_[size_t(g)] * probability(size_t(g), kLogPrior);
    }
    const double painted = PixelsOf(inside);
    const double log_prior = kLogPrior + std::min(0.0, std::log(painted / std::max(1.0, mistaken)));
    Each(count_, [&](size_t g) { looks_[g].prior = float(probability(g, log_prior)); });
    return true;
  }

  void Solve(std::vector<double>* solved, Monitor& monitor) const {
    std::vector<NodeTerm> terms(count_);
    Each(count_, [&](size_t g) {
      const double prior = double(looks_[g].prior);
      terms[g].Add(trust_[g], share_[g]);
      terms[g].Add(1, prior);
      (*solved)[g] = trust_[g] > 0 ? share_[g] : prior;
    });
    if (FitsDevice(edges_, backend_)) {
      SolveOnDevice(terms, solved, monitor);
      return;
    }
    std::vector<float> weights(edges_.weight.size());
    Each(count_, [&](size_t g) {
      for (size_t e = edges_.begin[g]; e < edges_.begin[g + 1]; ++e) {
        const NodeLook& other = looks_[size_t(edges_.other[e])];
        weights[e] =
            kSmoothness * (WeightBetween(looks_[g], other, edges_.weight[e]) + kLeastWeight);
      }
    });
    SolveGraph(edges_, weights, terms, solved, monitor);
  }

  // The edges stay on the device. Only the terms of the nodes go there, and x comes back.
  void SolveOnDevice(const std::vector<NodeTerm>& terms, std::vector<double>* solved,
                     Monitor& monitor) const {
    monitor.ThrowIfCancelled();
    const DeviceEdges edges = graph_.OnDevice(*backend_);
    const auto looks = backend_->Upload(std::span<const NodeLook>(looks_));
    const auto weights = backend_->Allocate<float>(edges.weight.size());
    backend_->graph()->WeighEdges({edges.begin.data(), edges.other.data(), edges.weight.data(),
                                   looks.data(), weights.data(), int64_t(count_), kSmoothness,
                                   kLeastWeight});
    SolveGraphOnDevice(edges, weights, terms, solved, *backend_);
  }

  // The painted Gaussians that painted views see well. Others may be inside by mistake: a few
  // pixels of a surface far behind.
  std::vector<int> Anchors() const {
    std::vector<int> anchors = Members(true);
    std::vector<double> trust;
    for (const int g : anchors) trust.push_back(trust_[size_t(g)]);
    const double least = kAnchored * Median(std::move(trust));
    std::erase_if(anchors, [&](int g) { return trust_[size_t(g)] < least; });
    return anchors;
  }

  // A ball around the painted Gaussians. Those beyond it are not part of the same object.
  struct Ball {
    Eigen::Vector3f middle;
    float radius;
    bool Holds(const Eigen::Vector3f& at) const { return (at - middle).norm() <= radius; }
  };
  Ball ReachOf(const std::vector<int>& painted) const {
    std::vector<float> values(painted.size());
    const auto quantile = [&](double q, const auto& value) {
      std::transform(painted.begin(), painted.end(), values.begin(),
                     [&](int g) { return value(surfaces_[size_t(g)].mean); });
      return Quantile(values, q);
    };
    Ball ball;
    for (int axis = 0; axis < 3; ++axis) {
      ball.middle[axis] = quantile(0.5, [&](const Eigen::Vector3f& mean) { return mean[axis]; });
    }
    ball.radius = kReach * quantile(kWithinRadius, [&](const Eigen::Vector3f& mean) {
                    return (mean - ball.middle).norm();
                  });
    return ball;
  }

  // Gaussians become outside if no chain of selected neighbors within reach joins them to painted
  // ones.
  void DropUnconnected(std::vector<Solved>* solved) const {
    constexpr double kHalf = 0.5;
    std::vector<uint8_t> reached(count_, 0);
    std::vector<int> open = Anchors();
    const Ball reach = ReachOf(open);
    for (const int g : open) reached[size_t(g)] = 1;
    constexpr size_t kOpen = 512;  // nodes a task
    while (!open.empty()) {
      // The order in which tasks reach nodes does not matter: all connected nodes are reached in
      // the end.
      std::vector<std::vector<int>> found((open.size() + kOpen - 1) / kOpen);
      ParallelTasks(int64_t(found.size()), [&](size_t part) {
        const size_t end = std::min(open.size(), (part + 1) * kOpen);
        for (size_t i = part * kOpen; i < end; ++i) {
          const auto g = size_t(open[i]);
          for (size_t e = edges_.begin[g]; e < edges_.begin[g + 1]; ++e) {
            const auto other = size_t(edges_.other[e]);
            if (edges_.weight[e] < kConnected || (*solved)[other].share < kHalf) continue;
            if (!reach.Holds(surfaces_[other].mean)) continue;
            const std::atomic_ref<uint8_t> mark(reached[other]);
            if (mark.load(std::memory_order_relaxed) || mark.exchange(1)) continue;
            found[part].push_back(int(other));
          }
        }
      });
      open.clear();
      for (const auto& part : found) open.insert(open.end(), part.begin(), part.end());
    }
    Each(count_, [&](size_t g) {
      if (!reached[g] && (*solved)[g].share >= kHalf) (*solved)[g].share = 0;
    });
  }

  Backend* backend_;
  const GaussianGraph& graph_;
  const std::vector<GaussianSurface>& surfaces_;
  const EdgeMatrix& edges_;
  size_t count_;
  std::vector<double> share_, trust_;  // m_g, trust_g
  std::vector<double> pixels_;         // known ones
  std::vector<NodeLook> looks_;        // .open is 0 for a floater
};

}  // namespace

CompletedShares CompleteShares(const GaussianGraph& graph, const ShareEvidence& evidence,
                               Completion completion, Monitor& monitor, Backend* backend) {
  for (const auto& values : {evidence.inside, evidence.known, evidence.seen, evidence.painted,
                             evidence.visible, evidence.visible_squared}) {
    CheckOption(values.size() == graph.NumGaussians(),
                "a completion needs the evidence of every Gaussian");
  }
  const std::vector<Solved> solved = Completer(graph, evidence, backend).Run(completion, monitor);
  std::vector<Solved> of(graph.NumGaussians());
  for (size_t i = 0; i < solved.size(); ++i) of[graph.GaussianOf(i)] = solved[i];
  CompletedShares result;
  result.shares.resize(of.size());
  result.confidence.resize(of.size());
  Each(of.size(), [&](size_t g) {
    const Proof proof = ProofOf(evidence, g);
    const double x = of[g].x, unknown = 1 - proof.kept;
    const double share = proof.kept * proof.share + unknown * of[g].share;
    result.shares[g] = float(std::clamp(share, 0.0, 1.0));
    result.confidence[g] = float(1 - unknown * std::max(4 * x * (1 - x), kUnseenDoubt * x));
  });
  return result;
}

}  // namespace retint
