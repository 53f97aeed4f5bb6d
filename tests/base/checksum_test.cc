// SPDX-License-Identifier: BSD-3-Clause
#include "base/checksum.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "tests/support/data.h"

namespace retint {
namespace {

// Figures of the reference program, xxhsum.
TEST(Checksum, IsXxh64) {
  EXPECT_EQ(HexText(Xxh64("")), "ef46db3751d8e999");
  EXPECT_EQ(HexText(Xxh64("a")), "d24ec4f1a98c6e5b");
  EXPECT_EQ(HexText(Xxh64("abc")), "44bc2cf5ad770999");
  EXPECT_EQ(HexText(Xxh64("Nobody inspects the spammish repetition")), "fbcea83c8a378bf1");
}

TEST(Checksum, DoesNotDependOnTheParts) {
  std::string bytes;
  for (int i = 0; i < 1000; ++i) bytes += static_cast<char>(i * 7 + i / 13);
  const uint64_t whole = Xxh64(bytes);
  for (const size_t part :
       {size_t{1}, size_t{3}, size_t{31}, size_t{32}, size_t{33}, size_t{999}}) {
    Xxh64Stream stream;
    for (size_t at = 0; at < bytes.size(); at += part) {
      stream.Add(std::string_view(bytes).substr(at, part));
    }
    EXPECT_EQ(stream.Get(), whole) << "parts of " << part;
  }
}

TEST(Checksum, OfAFileIsThatOfItsBytes) {
  const TempFolder folder;
  const std::string bytes(3 << 20, 'x');
  WriteFile(folder / "file", bytes);
  const FileChecksum sum = ChecksumFile(folder / "file");
  EXPECT_EQ(sum.bytes, bytes.size());
  EXPECT_EQ(sum.xxh64, Xxh64(bytes));
  EXPECT_THROW(ChecksumFile(folder / "none"), InputError);
  EXPECT_THROW(ChecksumFile(folder.path()), InputError);
}

}  // namespace
}  // namespace retint
