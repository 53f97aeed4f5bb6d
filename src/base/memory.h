// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace retint {

// Gives the pages of freed memory back to the system, which the C library would keep for later. It
// takes some milliseconds a gigabyte. Does nothing where the C library offers no such call.
void ReleaseFreedMemory();

}  // namespace retint
