// SPDX-License-Identifier: BSD-3-Clause
// Text for a terminal or a log.
#pragma once

#include <string>
#include <string_view>

namespace retint {

// On one line, and without anything that a terminal obeys: control characters, also those above
// 127, become <U+001B>, and bytes that are no UTF-8 become <0xFF>.
std::string Printable(std::string_view text);

// Without line breaks, doubled blanks and those at the ends.
std::string OneLine(std::string_view text);

}  // namespace retint
