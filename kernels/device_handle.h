// SPDX-License-Identifier: BSD-3-Clause
// What a library needs to know of a device whose memory it moves by itself.
#pragma once

#include <string>

#include "kernels/backend.h"

namespace retint {

// Names the device for every process that uses it, a GPU by its UUID; empty: the host.
std::string DeviceIdentity(const Backend& backend);
// The cudaStream_t on which the backend queues its work, as long as it lives; null: the host.
void* DeviceStream(const Backend& backend);

}  // namespace retint
