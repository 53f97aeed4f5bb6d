// SPDX-License-Identifier: BSD-3-Clause
// Host memory of the CPU backend.
#pragma once

#include <cstddef>
#include <memory>

#include "kernels/backend.h"

namespace retint {

// Zeroed; aligned to 64 bytes. Large blocks ask the system for huge pages: rows and slots are
// visited in order of depth, anywhere in memory, and the address translation of small pages would
// cost more than the arithmetic. std::bad_alloc when there is none.
std::shared_ptr<DeviceMemory> AllocateHost(size_t bytes);

}  // namespace retint
