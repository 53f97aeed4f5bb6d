// SPDX-License-Identifier: BSD-3-Clause
// JSON from untrusted files.
#pragma once

#include <filesystem>
#include <string_view>

#include <nlohmann/json.hpp>

namespace retint {

// InputError of `path`, "`what` ...", for text that is not a JSON object, or exceeds limits that no
// scene reaches. They protect memory: a byte of text may use a hundred bytes of it.
struct JsonLimits {
  int depth = 64;
  size_t values = size_t{1} << 21;
};
nlohmann::json ParseJson(std::string_view text, const std::filesystem::path& path,
                         const std::string& what, const JsonLimits& limits = {});

// Whether `value` is that text; false for nullptr.
bool IsText(const nlohmann::json* value, std::string_view text);

// The member `name`; nullptr if `value` is not an object or does not have it.
const nlohmann::json* Member(const nlohmann::json& value, const char* name);

}  // namespace retint
