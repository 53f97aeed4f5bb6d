// SPDX-License-Identifier: BSD-3-Clause
// How a message names an option. The library writes the option's key, which is also its keyword in
// Python and its key in job files: "`memory_mb=96` is enough". A program that calls its options
// something else replaces the names in its messages: "--memory-mb 96 is enough".
#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace retint {

// "`white_balance`", also of "white-balance".
std::string OptionName(std::string_view name);
std::string OptionName(std::string_view name, std::string_view value);  // "`backend=cpu`"

// `value` is empty if the message names no value.
using OptionSpelling = std::function<std::string(std::string_view name, std::string_view value)>;

// `message` with `spell` of each option instead of the text by OptionName().
std::string SpellOptions(std::string_view message, const OptionSpelling& spell);

}  // namespace retint
