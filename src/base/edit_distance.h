// SPDX-License-Identifier: BSD-3-Clause
// How alike two names are, to suggest one for another that was misspelled.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace retint {

// Characters to insert, remove or replace to turn one into the other (Levenshtein 1966).
int EditDistance(std::string_view a, std::string_view b);

// At most `count` of `names`, those most like `name` first.
std::vector<std::string> NearestNames(std::string_view name, const std::vector<std::string>& names,
                                      size_t count);

}  // namespace retint
