// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/cuda/device.cuh"

#include <string>
#include <string_view>

#include "kernels/cuda/cuda_backend.h"

namespace retint {

DeviceOutOfMemory::DeviceOutOfMemory(std::string message) : message_(std::move(message)) {}

namespace {

// Any kernel: has the program code for the device?
__global__ void Probe() {}

}  // namespace

bool CudaAvailable(std::string* reason) {
  const auto no = [&](std::string_view why) {
    cudaGetLastError();  // so that later calls do not see this error
    if (reason) *reason = why;
    return false;
  };
  // A machine without any driver is told as "driver too old" by the runtime, with version 0.
  int driver = 0, devices = 0;
  if (cudaDriverGetVersion(&driver) != cudaSuccess || driver == 0) return no(kCudaNoDevice);
  const cudaError_t code = cudaGetDeviceCount(&devices);
  if (code == cudaErrorNoDevice || (code == cudaSuccess && devices == 0)) return no(kCudaNoDevice);
  if (code != cudaSuccess) return no(cudaGetErrorString(code));
  cudaDeviceProp properties{};
  if (cudaGetDeviceProperties(&properties, 0) != cudaSuccess) {
    return no("the device does not answer");
  }
  cudaFuncAttributes attributes{};
  const cudaError_t probed = cudaFuncGetAttributes(&attributes, Probe);
  if (probed == cudaErrorNoKernelImageForDevice || probed == cudaErrorInvalidDeviceFunction) {
    const std::string generation =
        std::to_string(properties.major) + "." + std::to_string(properties.minor);
    return no("the program was built for other GPUs than " + std::string(properties.name) +
              ", whose compute capability is " + generation);
  }
  if (probed != cudaSuccess) return no(cudaGetErrorString(probed));
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
  cudaGetLastError();  // clears errors that are not sticky
  if (code == cudaErrorMemoryAllocation) {
    throw DeviceOutOfMemory(std::string(call) + ": out of device memory");
  }
  throw DeviceError(std::string(call) + ": " + cudaGetErrorString(code));
}

}  // namespace cuda
}  // namespace retint
