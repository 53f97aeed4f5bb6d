// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/device_handle.h"

#ifdef RETINT_HAVE_CUDA
#include "kernels/cuda/cuda_backend.h"
#endif

namespace retint {

#ifdef RETINT_HAVE_CUDA
std::string DeviceIdentity(const Backend& backend) {
  return backend.IsHost() ? "" : CudaIdentity(backend);
}
void* DeviceStream(const Backend& backend) {
  return backend.IsHost() ? nullptr : CudaStream(backend);
}
#else
std::string DeviceIdentity(const Backend&) { return ""; }
void* DeviceStream(const Backend&) { return nullptr; }
#endif

}  // namespace retint
