// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/json.h"

#include "base/error.h"

namespace retint {
namespace {

using Json = nlohmann::json;

}  // namespace

Json ParseJson(std::string_view text, const std::filesystem::path& path, const std::string& what,
               const JsonLimits& limits) {
  size_t values = 0;
  const auto count = [&](int depth, Json::parse_event_t event, Json&) {
    using Event = Json::parse_event_t;
    if (event == Event::value || event == Event::array_start || event == Event::object_start) {
      if (++values > limits.values || depth > limits.depth) {
        throw InputError(path, what + " holds too much JSON");
      }
    }
    return true;
  };
  Json json = Json::parse(text, count, /*allow_exceptions=*/false);
  if (!json.is_object()) throw InputError(path, what + " is not a JSON object, or truncated");
  return json;
}

bool IsText(const Json* value, std::string_view text) {
  return value && value->is_string() && value->get_ref<const std::string&>() == text;
}

const Json* Member(const Json& value, const char* name) {
  const auto found = value.is_object() ? value.find(name) : value.end();
  return found == value.end() ? nullptr : &*found;
}

}  // namespace retint
