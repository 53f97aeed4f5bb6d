// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstring>
#include <vector>

#include <hwy/cache_control.h>

#include "base/parallel.h"
#include "kernels/common/sh.h"
#include "kernels/cpu/geometry.h"
#include "kernels/cpu/groups.h"

namespace retint {
namespace {

constexpr int64_t kGrain = 1024;

int64_t GaussianOf(const int32_t* rows, int64_t entry) { return rows ? rows[entry] : entry; }

int64_t SlotOf(const int32_t* rows, const int32_t* slots, int64_t entry) {
  return slots ? slots[entry] : GaussianOf(rows, entry);
}

// Rows come in order of depth, so their Gaussians and blocks lie anywhere:
// without prefetching, memory latency is all there is.
template <typename Params>
void PrefetchEntry(const CpuModel& model, const Params& params, int64_t entry, const float* blocks,
                   int64_t block_size) {
  constexpr int64_t kLine = 16;  // floats
  hwy::Prefetch(&model.means[size_t(GaussianOf(params.rows, entry)) * 3]);
  const int64_t slot = SlotOf(params.rows, params.slots, entry);
  for (int64_t at = 0; slot >= 0 && at < block_size; at += kLine) {
    hwy::Prefetch(blocks + slot * block_size + at);
  }
}

// body(entry, block, basis) for entries [0, count) with a slot, `block` being its part of `blocks`;
// missing(entry) for the others.
template <typename Params, typename Float, typename Body, typename Missing>
void ForEachBasis(const CpuModel& model, const Params& params, Float* blocks, int64_t block_size,
                  const Body& body, const Missing& missing) {
  constexpr int64_t kAhead = 8;
  ParallelRanges(params.count, kGrain, [&](int64_t begin, int64_t end) {
    float basis[kMaxShCoeffs];
    for (int64_t i = begin; i < end; ++i) {
      if (i + kAhead < end) PrefetchEntry(model, params, i + kAhead, blocks, block_size);
      const int64_t slot = SlotOf(params.rows, params.slots, i);
      if (slot < 0) {
        missing(i);
        continue;
      }
      const int64_t gaussian = GaussianOf(params.rows, i);
      ShBasisTowards(model.sh_degree(), &model.means[size_t(gaussian) * 3], params.center, basis);
      body(i, blocks + slot * block_size, basis);
    }
  });
}

// The entry of each Gaussian, -1 of those that have none, where most of them have one: then blocks
// are read in the order in which they lie in memory, which takes a fifth of the time. Empty: not
// so, or a Gaussian has several entries.
std::vector<int32_t> EntriesOf(const Model& model, const EvalShParams& params) {
  if (!params.rows || params.slots || 2 * params.count < model.count()) return {};
  std::vector<int32_t> entries(size_t(model.count()), -1);
  for (int64_t i = 0; i < params.count; ++i) {
    int32_t& entry = entries[size_t(params.rows[i])];
    if (entry >= 0) return {};
    entry = int32_t(i);
  }
  return entries;
}

// sum_k basis[k] * coefficients[k, :], the channels side by side in a vector: each sum is added in
// the order in which it would be alone.
void Dot(const float* basis, const float* coefficients, int k, float* out) {
  using Vector __attribute__((vector_size(16))) = float;
  Vector sum = {};
  for (int i = 0; i + 1 < k; ++i, coefficients += 3) {
    Vector coefficient;  // and the first value of the next one
    std::memcpy(&coefficient, coefficients, sizeof(Vector));
    sum += basis[i] * coefficient;
  }
  sum += basis[k - 1] * Vector{coefficients[0], coefficients[1], coefficients[2], 0};
  for (int c = 0; c < 3; ++c) out[c] = sum[c];
}

class CpuShOps : public ShOps {
 protected:
  void DoEvalSh(const Model& model, const EvalShParams& params) override;
  void DoEvalShTranspose(const Model& model, const EvalShTransposeParams& params) override;
  void DoAccumulateBlocks(const Model& model, const AccumulateBlocksParams& params) override;
};

void CpuShOps::DoEvalSh(const Model& model, const EvalShParams& params) {
  const int k = model.num_sh_coeffs();
  const auto eval = [&](int64_t i, const float* sh, const float* basis) {
    float* color = params.colors + params.stride * i;
    Dot(basis, sh, k, color);
    for (int c = 0; c < 3; ++c) color[c] = std::max(0.0f, color[c] + 0.5f);
  };
  const std::vector<int32_t> entries = EntriesOf(model, params);
  if (entries.empty()) {
    ForEachBasis(CpuModelOf(model), params, params.sh, 3 * k, eval,
                 [&](int64_t i) { std::fill_n(params.colors + params.stride * i, 3, 0.0f); });
    return;
  }
  const float* const means = CpuModelOf(model).means.data();
  ParallelRanges(model.count(), kGrain, [&](int64_t begin, int64_t end) {
    float basis[kMaxShCoeffs];
    for (int64_t g = begin; g < end; ++g) {
      const int32_t entry = entries[size_t(g)];
      if (entry < 0) continue;
      ShBasisTowards(model.sh_degree(), means + 3 * g, params.center, basis);
      eval(entry, params.sh + 3 * k * g, basis);
    }
  });
}

void CpuShOps::DoEvalShTranspose(const Model& model, const EvalShTransposeParams& params) {
  const int k = model.num_sh_coeffs();
  ForEachBasis(
      CpuModelOf(model), params, params.gradient, 3 * k,
      [&](int64_t i, float* out, const float* basis) {
        float g[3];
        for (int c = 0; c < 3; ++c) {
          const bool open = !params.colors || params.colors[3 * i + c] > 0;
          g[c] = open ? params.color_gradients[3 * i + c] : 0.0f;
        }
        for (int j = 0; j < k; ++j) {
          for (int c = 0; c < 3; ++c) out[3 * j + c] += basis[j] * g[c];
        }
      },
      [](int64_t) {});
}

void CpuShOps::DoAccumulateBlocks(const Model& model, const AccumulateBlocksParams& params) {
  const int k = model.num_sh_coeffs();
  ForEachBasis(
      CpuModelOf(model), params, params.blocks, k * (k + 1) / 2,
      [&](int64_t i, float* block, const float* basis) {
        for (int row = 0; row < k; ++row) {
          const float scaled = params.weights[i] * basis[row];
          for (int column = 0; column <= row; ++column) *block++ += scaled * basis[column];
        }
      },
      [](int64_t) {});
}

}  // namespace

std::unique_ptr<ShOps> MakeCpuShOps() { return std::make_unique<CpuShOps>(); }

}  // namespace retint
