// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include <hwy/cache_control.h>
#include <Eigen/Core>

#include "base/parallel.h"
#include "kernels/common/sh.h"
#include "kernels/common/sh_edit.h"
#include "kernels/cpu/geometry.h"
#include "kernels/cpu/groups.h"
#include "kernels/cpu/sh_kernels.h"

namespace retint {
namespace {

constexpr int64_t kGrain = 1024;

int64_t GaussianOf(const int32_t* rows, int64_t entry) { return rows ? rows[entry] : entry; }

int64_t SlotOf(const int32_t* rows, const int32_t* slots, int64_t entry) {
  return slots ? slots[entry] : GaussianOf(rows, entry);
}

using Floats __attribute__((vector_size(16))) = float;

// A number of each of four Gaussians, as ShBasis() takes it.
struct Four {
  Floats x;
  Four() = default;
  explicit Four(float value) : x{value, value, value, value} {}
  explicit Four(Floats value) : x(value) {}
};
Four operator-(Four a, Four b) { return Four(a.x - b.x); }
Four operator*(Four a, Four b) { return Four(a.x * b.x); }

// Rows of one number of each Gaussian become rows of one Gaussian each.
void Transpose(const Four* rows, float* const* to) {
  const Floats a = rows[0].x, b = rows[1].x, c = rows[2].x, d = rows[3].x;
  const Floats low_ab = __builtin_shufflevector(a, b, 0, 4, 1, 5);
  const Floats low_cd = __builtin_shufflevector(c, d, 0, 4, 1, 5);
  const Floats high_ab = __builtin_shufflevector(a, b, 2, 6, 3, 7);
  const Floats high_cd = __builtin_shufflevector(c, d, 2, 6, 3, 7);
  const Floats columns[] = {__builtin_shufflevector(low_ab, low_cd, 0, 1, 4, 5),
                            __builtin_shufflevector(low_ab, low_cd, 2, 3, 6, 7),
                            __builtin_shufflevector(high_ab, high_cd, 0, 1, 4, 5),
                            __builtin_shufflevector(high_ab, high_cd, 2, 3, 6, 7)};
  for (int i = 0; i < 4; ++i) std::memcpy(to[i], &columns[i], sizeof(Floats));
}

// The bases of a group's Gaussians in the directions from `center`, as ShBasisTowards().
template <typename Float>
void FindBases(int degree, const float* const* means, const float* center, ShGroup<Float>* group) {
  Floats to[3] = {}, inverse;
  for (int i = 0; i < group->count; ++i) {
    for (int c = 0; c < 3; ++c) to[c][i] = means[i][c] - center[c];
  }
  const Floats squares = to[0] * to[0] + to[1] * to[1] + to[2] * to[2];
  for (int i = 0; i < 4; ++i) {
    if (!(squares[i] > 0)) to[2][i] = 1;
    inverse[i] = squares[i] > 0 ? 1 / std::sqrt(squares[i]) : 1.0f;
  }
  Four basis[kMaxShCoeffs] = {};
  ShBasis(degree, Four(to[0] * inverse), Four(to[1] * inverse), Four(to[2] * inverse), basis);
  for (int k = 0; k < (degree + 1) * (degree + 1); k += 4) {
    float* const rows[] = {group->bases[0] + k, group->bases[1] + k, group->bases[2] + k,
                           group->bases[3] + k};
    Transpose(basis + k, rows);
  }
}

// Collects Gaussians into full groups, and passes on the remaining ones at the end.
template <typename Float, typename Body>
class Grouper {
 public:
  Grouper(const CpuModel& model, const float* center, const Body& body)
      : model_(model), center_(center), body_(body) {}
  ~Grouper() { Flush(); }
  Grouper(const Grouper&) = delete;
  Grouper& operator=(const Grouper&) = delete;

  void Add(int64_t gaussian, int64_t entry, Float* block) {
    means_[group_.count] = &model_.means[size_t(gaussian) * 3];
    group_.blocks[group_.count] = block;
    group_.entries[group_.count] = entry;
    if (++group_.count == group_.kSize) Flush();
  }

 private:
  void Flush() {
    if (group_.count == 0) return;
    FindBases(model_.sh_degree(), means_, center_, &group_);
    body_(group_);
    group_.count = 0;
  }

  const CpuModel& model_;
  const float* center_;
  const Body& body_;
  const float* means_[ShGroup<Float>::kSize];
  ShGroup<Float> group_;
};

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

// body(group) for entries [0, count) with a slot, with their parts of `blocks`; missing(entry) for
// the others.
template <typename Params, typename Float, typename Body, typename Missing>
void ForEachGroup(const CpuModel& model, const Params& params, Float* blocks, int64_t block_size,
                  const Body& body, const Missing& missing) {
  constexpr int64_t kAhead = 8;
  ParallelRanges(params.count, kGrain, [&](int64_t begin, int64_t end) {
    Grouper<Float, Body> grouper(model, params.center, body);
    for (int64_t i = begin; i < end; ++i) {
      if (i + kAhead < end) PrefetchEntry(model, params, i + kAhead, blocks, block_size);
      const int64_t slot = SlotOf(params.rows, params.slots, i);
      if (slot < 0) {
        missing(i);
        continue;
      }
      grouper.Add(GaussianOf(params.rows, i), i, blocks + slot * block_size);
    }
  });
}

// The entry of each Gaussian, -1 for none, if most Gaussians have one. Blocks are then read in the
// order of memory, which takes a fifth of the time. Empty if few Gaussians have an entry, or one
// has several.
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

class CpuShOps : public ShOps {
 public:
  explicit CpuShOps(EditColorsKernel edit_colors) : edit_colors_(edit_colors) {}

 protected:
  void DoEvalSh(const Model& model, const EvalShParams& params) override;
  void DoEvalShTranspose(const Model& model, const EvalShTransposeParams& params) override;
  void DoAccumulateBlocks(const Model& model, const AccumulateBlocksParams& params) override;
  void DoEditSh(const EditShParams& params) override;

 private:
  EditColorsKernel edit_colors_;
  const ShKernels& kernels_ = NativeShKernels();
};

void CpuShOps::DoEvalSh(const Model& model, const EvalShParams& params) {
  const int k = model.num_sh_coeffs();
  const auto eval = [&](const ShGroup<const float>& group) {
    kernels_.eval(group, k, params.colors, params.stride);
  };
  const std::vector<int32_t> entries = EntriesOf(model, params);
  if (entries.empty()) {
    ForEachGroup(CpuModelOf(model), params, params.sh, 3 * k, eval,
                 [&](int64_t i) { std::fill_n(params.colors + params.stride * i, 3, 0.0f); });
    return;
  }
  ParallelRanges(model.count(), kGrain, [&](int64_t begin, int64_t end) {
    Grouper<const float, decltype(eval)> grouper(CpuModelOf(model), params.center, eval);
    for (int64_t g = begin; g < end; ++g) {
      const int32_t entry = entries[size_t(g)];
      if (entry >= 0) grouper.Add(g, entry, params.sh + 3 * k * g);
    }
  });
}

void CpuShOps::DoEvalShTranspose(const Model& model, const EvalShTransposeParams& params) {
  const int k = model.num_sh_coeffs();
  ForEachGroup(
      CpuModelOf(model), params, params.gradient, 3 * k,
      [&](const ShGroup<float>& group) {
        kernels_.eval_transpose(group, k, params.color_gradients, params.colors);
      },
      [](int64_t) {});
}

void CpuShOps::DoAccumulateBlocks(const Model& model, const AccumulateBlocksParams& params) {
  const int k = model.num_sh_coeffs();
  ForEachGroup(
      CpuModelOf(model), params, params.blocks, k * (k + 1) / 2,
      [&](const ShGroup<float>& group) { kernels_.accumulate(group, k, params.weights); },
      [](int64_t) {});
}

// [directions, k] or [k, directions], or of three channels.
using Rows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

void EditAround(const EditShParams& params, EditColorsKernel edit_colors, float share, float* sh) {
  const Eigen::Map<const Rows> basis(params.basis, params.directions, params.k);
  const Eigen::Map<const Rows> fit(params.fit, params.k, params.directions);
  Rows colors = (basis * Eigen::Map<const Rows>(sh, params.k, 3)).array() + 0.5f;
  const Rows shown = colors.cwiseMax(0.0f);
  Rows edited = shown;
  edit_colors(params.map, nullptr, edited.data(), params.directions, edited.data());
  for (Eigen::Index i = 0; i < colors.size(); ++i) {
    float& color = colors.data()[i];
    color = ChangeToShow(share * (edited.data()[i] - shown.data()[i]), share, color);
  }
  const Rows change = fit * colors;
  for (Eigen::Index i = 0; i < change.size(); ++i) {
    if (change.data()[i] != 0) sh[i] += change.data()[i];
  }
}

void CpuShOps::DoEditSh(const EditShParams& params) {
  ParallelRanges(params.count, 256, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const float share = params.shares[i];
      if (!(share > params.threshold)) continue;
      float* const sh = params.sh + i * params.k * 3;
      if (params.map.program) {
        EditAround(params, edit_colors_, share, sh);
      } else {
        for (int k = 0; k < params.k; ++k) EditCoefficient(params.map, share, k, sh + 3 * k);
      }
    }
  });
}

}  // namespace

std::unique_ptr<ShOps> MakeCpuShOps(EditColorsKernel edit_colors) {
  return std::make_unique<CpuShOps>(edit_colors);
}

}  // namespace retint
