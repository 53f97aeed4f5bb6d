// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace retint {

// Gives the pages of freed memory back to the system, which the C library would keep for later. It
// takes some milliseconds a gigabyte. Does nothing where the C library offers no such call.
void ReleaseFreedMemory();

// Has the system provide the pages of memory that was just taken, by all threads; whoever fills it
// then, alone, is several times faster. A hint: the memory may be used the same without.
void PopulatePages(void* data, size_t bytes);

}  // namespace retint
