// SPDX-License-Identifier: BSD-3-Clause
// Edits as text: one operation as it stands on the command line, a list of them
// as JSON (docs/formats.md).
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "recolor/color_edit.h"

namespace retint {

// The value of an operation's option: its parameters' values in order, or KEY=VALUE,
// separated by commas; values of one key by colons. A color may also be #rrggbb or a name;
// any operation may have strength=S. No key comes twice. A white balance may have
// gray=COLOR instead, and becomes the one that makes this color gray. A LUT or a picture
// has the path of the file, and its strength. OptionError naming the operation; InputError
// for the file. `warnings`, here and below, get a sentence for each part that differs from
// the request.
ColorOperation ParseOperation(const ColorOperationType& type, std::string_view text,
                              std::vector<std::string>* warnings = nullptr);

// The FILE of FILE[,strength=S]. If there is a file whose own name ends like that, all of the
// text.
std::string_view FileOf(std::string_view text);

// {"operations": [{"op": "tint", "color": [R, G, B]}, ...]}. Files of tables
// are looked for in `folder`. OptionError naming the operation at fault, for
// text that is no JSON too; InputError for a table's file.
ColorEdit EditFromJson(std::string_view json, const std::filesystem::path& folder,
                       std::vector<std::string>* warnings = nullptr);

// The same as text, on one line. With tables, a LUT carries its values, so that
// the text alone is enough; without, the absolute path of its file, as far as
// that is known. So are pictures that are to be compared again.
std::string EditToJson(const ColorEdit& edit, bool with_tables);

// EditFromJson of a file, whose folder is where tables are; of a report of a run
// its "edit". InputError naming the file.
ColorEdit ReadEdit(const std::filesystem::path& path, std::vector<std::string>* warnings = nullptr);

}  // namespace retint
