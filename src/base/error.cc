// SPDX-License-Identifier: BSD-3-Clause
#include "base/error.h"

namespace retint {

// A scene without a workspace has no path: its fault stands by itself.
InputError::InputError(const std::filesystem::path& path, std::string_view fault)
    : Error((path.empty() ? "" : path.string() + ": ") + std::string(fault)) {}

InputError::InputError(const std::filesystem::path& path, int64_t line, std::string_view fault)
    : Error(path.string() + ":" + std::to_string(line) + ": " + std::string(fault)) {}

}  // namespace retint
