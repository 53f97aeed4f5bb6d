// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/color_map_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>

#include "base/median.h"
#include "kernels/common/color_ops.h"

namespace retint {
namespace {

constexpr int kSide = kFittedTableSize;
constexpr int kNodes = kSide * kSide * kSide;
constexpr int kStep[3] = {1, kSide, kSide* kSide};
constexpr int kRounds = 6;
// Of the second differences: at first so stiff that no minority bends the map, then halved until a
// cell's own pairs decide. In units of a pair's weight.
constexpr double kFirstSmoothness = 30, kLastSmoothness = 0.3;
constexpr double kSteadiness = 3e-3, kStay = 1e-6;

// The nodes and weights of TableColor at one color.
struct Stencil {
  std::array<int, 4> node;
  std::array<double, 4> weight;
};

Stencil StencilOf(const float* color) {
  int base = 0;
  double fraction[3];
  for (int c = 0; c < 3; ++c) {
    const double at = double(Clamp01(color[c])) * (kSide - 1);
    const int cell = std::min(int(at), kSide - 2);
    base += cell * kStep[c];
    fraction[c] = at - cell;
  }
  std::array<int, 3> axis = {0, 1, 2};
  std::stable_sort(axis.begin(), axis.end(),
                   [&](int x, int y) { return fraction[x] > fraction[y]; });
  Stencil stencil;
  double above = 1;
  for (size_t i = 0; i < 4; ++i) {
    const double here = i < 3 ? fraction[axis[i]] : 0;
    stencil.node[i] = base;
    stencil.weight[i] = above - here;
    above = here;
    if (i < 3) base += kStep[axis[i]];
  }
  return stencil;
}

using Matrix = Eigen::SparseMatrix<double>;
using Values = Eigen::Matrix<double, Eigen::Dynamic, 3>;

// Adds the square of a difference with the coefficients `of` at nodes `first + i step`.
template <size_t N>
void AddSquare(std::vector<Eigen::Triplet<double>>& entries, int first, int step,
               const std::array<double, N>& of, double weight) {
  for (size_t i = 0; i < N; ++i) {
    for (size_t j = 0; j < N; ++j) {
      entries.emplace_back(first + int(i) * step, first + int(j) * step, weight * of[i] * of[j]);
    }
  }
}

Matrix Penalty(double smoothness) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int node = 0; node < kNodes; ++node) {
    entries.emplace_back(node, node, kStay);
    for (const int step : kStep) {
      const int place = node / step % kSide;
      if (place + 1 < kSide) AddSquare<2>(entries, node, step, {-1, 1}, kSteadiness);
      if (place + 2 < kSide) AddSquare<3>(entries, node, step, {1, -2, 1}, smoothness);
    }
  }
  Matrix penalty(kNodes, kNodes);
  penalty.setFromTriplets(entries.begin(), entries.end());
  return penalty;
}

class Fit {
 public:
  Fit(std::span<const float> before, std::span<const float> after)
      : change_(Eigen::Index(before.size() / 3), 3),
        weights_(before.size() / 3, 1),
        nodes_(Values::Zero(kNodes, 3)) {
    for (size_t i = 0; i < weights_.size(); ++i) {
      stencils_.push_back(StencilOf(&before[3 * i]));
      for (size_t c = 0; c < 3; ++c) {
        change_(Eigen::Index(i), Eigen::Index(c)) =
            double(after[3 * i + c]) - double(before[3 * i + c]);
      }
    }
  }

  void Solve(double smoothness) {
    std::vector<Eigen::Triplet<double>> entries;
    Values rhs = Values::Zero(kNodes, 3);
    for (size_t i = 0; i < weights_.size(); ++i) {
      const Stencil& stencil = stencils_[i];
      for (size_t a = 0; a < 4; ++a) {
        const double weight = weights_[i] * stencil.weight[a];
        if (weight == 0) continue;
        rhs.row(stencil.node[a]) += weight * change_.row(Eigen::Index(i));
        for (size_t b = 0; b < 4; ++b) {
          entries.emplace_back(stencil.node[a], stencil.node[b], weight * stencil.weight[b]);
        }
      }
    }
    Matrix normal(kNodes, kNodes);
    normal.setFromTriplets(entries.begin(), entries.end());
    normal += Penalty(smoothness);
    nodes_ = Eigen::SimplicialLDLT<Matrix>(normal).solve(rhs);
  }

  void Reweight() {
    std::vector<double> residuals;
    for (size_t i = 0; i < weights_.size(); ++i) {
      Eigen::RowVector3d found = Eigen::RowVector3d::Zero();
      for (size_t a = 0; a < 4; ++a) {
        found += stencils_[i].weight[a] * nodes_.row(stencils_[i].node[a]);
      }
      residuals.push_back((found - change_.row(Eigen::Index(i))).norm());
    }
    weights_ = RobustWeights(residuals);
  }

  ColorTable Table() const {
    ColorTable table;
    table.size = kSide;
    for (int node = 0; node < kNodes; ++node) {
      for (int c = 0; c < 3; ++c) {
        const double own = double(node / kStep[c] % kSide) / (kSide - 1);
        table.values.push_back(float(std::clamp(own + nodes_(node, c), 0.0, 1.0)));
      }
    }
    return table;
  }

 private:
  std::vector<Stencil> stencils_;
  Values change_;  // [N, 3]
  std::vector<double> weights_;
  Values nodes_;  // their change
};

}  // namespace

ColorTable FitColorTable(std::span<const float> before, std::span<const float> after) {
  Fit fit(before, after);
  for (int round = 0; round < kRounds; ++round) {
    if (round > 0) fit.Reweight();
    fit.Solve(kFirstSmoothness *
              std::pow(kLastSmoothness / kFirstSmoothness, double(round) / (kRounds - 1)));
  }
  return fit.Table();
}

std::vector<double> RobustWeights(const std::vector<double>& residuals) {
  constexpr double kScales = 3;
  constexpr double kLeastScale = 0.008;  // two steps of eight bits
  const double scale = kScales * std::max(1.4826 * Median(residuals), kLeastScale);
  std::vector<double> weights;
  for (const double residual : residuals) {
    weights.push_back(1 / std::pow(1 + std::pow(residual / scale, 2), 2));
  }
  return weights;
}

}  // namespace retint
