// SPDX-License-Identifier: BSD-3-Clause
#include <stdexcept>
#include <string>

#include "kernels/backend.h"
#include "kernels/cpu/cpu_backend.h"

namespace retint {

std::vector<std::string> AvailableBackends() { return {"cpu"}; }

std::shared_ptr<Backend> CreateBackend(std::string_view name) {
  if (name == "auto" || name == "cpu") return CreateCpuBackend();
  if (name == "cuda") throw std::invalid_argument("backend \"cuda\" is not built in");
  throw std::invalid_argument("unknown backend \"" + std::string(name) +
                              "\"; use auto, cpu or cuda");
}

}  // namespace retint
