// SPDX-License-Identifier: BSD-3-Clause
// Colors as people write them: "#3060ff" or "steelblue".
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace retint {

// Whether a word is meant to be a color, right or wrong: it begins with # or a letter.
bool MayBeColor(std::string_view word);

// `word` is #rrggbb or the name of a CSS color, in upper or lower case. Display encoded sRGB, 0-255
// become 0-1. Returns the fault, empty if there is none; then `color` is set.
std::string ReadColor(std::string_view word, std::array<float, 3>* color);

std::vector<std::string_view> ColorNames();  // of CSS, by the alphabet

}  // namespace retint
