// SPDX-License-Identifier: BSD-3-Clause
// The CUDA backend: all groups of kernels/backend.h on one device, on a stream of its own. No
// CUDA type shows here.
#pragma once

#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>

#include "kernels/backend.h"

namespace retint {

// A failed call of the CUDA runtime: "cudaCall: why".
class DeviceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Exhausted device memory: the message has the failed call and the free bytes.
class DeviceOutOfMemory : public std::bad_alloc {
 public:
  explicit DeviceOutOfMemory(std::string message);
  const char* what() const noexcept override { return message_.c_str(); }

 private:
  std::string message_;
};

// The message of CudaFault() on a machine without a GPU, or without a driver for one.
inline constexpr std::string_view kCudaNoDevice = "no device";

// True if there is a driver and a device for which this program has code. If false, `reason` says
// which of them is missing.
bool CudaAvailable(std::string* reason = nullptr);

// On the current device.
std::shared_ptr<Backend> CreateCudaBackend();

}  // namespace retint
