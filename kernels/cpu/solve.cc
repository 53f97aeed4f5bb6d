// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "kernels/common/sh.h"
#include "kernels/cpu/groups.h"

namespace retint {
namespace {

constexpr int64_t kElements = 1 << 15;  // a task
constexpr int64_t kBlocks = 256;

int PackedSize(int k) { return k * (k + 1) / 2; }

// In place L of A = L L^T, with 1 / L_ii on the diagonal. False where A is not positive definite.
bool Cholesky(int k, float* a) {
  float* row = a;
  for (int i = 0; i < k; row += ++i) {
    const float* other = a;
    for (int j = 0; j < i; other += ++j) {
      float sum = row[j];
      for (int l = 0; l < j; ++l) sum -= row[l] * other[l];
      row[j] = sum * other[j];
    }
    float sum = row[i];
    for (int l = 0; l < i; ++l) sum -= row[l] * row[l];
    if (!(sum > 0) || !std::isfinite(sum)) return false;
    row[i] = 1 / std::sqrt(sum);
  }
  return true;
}

class CpuSolveOps : public SolveOps {
 protected:
  void DoAddRidge(const AddRidgeParams& params) override;
  void DoFactorBlocks(const FactorBlocksParams& params) override;
  void DoSolveBlocks(const SolveBlocksParams& params) override;
  double DoRidgeTerm(const RidgeTermParams& params) override;
  void DoLinearCombination(const LinearCombinationParams& params) override;
  double DoDot(const float* x, const float* y, int64_t count) override;
  void DoAdam(const AdamParams& params) override;
};

void CpuSolveOps::DoAddRidge(const AddRidgeParams& params) {
  const int size = PackedSize(params.k);
  ParallelRanges(params.count, kBlocks, [&](int64_t begin, int64_t end) {
    for (int64_t b = begin; b < end; ++b) {
      float* block = params.blocks + b * size;
      const float weight = block[0] / (kShC0 * kShC0);
      params.weights[b] = weight;
      for (int i = 0; i < params.k; ++i) block[PackedSize(i) + i] += params.ridge[i] * weight;
    }
  });
}

void CpuSolveOps::DoFactorBlocks(const FactorBlocksParams& params) {
  const int size = PackedSize(params.k);
  ParallelRanges(params.count, kBlocks, [&](int64_t begin, int64_t end) {
    for (int64_t b = begin; b < end; ++b) {
      float* block = params.blocks + b * size;
      // The inverse of an all-zero factor is zero in SolveBlocks.
      if (!Cholesky(params.k, block)) std::fill_n(block, size, 0.0f);
    }
  });
}

void CpuSolveOps::DoSolveBlocks(const SolveBlocksParams& params) {
  const int k = params.k, size = PackedSize(k);
  ParallelRanges(params.count, kBlocks, [&](int64_t begin, int64_t end) {
    for (int64_t b = begin; b < end; ++b) {
      const float* factor = params.factors + b * size;
      float x[kMaxShCoeffs][3];
      const float* rhs = params.rhs + b * k * 3;
      for (int i = 0; i < k; ++i) {
        for (int c = 0; c < 3; ++c) x[i][c] = rhs[3 * i + c];
      }
      const float* row = factor;
      for (int i = 0; i < k; row += ++i) {  // L z = b
        for (int j = 0; j < i; ++j) {
          for (int c = 0; c < 3; ++c) x[i][c] -= row[j] * x[j][c];
        }
        for (int c = 0; c < 3; ++c) x[i][c] *= row[i];
      }
      for (int i = k - 1; i >= 0; --i) {  // L^T x = z
        row = factor + PackedSize(i);
        for (int c = 0; c < 3; ++c) x[i][c] *= row[i];
        for (int j = 0; j < i; ++j) {
          for (int c = 0; c < 3; ++c) x[j][c] -= row[j] * x[i][c];
        }
      }
      std::copy_n(&x[0][0], 3 * k, params.solution + b * k * 3);
    }
  });
}

double CpuSolveOps::DoRidgeTerm(const RidgeTermParams& params) {
  return OrderedSum(params.count, kBlocks, [&](int64_t begin, int64_t end) {
    double sum = 0;
    for (int64_t b = begin; b < end; ++b) {
      for (int i = 0; i < params.k; ++i) {
        const float factor = params.ridge[i] * params.weights[b];
        const int64_t at = (b * params.k + i) * 3;
        for (int64_t j = at; j < at + 3; ++j) {
          const float away = params.x[j] - params.center[j];
          if (params.descent) params.descent[j] -= factor * away;
          sum += double(factor * away) * double(away);
        }
      }
    }
    return sum;
  });
}

void CpuSolveOps::DoLinearCombination(const LinearCombinationParams& params) {
  ParallelRanges(params.count, kElements, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      params.out[i] = params.a * params.x[i] + params.b * params.y[i];
    }
  });
}

double CpuSolveOps::DoDot(const float* x, const float* y, int64_t count) {
  return OrderedSum(count, kElements, [&](int64_t begin, int64_t end) {
    double sums[4] = {};
    int64_t i = begin;
    for (; i + 4 <= end; i += 4) {
      for (int j = 0; j < 4; ++j) sums[j] += double(x[i + j]) * double(y[i + j]);
    }
    for (; i < end; ++i) sums[0] += double(x[i]) * double(y[i]);
    return (sums[0] + sums[1]) + (sums[2] + sums[3]);
  });
}

void CpuSolveOps::DoAdam(const AdamParams& params) {
  const double correction1 = 1 - std::pow(double(params.beta1), double(params.step));
  const double correction2 = 1 - std::pow(double(params.beta2), double(params.step));
  const float rate = float(params.learning_rate / correction1);
  const float root = float(1 / std::sqrt(correction2));
  ParallelRanges(params.count, kElements, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const float g = params.gradients[i];
      const float m = params.beta1 * params.m[i] + (1 - params.beta1) * g;
      const float v = params.beta2 * params.v[i] + (1 - params.beta2) * g * g;
      params.m[i] = m;
      params.v[i] = v;
      params.values[i] -= rate * m / (std::sqrt(v) * root + params.epsilon);
    }
  });
}

}  // namespace

std::unique_ptr<SolveOps> MakeCpuSolveOps() { return std::make_unique<CpuSolveOps>(); }

}  // namespace retint
