// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/common/sh.h"

#include "kernels/cuda/launch.cuh"
#include "kernels/cuda/ops.cuh"

namespace retint::cuda {
namespace {

// What an entry of the SH operations speaks of.
struct Entries {
  const int32_t* rows;
  const int32_t* slots;
  const float* means;
  float center[3];
  int degree, k;

  __device__ int64_t Gaussian(int64_t entry) const { return rows ? rows[entry] : entry; }
  __device__ int64_t Slot(int64_t entry) const { return slots ? slots[entry] : Gaussian(entry); }
  __device__ void Basis(int64_t entry, float* basis) const {
    ShBasisTowards(degree, means + 3 * Gaussian(entry), center, basis);
  }
};

template <typename Params>
Entries EntriesOf(const CudaModel& model, const Params& params) {
  Entries out{params.rows,        params.slots,
              model.means.data(), {params.center[0], params.center[1], params.center[2]},
              model.sh_degree(),  model.num_sh_coeffs()};
  return out;
}

// sum_k basis[k] * coefficients[k, :]; a block of degree 3 is read in 16-byte pieces.
__device__ float3 Contract(const float* basis, const float* coefficients, int k) {
  float sum[3] = {};
  if (k == kMaxShCoeffs) {
    const float4* from = reinterpret_cast<const float4*>(coefficients);
#pragma unroll
    for (int piece = 0; piece < 12; ++piece) {
      const float4 v = from[piece];
      const float values[4] = {v.x, v.y, v.z, v.w};
#pragma unroll
      for (int i = 0; i < 4; ++i)
        sum[(4 * piece + i) % 3] += basis[(4 * piece + i) / 3] * values[i];
    }
  } else {
    for (int i = 0; i < k; ++i) {
      for (int c = 0; c < 3; ++c) sum[c] += basis[i] * coefficients[3 * i + c];
    }
  }
  return {sum[0], sum[1], sum[2]};
}

}  // namespace

void EvalSh(const CudaModel& model, const EvalShParams& params, cudaStream_t stream) {
  const Entries entries = EntriesOf(model, params);
  ForEach(params.count, stream, "EvalSh", [=] __device__(int64_t i) {
    const int64_t slot = entries.Slot(i);
    float* color = params.colors + params.stride * i;
    if (slot < 0) {
      color[0] = color[1] = color[2] = 0;
      return;
    }
    float basis[kMaxShCoeffs];
    entries.Basis(i, basis);
    const float3 sum = Contract(basis, params.sh + slot * 3 * entries.k, entries.k);
    color[0] = fmaxf(0.0f, sum.x + 0.5f);
    color[1] = fmaxf(0.0f, sum.y + 0.5f);
    color[2] = fmaxf(0.0f, sum.z + 0.5f);
  });
}

void EvalShTranspose(const CudaModel& model, const EvalShTransposeParams& params,
                     cudaStream_t stream) {
  const Entries entries = EntriesOf(model, params);
  ForEach(params.count, stream, "EvalShTranspose", [=] __device__(int64_t i) {
    const int64_t slot = entries.Slot(i);
    if (slot < 0) return;
    float basis[kMaxShCoeffs];
    entries.Basis(i, basis);
    float g[3];
    for (int c = 0; c < 3; ++c) {
      const bool open = !params.colors || params.colors[3 * i + c] > 0;
      g[c] = open ? params.color_gradients[3 * i + c] : 0.0f;
    }
    float* out = params.gradient + slot * 3 * entries.k;
    for (int j = 0; j < entries.k; ++j) {
      for (int c = 0; c < 3; ++c) out[3 * j + c] += basis[j] * g[c];
    }
  });
}

void ShTangent(const CudaModel& model, const ShTangentParams& params, cudaStream_t stream) {
  const Entries entries = EntriesOf(model, params);
  ForEach(params.count, stream, "ShTangent", [=] __device__(int64_t i) {
    const int64_t slot = entries.Slot(i);
    float* out = params.tangents + 3 * i;
    float3 sum = {0, 0, 0};
    if (slot >= 0) {
      float basis[kMaxShCoeffs];
      entries.Basis(i, basis);
      sum = Contract(basis, params.direction + slot * 3 * entries.k, entries.k);
      if (params.colors) {
        if (!(params.colors[3 * i] > 0)) sum.x = 0;
        if (!(params.colors[3 * i + 1] > 0)) sum.y = 0;
        if (!(params.colors[3 * i + 2] > 0)) sum.z = 0;
      }
    }
    out[0] = sum.x, out[1] = sum.y, out[2] = sum.z;
  });
}

void AccumulateBlocks(const CudaModel& model, const AccumulateBlocksParams& params,
                      cudaStream_t stream) {
  const Entries entries = EntriesOf(model, params);
  ForEach(params.count, stream, "AccumulateBlocks", [=] __device__(int64_t i) {
    const int64_t slot = entries.Slot(i);
    if (slot < 0) return;
    float basis[kMaxShCoeffs];
    entries.Basis(i, basis);
    float* block = params.blocks + slot * (entries.k * (entries.k + 1) / 2);
    for (int row = 0; row < entries.k; ++row) {
      const float scaled = params.weights[i] * basis[row];
      for (int column = 0; column <= row; ++column) *block++ += scaled * basis[column];
    }
  });
}

}  // namespace retint::cuda
