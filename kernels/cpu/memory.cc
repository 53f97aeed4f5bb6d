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
constexpr size_t kHugePage = size_t{1} << 21;

void* TakeZeroed(size_t bytes) {
  const size_t alignment = bytes >= kHugePage ? kHugePage : kAlignment;
  const size_t rounded = (std::max<size_t>(bytes, 1) + alignment - 1) / alignment * alignment;
  if (rounded < bytes) throw std::bad_alloc();
  void* data = std::aligned_alloc(alignment, rounded);
  if (!data) throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
  if (alignment == kHugePage) madvise(data, rounded, MADV_HUGEPAGE);  // a hint; may be refused
#endif
  std::memset(data, 0, rounded);
  return data;
}

class HostMemory : public DeviceMemory {
 public:
  explicit HostMemory(size_t bytes) : DeviceMemory(TakeZeroed(bytes), bytes) {}
  ~HostMemory() override { std::free(data_); }
};

}  // namespace

std::shared_ptr<DeviceMemory> AllocateHost(size_t bytes) {
  return std::make_shared<HostMemory>(bytes);
}

}  // namespace retint
