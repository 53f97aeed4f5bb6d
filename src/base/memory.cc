// SPDX-License-Identifier: BSD-3-Clause
#include "base/memory.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "base/parallel.h"

namespace retint {

void ReleaseFreedMemory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

void GiveLargeBlocksBackAtOnce() {
#ifdef __GLIBC__
  constexpr int kLeastBytes = 256 << 10;
  mallopt(M_MMAP_THRESHOLD, kLeastBytes);
  mallopt(M_TRIM_THRESHOLD, kLeastBytes);
#endif
}

void PopulatePages(void* data, size_t bytes) {
#ifdef MADV_POPULATE_WRITE
  constexpr int64_t kPagesOfPiece = 2048;
  const auto page = static_cast<uintptr_t>(sysconf(_SC_PAGESIZE));
  const uintptr_t first = (reinterpret_cast<uintptr_t>(data) + page - 1) / page;
  const uintptr_t end = (reinterpret_cast<uintptr_t>(data) + bytes) / page;
  if (end <= first) return;
#ifdef MADV_HUGEPAGE
  // If the system leaves it to programs. It takes a five-hundredth of the steps.
  madvise(reinterpret_cast<void*>(first * page), (end - first) * page, MADV_HUGEPAGE);
#endif
  ParallelRanges(int64_t(end - first), kPagesOfPiece, [&](int64_t from, int64_t to) {
    madvise(reinterpret_cast<void*>((first + uintptr_t(from)) * page), size_t(to - from) * page,
            MADV_POPULATE_WRITE);
  });
#else
  static_cast<void>(data), static_cast<void>(bytes);
#endif
}

}  // namespace retint
