// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/common/sh.h"
#include "kernels/common/sh_edit.h"

#include <type_traits>

#include "kernels/cuda/geometry.cuh"
#include "kernels/cuda/groups.cuh"
#include "kernels/cuda/launch.cuh"

namespace retint::cuda {
namespace {

// Maps an entry of the SH operations to its Gaussian and slot.
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
Entries EntriesOf(const Model& model, const Params& params) {
  Entries out{params.rows,
              params.slots,
              Own(model).means.data(),
              {params.center[0], params.center[1], params.center[2]},
              model.sh_degree(),
              model.num_sh_coeffs()};
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

// The kernels that add to blocks of coefficients: a thread an entry for its basis, then all threads
// over the blocks, so that memory is passed over in its order.
constexpr int kBatch = 128;

template <int K>
struct Prepared {
  float basis[kBatch][K + 1];  // odd or even, the rows of 32 threads start in different banks
  float value[kBatch][3];
  int64_t slot[kBatch];
};

// block[slot] += term(entry in the batch, element) for `kElements` elements of every live entry.
template <int kElements, typename Term>
__device__ void AddToBlocks(const int64_t* slots, int entries, float* blocks, const Term& term) {
  constexpr int kWide = kElements % 4 == 0 ? 4 : 1, kPieces = kElements / kWide;
  for (int i = threadIdx.x; i < entries * kPieces; i += kBatch) {
    const int entry = i / kPieces, piece = i % kPieces;
    if (slots[entry] < 0) continue;
    float* const to = blocks + slots[entry] * kElements + kWide * piece;
    if constexpr (kWide == 4) {
      float4 value = *reinterpret_cast<float4*>(to);
      value.x += term(entry, 4 * piece);
      value.y += term(entry, 4 * piece + 1);
      value.z += term(entry, 4 * piece + 2);
      value.w += term(entry, 4 * piece + 3);
      *reinterpret_cast<float4*>(to) = value;
    } else {
      *to += term(entry, piece);
    }
  }
}

// Fills the batch of this block; returns how many entries it has.
template <int K>
__device__ int PrepareBatch(const Entries& entries, int64_t count, Prepared<K>* batch) {
  const int64_t first = int64_t(blockIdx.x) * kBatch, entry = first + threadIdx.x;
  if (entry < count) {
    batch->slot[threadIdx.x] = entries.Slot(entry);
    float basis[kMaxShCoeffs];
    entries.Basis(entry, basis);
#pragma unroll
    for (int k = 0; k < K; ++k) batch->basis[threadIdx.x][k] = basis[k];
  }
  return int(count - first < kBatch ? count - first : kBatch);
}

template <int K>
__global__ void __launch_bounds__(kBatch)
    TransposeKernel(Entries entries, EvalShTransposeParams params) {
  __shared__ Prepared<K> batch;
  const int live = PrepareBatch<K>(entries, params.count, &batch);
  const int64_t first = int64_t(blockIdx.x) * kBatch * 3;
  for (int i = threadIdx.x; i < 3 * live; i += kBatch) {
    const bool open = !params.colors || params.colors[first + i] > 0;
    batch.value[i / 3][i % 3] = open ? params.color_gradients[first + i] : 0.0f;
  }
  __syncthreads();
  AddToBlocks<3 * K>(batch.slot, live, params.gradient, [&](int entry, int element) {
    return batch.basis[entry][element / 3] * batch.value[entry][element % 3];
  });
}

template <int K>
__global__ void __launch_bounds__(kBatch)
    BlocksKernel(Entries entries, AccumulateBlocksParams params) {
  __shared__ Prepared<K> batch;
  const int live = PrepareBatch<K>(entries, params.count, &batch);
  const int64_t entry_of_thread = int64_t(blockIdx.x) * kBatch + threadIdx.x;
  if (entry_of_thread < params.count) {
    batch.value[threadIdx.x][0] = params.weights[entry_of_thread];
  }
  __syncthreads();
  AddToBlocks<K*(K + 1) / 2>(batch.slot, live, params.blocks, [&](int entry, int element) {
    int row = int((sqrtf(8.0f * float(element) + 1) - 1) * 0.5f);
    if ((row + 1) * (row + 2) / 2 <= element) ++row;
    const int column = element - row * (row + 1) / 2;
    return batch.value[entry][0] * batch.basis[entry][row] * batch.basis[entry][column];
  });
}

// function(std::integral_constant<int, K>) for the run-time number of coefficients.
template <typename Function>
void WithCoefficients(int k, const Function& function) {
  switch (k) {
    case 1:
      return function(std::integral_constant<int, 1>());
    case 4:
      return function(std::integral_constant<int, 4>());
    case 9:
      return function(std::integral_constant<int, 9>());
    default:
      return function(std::integral_constant<int, 16>());
  }
}

// A warp a Gaussian: its lanes share the directions, then the coefficients.
constexpr int kEditWarps = 4;

__global__ void __launch_bounds__(32 * kEditWarps) EditAroundKernel(EditShParams params) {
  __shared__ float changes[kEditWarps][3 * kMaxEditDirections];
  const int warp = threadIdx.x / 32, lane = threadIdx.x % 32;
  const int64_t i = int64_t(blockIdx.x) * kEditWarps + warp;
  if (i >= params.count) return;
  const float share = params.shares[i];
  if (!(share > params.threshold)) return;
  float* const sh = params.sh + i * params.k * 3;
  float* const change = changes[warp];
  for (int d = lane; d < params.directions; d += 32) {
    const float3 sum = Contract(params.basis + d * params.k, sh, params.k);
    const float color[3] = {sum.x + 0.5f, sum.y + 0.5f, sum.z + 0.5f};
    const float shown[3] = {fmaxf(0.0f, color[0]), fmaxf(0.0f, color[1]), fmaxf(0.0f, color[2])};
    float edited[3];
    ApplyColorMap(params.map, 1.0f, shown, edited);
    for (int c = 0; c < 3; ++c) {
      change[3 * d + c] = ChangeToShow(share * (edited[c] - shown[c]), share, color[c]);
    }
  }
  __syncwarp();
  for (int j = lane; j < 3 * params.k; j += 32) {
    const float* fit = params.fit + j / 3 * params.directions;
    float sum = 0;
    for (int d = 0; d < params.directions; ++d) sum += fit[d] * change[3 * d + j % 3];
    if (sum != 0) sh[j] += sum;
  }
}

class CudaShOps : public ShOps {
 public:
  explicit CudaShOps(cudaStream_t stream) : stream_(stream) {}
  void DoEvalSh(const Model& model, const EvalShParams& params) override;
  void DoEvalShTranspose(const Model& model, const EvalShTransposeParams& params) override;
  void DoAccumulateBlocks(const Model& model, const AccumulateBlocksParams& params) override;
  void DoEditSh(const EditShParams& params) override;

 private:
  cudaStream_t stream_;
};

void CudaShOps::DoEvalSh(const Model& model, const EvalShParams& params) {
  const Entries entries = EntriesOf(model, params);
  ForEach(params.count, stream_, "EvalSh", [=] __device__(int64_t i) {
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

void CudaShOps::DoEvalShTranspose(const Model& model, const EvalShTransposeParams& params) {
  if (params.count <= 0) return;
  const Entries entries = EntriesOf(model, params);
  WithCoefficients(entries.k, [&](auto k) {
    TransposeKernel<k()><<<Blocks(params.count, kBatch), kBatch, 0, stream_>>>(entries, params);
    Check(cudaGetLastError(), "EvalShTranspose");
  });
}

void CudaShOps::DoAccumulateBlocks(const Model& model, const AccumulateBlocksParams& params) {
  if (params.count <= 0) return;
  const Entries entries = EntriesOf(model, params);
  WithCoefficients(entries.k, [&](auto k) {
    BlocksKernel<k()><<<Blocks(params.count, kBatch), kBatch, 0, stream_>>>(entries, params);
    Check(cudaGetLastError(), "AccumulateBlocks");
  });
}

void CudaShOps::DoEditSh(const EditShParams& params) {
  if (params.count <= 0) return;
  if (params.map.program) {
    EditAroundKernel<<<Blocks(params.count, kEditWarps), 32 * kEditWarps, 0, stream_>>>(params);
    Check(cudaGetLastError(), "EditSh");
    return;
  }
  ForEach(params.count * params.k, stream_, "EditSh", [=] __device__(int64_t i) {
    const float share = params.shares[i / params.k];
    if (share > params.threshold) {
      EditCoefficient(params.map, share, int(i % params.k), params.sh + 3 * i);
    }
  });
}

}  // namespace

std::unique_ptr<ShOps> MakeShOps(cudaStream_t stream) {
  return std::make_unique<CudaShOps>(stream);
}

}  // namespace retint::cuda
