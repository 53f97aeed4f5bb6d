// SPDX-License-Identifier: BSD-3-Clause
// Host memory that a device copies from and to at full speed.
#pragma once

#include <cstddef>

namespace retint {

// While it lives, the pages of a piece of host memory stay where they are, which makes copies
// between it and a device several times faster. Where that cannot be had, without CUDA or beyond
// the system's limit, it does nothing. The memory must outlive it.
class PageLock {
 public:
  PageLock(void* data, size_t bytes);
  ~PageLock();
  PageLock(const PageLock&) = delete;
  PageLock& operator=(const PageLock&) = delete;

 private:
  void* locked_ = nullptr;
};

}  // namespace retint
