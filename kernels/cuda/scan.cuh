// SPDX-License-Identifier: BSD-3-Clause
// CUB's device-wide algorithms with their temporary memory, and small results brought to the host.
#pragma once

#include <atomic>
#include <cstring>
#include <memory>
#include <tuple>

#include <thrust/iterator/counting_iterator.h>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#include <cub/device/device_select.cuh>

#include "kernels/cuda/device.cuh"

namespace retint::cuda {

// Runs a CUB algorithm with its temporary memory.
template <typename Call>
void WithTemporary(cudaStream_t stream, const char* name, const Call& call) {
  size_t bytes = 0;
  Check(call(nullptr, bytes), name);
  Scratch<char> memory(stream, bytes);
  Check(call(memory.data(), bytes), name);
}

// 64 bytes of this thread's page-locked host memory, so that a copy does not wait in the driver.
inline char* PinnedWords() {
  struct Free {
    void operator()(char* words) const { cudaFreeHost(words); }
  };
  thread_local std::unique_ptr<char, Free> words;
  if (!words) {
    void* data = nullptr;
    Check(cudaHostAlloc(&data, 64, cudaHostAllocDefault), "cudaHostAlloc");
    words.reset(static_cast<char*>(data));
  }
  return words.get();
}

// A value that a kernel writes to the host while later work is queued; one member, 0 at first, says
// when it is there. One at a time a thread.
template <typename T>
class HostWords {
 public:
  HostWords() {
    static_assert(sizeof(T) <= 64);
    std::memset(PinnedWords(), 0, sizeof(T));
  }
  T* device() const { return reinterpret_cast<T*>(PinnedWords()); }
  // The kernel sets `done` last, after a system-wide fence.
  template <typename Flag>
  T Wait(cudaStream_t stream, Flag T::*done) const {
    constexpr int kLooks = 4096;  // before the stream is asked whether it failed
    const volatile Flag& flag = device()->*done;
    for (int look = 1; !flag; ++look) {
      if (look % kLooks) continue;
      const cudaError_t state = cudaStreamQuery(stream);
      if (state != cudaErrorNotReady) Check(state, "cudaStreamQuery");
    }
    std::atomic_thread_fence(std::memory_order_acquire);
    return *device();
  }
};

// A few values of the device, at the price of one wait.
template <typename... T>
std::tuple<T...> ReadBack(cudaStream_t stream, const T*... device) {
  static_assert((sizeof(T) + ...) <= 64);
  char* const words = PinnedWords();
  size_t at = 0;
  const auto start = [&](const void* from, size_t bytes) {
    Check(cudaMemcpyAsync(words + at, from, bytes, cudaMemcpyDeviceToHost, stream),
          "cudaMemcpyAsync");
    at += bytes;
  };
  (start(device, sizeof(T)), ...);
  Check(cudaStreamSynchronize(stream), "cudaStreamSynchronize");
  std::tuple<T...> values;
  at = 0;
  const auto fetch = [&](auto& value) {
    std::memcpy(&value, words + at, sizeof(value));
    at += sizeof(value);
  };
  std::apply([&](auto&... value) { (fetch(value), ...); }, values);
  return values;
}

// Indices of the set flags, ascending, into `indices`; how many there are into *selected.
template <typename Flag, typename Count>
void SelectIndices(int64_t count, const Flag* flags, int32_t* indices, Count* selected,
                   cudaStream_t stream) {
  WithTemporary(stream, "cub::DeviceSelect", [&](void* memory, size_t& bytes) {
    return cub::DeviceSelect::Flagged(memory, bytes, thrust::counting_iterator<int32_t>(0), flags,
                                      indices, selected, count, stream);
  });
}

template <typename T>
void InclusiveSum(int64_t count, const T* from, T* to, cudaStream_t stream) {
  WithTemporary(stream, "cub::DeviceScan", [&](void* memory, size_t& bytes) {
    return cub::DeviceScan::InclusiveSum(memory, bytes, from, to, count, stream);
  });
}

inline int BitsOf(uint32_t largest) {
  int bits = 1;
  while (largest >> bits) ++bits;
  return bits;
}

}  // namespace retint::cuda
