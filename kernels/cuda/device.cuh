// SPDX-License-Identifier: BSD-3-Clause
// Errors, memory and launches shared by the CUDA sources.
#pragma once

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>

#include <cuda_runtime.h>

namespace retint::cuda {

inline constexpr unsigned kFullWarp = 0xffffffffu;

#ifdef __CUDACC__
__device__ inline unsigned WarpSum(unsigned value) {
#if __CUDA_ARCH__ >= 800
  return __reduce_add_sync(kFullWarp, value);
#else
  for (int offset = 16; offset > 0; offset /= 2) value += __shfl_xor_sync(kFullWarp, value, offset);
  return value;
#endif
}
#endif

// Throws DeviceError("cudaCall: why"), or DeviceOutOfMemory for exhausted memory.
void Check(cudaError_t code, const char* call);

// Memory from the device's stream-ordered pool. If it fails, the pool returns its unused memory to
// the driver and the call is repeated. DeviceOutOfMemory has the requested and the free bytes.
void* TakeMemory(size_t bytes, cudaStream_t stream);

// Number of blocks of `threads` that cover `count`.
inline unsigned Blocks(int64_t count, int threads) {
  return static_cast<unsigned>((count + threads - 1) / threads);
}

inline unsigned BlocksUpTo(unsigned most, int64_t count, int threads) {
  const unsigned blocks = Blocks(count, threads);
  return blocks < most ? blocks : most;
}

// Memory of the pool, given back in stream order.
template <typename T>
class Scratch {
 public:
  Scratch() = default;
  Scratch(cudaStream_t stream, size_t count) : stream_(stream), count_(count) {
    data_ = static_cast<T*>(TakeMemory((count ? count : 1) * sizeof(T), stream));
  }
  Scratch(Scratch&& other) noexcept { *this = static_cast<Scratch&&>(other); }
  Scratch& operator=(Scratch&& other) noexcept {
    if (this == &other) return *this;
    Release();
    stream_ = other.stream_, count_ = other.count_, data_ = other.data_;
    other.data_ = nullptr, other.count_ = 0;
    return *this;
  }
  ~Scratch() { Release(); }
  T* data() const { return data_; }
  size_t size() const { return count_; }
  size_t bytes() const { return count_ * sizeof(T); }

 private:
  void Release() {
    if (data_) cudaFreeAsync(data_, stream_);
    data_ = nullptr;
  }
  cudaStream_t stream_ = nullptr;
  size_t count_ = 0;
  T* data_ = nullptr;
};

}  // namespace retint::cuda
