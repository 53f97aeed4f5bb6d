// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace retint {

// Gives the pages of freed memory back to the system, which the C library would keep for later. It
// takes some milliseconds a gigabyte. Does nothing where the C library offers no such call.
void ReleaseFreedMemory();

// From now on every block of 256 KiB and more has pages of its own, which the system has back as
// soon as the block is freed. The GNU C library would raise that limit to 32 MiB as such blocks are
// freed. It would keep the gaps between blocks that are in use: a third of a session's memory after
// a fit. For programs that run long; call it before memory is taken. Does nothing with other C
// libraries.
void GiveLargeBlocksBackAtOnce();

// Has the system provide the pages of memory that was just taken, by all threads, and large ones
// where it can; whoever fills it then, alone, is several times faster. A hint: the memory may be
// used the same without.
void PopulatePages(void* data, size_t bytes);

// Leaves values unset where std::allocator zeroes them, for large arrays that are filled next.
template <typename T>
struct UnsetAllocator : std::allocator<T> {
  template <typename U>
  struct rebind {
    using other = UnsetAllocator<U>;
  };
  template <typename U>
  void construct(U* value) noexcept {
    ::new (static_cast<void*>(value)) U;
  }
  template <typename U, typename... Arguments>
  void construct(U* value, Arguments&&... arguments) {
    ::new (static_cast<void*>(value)) U(std::forward<Arguments>(arguments)...);
  }
};
template <typename T>
using UnsetVector = std::vector<T, UnsetAllocator<T>>;

// values.reserve(count) of a std::vector or a std::string. A large one has its pages at once: one
// by one, as each is first written, they take several times as long.
template <typename Container>
void ReservePopulated(Container& values, size_t count) {
  constexpr size_t kLarge = size_t{1} << 20;  // bytes
  constexpr size_t kValueBytes = sizeof(typename Container::value_type);
  if (count > values.capacity() && count * kValueBytes >= kLarge) {
    values.reserve(count);
    PopulatePages(values.data() + values.size(), (count - values.size()) * kValueBytes);
  }
}

}  // namespace retint
