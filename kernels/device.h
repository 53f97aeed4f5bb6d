// SPDX-License-Identifier: BSD-3-Clause
// The memory of a backend: the host's for "cpu", the device's for "cuda". Also the properties of a
// device that a library needs if it moves data there by itself.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace retint {

// Untyped memory of a backend; freed with the last reference.
class DeviceMemory {
 public:
  virtual ~DeviceMemory() = default;
  void* data() const { return data_; }
  size_t bytes() const { return bytes_; }

 protected:
  DeviceMemory(void* data, size_t bytes) : data_(data), bytes_(bytes) {}
  void* data_;
  size_t bytes_;
};

// Typed handle of backend memory. Copies share the memory.
template <typename T>
class Buffer {
 public:
  Buffer() = default;
  Buffer(std::shared_ptr<DeviceMemory> memory, size_t count)
      : memory_(std::move(memory)), count_(count) {}
  T* data() const { return memory_ ? static_cast<T*>(memory_->data()) : nullptr; }
  size_t size() const { return count_; }
  bool empty() const { return count_ == 0; }

 private:
  std::shared_ptr<DeviceMemory> memory_;
  size_t count_ = 0;
};

// Bytes on their way to the host, while the backend continues with the work queued behind them. The
// backend must outlive it.
class Arrival {
 public:
  virtual ~Arrival() = default;
  // Waits for the bytes, which live as long as this. From any thread, but from one at a time.
  virtual const void* Wait() = 0;
};

// Copies and fills happen in the order of the operations of the same backend. Thread-safe.
class Device {
 public:
  virtual ~Device() = default;

  // Zero-initialised. Throws std::bad_alloc if there is not enough memory; for a device, its
  // message has the requested and the free bytes.
  virtual std::shared_ptr<DeviceMemory> AllocateBytes(size_t bytes) = 0;
  virtual void CopyToDevice(void* device, const void* host, size_t bytes) = 0;
  virtual void CopyToHost(void* host, const void* device, size_t bytes) = 0;
  // As CopyToHost, but the wait is in Arrival::Wait. Until the arrival is gone the memory must stay
  // as it is.
  virtual std::unique_ptr<Arrival> SendToHost(const void* device, size_t bytes) {
    return std::make_unique<LateCopy>(*this, device, bytes);
  }
  virtual void Fill(void* device, int byte, size_t bytes) = 0;
  virtual void Synchronize() = 0;
  virtual size_t PeakDeviceBytes() const = 0;  // 0 on the CPU
  // Device memory that this process can use: the free memory, and the memory that it already holds,
  // in use or in its pool. 0 on the CPU.
  virtual size_t AvailableDeviceBytes() const = 0;
  // Returns the pool's free memory to the driver, after waiting for queued work. Call it before you
  // allocate blocks of very different sizes, because they do not fit into the old holes.
  virtual void ReleaseFreed() {}
  // Whether its memory is the host's, which may then be read and written in place.
  virtual bool IsHost() const = 0;
  // Names the device for every process that uses it, a GPU by its UUID; empty: the host.
  virtual std::string Identity() const { return {}; }
  // The cudaStream_t on which it queues its work, as long as it lives; null: the host.
  virtual void* Stream() const { return nullptr; }
  // Keeps the pages of host memory in place while the result lives, so that copies between it and
  // the device are several times faster. Null: the device gains nothing, or the system refuses. The
  // memory must outlive the result.
  virtual std::shared_ptr<void> LockPages(void* /*data*/, size_t /*bytes*/) { return nullptr; }

  template <typename T>
  Buffer<T> Allocate(size_t count) {
    return Buffer<T>(AllocateBytes(count * sizeof(T)), count);
  }
  template <typename T>
  Buffer<T> Upload(std::span<const T> host) {
    auto buffer = Allocate<T>(host.size());
    CopyToDevice(buffer.data(), host.data(), host.size_bytes());
    return buffer;
  }
  // The memory of `buffer`: new where it holds fewer than `count`, and then all zero.
  template <typename T>
  T* Grow(Buffer<T>& buffer, size_t count) {
    if (buffer.size() < count) {
      buffer = {};  // freed before the larger one is taken
      buffer = Allocate<T>(count);
    }
    return buffer.data();
  }
  template <typename T>
  std::vector<T> Download(const T* device, size_t count) {
    std::vector<T> host(count);
    CopyToHost(host.data(), device, count * sizeof(T));
    return host;
  }

 private:
  // The host's memory itself, or a copy that is made when it is waited for.
  class LateCopy : public Arrival {
   public:
    LateCopy(Device& device, const void* from, size_t bytes)
        : device_(device), from_(from), bytes_(bytes) {}
    const void* Wait() override {
      if (device_.IsHost()) return from_;
      if (copy_.empty()) {
        copy_ = device_.Download(static_cast<const std::byte*>(from_), bytes_);
      }
      return copy_.data();
    }

   private:
    Device& device_;
    const void* from_;
    size_t bytes_;
    std::vector<std::byte> copy_;
  };
};

}  // namespace retint
