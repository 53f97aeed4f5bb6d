// SPDX-License-Identifier: BSD-3-Clause
#include <stdexcept>
#include <string>

#include "kernels/backend.h"
#include "kernels/cpu/cpu_backend.h"
#ifdef RETINT_HAVE_CUDA
#include "kernels/cuda/cuda_backend.h"
#endif

namespace retint {

namespace {

// Null where there is none; `reason` then says why.
std::shared_ptr<Backend> TryCuda(std::string* reason) {
#ifdef RETINT_HAVE_CUDA
  return CudaAvailable(reason) ? CreateCudaBackend() : nullptr;
#else
  *reason = "not built in";
  return nullptr;
#endif
}

}  // namespace

std::vector<std::string> AvailableBackends() {
  std::vector<std::string> names = {"cpu"};
#ifdef RETINT_HAVE_CUDA
  if (CudaAvailable()) names.push_back("cuda");
#endif
  return names;
}

std::shared_ptr<Backend> CreateBackend(std::string_view name) {
  std::string reason;
  if (name == "cpu") return CreateCpuBackend();
  if (name == "cuda" || name == "auto") {
    if (auto backend = TryCuda(&reason)) return backend;
    if (name == "auto") return CreateCpuBackend();
    throw std::invalid_argument("backend \"cuda\" cannot be used: " + reason);
  }
  throw std::invalid_argument("unknown backend \"" + std::string(name) +
                              "\"; use auto, cpu or cuda");
}

}  // namespace retint
