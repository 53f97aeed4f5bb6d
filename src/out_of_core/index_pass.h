// SPDX-License-Identifier: BSD-3-Clause
// Internal to out_of_core: a splat's file from front to back, one piece read ahead, and the
// checksum of all that went by.
#pragma once

#include <cstdint>
#include <future>
#include <string>
#include <string_view>

#include "base/checksum.h"
#include "splat_io/ply_file.h"

namespace retint {

// Two pieces are in memory.
class IndexPass {
 public:
  IndexPass(const PlyFile& file, uint64_t piece_bytes);

  // The next piece of the records; empty at their end. Valid until the next call.
  std::string_view Next();
  // XXH64 of the whole file, after the last piece.
  uint64_t Checksum();

 private:
  uint64_t end() const { return file_.first_byte() + file_.count() * file_.record_bytes(); }
  void ReadAhead();

  const PlyFile& file_;
  uint64_t piece_, at_;
  Xxh64Stream sum_;
  std::string current_, next_;
  std::future<void> read_, hashed_;  // last: their threads use the rest
};

}  // namespace retint
