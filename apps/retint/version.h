// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "kernels/backend.h"

namespace retint::cli {

// Version, backends and libraries, a line each.
std::string VersionText();

// One line: the backend that runs and, where `asked` ("auto", "cpu" or "cuda") left the choice to
// the program, why it is not the GPU: "cpu (AVX2 (Highway), 8 threads); cuda: no device".
std::string BackendText(const Backend& backend, std::string_view asked);

}  // namespace retint::cli
