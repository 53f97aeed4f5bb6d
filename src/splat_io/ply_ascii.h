// SPDX-License-Identifier: BSD-3-Clause
// Reads the body of an ascii PLY block by block, as the bytes that a binary little-endian PLY would
// have.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/input_file.h"
#include "base/ply_header.h"

namespace retint {

class PlyAscii {
 public:
  // Starts after the header. Reads nothing yet.
  PlyAscii(const InputFile& file, const PlyHeader& header);

  // Reads `count` rows of scalars into the first bytes of `to`. `first`: index of the first row,
  // for messages. InputError with the line for a value that is missing, not a number or out of its
  // type's range.
  void ReadRows(const PlyElement& element, size_t first, size_t count, std::vector<char>& to);
  // Appends a whole element, including lists, to `to`, which grows with the values found.
  void ReadElement(const PlyElement& element, std::vector<char>& to);
  // Whether only white space is left.
  bool AtEnd() { return NextWord().empty(); }

 private:
  std::string_view NextWord();  // empty at the end of the file; valid until the next call
  bool Refill();
  // Reads one value of a PLY type into `to`, which must have room for it.
  void ReadValue(const std::string& type, const std::string& name, char* to);
  [[noreturn]] void Fail(const std::string& fault) const;

  const InputFile& file_;
  uint64_t offset_;  // of the next block
  std::string buffer_;
  size_t position_ = 0;  // in buffer_
  int64_t line_ = 1;
  std::string row_name_;  // "Gaussian 3", for messages
};

}  // namespace retint
