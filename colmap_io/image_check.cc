// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/image_check.h"

#include <array>
#include <cstdint>
#include <string>

#include "base/error.h"

namespace retint {
namespace {

constexpr std::string_view kPngSignature = "\x89PNG\r\n\x1a\n";
constexpr std::string_view kJpegSignature = "\xFF\xD8\xFF";

// The largest ratio of deflate (1032:1), and the most pixels that a byte of a JPEG can encode: one
// bit for an 8x8 block of a gray progressive file is 512.
constexpr uint64_t kMaxDeflateRatio = 1032;
constexpr uint64_t kMaxJpegPixelsPerByte = 512;
constexpr uint64_t kSlackBytes = 1024;

uint32_t BigEndian(std::string_view bytes, size_t at, size_t count) {
  uint32_t value = 0;
  for (size_t i = 0; i < count; ++i) value = value << 8 | static_cast<uint8_t>(bytes[at + i]);
  return value;
}

// CRC-32 of ISO 3309, as PNG's appendix D gives it.
uint32_t Crc32(std::string_view bytes) {
  static const auto table = [] {
    std::array<uint32_t, 256> entries{};
    for (uint32_t n = 0; n < 256; ++n) {
      uint32_t c = n;
      for (int k = 0; k < 8; ++k) c = c & 1 ? 0xEDB88320u ^ (c >> 1) : c >> 1;
      entries[n] = c;
    }
    return entries;
  }();
  uint32_t crc = 0xFFFFFFFFu;
  for (const char byte : bytes) crc = table[(crc ^ static_cast<uint8_t>(byte)) & 255] ^ (crc >> 8);
  return ~crc;
}

void CheckSize(uint64_t width, uint64_t height, uint64_t max_pixels,
               const std::filesystem::path& path) {
  if (width == 0 || height == 0 || width * height > max_pixels) {
    throw InputError(path, "image size " + std::to_string(width) + "x" + std::to_string(height) +
                               " does not fit the file");
  }
}

uint64_t PngBitsPerPixel(std::string_view header, const std::filesystem::path& path) {
  constexpr std::array<uint64_t, 7> kChannels = {1, 0, 3, 1, 2, 0, 4};  // by color type
  const auto depth = static_cast<uint8_t>(header[8]);
  const auto color = static_cast<uint8_t>(header[9]);
  if (depth == 0 || depth > 16 || color >= kChannels.size() || kChannels[color] == 0) {
    throw InputError(path, "damaged PNG file: no such pixel format");
  }
  return depth * kChannels[color];
}

void CheckPng(std::string_view bytes, const std::filesystem::path& path) {
  constexpr size_t kFrame = 12;  // length, type, CRC
  size_t at = kPngSignature.size();
  for (bool first = true;; first = false) {
    if (bytes.size() - at < kFrame) throw InputError(path, "truncated PNG file");
    const uint64_t length = BigEndian(bytes, at, 4);
    if (length > bytes.size() - at - kFrame) throw InputError(path, "truncated PNG file");
    const std::string_view type = bytes.substr(at + 4, 4);
    if (Crc32(bytes.substr(at + 4, length + 4)) != BigEndian(bytes, at + 8 + length, 4)) {
      throw InputError(path, "damaged PNG file: checksum at byte " + std::to_string(at));
    }
    if (first) {
      if (type != "IHDR" || length != 13) throw InputError(path, "damaged PNG file: no header");
      CheckSize(BigEndian(bytes, at + 8, 4), BigEndian(bytes, at + 12, 4),
                (bytes.size() + kSlackBytes) * kMaxDeflateRatio * 8 /
                    PngBitsPerPixel(bytes.substr(at + 8, 13), path),
                path);
    }
    if (type == "IEND") return;
    at += length + kFrame;
  }
}

// Walks the segments of ITU T.81, annex B, up to the end-of-image marker.
void CheckJpeg(std::string_view bytes, const std::filesystem::path& path) {
  const auto fail = [&] { throw InputError(path, "truncated JPEG file"); };
  bool in_scan = false;
  size_t at = 2;
  while (true) {
    at = bytes.find('\xFF', at);
    if (at == std::string_view::npos || at + 1 >= bytes.size()) fail();
    const auto marker = static_cast<uint8_t>(bytes[at + 1]);
    if (marker == 0xFF) {  // fill byte
      ++at;
      continue;
    }
    at += 2;
    if (marker == 0xD9) {
      if (!in_scan) throw InputError(path, "damaged JPEG file: no picture in it");
      return;
    }
    // Stuffed zeros and restart markers stand alone.
    if (marker == 0x00 || marker == 0x01 || (marker >= 0xD0 && marker <= 0xD7)) continue;
    if (bytes.size() - at < 2) fail();
    const size_t length = BigEndian(bytes, at, 2);
    if (length < 2)
      throw InputError(path, "damaged JPEG file: segment at byte " + std::to_string(at - 2));
    if (length > bytes.size() - at) fail();
    const bool frame =
        marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
    if (frame && length >= 8) {
      CheckSize(BigEndian(bytes, at + 5, 2), BigEndian(bytes, at + 3, 2),
                (bytes.size() + kSlackBytes) * kMaxJpegPixelsPerByte, path);
    }
    in_scan |= marker == 0xDA;
    at += length;
  }
}

}  // namespace

void CheckImageFile(std::string_view bytes, const std::filesystem::path& path) {
  if (bytes.empty()) throw InputError(path, "is empty");
  if (bytes.starts_with(kPngSignature)) return CheckPng(bytes, path);
  if (bytes.starts_with(kJpegSignature)) return CheckJpeg(bytes, path);
}

}  // namespace retint
