// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/png_text.h"

#include <gtest/gtest.h>

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "tests/support/data.h"

namespace retint {
namespace {

TEST(PngText, StandsBesideTheSamePixels) {
  const TempFolder folder;
  Mask mask(5, 3);
  mask(2, 1) = 255;
  const std::string plain = EncodePng(mask), text = "größe.onnx (xxh64 0f, CPU)";
  WriteFile(folder / "mask.png", WithPngText(plain, kOutlinedBy, text));
  EXPECT_EQ(ReadPngText(folder / "mask.png", kOutlinedBy), text);
  EXPECT_EQ(ReadPngText(folder / "mask.png", "Outlined"), "") << "another keyword";
  EXPECT_EQ(ReadMask(folder / "mask.png").data, mask.data);
  WriteFile(folder / "plain.png", plain);
  EXPECT_EQ(ReadPngText(folder / "plain.png", kOutlinedBy), "");
}

// As another program's reader sees it: zlib's checksum of the type and the text, in the order of a
// network. The bytes are those that Python's zlib.crc32() and struct.pack() make.
TEST(PngText, IsAChunkOfPng) {
  const std::string plain = EncodePng(Mask(1, 1)), with = WithPngText(plain, "A", "b");
  const std::string chunk = std::string("\0\0\0\7iTXtA\0\0\0\0\0b\x50\xb1\x3d\xde", 19);
  EXPECT_EQ(with, plain.substr(0, 33) + chunk + plain.substr(33));
}

TEST(PngText, ReadsNothingOfDamagedFiles) {
  const TempFolder folder;
  const std::string whole = WithPngText(EncodePng(Mask(4, 4)), kOutlinedBy, "a network");
  for (size_t length = 0; length < whole.size(); ++length) {
    WriteFile(folder / "cut.png", whole.substr(0, length));
    const std::string text = ReadPngText(folder / "cut.png", kOutlinedBy);
    EXPECT_TRUE(text.empty() || text == "a network") << length;
  }
  std::string endless = whole;
  endless.replace(33, 4, "\xff\xff\xff\xff");
  WriteFile(folder / "endless.png", endless);
  EXPECT_EQ(ReadPngText(folder / "endless.png", kOutlinedBy), "");
  WriteFile(folder / "escapes.png",
            WithPngText(EncodePng(Mask(4, 4)), kOutlinedBy, "a\x1b[2J\n" + std::string(9000, 'x')));
  const std::string text = ReadPngText(folder / "escapes.png", kOutlinedBy);
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
  EXPECT_LT(text.size(), 1100U);
}

}  // namespace
}  // namespace retint
