// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace retint {

// Gives the pages of freed memory back to the system, which the C library would keep for later. It
// takes some milliseconds a gigabyte. Does nothing where the C library offers no such call.
void ReleaseFreedMemory();

// From now on every block of 256 KiB and more has pages of its own, which the system has back as
// soon as the block is freed. The GNU C library would raise that limit to 32 MiB as such blocks are
// freed, and keep what lies between blocks that are in use: a third of a session's memory after a
// fit. For programs that run long; call it before memory is taken. Does nothing with other C
// libraries.
void GiveLargeBlocksBackAtOnce();

// Has the system provide the pages of memory that was just taken, by all threads; whoever fills it
// then, alone, is several times faster. A hint: the memory may be used the same without.
void PopulatePages(void* data, size_t bytes);

}  // namespace retint
