// SPDX-License-Identifier: BSD-3-Clause
// Host memory of the CPU backend.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <utility>
#include <vector>

#include "kernels/device.h"

namespace retint {

// Zeroed; aligned to 64 bytes. Large blocks ask the system for huge pages. Rows and slots are
// visited in order of depth, anywhere in memory, so with small pages the address translation would
// cost more than the arithmetic. Throws std::bad_alloc if there is not enough memory.
std::shared_ptr<DeviceMemory> AllocateHost(size_t bytes);

// The same without the zeros. Throws std::bad_alloc too; free it with std::free.
void* AllocateUnset(size_t bytes);

template <typename T>
struct LargeAllocator {
  using value_type = T;
  LargeAllocator() = default;
  template <typename U>
  LargeAllocator(const LargeAllocator<U>&) {}
  T* allocate(size_t count) {
    if (count > SIZE_MAX / sizeof(T)) throw std::bad_alloc();
    return static_cast<T*>(AllocateUnset(count * sizeof(T)));
  }
  void deallocate(T* data, size_t) { std::free(data); }
  template <typename U, typename... Arguments>
  void construct(U* at, Arguments&&... arguments) {
    if constexpr (sizeof...(Arguments) == 0) {
      ::new (static_cast<void*>(at)) U;
    } else {
      ::new (static_cast<void*>(at)) U(std::forward<Arguments>(arguments)...);
    }
  }
  bool operator==(const LargeAllocator&) const = default;
};

// A large array whose elements resize() leaves unset, so that the threads that fill it are the
// first to touch it.
template <typename T>
using LargeVector = std::vector<T, LargeAllocator<T>>;

}  // namespace retint
