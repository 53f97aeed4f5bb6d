// SPDX-License-Identifier: BSD-3-Clause
#include "out_of_core/index_pass.h"

#include <algorithm>

namespace retint {

IndexPass::IndexPass(const PlyFile& file, uint64_t piece_bytes)
    : file_(file), piece_(piece_bytes), at_(file.first_byte()) {
  std::string head(file.first_byte(), '\0');
  file.ReadBytes(0, head.data(), head.size());
  sum_.Add(head);
  ReadAhead();
}

std::string_view IndexPass::Next() {
  if (hashed_.valid()) hashed_.get();  // of the piece that is read over now
  if (!read_.valid()) return {};
  read_.get();
  std::swap(current_, next_);
  ReadAhead();
  // Beside the parsing of the caller.
  hashed_ = std::async(std::launch::async, [this] { sum_.Add(current_); });
  return current_;
}

uint64_t IndexPass::Checksum() {
  if (hashed_.valid()) hashed_.get();
  for (uint64_t at = end(); at < file_.stamp().bytes; at += current_.size()) {
    current_.resize(std::min(piece_, file_.stamp().bytes - at));
    file_.ReadBytes(at, current_.data(), current_.size());
    sum_.Add(current_);
  }
  return sum_.Get();
}

void IndexPass::ReadAhead() {
  const uint64_t size = std::min(piece_, end() - at_);
  if (size == 0) return;
  next_.resize(size);
  read_ = std::async(std::launch::async,
                     [this, from = at_] { file_.ReadBytes(from, next_.data(), next_.size()); });
  at_ += size;
}

}  // namespace retint
