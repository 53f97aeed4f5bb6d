// SPDX-License-Identifier: BSD-3-Clause
#include <functional>
#include <limits>
#include <random>

#include <sys/stat.h>

#include <gmock/gmock.h>

#include "splat_io/splat_io.h"
#include "tests/splat_io/ply_text.h"

namespace retint {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::string Refusal(const std::filesystem::path& path, const std::string& bytes) {
  SpillFile(path, bytes);
  const std::string message = MessageOf<InputError>([&] { ReadSplat(path); });
  EXPECT_THAT(message, AllOf(HasSubstr(path.string() + ":"), Not(HasSubstr("\n"))));
  return message;
}

void Replace(std::string& text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
}

struct BadPly {
  const char* name;
  std::function<void(PlyText&)> spoil;  // the parts, before they are joined
  const char* fault;
};

void PrintTo(const BadPly& bad, std::ostream* out) { *out << bad.fault; }

class BadPlyTest : public ::testing::TestWithParam<BadPly> {};

TEST_P(BadPlyTest, IsRefusedByName) {
  const TempFolder folder;
  PlyText ply = PlyText::Canonical(5, 1);
  GetParam().spoil(ply);
  EXPECT_THAT(Refusal(folder / "bad.ply", ply.Bytes()), HasSubstr(GetParam().fault));
}

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

INSTANTIATE_TEST_SUITE_P(
    Faults, BadPlyTest,
    ::testing::Values(
        BadPly{"NaN", [](PlyText& p) { p["scale_1"].values[3] = PlyText::Raw(kNaN); },
               "Gaussian 3: scale_1 is NaN"},
        BadPly{"Infinity", [](PlyText& p) { p["f_rest_8"].values[4] = PlyText::Raw(-kInfinity); },
               "Gaussian 4: f_rest_8 is infinite"},
        BadPly{"FirstFaultOfAField",
               [](PlyText& p) {
                 p["rot_0"].values[2] = PlyText::Raw(kNaN);
                 p["rot_3"].values[1] = PlyText::Raw(kInfinity);
               },
               "Gaussian 1: rot_3 is infinite"},
        BadPly{"MissingColumn", [](PlyText& p) { p.Remove("opacity"); },
               "not a 3DGS .ply: vertex lacks opacity"},
        BadPly{"MissingColumns",
               [](PlyText& p) {
                 p.Remove("scale_2");
                 p.Remove("f_dc_1");
               },
               "vertex lacks scale_2, f_dc_1"},
        BadPly{"PointCloud", [](PlyText& p) { p.columns.resize(3); },
               "vertex lacks rot_0, rot_1, rot_2, rot_3, scale_0, scale_1, scale_2, opacity, ... "
               "(11 in all)"},
        BadPly{"RestCount", [](PlyText& p) { p.Remove("f_rest_8"); },
               "8 f_rest_* columns; 0, 9, 24, 45 or 72"},
        BadPly{"RestNumbering", [](PlyText& p) { p["f_rest_4"].name = "f_rest_9"; },
               "vertex lacks f_rest_4"},
        BadPly{"IntColumn", [](PlyText& p) { p["y"].type = "int"; },
               "bad.ply:5: property y is int, expected float or double"},
        BadPly{"RepeatedColumn", [](PlyText& p) { p["ny"].name = "nx"; },
               "bad.ply:8: second property \"nx\""},
        BadPly{"ListColumn", [](PlyText& p) { p["nz"].type = "list uchar int"; },
               "bad.ply:9: list property nz in element vertex is not supported"},
        BadPly{"UnknownType", [](PlyText& p) { p["nz"].type = "half"; },
               "bad.ply:9: unknown type \"half\""},
        BadPly{"NoGaussians", [](PlyText& p) { p.count = 0; }, "holds no Gaussians"},
        BadPly{"BigEndian", [](PlyText& p) { p.format = "binary_big_endian"; },
               "this is a PLY of format binary_big_endian, not supported; supported: binary_"}),
    [](const auto& test) { return std::string(test.param.name); });

// As in other programs, which read only the announced Gaussians.
TEST(BadFileTest, WhatFollowsTheGaussiansIsIgnored) {
  const TempFolder folder;
  PlyText ply = PlyText::Canonical(5, 1);
  SpillFile(folder / "good.ply", ply.Bytes());
  ply.trailing_bytes = "xyz";
  SpillFile(folder / "more.ply", ply.Bytes());
  const GaussianModel good = ReadSplat(folder / "good.ply"), more = ReadSplat(folder / "more.ply");
  EXPECT_EQ(more.sh, good.sh);
  EXPECT_THAT(more.source.notes,
              testing::ElementsAre(HasSubstr("3 bytes after the last of 5 Gaussians are ignored")));
  WriteSplat(folder / "again.ply", more);
  EXPECT_EQ(ReadFile(folder / "again.ply"), ReadFile(folder / "good.ply"));

  WriteSplat(folder / "good.compressed.ply", good);
  SpillFile(folder / "more.compressed.ply", ReadFile(folder / "good.compressed.ply") + "xyz");
  EXPECT_THAT(ReadSplat(folder / "more.compressed.ply").source.notes,
              testing::ElementsAre(HasSubstr("3 bytes after the last of 5 Gaussians are ignored")));
}

struct BadHeader {
  const char* name;
  std::string from, to, fault;
};

void PrintTo(const BadHeader& bad, std::ostream* out) { *out << bad.fault; }

class BadHeaderTest : public ::testing::TestWithParam<BadHeader> {};

TEST_P(BadHeaderTest, IsRefusedByName) {
  const TempFolder folder;
  std::string bytes = PlyText::Canonical(5, 0).Bytes();
  Replace(bytes, GetParam().from, GetParam().to);
  EXPECT_THAT(Refusal(folder / "bad.ply", bytes), HasSubstr(GetParam().fault));
}

INSTANTIATE_TEST_SUITE_P(
    Faults, BadHeaderTest,
    ::testing::Values(
        BadHeader{"NotPly", "ply\n", "plain\n", "not a PLY file"},
        BadHeader{"NoFormat", "format binary_little_endian 1.0\n", "", "no format line"},
        BadHeader{"OtherVersion", "endian 1.0", "endian 2.0", "bad.ply:2: expected a format line"},
        BadHeader{"TwoFormats", "1.0\n", "1.0\nformat ascii 1.0\n", "bad.ply:3: second format"},
        BadHeader{"CountIsNoNumber", "vertex 5", "vertex five", "bad.ply:3: expected \"element"},
        BadHeader{"CountIsNegative", "vertex 5", "vertex -5", "bad.ply:3: expected \"element"},
        BadHeader{"CountOverflows", "vertex 5", "vertex 99999999999999999999",
                  "bad.ply:3: expected \"element"},
        BadHeader{"CountIsHuge", "vertex 5", "vertex 18446744073709551615", "truncated"},
        BadHeader{"CountWraps", "vertex 5", "vertex 4611686018427387905", "truncated"},
        BadHeader{"OneTooMany", "vertex 5", "vertex 6",
                  "truncated: the header announces 6 Gaussians of 68 bytes, 340 bytes follow"},
        BadHeader{"NoVertex", "element vertex 5", "element point 5", "element point stands"},
        BadHeader{"ElementBefore", "element vertex",
                  "element camera 1\nproperty float f\nelement vertex", "element camera stands"},
        BadHeader{"TwoVertex", "end_header", "element vertex 1\nend_header", "second element"},
        BadHeader{"PropertyFirst", "element vertex 5\n", "", "bad.ply:3: property before any"},
        BadHeader{"NoName", "property float x\n", "property float\n", "bad.ply:4: expected"},
        BadHeader{"BadList", "property float nx\n", "property list half int a\n", "bad.ply:7"},
        BadHeader{"UnknownLine", "end_header", "wat \x01\x02 is this\nend_header",
                  "unknown PLY header line \"wat ?? is this\""},
        BadHeader{"EmptyLine", "end_header", "\nend_header", "empty line"}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(BadFileTest, HeaderWithoutEnd) {
  const TempFolder folder;
  std::string bytes = PlyText::Canonical(1, 0).Header();
  bytes.resize(bytes.size() - 11);
  EXPECT_THAT(Refusal(folder / "a.ply", bytes), HasSubstr("PLY header has no end_header line"));
  while (bytes.size() < (2 << 20)) bytes += "comment " + std::string(1000, 'c') + "\n";
  EXPECT_THAT(Refusal(folder / "b.ply", bytes), HasSubstr("no end_header line in its first MiB"));
}

TEST(BadFileTest, EveryTruncationIsRefused) {
  const TempFolder folder;
  const std::string bytes = PlyText::Canonical(2, 0).Bytes();
  for (size_t length = 0; length < bytes.size(); ++length) {
    SCOPED_TRACE(length);
    Refusal(folder / "bad.ply", bytes.substr(0, length));
  }
}

// Damage is either refused with one line or harmless; nothing else may happen (under the
// sanitizers, nothing at all).
TEST(BadFileTest, DamagedBytesNeverCrash) {
  const TempFolder folder;
  const std::string good = PlyText::Canonical(2, 1).Bytes();
  const size_t header = PlyText::Canonical(2, 1).Header().size();
  std::mt19937 random(1);
  int refused = 0;
  for (int i = 0; i < 1500; ++i) {
    std::string bytes = good;
    for (int flips = 1 + i % 3; flips > 0; --flips) {
      bytes[random() % header] = static_cast<char>(random());
    }
    SpillFile(folder / "bad.ply", bytes);
    try {
      const GaussianModel model = ReadSplat(folder / "bad.ply");
      EXPECT_NO_THROW(model.Validate());
      EXPECT_EQ(model.NumGaussians(), 2u);
    } catch (const InputError& error) {
      ++refused;
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
  EXPECT_GT(refused, 1000);
}

TEST(BadFileTest, MissingFolderEmptyAndUnknownFiles) {
  const TempFolder folder;
  const auto message = [](const std::filesystem::path& path) {
    return MessageOf<InputError>([&] { ReadSplat(path); });
  };
  EXPECT_THAT(message(folder / "none.ply"), HasSubstr("none.ply: No such file or directory"));
  EXPECT_THAT(message(folder.path()), HasSubstr("not a file"));
  ASSERT_EQ(mkfifo((folder / "pipe.ply").c_str(), 0600), 0);
  EXPECT_THAT(message(folder / "pipe.ply"), HasSubstr("not a file"));
  EXPECT_THAT(Refusal(folder / "empty.ply", ""), HasSubstr("empty file"));
  EXPECT_THAT(Refusal(folder / "a.ply", "PK\x03\x04"), HasSubstr("a zip archive"));
  EXPECT_THAT(Refusal(folder / "a.pth", "PK\x03\x04"), HasSubstr("a PyTorch checkpoint"));
  EXPECT_THAT(Refusal(folder / "a.txt", "hello"), HasSubstr("not a known splat format"));
}

}  // namespace
}  // namespace retint
