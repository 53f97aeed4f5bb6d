// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/page_lock.h"

#ifdef RETINT_HAVE_CUDA
#include "kernels/cuda/page_lock.h"
#endif

namespace retint {

#ifdef RETINT_HAVE_CUDA
PageLock::PageLock(void* data, size_t bytes)
    : locked_(bytes > 0 && cuda::LockPages(data, bytes) ? data : nullptr) {}

PageLock::~PageLock() {
  if (locked_) cuda::UnlockPages(locked_);
}
#else
PageLock::PageLock(void*, size_t) {}
PageLock::~PageLock() = default;
#endif

}  // namespace retint
