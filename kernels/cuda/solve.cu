// SPDX-License-Identifier: BSD-3-Clause
// Adam, the vector algebra of the solvers, and the 16x16 blocks: half a warp a block, a row a lane.
#include <cmath>
#include <mutex>
#include <type_traits>

#include "kernels/common/sh.h"
#include "kernels/cuda/groups.cuh"
#include "kernels/cuda/launch.cuh"
#include "kernels/cuda/scan.cuh"

namespace retint::cuda {
namespace {

constexpr int kLanes = 16;  // a block of the matrix
constexpr int kThreads = 128;
constexpr int kSumThreads = 256;

template <int K>
__device__ void LoadRow(const float* packed, int lane, float* row) {
#pragma unroll
  for (int j = 0; j < K; ++j) {
    row[j] = lane < K && j <= lane ? packed[lane * (lane + 1) / 2 + j] : 0.0f;
  }
}

// In place L of A = L L^T, with 1 / L_ii on the diagonal; all zero where A is not positive
// definite.
template <int K>
__global__ void __launch_bounds__(kThreads) FactorKernel(FactorBlocksParams params) {
  const int lane = threadIdx.x % kLanes;
  const int64_t block = (int64_t(blockIdx.x) * kThreads + threadIdx.x) / kLanes;
  const bool live = block < params.count;
  float* packed = params.blocks + (live ? block : 0) * (K * (K + 1) / 2);
  float row[K];
  LoadRow<K>(packed, live ? lane : K, row);
  bool positive = true;
#pragma unroll
  for (int j = 0; j < K; ++j) {
    const float pivot = __shfl_sync(kFullWarp, row[j], j, kLanes);
    positive = positive && pivot > 0 && isfinite(pivot);
    const float inverse = positive ? rsqrtf(pivot) : 0.0f;
    // One Newton step: rsqrtf is good to 2 ulp only.
    const float refined = positive ? inverse * (1.5f - 0.5f * pivot * inverse * inverse) : 0.0f;
    row[j] = lane == j ? refined : row[j] * refined;
#pragma unroll
    for (int l = j + 1; l < K; ++l) {
      const float other = __shfl_sync(kFullWarp, row[j], l, kLanes);
      if (lane >= l) row[l] -= row[j] * other;
    }
  }
  if (!live || lane >= K) return;
#pragma unroll
  for (int j = 0; j < K; ++j) {
    if (j <= lane) packed[lane * (lane + 1) / 2 + j] = positive ? row[j] : 0.0f;
  }
}

template <int K>
__global__ void __launch_bounds__(kThreads) SolveKernel(SolveBlocksParams params) {
  const int lane = threadIdx.x % kLanes;
  const int64_t block = (int64_t(blockIdx.x) * kThreads + threadIdx.x) / kLanes;
  const bool live = block < params.count;
  const int64_t at = ((live ? block : 0) * K + (lane < K ? lane : 0)) * 3;
  float row[K];
  LoadRow<K>(params.factors + (live ? block : 0) * (K * (K + 1) / 2), live ? lane : K, row);
  float x[3];
#pragma unroll
  for (int c = 0; c < 3; ++c) x[c] = live && lane < K ? params.rhs[at + c] : 0.0f;
#pragma unroll
  for (int j = 0; j < K; ++j) {  // L z = b
#pragma unroll
    for (int c = 0; c < 3; ++c) {
      if (lane == j) x[c] *= row[j];
      const float z = __shfl_sync(kFullWarp, x[c], j, kLanes);
      if (lane > j) x[c] -= row[j] * z;
    }
  }
#pragma unroll
  for (int j = K - 1; j >= 0; --j) {  // L^T x = z: row j of L is column j of L^T
#pragma unroll
    for (int c = 0; c < 3; ++c) {
      if (lane == j) x[c] *= row[j];
    }
#pragma unroll
    for (int i = 0; i < j; ++i) {
      const float l = __shfl_sync(kFullWarp, row[i], j, kLanes);
#pragma unroll
      for (int c = 0; c < 3; ++c) {
        const float solved = __shfl_sync(kFullWarp, x[c], j, kLanes);
        if (lane == i) x[c] -= l * solved;
      }
    }
  }
  if (!live || lane >= K) return;
#pragma unroll
  for (int c = 0; c < 3; ++c) params.solution[at + c] = x[c];
}

// function(std::integral_constant<int, K>) for the run-time block size.
template <typename Function>
void WithBlockSize(int k, const Function& function) {
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

__global__ void DotKernel(const float* x, const float* y, int64_t count, BlockSums sums,
                          double* total) {
  double sum = 0;
  for (int64_t i = int64_t(blockIdx.x) * blockDim.x + threadIdx.x; i < count;
       i += int64_t(gridDim.x) * blockDim.x) {
    sum += double(x[i]) * double(y[i]);
  }
  sums.AddTo(total, sum);
}

__global__ void RidgeTermKernel(RidgeTermParams params, int64_t count, BlockSums sums,
                                double* total) {
  double sum = 0;
  for (int64_t i = int64_t(blockIdx.x) * blockDim.x + threadIdx.x; i < count;
       i += int64_t(gridDim.x) * blockDim.x) {
    const int64_t coefficient = i / 3, block = coefficient / params.k;
    const float factor = params.ridge[coefficient % params.k] * params.weights[block];
    const float away = params.x[i] - params.center[i];
    if (params.descent) params.descent[i] -= factor * away;
    sum += double(factor * away) * double(away);
  }
  sums.AddTo(total, sum);
}

class CudaSolveOps : public SolveOps {
 public:
  explicit CudaSolveOps(cudaStream_t stream) : stream_(stream) {}
  void DoAddRidge(const AddRidgeParams& params) override;
  void DoFactorBlocks(const FactorBlocksParams& params) override;
  void DoSolveBlocks(const SolveBlocksParams& params) override;
  double DoRidgeTerm(const RidgeTermParams& params) override;
  void DoLinearCombination(const LinearCombinationParams& params) override;
  double DoDot(const float* x, const float* y, int64_t count) override;
  void DoAdam(const AdamParams& params) override;

 private:
  // The sum that the kernel started by launch(blocks, sums, total) over `count` values adds to
  // *total.
  template <typename Launch>
  double Sum(int64_t count, const char* name, const Launch& launch);

  cudaStream_t stream_;
  std::mutex mutex_;  // of sums_
  BlockSumsMemory sums_;
};

void CudaSolveOps::DoAddRidge(const AddRidgeParams& params) {
  ForEach(params.count, stream_, "AddRidge", [=] __device__(int64_t b) {
    float* block = params.blocks + b * (params.k * (params.k + 1) / 2);
    const float weight = block[0] / (kShC0 * kShC0);
    params.weights[b] = weight;
    for (int i = 0; i < params.k; ++i) block[i * (i + 1) / 2 + i] += params.ridge[i] * weight;
  });
}

void CudaSolveOps::DoFactorBlocks(const FactorBlocksParams& params) {
  WithBlockSize(params.k, [&](auto k) {
    if (params.count <= 0) return;
    FactorKernel<k()><<<Blocks(params.count * kLanes, kThreads), kThreads, 0, stream_>>>(params);
    Check(cudaGetLastError(), "FactorBlocks");
  });
}

void CudaSolveOps::DoSolveBlocks(const SolveBlocksParams& params) {
  WithBlockSize(params.k, [&](auto k) {
    if (params.count <= 0) return;
    SolveKernel<k()><<<Blocks(params.count * kLanes, kThreads), kThreads, 0, stream_>>>(params);
    Check(cudaGetLastError(), "SolveBlocks");
  });
}

double CudaSolveOps::DoRidgeTerm(const RidgeTermParams& params) {
  const int64_t count = params.count * params.k * 3;
  return Sum(count, "RidgeTerm", [&](unsigned blocks, BlockSums sums, double* total) {
    RidgeTermKernel<<<blocks, kSumThreads, 0, stream_>>>(params, count, sums, total);
  });
}

void CudaSolveOps::DoLinearCombination(const LinearCombinationParams& params) {
  ForEach(params.count, stream_, "LinearCombination", [=] __device__(int64_t i) {
    params.out[i] = params.a * params.x[i] + params.b * params.y[i];
  });
}

double CudaSolveOps::DoDot(const float* x, const float* y, int64_t count) {
  return Sum(count, "Dot", [&](unsigned blocks, BlockSums sums, double* total) {
    DotKernel<<<blocks, kSumThreads, 0, stream_>>>(x, y, count, sums, total);
  });
}

template <typename Launch>
double CudaSolveOps::Sum(int64_t count, const char* name, const Launch& launch) {
  Scratch<double> sum(stream_, 1);
  Check(cudaMemsetAsync(sum.data(), 0, sum.bytes(), stream_), "cudaMemsetAsync");
  if (count > 0) {
    const std::lock_guard lock(mutex_);
    const unsigned blocks = BlocksUpTo(1024, count, kSumThreads);
    launch(blocks, sums_.Take(blocks, stream_), sum.data());
    Check(cudaGetLastError(), name);
  }
  return std::get<0>(ReadBack(stream_, sum.data()));
}

void CudaSolveOps::DoAdam(const AdamParams& params) {
  const double correction1 = 1 - std::pow(double(params.beta1), double(params.step));
  const double correction2 = 1 - std::pow(double(params.beta2), double(params.step));
  const float rate = float(params.learning_rate / correction1);
  const float root = float(1 / std::sqrt(correction2));
  ForEach(params.count, stream_, "Adam", [=] __device__(int64_t i) {
    const float g = params.gradients[i];
    const float m = params.beta1 * params.m[i] + (1 - params.beta1) * g;
    const float v = params.beta2 * params.v[i] + (1 - params.beta2) * g * g;
    params.m[i] = m;
    params.v[i] = v;
    params.values[i] -= rate * m / (sqrtf(v) * root + params.epsilon);
  });
}

}  // namespace

std::unique_ptr<SolveOps> MakeSolveOps(cudaStream_t stream) {
  return std::make_unique<CudaSolveOps>(stream);
}

}  // namespace retint::cuda
