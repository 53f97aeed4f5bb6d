// SPDX-License-Identifier: BSD-3-Clause
// Names that are bytes, as an image's or a file's may be, in texts that are UTF-8.
#pragma once

#include <string>
#include <string_view>

namespace retint {

// '%', control characters and, where the whole is not UTF-8, bytes above 127 become %XX.
std::string EscapeBytes(std::string_view bytes);
std::string UnescapeBytes(std::string_view text);
// Of a hexadecimal digit; -1 for another character.
int HexValue(char c);

}  // namespace retint
