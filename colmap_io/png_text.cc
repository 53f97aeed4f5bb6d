// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/png_text.h"

#include <algorithm>
#include <cstdint>

#include <zlib.h>

#include "base/files.h"
#include "base/printable.h"

namespace retint {
namespace {

constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";
constexpr size_t kFrame = 12;                                // length, type and checksum of a chunk
constexpr size_t kHeader = kSignature.size() + kFrame + 13;  // up to the end of IHDR

std::string BigEndian(uint32_t value) {
  std::string bytes;
  for (const int shift : {24, 16, 8, 0}) bytes += char(uint8_t(value >> shift));
  return bytes;
}

uint32_t ReadBigEndian(std::string_view bytes) {
  uint32_t value = 0;
  for (size_t i = 0; i < 4; ++i) value = (value << 8) | uint8_t(bytes[i]);
  return value;
}

// Before the text: not compressed, of no language, with no translated keyword.
std::string StartOf(std::string_view keyword) {
  return std::string(keyword) + std::string(5, '\0');
}

}  // namespace

std::string WithPngText(std::string png, std::string_view keyword, std::string_view text) {
  std::string chunk = "iTXt" + StartOf(keyword) + std::string(text);
  const uLong sum = crc32(0, reinterpret_cast<const Bytef*>(chunk.data()), uInt(chunk.size()));
  chunk = BigEndian(uint32_t(chunk.size() - 4)) + chunk + BigEndian(uint32_t(sum));
  return png.insert(kHeader, chunk);
}

std::string ReadPngText(const std::filesystem::path& path, std::string_view keyword) {
  const std::string file = ReadFile(path);
  if (!file.starts_with(kSignature)) return {};
  const std::string start = StartOf(keyword);
  std::string_view rest = std::string_view(file).substr(kSignature.size());
  while (rest.size() >= kFrame) {
    const size_t length = ReadBigEndian(rest);
    if (length > rest.size() - kFrame) break;
    const std::string_view data = rest.substr(8, length);
    if (rest.substr(4, 4) == "iTXt" && data.starts_with(start)) {
      constexpr size_t kMost = 1000;
      return Printable(data.substr(start.size(), kMost));
    }
    rest.remove_prefix(kFrame + length);
  }
  return {};
}

}  // namespace retint
