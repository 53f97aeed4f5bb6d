// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/usdc_compression.h"

#include <algorithm>
#include <stdexcept>

#include "splat_io/splat_row.h"

namespace retint {
namespace {

constexpr uint64_t kMostRatio = 255;  // of LZ4: a byte of length stands for at most that many bytes
constexpr size_t kLeastMatch = 4;

[[noreturn]] void Damaged() { throw std::runtime_error("the compressed data is damaged"); }

// 15 means that more bytes follow, up to the first one below 255.
size_t Length(std::string_view block, size_t& at, size_t length) {
  if (length < 15) return length;
  uint8_t more;
  do {
    if (at >= block.size()) Damaged();
    more = static_cast<uint8_t>(block[at++]);
    length += more;
  } while (more == 255);
  return length;
}

void UnpackBlock(std::string_view block, uint64_t most, std::string& bytes) {
  const size_t begin = bytes.size();
  for (size_t at = 0; at < block.size();) {
    const auto token = static_cast<uint8_t>(block[at++]);
    const size_t literals = Length(block, at, token >> 4);
    if (literals > block.size() - at || bytes.size() + literals > most) Damaged();
    bytes.append(block.substr(at, literals));
    at += literals;
    if (at == block.size()) return;  // the last sequence has no match
    if (block.size() - at < 2) Damaged();
    const size_t back = LoadAs<uint16_t>(block.data() + at);
    at += 2;
    const size_t match = Length(block, at, token & 15) + kLeastMatch;
    if (back == 0 || back > bytes.size() - begin || bytes.size() + match > most) Damaged();
    for (size_t i = 0, from = bytes.size() - back; i < match; ++i) bytes += bytes[from + i];
  }
}

}  // namespace

std::string UnpackCrateBytes(std::string_view packed, uint64_t most) {
  if (packed.empty()) Damaged();
  most = std::min(most, kMostRatio * packed.size());
  std::string bytes;
  const auto chunks = static_cast<uint8_t>(packed[0]);
  packed.remove_prefix(1);
  if (chunks == 0) {
    UnpackBlock(packed, most, bytes);
    return bytes;
  }
  for (int i = 0; i < chunks; ++i) {
    if (packed.size() < 4) Damaged();
    const auto size = LoadAs<uint32_t>(packed.data());
    if (size > packed.size() - 4) Damaged();
    UnpackBlock(packed.substr(4, size), most, bytes);
    packed.remove_prefix(4 + size_t{size});
  }
  return bytes;
}

std::string PackCrateBytes(std::string_view bytes) {
  std::string packed(1, '\0');
  packed += static_cast<char>(std::min<size_t>(bytes.size(), 15) << 4);
  if (bytes.size() >= 15) {
    size_t left = bytes.size() - 15;
    for (; left >= 255; left -= 255) packed += static_cast<char>(255);
    packed += static_cast<char>(left);
  }
  return packed += bytes;
}

std::vector<int32_t> UnpackCrateIntegers(std::string_view packed, uint64_t count) {
  if (count == 0) return {};
  const uint64_t code_bytes = (2 * count + 7) / 8;
  const std::string bytes = UnpackCrateBytes(packed, 4 + code_bytes + 4 * count);
  if (bytes.size() < 4 || bytes.size() - 4 < code_bytes) Damaged();
  const auto common = LoadAs<uint32_t>(bytes.data());
  size_t at = 4 + code_bytes;
  std::vector<int32_t> values(count);
  uint32_t value = 0;
  const auto difference = [&]<typename T>(T) {
    if (bytes.size() - at < sizeof(T)) Damaged();
    const auto step = static_cast<int32_t>(LoadAs<T>(bytes.data() + at));
    at += sizeof(T);
    return static_cast<uint32_t>(step);
  };
  for (size_t i = 0; i < count; ++i) {
    switch (static_cast<uint8_t>(bytes[4 + i / 4]) >> 2 * (i % 4) & 3) {
      case 0:
        value += common;
        break;
      case 1:
        value += difference(int8_t{});
        break;
      case 2:
        value += difference(int16_t{});
        break;
      default:
        value += difference(int32_t{});
    }
    values[i] = static_cast<int32_t>(value);
  }
  return values;
}

std::string PackCrateIntegers(std::span<const int32_t> values) {
  std::string codes((2 * values.size() + 7) / 8, '\0'), steps;
  int32_t before = 0;
  const auto append = [&]<typename T>(T step) {
    steps.append(reinterpret_cast<const char*>(&step), sizeof step);
  };
  for (size_t i = 0; i < values.size(); ++i) {
    const auto step =
        static_cast<int32_t>(static_cast<uint32_t>(values[i]) - static_cast<uint32_t>(before));
    before = values[i];
    int code = 0;  // a difference of 0 counts as the most frequent one
    if (step != 0) code = step == int8_t(step) ? 1 : step == int16_t(step) ? 2 : 3;
    codes[i / 4] = static_cast<char>(codes[i / 4] | code << 2 * (i % 4));
    if (code == 1) append(static_cast<int8_t>(step));
    if (code == 2) append(static_cast<int16_t>(step));
    if (code == 3) append(step);
  }
  return PackCrateBytes(std::string(4, '\0') + codes + steps);
}

}  // namespace retint
