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
std::string ToJson(const SceneMatch& match, const std::vector<std::string>& sentences);
std::vector<std::string> LinesOf(const SceneMatch& match);
HtmlContent PageOf(const SceneMatch& match, const std::vector<std::string>& sentences);

}  // namespace retint
