// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/cuda/page_lock.h"

#include <cuda_runtime.h>

namespace retint::cuda {

bool LockPages(void* data, size_t bytes) {
  if (cudaHostRegister(data, bytes, cudaHostRegisterPortable) == cudaSuccess) return true;
  cudaGetLastError();  // a copy without it works as well
  return false;
}

void UnlockPages(void* data) { cudaHostUnregister(data); }

}  // namespace retint::cuda
