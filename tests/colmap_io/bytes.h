// SPDX-License-Identifier: BSD-3-Clause
// Little-endian bytes, spelled out apart from the library's own writer.
#pragma once

#include <bit>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>

namespace retint {

class Bytes {
 public:
  Bytes& U8(uint64_t value) { return Add(value, 1); }
  Bytes& U32(uint64_t value) { return Add(value, 4); }
  Bytes& U64(uint64_t value) { return Add(value, 8); }
  Bytes& F64(double value) { return Add(std::bit_cast<uint64_t>(value), 8); }
  Bytes& Pose(std::initializer_list<double> values) {
    for (const double value : values) F64(value);
    return *this;
  }
  Bytes& Text(std::string_view text) {
    out_ += text;
    return *this;
  }
  const std::string& str() const { return out_; }

 private:
  Bytes& Add(uint64_t value, int count) {
    for (int i = 0; i < count; ++i) out_ += static_cast<char>(value >> (8 * i) & 255);
    return *this;
  }
  std::string out_;
};

}  // namespace retint
