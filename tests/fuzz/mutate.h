// SPDX-License-Identifier: BSD-3-Clause
// Bytes that are nearly a file.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>

namespace retint {

// One of the ways in which files go wrong: bits flipped, cut off, pieces repeated, lost, moved or
// taken from `other`, numbers that are extreme, in binary or in text.
inline void MutateOnce(std::mt19937& random, const std::string& other, std::string* bytes) {
  static constexpr std::array<uint64_t, 10> kExtremes = {
      0, 1, 0x7f, 0xff, 0x7fff, 0xffff, 0x7fffffff, 0xffffffff, 0x7fffffffffffffff, ~uint64_t{0}};
  static constexpr std::array<const char*, 10> kWords = {
      "0", "-1", "nan", "1e999", "99999999999999999999", "4294967296", "\"", "[", "}", "\n"};
  const auto below = [&](size_t n) { return n == 0 ? size_t{0} : size_t{random()} % n; };
  const size_t at = below(bytes->size());
  const size_t length = 1 + below(std::min<size_t>(64, bytes->size() - at));
  switch (random() % 9) {
    case 0:
      if (!bytes->empty()) (*bytes)[at] = static_cast<char>((*bytes)[at] ^ 1 << random() % 8);
      break;
    case 1:
      if (!bytes->empty()) (*bytes)[at] = static_cast<char>(random());
      break;
    case 2:
      bytes->resize(at);
      break;
    case 3:
      bytes->insert(below(bytes->size()), bytes->substr(at, length));
      break;
    case 4:
      bytes->erase(at, length);
      break;
    case 5: {
      const uint64_t value = kExtremes[below(kExtremes.size())];
      const size_t width = size_t{1} << below(4);
      if (at + width <= bytes->size()) std::memcpy(bytes->data() + at, &value, width);
      break;
    }
    case 6: {  // a number or a word of text
      constexpr const char* kNumber = "0123456789.-+e";
      const size_t begin = bytes->find_first_of(kNumber, at);
      if (begin == std::string::npos) break;
      const size_t end = std::min(bytes->find_first_not_of(kNumber, begin), bytes->size());
      bytes->replace(begin, end - begin, kWords[below(kWords.size())]);
      break;
    }
    case 7: {
      const size_t from = below(other.size());
      bytes->replace(at, length, other.substr(from, 1 + below(64)));
      break;
    }
    default: {
      const float value =
          std::array<float, 4>{1e38F, -1e-38F, std::nanf(""), INFINITY}[random() % 4];
      if (at + 4 <= bytes->size()) std::memcpy(bytes->data() + at, &value, 4);
    }
  }
}

}  // namespace retint
