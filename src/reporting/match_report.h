// SPDX-License-Identifier: BSD-3-Clause
// What `retint match` found, as JSON, as lines and for a page.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "editing/match_scene.h"
#include "reporting/report_html.h"

namespace retint {

// docs/matching.md lists the keys.
std::string ToJson(const SceneMatch& match);
// A report of regions, with that of the match that found the edit of one.
std::string WithMatch(const std::string& report, const std::string& region,
                      const SceneMatch& match);
std::vector<std::string> LinesOf(const SceneMatch& match);
HtmlContent PageOf(const SceneMatch& match);

}  // namespace retint
