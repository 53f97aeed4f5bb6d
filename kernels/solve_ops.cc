// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/solve_ops.h"

#include "kernels/check.h"

namespace retint {
namespace {

void RequireBlocks(int64_t count, int k) {
  RequireCount(count);
  Require(k == 1 || k == 4 || k == 9 || k == 16, "k must be 1, 4, 9 or 16");
}

}  // namespace

void SolveOps::AddRidge(const AddRidgeParams& params) {
  RequireBlocks(params.count, params.k);
  DoAddRidge(params);
}

void SolveOps::FactorBlocks(const FactorBlocksParams& params) {
  RequireBlocks(params.count, params.k);
  DoFactorBlocks(params);
}

void SolveOps::SolveBlocks(const SolveBlocksParams& params) {
  RequireBlocks(params.count, params.k);
  DoSolveBlocks(params);
}

double SolveOps::RidgeTerm(const RidgeTermParams& params) {
  RequireBlocks(params.count, params.k);
  return DoRidgeTerm(params);
}

void SolveOps::LinearCombination(const LinearCombinationParams& params) {
  RequireCount(params.count);
  DoLinearCombination(params);
}

double SolveOps::Dot(const float* x, const float* y, int64_t count) {
  RequireCount(count);
  return DoDot(x, y, count);
}

void SolveOps::Adam(const AdamParams& params) {
  RequireCount(params.count);
  Require(params.step >= 1, "Adam's steps count from 1");
  DoAdam(params);
}

}  // namespace retint
