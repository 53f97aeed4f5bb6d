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

void Check(cudaError_t code, const char* call) {
  if (code == cudaSuccess) return;
  cudaGetLastError();  // clears what is not sticky
  if (code == cudaErrorMemoryAllocation) {
    size_t free = 0, total = 0;
    cudaMemGetInfo(&free, &total);
    throw DeviceOutOfMemory(std::string(call) + ": out of device memory, " +
                            std::to_string(free >> 20) + " of " + std::to_string(total >> 20) +
                            " MiB free");
  }
  throw DeviceError(std::string(call) + ": " + cudaGetErrorString(code));
}

}  // namespace cuda
}  // namespace retint
