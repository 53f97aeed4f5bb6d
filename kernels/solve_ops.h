// SPDX-License-Identifier: BSD-3-Clause
// The algebra of the refit's solvers: blocks of K = 1, 4, 9 or 16 SH coefficients a Gaussian,
// vectors of floats, Adam. Blocks come from ShOps::AccumulateBlocks. Sums do not depend on the
// number of threads.
#pragma once

#include <cstdint>

#include "kernels/common/types.h"

namespace retint {

// Adds ridge[k] * weight to the diagonals of blocks and writes weight = sum of the accumulated
// weights = block[0] / Y_00^2.
struct AddRidgeParams {
  float* blocks;   // [count, K (K + 1) / 2]
  float* weights;  // [count]
  int64_t count;
  int32_t k;
  float ridge[kMaxShCoeffs];
};

// Cholesky of every block in place (ridge already added), then x = block^-1 b, three right-hand
// sides each. A block that is not positive definite gives x = 0.
struct FactorBlocksParams {
  float* blocks;  // [count, K (K + 1) / 2]
  int64_t count;
  int32_t k;
};
struct SolveBlocksParams {
  const float* factors;  // from FactorBlocks
  const float* rhs;      // [count, K, 3]
  float* solution;       // [count, K, 3]
  int64_t count;
  int32_t k;
};

// The ridge's part of a loss, sum over g, k of ridge[k] weights[g] |x[g, k, :] - center[g, k,
// :]|^2, and half of its gradient, which is taken off `descent`.
struct RidgeTermParams {
  const float* weights;  // [count]
  const float* x;        // [count, K, 3]
  const float* center;   // [count, K, 3]
  float* descent;        // [count, K, 3] half the negative gradient of a loss; null: only the value
  int64_t count;
  int32_t k;
  float ridge[kMaxShCoeffs];
};

// out = a x + b y, element by element; out may be x or y.
struct LinearCombinationParams {
  const float* x;
  const float* y;
  float a, b;
  float* out;
  int64_t count;
};

// Adam (Kingma & Ba 2015) on `count` values: m, v moments, `step` counts from 1.
struct AdamParams {
  float* values;
  const float* gradients;
  float* m;
  float* v;
  int64_t count;
  int64_t step;
  float learning_rate, beta1, beta2, epsilon;
};

class SolveOps {
 public:
  virtual ~SolveOps() = default;

  void AddRidge(const AddRidgeParams& params);
  void FactorBlocks(const FactorBlocksParams& params);
  void SolveBlocks(const SolveBlocksParams& params);
  double RidgeTerm(const RidgeTermParams& params);
  void LinearCombination(const LinearCombinationParams& params);
  double Dot(const float* x, const float* y, int64_t count);
  void Adam(const AdamParams& params);

 protected:
  virtual void DoAddRidge(const AddRidgeParams& params) = 0;
  virtual void DoFactorBlocks(const FactorBlocksParams& params) = 0;
  virtual void DoSolveBlocks(const SolveBlocksParams& params) = 0;
  virtual double DoRidgeTerm(const RidgeTermParams& params) = 0;
  virtual void DoLinearCombination(const LinearCombinationParams& params) = 0;
  virtual double DoDot(const float* x, const float* y, int64_t count) = 0;
  virtual void DoAdam(const AdamParams& params) = 0;
};

}  // namespace retint
