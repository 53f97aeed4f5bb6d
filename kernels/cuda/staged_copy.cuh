// SPDX-License-Identifier: BSD-3-Clause
// Large copies between a device and ordinary host memory, whose pages may move: CUDA copies such
// memory through a buffer of its own with a single thread. Here all threads fill and empty two
// buffers, one of which is on its way while the other is worked on.
#pragma once

#include <cstddef>
#include <mutex>

#include <cuda_runtime.h>

namespace retint::cuda {

class StagedCopy {
 public:
  explicit StagedCopy(cudaStream_t stream) : stream_(stream) {}
  ~StagedCopy();
  StagedCopy(const StagedCopy&) = delete;
  StagedCopy& operator=(const StagedCopy&) = delete;

  // Whether a copy from or to `host` gains by it: it is large, and its pages may move.
  static bool Pays(const void* host, size_t bytes);
  // On return `host` may be written again; the device has the bytes in the order of the stream.
  void ToDevice(void* device, const void* host, size_t bytes);
  // On return `host` has the bytes.
  void ToHost(void* host, const void* device, size_t bytes);

 private:
  static constexpr size_t kBuffers = 2, kBufferBytes = size_t{32} << 20;

  bool TakeBuffers();  // false: there is no page-locked memory to be had, and CUDA copies alone

  cudaStream_t stream_;
  std::mutex mutex_;
  void* buffers_[kBuffers] = {};
  cudaEvent_t arrived_[kBuffers] = {};  // what was last queued on the buffer
};

}  // namespace retint::cuda
