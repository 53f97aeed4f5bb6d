// SPDX-License-Identifier: BSD-3-Clause
// JSON that people write: of a key that comes twice in one object, a reader would silently take the
// last. For users of nlohmann_json.
#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.h"

namespace retint {

// The value that `text` stands for. OptionError naming the key that comes twice; else the exception
// of Json::parse.
template <typename Json>
Json ParseWithUniqueKeys(std::string_view text) {
  std::vector<std::set<std::string>> open;  // keys of the objects around the place
  return Json::parse(text, [&](int /*depth*/, typename Json::parse_event_t event, Json& parsed) {
    using Event = typename Json::parse_event_t;
    if (event == Event::object_start) open.emplace_back();
    if (event == Event::object_end) open.pop_back();
    if (event == Event::key && !open.back().insert(parsed.template get<std::string>()).second) {
      throw OptionError("has \"" + parsed.template get<std::string>() + "\" twice in one object");
    }
    return true;
  });
}

}  // namespace retint
