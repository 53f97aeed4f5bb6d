// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace retint::cli {

// Version, backends and libraries, a line each.
std::string VersionText();

}  // namespace retint::cli
