// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/cuda/cuda_backend.h"

#include <stdexcept>
#include <utility>

#include "kernels/cuda/device.cuh"
#include "kernels/cuda/groups.cuh"
#include "kernels/cuda/staged_copy.cuh"

namespace retint {
namespace cuda {
namespace {

// Freed in stream order, so that work in flight still has it.
class PoolMemory : public DeviceMemory {
 public:
  PoolMemory(cudaStream_t stream, size_t bytes) : DeviceMemory(nullptr, bytes), stream_(stream) {
    if (bytes == 0) return;
    data_ = TakeMemory(bytes, stream);
    Check(cudaMemsetAsync(data_, 0, bytes, stream), "cudaMemsetAsync");
  }
  ~PoolMemory() override {
    if (data_) cudaFreeAsync(data_, stream_);
  }

 private:
  cudaStream_t stream_;
};

class CudaBackend : public Backend {
 public:
  CudaBackend() {
    std::string reason;
    if (!CudaAvailable(&reason)) throw std::invalid_argument("backend \"cuda\": " + reason);
    Check(cudaGetDevice(&device_), "cudaGetDevice");
    Check(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "cudaStreamCreate");
    // Memory given back stays in the pool: allocation is then free of calls to the driver.
    Check(cudaDeviceGetDefaultMemPool(&pool_, device_), "cudaDeviceGetDefaultMemPool");
    uint64_t keep = UINT64_MAX;
    Check(cudaMemPoolSetAttribute(pool_, cudaMemPoolAttrReleaseThreshold, &keep),
          "cudaMemPoolSetAttribute");
    staged_ = std::make_unique<StagedCopy>(stream_);
    auto blend = MakeBlendOps(stream_);
    sh_ = MakeShOps(stream_);
    solve_ = MakeSolveOps(stream_);
    refit_ = MakeRefitOps(stream_, *blend);
    blend_ = std::move(blend);
    mask_ = MakeMaskOps(stream_);
    stereo_ = MakeStereoOps(stream_);
    neighbors_ = MakeNeighborOps(stream_);
    graph_ = MakeGraphOps(stream_);
  }
  ~CudaBackend() override {
    // Their memory is given back on the stream.
    blend_.reset(), sh_.reset(), solve_.reset(), refit_.reset();
    mask_.reset(), stereo_.reset(), neighbors_.reset(), graph_.reset();
    staged_.reset();
    cudaStreamDestroy(stream_);
  }
  CudaBackend(const CudaBackend&) = delete;
  CudaBackend& operator=(const CudaBackend&) = delete;

  std::string_view Name() const override { return "cuda"; }
  std::string Description() const override {
    cudaDeviceProp properties{};
    Check(cudaGetDeviceProperties(&properties, device_), "cudaGetDeviceProperties");
    return std::string(properties.name) + ", " + std::to_string(properties.totalGlobalMem >> 20) +
           " MiB";
  }

  std::string Identity() const override {
    cudaDeviceProp properties{};
    Check(cudaGetDeviceProperties(&properties, device_), "cudaGetDeviceProperties");
    constexpr char kDigits[] = "0123456789abcdef";
    std::string identity;
    for (const char byte : properties.uuid.bytes) {
      identity += kDigits[static_cast<unsigned char>(byte) / 16];
      identity += kDigits[static_cast<unsigned char>(byte) % 16];
    }
    return identity;
  }
  void* Stream() const override { return stream_; }
  std::shared_ptr<void> LockPages(void* data, size_t bytes) override {
    if (bytes == 0) return nullptr;
    if (cudaHostRegister(data, bytes, cudaHostRegisterPortable) != cudaSuccess) {
      cudaGetLastError();  // a copy works without it as well
      return nullptr;
    }
    return {data, [](void* locked) { cudaHostUnregister(locked); }};
  }

  std::shared_ptr<DeviceMemory> AllocateBytes(size_t bytes) override {
    return std::make_shared<PoolMemory>(stream_, bytes);
  }
  void CopyToDevice(void* device, const void* host, size_t bytes) override {
    if (bytes == 0) return;
    if (StagedCopy::Pays(host, bytes)) return staged_->ToDevice(device, host, bytes);
    Check(cudaMemcpyAsync(device, host, bytes, cudaMemcpyHostToDevice, stream_), "cudaMemcpyAsync");
  }
  void CopyToHost(void* host, const void* device, size_t bytes) override {
    if (bytes == 0) return;
    if (StagedCopy::Pays(host, bytes)) return staged_->ToHost(host, device, bytes);
    Check(cudaMemcpyAsync(host, device, bytes, cudaMemcpyDeviceToHost, stream_), "cudaMemcpyAsync");
    Synchronize();
  }
  std::unique_ptr<Arrival> SendToHost(const void* device, size_t bytes) override {
    std::unique_ptr<Arrival> sent = bytes > 0 ? staged_->Send(device, bytes) : nullptr;
    return sent ? std::move(sent) : Backend::SendToHost(device, bytes);
  }
  void Fill(void* device, int byte, size_t bytes) override {
    if (bytes == 0) return;
    Check(cudaMemsetAsync(device, byte, bytes, stream_), "cudaMemsetAsync");
  }
  void Synchronize() override { Check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize"); }
  void ReleaseFreed() override {
    Synchronize();
    Check(cudaMemPoolTrimTo(pool_, 0), "cudaMemPoolTrimTo");
  }
  bool IsHost() const override { return false; }
  size_t PeakDeviceBytes() const override {
    uint64_t peak = 0;
    Check(cudaMemPoolGetAttribute(pool_, cudaMemPoolAttrUsedMemHigh, &peak),
          "cudaMemPoolGetAttribute");
    return size_t(peak);
  }
  size_t AvailableDeviceBytes() const override {
    size_t free = 0, total = 0;
    Check(cudaMemGetInfo(&free, &total), "cudaMemGetInfo");
    uint64_t held = 0;
    Check(cudaMemPoolGetAttribute(pool_, cudaMemPoolAttrReservedMemCurrent, &held),
          "cudaMemPoolGetAttribute");
    return free + size_t(held);
  }

 private:
  int device_ = 0;
  cudaStream_t stream_ = nullptr;
  cudaMemPool_t pool_ = nullptr;
  std::unique_ptr<StagedCopy> staged_;
};

}  // namespace
}  // namespace cuda

std::shared_ptr<Backend> CreateCudaBackend() { return std::make_shared<cuda::CudaBackend>(); }

}  // namespace retint
