// SPDX-License-Identifier: BSD-3-Clause
// The CPU backend: oneTBB over tiles (tbb::global_control is respected), Highway inside them.
#pragma once

#include <memory>

#include "kernels/backend.h"

namespace retint {

struct CpuOptions {
  bool scalar = false;  // plain C++ inner loops, the oracle of the SIMD ones
};

std::shared_ptr<Backend> CreateCpuBackend(const CpuOptions& options = {});

}  // namespace retint
