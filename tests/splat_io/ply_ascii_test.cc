// SPDX-License-Identifier: BSD-3-Clause
// 3DGS .ply as text and with doubles.
#include <algorithm>
#include <charconv>

#include <gmock/gmock.h>

#include "splat_io/splat_io.h"
#include "tests/splat_io/ply_text.h"

namespace retint {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// The body of an all-float .ply as text, one row a line.
std::string AsciiBody(PlyText& ply) {
  std::string text;
  for (size_t r = 0; r < ply.count; ++r) {
    for (size_t c = 0; c < ply.columns.size(); ++c) {
      char number[32];
      const auto end = std::to_chars(number, number + 32, ply.Float(ply.columns[c].name, r)).ptr;
      text += (c > 0 ? " " : "") + std::string(number, end);
    }
    text += "\n";
  }
  return text;
}

std::string Ascii(PlyText ply) {
  const std::string body = AsciiBody(ply);
  ply.format = "ascii";
  return ply.Header() + body;
}

class PlyAsciiTest : public ::testing::Test {
 protected:
  GaussianModel Read(const std::string& bytes) {
    SpillFile(in_, bytes);
    return ReadSplat(in_);
  }
  std::string Refusal(const std::string& bytes) {
    SpillFile(in_, bytes);
    const std::string message = MessageOf<InputError>([&] { ReadSplat(in_); });
    EXPECT_THAT(message, AllOf(HasSubstr(in_.string() + ":"), Not(HasSubstr("\n"))));
    return message;
  }
  std::string Written(const GaussianModel& model) {
    WriteSplat(out_, model);
    return ReadFile(out_);
  }
  TempFolder folder_;
  const std::filesystem::path in_ = folder_ / "in.ply", out_ = folder_ / "out.ply";
};

TEST_F(PlyAsciiTest, IsWrittenAsTheSameBinary) {
  for (int degree = 0; degree <= 3; ++degree) {
    // 3000 rows of degree 3 are several blocks of text and of rows.
    const PlyText ply = PlyText::Canonical(degree == 3 ? 3000 : 5, degree);
    EXPECT_TRUE(Written(Read(Ascii(ply))) == ply.Bytes()) << degree;
  }
}

TEST_F(PlyAsciiTest, DoublesAreReadAndWrittenAsFloats) {
  PlyText ply = PlyText::Canonical(5, 1);
  const std::string floats = ply.Bytes();
  for (const char* name : {"y", "f_rest_3", "rot_3"}) {
    PlyText::Column& column = ply[name];
    for (size_t r = 0; r < ply.count; ++r) {
      float value;
      std::memcpy(&value, column.values[r].data(), sizeof(value));
      // Less than half a float's step more, which is lost.
      column.values[r] = PlyText::Raw(double(value) * (1 + 1e-9));
    }
    column.type = "double";
  }
  EXPECT_EQ(Written(Read(ply.Bytes())), floats);
  ply["y"].values[2] = PlyText::Raw(1e300);
  EXPECT_THAT(Refusal(ply.Bytes()), HasSubstr("Gaussian 2: y is infinite"));
}

TEST_F(PlyAsciiTest, TakesEveryWayToWriteANumber) {
  PlyText ply = PlyText::Canonical(1, 0);
  std::string bytes = Ascii(ply);
  bytes.resize(bytes.rfind('\n', bytes.size() - 2) + 1);
  bytes += "+1.5e0\t-2 1E-60 0 0 0\r\n 0.25 .5 5. 1 -1e1 2 3 \n\n 1 0 0 0 \r\n\n";
  const GaussianModel model = Read(bytes);
  EXPECT_THAT(model.means, ::testing::ElementsAre(1.5f, -2.0f, 0.0f));
  EXPECT_THAT(model.sh, ::testing::ElementsAre(0.25f, 0.5f, 5.0f));
  EXPECT_THAT(model.log_scales, ::testing::ElementsAre(-10.0f, 2.0f, 3.0f));
}

TEST_F(PlyAsciiTest, CarriesColumnsAndElementsOfEveryType) {
  PlyText ply = PlyText::Canonical(2, 0);
  ply.format = "ascii";
  const std::string body = AsciiBody(ply);
  const size_t line = body.find('\n');
  for (const char* type : {"char", "uchar", "short", "ushort", "int", "uint", "double"}) {
    ply.columns.push_back({type, std::string("my_") + type, {}});
  }
  ply.trailing_header = {"element face 2", "property list uchar short corners",
                         "property float weight"};
  const std::string ascii = ply.Header() + body.substr(0, line) +
                            " -128 255 -32768 65535 -2147483648 4294967295 0.1\n" +
                            body.substr(line + 1, body.size() - line - 2) +
                            " 127 0 32767 0 7 8 -1e300\n3 1 -2 3 0.5\n0 1.5\n";
  ply.format = "binary_little_endian";
  const auto values = [&](size_t column, std::string first, std::string second) {
    ply.columns[ply.columns.size() - 7 + column].values = {std::move(first), std::move(second)};
  };
  values(0, PlyText::Raw(int8_t{-128}), PlyText::Raw(int8_t{127}));
  values(1, PlyText::Raw(uint8_t{255}), PlyText::Raw(uint8_t{0}));
  values(2, PlyText::Raw(int16_t{-32768}), PlyText::Raw(int16_t{32767}));
  values(3, PlyText::Raw(uint16_t{65535}), PlyText::Raw(uint16_t{0}));
  values(4, PlyText::Raw(INT32_MIN), PlyText::Raw(int32_t{7}));
  values(5, PlyText::Raw(UINT32_MAX), PlyText::Raw(uint32_t{8}));
  values(6, PlyText::Raw(0.1), PlyText::Raw(-1e300));
  ply.trailing_bytes = PlyText::Raw(uint8_t{3}) + PlyText::Raw(int16_t{1}) +
                       PlyText::Raw(int16_t{-2}) + PlyText::Raw(int16_t{3}) + PlyText::Raw(0.5f) +
                       PlyText::Raw(uint8_t{0}) + PlyText::Raw(1.5f);
  EXPECT_EQ(Written(Read(ascii)), ply.Bytes());
}

TEST_F(PlyAsciiTest, DamageIsRefusedByGaussianColumnAndLine) {
  const PlyText ply = PlyText::Canonical(3, 0);
  const std::string good = Ascii(ply);
  const std::string header = ply.Header();
  const auto header_lines = std::count(header.begin(), header.end(), '\n');
  const auto spoiled = [&](const std::string& row) {
    const size_t end = good.size() - 1, begin = good.rfind('\n', end - 1) + 1;
    return good.substr(0, begin) + row;
  };
  const std::string at = "in.ply:" + std::to_string(header_lines + 3) + ": ";
  EXPECT_THAT(Refusal(spoiled("1 2 three 0 0 0 0 0 0 0 0 0 0 1 0 0 0\n")),
              HasSubstr(at + "Gaussian 2: z is \"three\", expected a number of type float"));
  EXPECT_THAT(Refusal(spoiled("1 2 3 0 0 0 0 0 0 0 0 0 0 1 0 0\n")),
              HasSubstr("truncated: Gaussian 2 lacks rot_3"));
  EXPECT_THAT(Refusal(spoiled("1 2 nan 0 0 0 0 0 0 0 0 0 0 1 0 0 0\n")),
              HasSubstr("Gaussian 2: z is NaN"));
  EXPECT_THAT(Refusal(spoiled("1 2 1e60 0 0 0 0 0 0 0 0 0 0 1 0 0 0\n")),
              HasSubstr("Gaussian 2: z is infinite"));
  EXPECT_THAT(Refusal(spoiled(std::string(1 << 20, '1'))),
              HasSubstr("expected numbers between spaces"));
  std::string many = good;
  many.replace(many.find("vertex 3"), 8, "vertex 99999999999");
  EXPECT_THAT(Refusal(many), HasSubstr("truncated: the header announces 99999999999 Gaussians"));
  // Cut anywhere but within the last number, which then is another one.
  for (size_t length = 0; length < good.size() - 20; length += 7) {
    SCOPED_TRACE(length);
    Refusal(good.substr(0, length));
  }
}

}  // namespace
}  // namespace retint
