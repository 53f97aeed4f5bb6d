// SPDX-License-Identifier: BSD-3-Clause
// How alike two names are, to suggest one for another that was misspelled.
#pragma once

#include <string_view>

namespace retint {

// Characters to insert, remove or replace to turn one into the other (Levenshtein 1966).
int EditDistance(std::string_view a, std::string_view b);

}  // namespace retint
