// SPDX-License-Identifier: BSD-3-Clause
#include <stdexcept>
#include <string>

#include "kernels/backend.h"
#include "kernels/cpu/cpu_backend.h"
#ifdef RETINT_HAVE_CUDA
#include "kernels/cuda/cuda_backend.h"
#endif

namespace retint {

std::vector<std::string> AvailableBackends() {
  std::vector<std::string> names = {"cpu"};
  if (CudaFault().empty()) names.push_back("cuda");
  return names;
}

std::string CudaFault() {
#ifdef RETINT_HAVE_CUDA
  std::string reason;
  return CudaAvailable(&reason) ? "" : reason;
#else
  return std::string(kCudaNotBuiltIn);
#endif
}

std::shared_ptr<Backend> CreateBackend(std::string_view name) {
  if (name == "cpu") return CreateCpuBackend();
  if (name == "cuda" || name == "auto") {
    const std::string fault = CudaFault();
#ifdef RETINT_HAVE_CUDA
    if (fault.empty()) return CreateCudaBackend();
#endif
    if (name == "auto") return CreateCpuBackend();
    throw std::invalid_argument("backend \"cuda\" cannot be used: " + fault);
  }
  throw std::invalid_argument("unknown backend \"" + std::string(name) +
                              "\"; use auto, cpu or cuda");
}

}  // namespace retint
