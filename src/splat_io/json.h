// SPDX-License-Identifier: BSD-3-Clause
// JSON of files that nobody vouches for.
#pragma once

#include <filesystem>
#include <string_view>

#include <nlohmann/json.hpp>

namespace retint {

// InputError of `path`, "`what` ...", for text that is no JSON object, or that holds more values or
// nests them deeper than any scene does: a byte of text may take a hundred of memory.
struct JsonLimits {
  int depth = 64;
  size_t values = size_t{1} << 21;
};
nlohmann::json ParseJson(std::string_view text, const std::filesystem::path& path,
                         const std::string& what, const JsonLimits& limits = {});

// Whether `value` is that text; false for nullptr.
bool IsText(const nlohmann::json* value, std::string_view text);

// The member `name`; nullptr where `value` is no object or has none.
const nlohmann::json* Member(const nlohmann::json& value, const char* name);

}  // namespace retint
