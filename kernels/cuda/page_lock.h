// SPDX-License-Identifier: BSD-3-Clause
// CUDA's side of kernels/page_lock.h.
#pragma once

#include <cstddef>

namespace retint::cuda {

bool LockPages(void* data, size_t bytes);  // false where it cannot be done
void UnlockPages(void* data);

}  // namespace retint::cuda
