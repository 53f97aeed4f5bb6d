// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/cuda/staged_copy.cuh"

#include <algorithm>
#include <cstdint>
#include <cstring>

#include <tbb/task_arena.h>

#include "base/parallel.h"
#include "kernels/cuda/device.cuh"

namespace retint::cuda {
namespace {

constexpr size_t kLeastBytes = size_t{8} << 20;

// The bytes copied at a time. Even a copy that fits in one buffer is cut into pieces, so that the
// device can start before the host is done.
size_t PieceOf(size_t bytes, size_t buffer_bytes) {
  constexpr size_t kLeast = size_t{4} << 20, kPieces = 4, kAlignment = 256;
  const size_t piece = std::max(kLeast, (bytes / kPieces / kAlignment + 1) * kAlignment);
  return std::min(piece, buffer_bytes);
}

// memcpy by all threads. Isolated: a thread that waits here holds the lock, and must not take up a
// task that copies too.
void CopyByAll(void* to, const void* from, size_t bytes) {
  constexpr int64_t kGrain = 1 << 20;
  tbb::this_task_arena::isolate([&] {
    ParallelRanges(int64_t(bytes), kGrain, [&](int64_t begin, int64_t end) {
      std::memcpy(static_cast<char*>(to) + begin, static_cast<const char*>(from) + begin,
                  size_t(end - begin));
    });
  });
}

}  // namespace

// A part of a buffer, and when the bytes are there.
class StagedCopy::Sent : public Arrival {
 public:
  Sent(StagedCopy* owner, size_t buffer, size_t at, size_t bytes)
      : owner_(owner),
        buffer_(buffer),
        at_(static_cast<char*>(owner->buffers_[buffer]) + at),
        bytes_(bytes) {}
  ~Sent() override {
    if (arrived_) {
      cudaEventSynchronize(arrived_);
      cudaEventDestroy(arrived_);
    }
    const std::lock_guard lock(owner_->mutex_);
    --owner_->lent_[buffer_];
  }

  void Start(const void* device) {
    Check(cudaEventCreateWithFlags(&arrived_, cudaEventDisableTiming), "cudaEventCreate");
    Check(cudaMemcpyAsync(at_, device, bytes_, cudaMemcpyDeviceToHost, owner_->stream_),
          "cudaMemcpyAsync");
    Check(cudaEventRecord(arrived_, owner_->stream_), "cudaEventRecord");
  }
  const void* Wait() override {
    Check(cudaEventSynchronize(arrived_), "cudaEventSynchronize");
    return at_;
  }

 private:
  StagedCopy* owner_;
  size_t buffer_;
  char* at_;
  size_t bytes_;
  cudaEvent_t arrived_ = nullptr;
};

StagedCopy::~StagedCopy() {
  for (size_t b = 0; b < kBuffers; ++b) {
    if (arrived_[b]) {
      cudaEventSynchronize(arrived_[b]);
      cudaEventDestroy(arrived_[b]);
    }
    if (buffers_[b]) cudaFreeHost(buffers_[b]);
  }
}

bool StagedCopy::Pays(const void* host, size_t bytes) {
  if (bytes < kLeastBytes) return false;
  cudaPointerAttributes attributes{};
  if (cudaPointerGetAttributes(&attributes, host) != cudaSuccess) {
    cudaGetLastError();
    return false;
  }
  return attributes.type == cudaMemoryTypeUnregistered;
}

bool StagedCopy::TakeBuffers() {
  if (std::ranges::any_of(lent_, [](int arrivals) { return arrivals > 0; })) return false;
  for (size_t b = 0; b < kBuffers; ++b) {
    if (!buffers_[b] && cudaMallocHost(&buffers_[b], kBufferBytes) != cudaSuccess) {
      cudaGetLastError();  // a copy without it works as well
      buffers_[b] = nullptr;
      return false;
    }
    if (arrived_[b]) continue;
    Check(cudaEventCreateWithFlags(&arrived_[b], cudaEventDisableTiming), "cudaEventCreate");
  }
  return true;
}

void StagedCopy::ToDevice(void* device, const void* host, size_t bytes) {
  const std::lock_guard lock(mutex_);
  if (!TakeBuffers()) {
    Check(cudaMemcpyAsync(device, host, bytes, cudaMemcpyHostToDevice, stream_), "cudaMemcpyAsync");
    return;
  }
  const size_t piece = PieceOf(bytes, kBufferBytes);
  for (size_t at = 0, count = 0; at < bytes; at += count) {
    const size_t b = at / kBufferBytes % kBuffers, within = at % kBufferBytes;
    count = std::min({piece, bytes - at, kBufferBytes - within});
    if (within == 0) Check(cudaEventSynchronize(arrived_[b]), "cudaEventSynchronize");
    char* const staged = static_cast<char*>(buffers_[b]) + within;
    CopyByAll(staged, static_cast<const char*>(host) + at, count);
    Check(cudaMemcpyAsync(static_cast<char*>(device) + at, staged, count, cudaMemcpyHostToDevice,
                          stream_),
          "cudaMemcpyAsync");
    Check(cudaEventRecord(arrived_[b], stream_), "cudaEventRecord");
  }
}

void StagedCopy::ToHost(void* host, const void* device, size_t bytes) {
  const std::lock_guard lock(mutex_);
  if (!TakeBuffers()) {
    Check(cudaMemcpyAsync(host, device, bytes, cudaMemcpyDeviceToHost, stream_), "cudaMemcpyAsync");
    Check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
    return;
  }
  const size_t piece = PieceOf(bytes, kBufferBytes);
  const auto start = [&](size_t at, size_t b) {
    if (at >= bytes) return;
    Check(cudaMemcpyAsync(buffers_[b], static_cast<const char*>(device) + at,
                          std::min(piece, bytes - at), cudaMemcpyDeviceToHost, stream_),
          "cudaMemcpyAsync");
    Check(cudaEventRecord(arrived_[b], stream_), "cudaEventRecord");
  };
  for (size_t b = 0; b < kBuffers; ++b) start(b * piece, b);
  for (size_t at = 0, b = 0; at < bytes; at += piece, b = (b + 1) % kBuffers) {
    Check(cudaEventSynchronize(arrived_[b]), "cudaEventSynchronize");
    CopyByAll(static_cast<char*>(host) + at, buffers_[b], std::min(piece, bytes - at));
    start(at + kBuffers * piece, b);
  }
}

std::unique_ptr<Arrival> StagedCopy::Send(const void* device, size_t bytes) {
  constexpr size_t kAlignment = 256;
  std::unique_ptr<Sent> sent;
  {
    const std::lock_guard lock(mutex_);
    for (size_t b = 0; b < kBuffers && !sent; ++b) {
      if (lent_[b] == 0) lent_bytes_[b] = 0;
      if (!buffers_[b] || bytes > kBufferBytes - lent_bytes_[b]) continue;
      sent = std::make_unique<Sent>(this, b, lent_bytes_[b], bytes);
      ++lent_[b];
      const size_t end = lent_bytes_[b] + (bytes + kAlignment - 1) / kAlignment * kAlignment;
      lent_bytes_[b] = std::min(kBufferBytes, end);
    }
  }
  if (sent) sent->Start(device);  // without the lock, which its destructor takes
  return sent;
}

}  // namespace retint::cuda
