// SPDX-License-Identifier: BSD-3-Clause
// Block solver against Eigen, Adam and the vector algebra against their formulas.
#include <cmath>

#include <Eigen/Dense>

#include "kernels/common/sh.h"
#include "tests/kernels/test_scene.h"

namespace retint {
namespace {

class SolveOp : public BackendTest {
 protected:
  static int Packed(int k) { return k * (k + 1) / 2; }
  // A sum of random y y^T with a ridge.
  Eigen::MatrixXd RandomBlock(int k) {
    Eigen::MatrixXd a = 0.05 * Eigen::MatrixXd::Identity(k, k);
    for (int i = 0; i < 3 * k; ++i) {
      const auto y = UniformVector(rng_, size_t(k), -1, 1);
      const Eigen::VectorXd v = Eigen::Map<const Eigen::VectorXf>(y.data(), k).cast<double>();
      a += double(Uniform(rng_, 0, 1)) * v * v.transpose();
    }
    return a;
  }
  static void Append(const Eigen::MatrixXd& a, std::vector<float>* packed) {
    for (int i = 0; i < a.rows(); ++i) {
      for (int j = 0; j <= i; ++j) packed->push_back(float(a(i, j)));
    }
  }
};

TEST_P(SolveOp, SolvesBlocksLikeEigen) {
  for (const int k : {1, 4, 9, 16}) {
    const int count = 37;
    std::vector<Eigen::MatrixXd> matrices;
    std::vector<float> packed;
    for (int b = 0; b < count; ++b) {
      matrices.push_back(RandomBlock(k));
      Append(matrices.back(), &packed);
    }
    const auto rhs = UniformVector(rng_, size_t(count * k * 3), -1, 1);
    Guarded<float> blocks(*backend_, packed), b(*backend_, rhs), x(*backend_, rhs.size());
    backend_->solve().FactorBlocks({blocks.data(), count, k});
    backend_->solve().SolveBlocks({blocks.data(), b.data(), x.data(), count, k});
    const auto solution = x.Read();
    blocks.Read();
    for (int i = 0; i < count; ++i) {
      using Rhs = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
      const Eigen::MatrixXd right =
          Eigen::Map<const Rhs>(&rhs[size_t(i * k * 3)], k, 3).cast<double>();
      const Eigen::MatrixXd expected = matrices[size_t(i)].llt().solve(right);
      const Eigen::MatrixXd actual =
          Eigen::Map<const Rhs>(&solution[size_t(i * k * 3)], k, 3).cast<double>();
      // Condition numbers of some hundreds times the float step.
      EXPECT_LE((actual - expected).norm(), 1e-4 * expected.norm()) << "k = " << k;
    }
  }
}

TEST_P(SolveOp, GivesZeroForBadBlocks) {
  const int k = 4;
  std::vector<float> packed;
  Append(RandomBlock(k), &packed);
  Append(-RandomBlock(k), &packed);
  Append(Eigen::MatrixXd::Zero(k, k), &packed);
  Append(NAN * Eigen::MatrixXd::Ones(k, k), &packed);
  const std::vector<float> rhs(size_t(4 * k * 3), 1.0f);
  Guarded<float> blocks(*backend_, packed), b(*backend_, rhs), x(*backend_, rhs.size());
  backend_->solve().FactorBlocks({blocks.data(), 4, k});
  backend_->solve().SolveBlocks({blocks.data(), b.data(), x.data(), 4, k});
  const auto solution = x.Read();
  for (int i = 0; i < k * 3; ++i) EXPECT_NE(solution[size_t(i)], 0.0f);
  for (size_t i = size_t(k) * 3; i < solution.size(); ++i) EXPECT_EQ(solution[i], 0.0f);
}

TEST_P(SolveOp, AddsRidges) {
  const int k = 9, count = 5;
  std::vector<float> packed;
  for (int b = 0; b < count; ++b) Append(RandomBlock(k), &packed);
  Guarded<float> blocks(*backend_, packed), weights(*backend_, count);
  AddRidgeParams params{blocks.data(), weights.data(), count, k, {}};
  for (int i = 0; i < k; ++i) params.ridge[i] = 0.01f * float(i + 1);
  backend_->solve().AddRidge(params);
  const auto out = blocks.Read(), w = weights.Read();
  for (int b = 0; b < count; ++b) {
    const float expected = packed[size_t(b * Packed(k))] / (kShC0 * kShC0);
    EXPECT_FLOAT_EQ(w[size_t(b)], expected);
    for (int i = 0; i < k; ++i) {
      for (int j = 0; j <= i; ++j) {
        const size_t at = size_t(b * Packed(k) + Packed(i) + j);
        EXPECT_FLOAT_EQ(out[at], packed[at] + (i == j ? params.ridge[i] * expected : 0));
      }
    }
  }
  const auto x = UniformVector(rng_, size_t(count * k * 3), -1, 1);
  const auto start = UniformVector(rng_, x.size(), -1, 1);
  const auto middle = UniformVector(rng_, x.size(), -1, 1);
  Guarded<float> in(*backend_, x), center(*backend_, middle), descent(*backend_, start);
  Guarded<float> weight_in(*backend_, w);
  RidgeTermParams term{weight_in.data(), in.data(), center.data(), descent.data(), count, k, {}};
  std::copy_n(params.ridge, k, term.ridge);
  const double value = backend_->solve().RidgeTerm(term);
  const auto taken = descent.Read();
  double expected = 0;
  for (size_t i = 0; i < x.size(); ++i) {
    const size_t g = i / size_t(k * 3), row = i / 3 % size_t(k);
    const double factor = double(params.ridge[row]) * double(w[g]);
    const double away = double(x[i]) - double(middle[i]);
    EXPECT_NEAR(taken[i], double(start[i]) - factor * away, 1e-5);
    expected += factor * away * away;
  }
  // Each term is rounded to floats, the sum is not.
  EXPECT_NEAR(value, expected, 1e-6 * expected);
  term.descent = nullptr;
  EXPECT_EQ(backend_->solve().RidgeTerm(term), value);
}

TEST_P(SolveOp, AdamFollowsItsFormula) {
  const size_t count = 1000;
  const auto start = UniformVector(rng_, count, -1, 1);
  Guarded<float> values(*backend_, start);
  Guarded<float> m(*backend_, std::vector<float>(count, 0.0f));
  Guarded<float> v(*backend_, std::vector<float>(count, 0.0f));
  std::vector<double> x(start.begin(), start.end()), em(count, 0.0), ev(count, 0.0);
  for (int step = 1; step <= 20; ++step) {
    auto gradient = UniformVector(rng_, count, -1, 1);
    gradient[0] = 0;  // stays where it is
    Guarded<float> g(*backend_, gradient);
    backend_->solve().Adam({values.data(), g.data(), m.data(), v.data(), int64_t(count), step,
                            1e-2f, 0.9f, 0.999f, 1e-15f});
    for (size_t i = 0; i < count; ++i) {
      em[i] = 0.9 * em[i] + 0.1 * double(gradient[i]);
      ev[i] = 0.999 * ev[i] + 0.001 * double(gradient[i]) * double(gradient[i]);
      const double mean = em[i] / (1 - std::pow(0.9, step)),
                   var = ev[i] / (1 - std::pow(0.999, step));
      x[i] -= 1e-2 * mean / (std::sqrt(var) + 1e-15);
    }
  }
  const auto out = values.Read();
  EXPECT_EQ(out[0], start[0]);
  // 20 steps of up to 0.01; float's 0.999 is off by 1e-8, which 1 - 0.999^t magnifies to 1e-5.
  EXPECT_LE(WorstDifference(out, x), 1e-5);
  m.Read(), v.Read();
}

TEST_P(SolveOp, CombinesAndMultiplies) {
  const auto x = UniformVector(rng_, 100003, -1, 1), y = UniformVector(rng_, 100003, -1, 1);
  Guarded<float> in_x(*backend_, x), in_y(*backend_, y), out(*backend_, x.size());
  backend_->solve().LinearCombination(
      {in_x.data(), in_y.data(), 2, -3, out.data(), int64_t(x.size())});
  const auto combined = out.Read();
  double dot = 0;
  for (size_t i = 0; i < x.size(); ++i) {
    EXPECT_NEAR(combined[i], 2 * x[i] - 3 * y[i], 1e-6);
    dot += double(x[i]) * double(y[i]);
  }
  EXPECT_NEAR(backend_->solve().Dot(in_x.data(), in_y.data(), int64_t(x.size())), dot, 1e-6);
  EXPECT_EQ(backend_->solve().Dot(in_x.data(), in_y.data(), 0), 0);
  backend_->solve().LinearCombination(
      {in_x.data(), in_y.data(), 1, 1, in_x.data(), 10});  // in place
  EXPECT_FLOAT_EQ(in_x.Read()[9], x[9] + y[9]);
}

RETINT_INSTANTIATE(SolveOp);

}  // namespace
}  // namespace retint
