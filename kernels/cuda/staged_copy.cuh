// SPDX-License-Identifier: BSD-3-Clause
// Large copies between a device and ordinary host memory, whose pages may move: CUDA copies such
// memory through a buffer of its own with a single thread. Here all threads fill and empty two
// buffers, one of which is on its way while the other is worked on. Smaller copies to the host may
// lie in them as long as somebody reads them.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>

#include <cuda_runtime.h>

#include "kernels/device.h"

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
  // Queues a copy into free space of the buffers. Null if it does not fit, or if there are no
  // buffers yet, because allocating them costs too much. The StagedCopy must outlive the result.
  std::unique_ptr<Arrival> Send(const void* device, size_t bytes);

 private:
  class Sent;

  static constexpr size_t kBuffers = 2, kBufferBytes = size_t{32} << 20;

  // False: no page-locked memory is to be had, or some is lent to arrivals, and CUDA copies alone.
  bool TakeBuffers();

  cudaStream_t stream_;
  std::mutex mutex_;
  void* buffers_[kBuffers] = {};
  cudaEvent_t arrived_[kBuffers] = {};  // the last copy queued on the buffer, except arrivals
  int lent_[kBuffers] = {};             // arrivals that have a part of it
  size_t lent_bytes_[kBuffers] = {};    // from its beginning; part of it may be free again
};

}  // namespace retint::cuda
