// SPDX-License-Identifier: BSD-3-Clause
// Text in a PNG beside its pixels: an iTXt chunk, as PNG (ISO/IEC 15948), 11.3.4.5 has it.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace retint {

// The keyword of masks that a network outlined; the text is MaskNetwork::Identity().
inline constexpr std::string_view kOutlinedBy = "Outlined by";

// `png`, a whole file's bytes, with `text` (UTF-8) under `keyword`.
std::string WithPngText(std::string png, std::string_view keyword, std::string_view text);
// The text of the first such chunk, on one line (base/printable.h), at most 1000 bytes of it. Empty
// if there is none, or the file is no PNG. InputError if it cannot be read.
std::string ReadPngText(const std::filesystem::path& path, std::string_view keyword);

}  // namespace retint
