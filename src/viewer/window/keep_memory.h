// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdlib>

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace retint {

// From now on, blocks of 4 MiB and more go back to the system as soon as they are freed, and
// smaller ones are used again. The GNU C library would keep blocks of up to 32 MiB and the gaps
// between them: 2.1 GiB at the peak of a fit of fox instead of 1.6. If every block of 256 KiB goes
// back, new pages take half the time of accepting a selection. Call it before memory is taken.
inline void KeepSmallBlocks() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 4 << 20);
  mallopt(M_TRIM_THRESHOLD, 64 << 20);
#endif
}

}  // namespace retint
