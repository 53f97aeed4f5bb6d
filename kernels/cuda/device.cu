// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/cuda/device.cuh"

#include <string>

#include "kernels/cuda/cuda_backend.h"

namespace retint {

DeviceOutOfMemory::DeviceOutOfMemory(std::string message) : message_(std::move(message)) {}

bool CudaAvailable(std::string* reason) {
  const auto no = [&](const std::string& why) {
    if (reason) *reason = why;
    return false;
  };
  int devices = 0;
  const cudaError_t code = cudaGetDeviceCount(&devices);
  if (code != cudaSuccess) return no(cudaGetErrorString(code));
  if (devices == 0) return no("no CUDA device");
  cudaDeviceProp properties{};
  if (cudaGetDeviceProperties(&properties, 0) != cudaSuccess)
    return no("the device does not answer");
  if (properties.major * 10 + properties.minor < 75) {
    return no(std::string(properties.name) + " is older than compute capability 7.5");
  }
  return true;
}

namespace cuda {
namespace {

std::string Mebibytes(size_t bytes) { return std::to_string(bytes >> 20) + " MiB"; }

}  // namespace

void* TakeMemory(size_t bytes, cudaStream_t stream) {
  void* data = nullptr;
  cudaError_t code = cudaMallocAsync(&data, bytes, stream);
  if (code == cudaErrorMemoryAllocation) {
    cudaGetLastError();
    int device = 0;
    cudaMemPool_t pool = nullptr;
    Check(cudaGetDevice(&device), "cudaGetDevice");
    Check(cudaDeviceGetDefaultMemPool(&pool, device), "cudaDeviceGetDefaultMemPool");
    Check(cudaStreamSynchronize(stream), "cudaStreamSynchronize");
    Check(cudaMemPoolTrimTo(pool, 0), "cudaMemPoolTrimTo");
    code = cudaMallocAsync(&data, bytes, stream);
    if (code == cudaErrorMemoryAllocation) {
      cudaGetLastError();
      size_t free = 0, total = 0;
      cudaMemGetInfo(&free, &total);
      throw DeviceOutOfMemory("cudaMallocAsync: " + Mebibytes(bytes) +
                              " of device memory do not fit, " + Mebibytes(free) + " of " +
                              Mebibytes(total) + " are free");
    }
  }
  Check(code, "cudaMallocAsync");
  return data;
}

void Check(cudaError_t code, const char* call) {
  if (code == cudaSuccess) return;
  cudaGetLastError();  // clears what is not sticky
  if (code == cudaErrorMemoryAllocation) {
    throw DeviceOutOfMemory(std::string(call) + ": out of device memory");
  }
  throw DeviceError(std::string(call) + ": " + cudaGetErrorString(code));
}

}  // namespace cuda
}  // namespace retint
