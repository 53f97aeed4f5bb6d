// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/cpu/memory.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <new>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace retint {
namespace {

constexpr size_t kAlignment = 64;
constexpr size_t kPage = 4096;  // the tail of a block is not worth a huge one
constexpr size_t kHugePage = size_t{1} << 21;

size_t RoundUp(size_t bytes, size_t alignment) {
  const size_t rounded = (std::max<size_t>(bytes, 1) + alignment - 1) / alignment * alignment;
  if (rounded < bytes) throw std::bad_alloc();
  return rounded;
}

void AskForHugePages(void* data, size_t bytes) {
#ifdef MADV_HUGEPAGE
  madvise(data, bytes, MADV_HUGEPAGE);  // a hint; may be refused
#else
  (void)data, (void)bytes;
#endif
}

class HostMemory : public DeviceMemory {
 public:
  explicit HostMemory(size_t bytes) : DeviceMemory(AllocateUnset(bytes), bytes) {
    std::memset(data_, 0, bytes);
  }
  ~HostMemory() override { std::free(data_); }
};

#ifdef __linux__
// Pages of its own, which the system hands out zeroed to whoever touches them first.
class MappedMemory : public DeviceMemory {
 public:
  explicit MappedMemory(size_t bytes) : MappedMemory(Map(RoundUp(bytes, kPage)), bytes) {}
  ~MappedMemory() override { munmap(mapping_.data, mapping_.bytes); }

 private:
  struct Mapping {
    void* data;
    size_t bytes;
  };
  MappedMemory(Mapping mapping, size_t bytes)
      : DeviceMemory(mapping.data, bytes), mapping_(mapping) {}

  // One huge page more than needed, to cut an aligned piece from.
  static Mapping Map(size_t bytes) {
    const size_t all = bytes + kHugePage;
    if (all < bytes) throw std::bad_alloc();
    void* const data =
        mmap(nullptr, all, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (data == MAP_FAILED) throw std::bad_alloc();
    char* const first = static_cast<char*>(data);
    const size_t before = (kHugePage - reinterpret_cast<uintptr_t>(data) % kHugePage) % kHugePage;
    if (before > 0) munmap(first, before);
    munmap(first + before + bytes, kHugePage - before);
    AskForHugePages(first + before, bytes);
    return {first + before, bytes};
  }

  Mapping mapping_;
};
#endif

}  // namespace

void* AllocateUnset(size_t bytes) {
  const bool large = bytes >= kHugePage;
  const size_t rounded = RoundUp(bytes, large ? kPage : kAlignment);
  void* data = nullptr;
  if (posix_memalign(&data, large ? kHugePage : kAlignment, rounded) != 0) throw std::bad_alloc();
  if (large) AskForHugePages(data, rounded);
  return data;
}

std::shared_ptr<DeviceMemory> AllocateHost(size_t bytes) {
#ifdef __linux__
  if (bytes >= kHugePage) return std::make_shared<MappedMemory>(bytes);
#endif
  return std::make_shared<HostMemory>(bytes);
}

}  // namespace retint
