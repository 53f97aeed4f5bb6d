// SPDX-License-Identifier: BSD-3-Clause
#include "base/escaped_bytes.h"

#include <string>

#include <gtest/gtest.h>

#include "base/printable.h"

namespace retint {
namespace {

using std::string_literals::operator""s;

TEST(Printable, LeavesTextAsItIs) {
  for (const char* text :
       {"", "000.png: is not a picture", "фото 写真 🙂.jpg", "50 % <U+001B>"}) {
    EXPECT_EQ(Printable(text), text);
  }
}

TEST(Printable, ShowsControlCharacters) {
  EXPECT_EQ(Printable("a\x1b[31m\nb\r\0\x7f.png"s),
            "a<U+001B>[31m<U+000A>b<U+000D><U+0000><U+007F>.png");
  // Those above 127, which terminals obey too: U+009B begins a sequence as ESC [ does.
  EXPECT_EQ(Printable("\xC2\x80\xC2\x9B\xC2\x9F\xC2\xA0"), "<U+0080><U+009B><U+009F>\xC2\xA0");
}

TEST(Printable, ShowsBytesThatAreNoUtf8) {
  EXPECT_EQ(Printable("\xFF.png"), "<0xFF>.png");
  EXPECT_EQ(Printable("\x9B"), "<0x9B>");
  EXPECT_EQ(Printable("\xE2\x82"), "<0xE2><0x82>");            // cut off
  EXPECT_EQ(Printable("\xC0\xAF"), "<0xC0><0xAF>");            // overlong
  EXPECT_EQ(Printable("\xED\xA0\x80"), "<0xED><0xA0><0x80>");  // a surrogate
  EXPECT_EQ(Printable("\xFFы"), "<0xFF>ы");
}

TEST(EscapeBytes, ComesBack) {
  for (const std::string& bytes : {"a%b\n\xFF"s, "ы%\0"s, "\xE2\x82"s, "plain.png"s}) {
    EXPECT_EQ(UnescapeBytes(EscapeBytes(bytes)), bytes);
  }
  EXPECT_EQ(EscapeBytes("ы\x7f"), "ы%7F");
  EXPECT_EQ(EscapeBytes("ы\xFF"), "%D1%8B%FF");
}

}  // namespace
}  // namespace retint
