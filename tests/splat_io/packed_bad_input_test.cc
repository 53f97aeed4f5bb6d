// SPDX-License-Identifier: BSD-3-Clause
// Damaged files of the formats that store rounded values: one line that names the fault, whatever
// they announce.
#include <functional>
#include <random>

#include <gmock/gmock.h>

#include "splat_io/compression.h"
#include "splat_io/splat_io.h"
#include "tests/splat_io/ply_text.h"
#include "tests/splat_io/random_scene.h"

namespace retint {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

std::string Written(const TempFolder& folder, const std::string& extension,
                    const GaussianModel& model) {
  WriteSplat(folder / ("good" + extension), model);
  return ReadFile(folder / ("good" + extension));
}

std::string Refusal(const std::filesystem::path& path, const std::string& bytes) {
  SpillFile(path, bytes);
  const std::string message = MessageOf<InputError>([&] { ReadSplat(path); });
  EXPECT_THAT(message, AllOf(HasSubstr(path.string() + ":"), Not(HasSubstr("\n"))));
  return message;
}

template <typename T>
std::string Replaced(std::string bytes, size_t at, T value) {
  const std::string raw = PlyText::Raw(value);
  EXPECT_LE(at + raw.size(), bytes.size());
  return bytes.replace(at, raw.size(), raw);
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string Zipped(const std::string& bytes) {
  const std::vector<char> packed = Gzip(bytes, [](size_t) {});
  return {packed.begin(), packed.end()};
}

std::string Unzipped(const std::string& packed) {
  UnsetVector<char> bytes;
  Gunzip(
      packed, 16, [](std::string_view) { return size_t{8} << 20; }, [](size_t) {}, bytes);
  return {bytes.begin(), bytes.end()};
}

class PackedDamageTest : public ::testing::TestWithParam<const char*> {};

TEST_P(PackedDamageTest, EveryTruncationIsRefused) {
  const TempFolder folder;
  const std::string good = Written(folder, GetParam(), RandomScene(3, 1));
  const bool headless = std::string(GetParam()) == ".splat";
  for (size_t length = 0; length < good.size(); ++length) {
    SCOPED_TRACE(length);
    // Whole records of a format without a header are a file.
    if (headless && length > 0 && length % 32 == 0) continue;
    Refusal(folder / (std::string("bad") + GetParam()), good.substr(0, length));
  }
}

// But for those behind a .ply, see BadFileTest.
TEST_P(PackedDamageTest, BytesBehindTheEndAreRefused) {
  if (std::string(GetParam()).ends_with(".ply")) return;
  const TempFolder folder;
  const std::string good = Written(folder, GetParam(), RandomScene(3, 1));
  Refusal(folder / (std::string("bad") + GetParam()), good + "x");
}

// Damage is either refused with one line or harmless; nothing else may happen (under the
// sanitizers, nothing at all).
TEST_P(PackedDamageTest, DamagedBytesNeverCrash) {
  const TempFolder folder;
  const std::filesystem::path path = folder / (std::string("bad") + GetParam());
  const std::string good = Written(folder, GetParam(), RandomScene(3, 1));
  std::mt19937 random(1);
  for (int i = 0; i < 1500; ++i) {
    std::string bytes = good;
    for (int flips = 1 + i % 3; flips > 0; --flips) {
      bytes[random() % bytes.size()] = static_cast<char>(random());
    }
    SpillFile(path, bytes);
    try {
      const GaussianModel model = ReadSplat(path);
      EXPECT_NO_THROW(model.Validate());
      EXPECT_LE(model.NumGaussians(), bytes.size());
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, PackedDamageTest,
                         ::testing::Values(".splat", ".compressed.ply", ".spz"),
                         [](const auto& test) {
                           std::string name = test.param + 1;
                           std::erase(name, '.');
                           return name;
                         });

TEST(DotSplatDamageTest, BadValuesAreNamed) {
  const TempFolder folder;
  const std::filesystem::path bad = folder / "bad.splat";
  const std::string good = Written(folder, ".splat", RandomScene(3, 0));
  EXPECT_THAT(Refusal(bad, Replaced(good, 32 + 4, NAN)), HasSubstr("Gaussian 1: mean is NaN"));
  EXPECT_THAT(Refusal(bad, Replaced(good, 64 + 12, -1.0f)), HasSubstr("Gaussian 2: scale is NaN"));
  EXPECT_THAT(Refusal(bad, Replaced(good, 64 + 12, INFINITY)),
              HasSubstr("Gaussian 2: scale is infinite"));
  EXPECT_THAT(Refusal(bad, good + "x"), HasSubstr("97 bytes are no whole number of records"));
  EXPECT_THAT(Refusal(bad, ""), HasSubstr("empty file"));
}

TEST(CompressedPlyDamageTest, FaultsAreNamed) {
  const TempFolder folder;
  const std::filesystem::path bad = folder / "bad.compressed.ply";
  const std::string good = Written(folder, ".compressed.ply", RandomScene(300, 1));
  const size_t body = good.find("end_header\n") + 11;
  const auto refusal = [&](const std::string& from, const std::string& to) {
    return Refusal(bad, Replaced(good, from, to));
  };
  EXPECT_THAT(Refusal(bad, Replaced(good, body + 72, NAN)),
              HasSubstr("Gaussian 256: mean is NaN"));  // the second chunk's min_x
  EXPECT_THAT(refusal("vertex 300", "vertex 301"), HasSubstr("truncated"));
  EXPECT_THAT(refusal("vertex 300", "vertex 299"), HasSubstr("do not match the 299 Gaussians"));
  EXPECT_THAT(refusal("vertex 300", "vertex 18446744073709551615"), HasSubstr("truncated"));
  EXPECT_THAT(refusal("vertex 300", "vertex 1152921504606846976"), HasSubstr("truncated"));
  EXPECT_THAT(refusal("vertex 300", "vertex 0"), HasSubstr("no Gaussians"));
  EXPECT_THAT(refusal("chunk 2", "chunk 1"), HasSubstr("do not match"));
  EXPECT_THAT(refusal("sh 300", "sh 200"), HasSubstr("do not match"));
  EXPECT_THAT(refusal("property float max_b\n", ""), HasSubstr("17 properties of element chunk"));
  EXPECT_THAT(refusal("float min_y", "float min_q"), HasSubstr("expected min_y"));
  EXPECT_THAT(refusal("uint packed_scale", "int packed_scale"), HasSubstr("packed_scale"));
  EXPECT_THAT(refusal("property uint packed_color\n", ""), HasSubstr("lacks packed values"));
  EXPECT_THAT(refusal("property uchar f_rest_8\n", ""), HasSubstr("8 properties of element sh"));
  EXPECT_THAT(refusal("element sh", "element hs"), HasSubstr("chunk, vertex and"));
  EXPECT_THAT(refusal("binary_little", "binary_big"), HasSubstr("format binary_big_endian"));
}

// Without bounds of color, as older writers left them out, colors lie in [0, 1].
TEST(CompressedPlyDamageTest, ChunksWithoutColorsAreRead) {
  const TempFolder folder;
  std::string bytes = Written(folder, ".compressed.ply", RandomScene(3, 0));
  for (const char* name : {"min_r", "min_g", "min_b", "max_r", "max_g", "max_b"}) {
    bytes = Replaced(bytes, std::string("property float ") + name + "\n", "");
  }
  const size_t body = bytes.find("end_header\n") + 11;
  bytes.erase(body + 48, 24);
  SpillFile(folder / "old.compressed.ply", bytes);
  const GaussianModel model = ReadSplat(folder / "old.compressed.ply");
  for (size_t g = 0; g < 3; ++g) {
    const auto byte = static_cast<uint8_t>(bytes[body + 48 + 16 * g + 15]);  // the highest: red
    EXPECT_NEAR(0.5 + 0.28209479 * model.sh[3 * g], byte / 255.0, 1e-6);
  }
  WriteSplat(folder / "again.compressed.ply", model);
  EXPECT_EQ(ReadFile(folder / "again.compressed.ply"), bytes);
}

// RFC 1952, 2.2: a gzip file may have several members.
TEST(SpzDamageTest, SeveralGzipMembersAreOne) {
  const TempFolder folder;
  const std::string whole = Written(folder, ".spz", RandomScene(300, 1));
  const std::string bytes = Unzipped(whole);
  for (const size_t cut : {size_t{1}, size_t{20}, bytes.size() / 2, bytes.size()}) {
    SpillFile(folder / "two.spz", Zipped(bytes.substr(0, cut)) + Zipped(bytes.substr(cut)));
    EXPECT_EQ(ReadSplat(folder / "two.spz").sh, ReadSplat(folder / "good.spz").sh) << cut;
  }
  EXPECT_THAT(Refusal(folder / "bad.spz", whole + "xyz"), HasSubstr("3 bytes follow"));
  EXPECT_THAT(Refusal(folder / "bad.spz", whole + Zipped("more")), HasSubstr("bytes follow"));
  EXPECT_THAT(Refusal(folder / "bad.spz", whole + Zipped("more").substr(0, 12)),
              HasSubstr("truncated"));
}

TEST(SpzDamageTest, FaultsAreNamed) {
  const TempFolder folder;
  const std::filesystem::path bad = folder / "bad.spz";
  const std::string zipped = Written(folder, ".spz", RandomScene(3, 1));
  const std::string good = Unzipped(zipped);
  const auto refusal = [&](size_t at, auto value) {
    const std::string bytes = Replaced(good, at, value);
    const std::string message = Refusal(bad, Zipped(bytes));
    EXPECT_EQ(Refusal(bad, bytes), message);  // unpacked, as some writers leave it
    return message;
  };
  EXPECT_THAT(refusal(4, uint32_t{9}), HasSubstr("SPZ version 9 is not supported"));
  EXPECT_THAT(refusal(8, uint32_t{0}), HasSubstr("no Gaussians"));
  EXPECT_THAT(refusal(8, uint32_t{4}), HasSubstr("truncated: the header announces 4 Gaussians"));
  EXPECT_THAT(refusal(8, uint32_t{2}), HasSubstr("bytes follow the last value"));
  EXPECT_THAT(refusal(12, uint8_t{5}), HasSubstr("SH degree 5"));
  EXPECT_THAT(refusal(13, uint8_t{25}), HasSubstr("25 fractional bits"));
  EXPECT_THAT(Refusal(bad, Zipped(Replaced(good, 8, uint32_t{4294967295}))),
              HasSubstr("truncated: the header announces 4294967295 Gaussians, more than"));
  EXPECT_THAT(Refusal(bad, Zipped("no splat at all")), HasSubstr("a gzip file"));
  std::string broken = zipped;
  broken[broken.size() - 6] ^= 1;  // of the checksum
  EXPECT_THAT(Refusal(bad, broken), HasSubstr("the compressed data is damaged"));
}

// A small file that unpacks to much more than its header announces, or that announces much more
// than it can hold, is refused before the memory is taken.
TEST(SpzDamageTest, BombsAreRefused) {
  const TempFolder folder;
  const std::string good = Unzipped(Written(folder, ".spz", RandomScene(3, 0)));
  const std::string bomb = Zipped(good + std::string(64 << 20, '\0'));
  ASSERT_LT(bomb.size(), size_t{1} << 20);
  EXPECT_THAT(Refusal(folder / "a.spz", bomb),
              HasSubstr("holds more data than its header announces"));
  const uint32_t many = (64 << 20) / 20;
  EXPECT_THAT(
      Refusal(folder / "b.spz", Zipped(Replaced(good, 8, many) + std::string(64 << 20, '\0'))),
      HasSubstr("more than"));
}

// A packed stream's own length is compared before anything is unpacked.
TEST(SpzDamageTest, LengthsAreComparedBeforeTheUnpacking) {
  size_t steps = 0;
  const std::string zeros(size_t{100} << 20, '\0');
  const std::string zipped = Zipped(zeros);
  UnsetVector<char> bytes;
  const auto gunzip = [&](size_t most) {
    Gunzip(
        zipped, 16, [&](std::string_view) { return most; }, [&](size_t) { ++steps; }, bytes);
  };
  EXPECT_THAT([&] { gunzip(size_t{70} << 20); },
              ThrowsMessage<std::runtime_error>(HasSubstr("holds more data than its header")));
  EXPECT_EQ(steps, 0u);
  gunzip(zeros.size());
  EXPECT_EQ(bytes.size(), zeros.size());
  const std::vector<char> frame = Zstd(zeros);
  steps = 0;
  EXPECT_THAT(
      [&] {
        Unzstd({frame.data(), frame.size()}, size_t{70} << 20, [&] { ++steps; });
      },
      ThrowsMessage<std::runtime_error>(HasSubstr("holds more data than its header")));
  EXPECT_EQ(steps, 0u);
}

// Large enough that Gaussians are decoded during the unpacking, which never happens for unpacked
// files.
TEST(SpzTest, DecodingBesideTheUnpackingGivesTheSame) {
  const TempFolder folder;
  std::string bytes = Unzipped(Written(folder, ".spz", RandomScene(60000, 3)));
  ASSERT_GT(bytes.size(), size_t{3} << 20);
  const auto expect_the_same = [&] {
    SpillFile(folder / "packed.spz", Zipped(bytes));
    SpillFile(folder / "raw.spz", bytes);
    const GaussianModel packed = ReadSplat(folder / "packed.spz");
    const GaussianModel raw = ReadSplat(folder / "raw.spz");
    EXPECT_TRUE(packed.means == raw.means);
    EXPECT_TRUE(packed.quats_wxyz == raw.quats_wxyz);
    EXPECT_TRUE(packed.log_scales == raw.log_scales);
    EXPECT_TRUE(packed.opacity_logits == raw.opacity_logits);
    EXPECT_TRUE(packed.sh == raw.sh);
  };
  expect_the_same();
  std::string broken = Zipped(bytes);
  broken[broken.size() - 6] ^= 1;  // of the checksum, after all Gaussians
  EXPECT_THAT(Refusal(folder / "broken.spz", broken), HasSubstr("the compressed data is damaged"));
  // Other axes, which are known at the end.
  bytes[14] = 2;
  bytes +=
      PlyText::Raw(uint32_t{0xADBE0003}) + PlyText::Raw(uint32_t{4}) + PlyText::Raw(uint32_t{6});
  expect_the_same();
}

TEST(SpzDamageTest, ExtensionsAreKeptAndTheirAxesObeyed) {
  const TempFolder folder;
  const GaussianModel model = RandomScene(3, 1);
  std::string bytes = Unzipped(Written(folder, ".spz", model));
  bytes[14] = 2;
  const std::string other = PlyText::Raw(uint32_t{0x12340001}) + PlyText::Raw(uint32_t{3}) + "abc";
  const auto axes = [](uint32_t system) {
    return PlyText::Raw(uint32_t{0xADBE0003}) + PlyText::Raw(uint32_t{4}) + PlyText::Raw(system);
  };
  // 6 is right-down-front: y and z are not turned.
  SpillFile(folder / "a.spz", Zipped(bytes + other + axes(6)));
  const GaussianModel turned = ReadSplat(folder / "a.spz");
  for (size_t g = 0; g < 3; ++g) {
    EXPECT_NEAR(turned.means[3 * g], model.means[3 * g], 1e-5);
    EXPECT_NEAR(turned.means[3 * g + 1], -model.means[3 * g + 1], 1e-5);
    EXPECT_NEAR(turned.means[3 * g + 2], -model.means[3 * g + 2], 1e-5);
  }
  WriteSplat(folder / "b.spz", turned);
  EXPECT_EQ(Unzipped(ReadFile(folder / "b.spz")), bytes + other + axes(6));
  EXPECT_THAT(Refusal(folder / "c.spz", Zipped(bytes + axes(17))),
              HasSubstr("coordinate system 17"));
  EXPECT_THAT(Refusal(folder / "c.spz", Zipped(bytes + other.substr(0, 9))),
              HasSubstr("truncated"));
}

}  // namespace
}  // namespace retint
