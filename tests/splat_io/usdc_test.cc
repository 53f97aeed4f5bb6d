// SPDX-License-Identifier: BSD-3-Clause
// OpenUSD crates: their tables, edits in place, damage.
#include <random>

#include <gmock/gmock.h>

#include "splat_io/splat_io.h"
#include "splat_io/splat_row.h"
#include "splat_io/usd_splats.h"
#include "splat_io/usdc_compression.h"
#include "splat_io/usdc_reader.h"
#include "tests/splat_io/ply_text.h"
#include "tests/splat_io/random_scene.h"

namespace retint {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using namespace std::string_literals;

TEST(CrateCompression, BlocksWithMatchesAreUnpacked) {
  // Three literals, a match of 9 bytes 3 back, which overlaps itself, then 5 literals.
  const std::string block = "\x35"s + "abc" + "\x03\x00"s + "\x50" + "hello";
  EXPECT_EQ(UnpackCrateBytes("\0"s + block, 100), "abcabcabcabchello");
  // Two chunks, each with its size.
  const std::string chunk = PlyText::Raw(static_cast<uint32_t>(block.size())) + block;
  EXPECT_EQ(UnpackCrateBytes("\x02" + chunk + chunk, 100), "abcabcabcabchelloabcabcabcabchello");
  // A match of 15 + 4 + 255 + 1 bytes.
  const std::string run = "\0\x1f"s + "x" + "\x01\0\xff\x01"s + "\0"s;
  EXPECT_EQ(UnpackCrateBytes(run, 1000), std::string(276, 'x'));
  for (const std::string& bad : {""s, "\0\x35"s, "\0"s + block.substr(0, 5), "\x02" + chunk,
                                 "\0\x35"s + "abc" + "\0\0"s, "\0\x35"s + "abc" + "\x04\0"s}) {
    EXPECT_THROW(UnpackCrateBytes(bad, 100), std::runtime_error);
  }
  EXPECT_THROW(UnpackCrateBytes("\0"s + block, 16), std::runtime_error);
  for (const size_t size : {0, 1, 14, 15, 16, 269, 270, 271, 5000}) {
    std::string bytes(size, '\0');
    for (size_t i = 0; i < size; ++i) bytes[i] = static_cast<char>(i * 7);
    EXPECT_EQ(UnpackCrateBytes(PackCrateBytes(bytes), size), bytes);
  }
}

TEST(CrateCompression, IntegersAreDifferences) {
  // The common difference is 10; codes of two bits, the first one lowest: 0 1 2 3, then 0.
  const std::string bytes = PlyText::Raw(int32_t{10}) + "\xe4\0"s + PlyText::Raw(int8_t{-3}) +
                            PlyText::Raw(int16_t{1000}) + PlyText::Raw(int32_t{-100000});
  EXPECT_THAT(UnpackCrateIntegers(PackCrateBytes(bytes), 5),
              ElementsAre(10, 7, 1007, -98993, -98983));
  EXPECT_THROW(UnpackCrateIntegers(PackCrateBytes(bytes), 1000), std::runtime_error);
  std::mt19937 random(1);
  std::vector<int32_t> values;
  for (int i = 0; i < 999; ++i) values.push_back(static_cast<int32_t>(random()) >> random() % 32);
  EXPECT_EQ(UnpackCrateIntegers(PackCrateIntegers(values), values.size()), values);
}

class UsdcTest : public ::testing::Test {
 protected:
  UsdcTest() : model_(RandomScene(20, 1)) {
    WriteSplat(folder_ / "good.usdc", model_);
    good_ = ReadFile(folder_ / "good.usdc");
    model_ = ReadSplat(folder_ / "good.usdc");
  }
  GaussianModel Read(const std::string& bytes) {
    SpillFile(folder_ / "in.usdc", bytes);
    return ReadSplat(folder_ / "in.usdc");
  }
  std::string Refusal(const std::string& bytes) {
    SpillFile(folder_ / "bad.usdc", bytes);
    const std::string message = MessageOf<InputError>([&] { ReadSplat(folder_ / "bad.usdc"); });
    EXPECT_THAT(message, AllOf(HasSubstr("bad.usdc:"), Not(HasSubstr("\n"))));
    return message;
  }
  // Where the array's count stands: before its first value.
  uint64_t ArrayAt(const std::string& first_value) const {
    const size_t at = good_.find(PlyText::Raw(uint64_t{20}) + first_value);
    EXPECT_NE(at, std::string::npos);
    return at;
  }
  // The file with another place, type and flags of an array, whose values are `bytes` at its end.
  // Our writer does not compress its table of fields.
  std::string Moved(CrateType type, uint64_t at, uint64_t flags, CrateType new_type,
                    const std::string& bytes) const {
    std::string moved = good_;
    const uint64_t from = kCrateArray | static_cast<uint64_t>(type) << 48 | at;
    const uint64_t to = kCrateArray | flags | static_cast<uint64_t>(new_type) << 48 | good_.size();
    const size_t place = moved.find(PlyText::Raw(from));
    EXPECT_NE(place, std::string::npos);
    return moved.replace(place, 8, PlyText::Raw(to)) + bytes;
  }
  std::string Opacity(size_t g) const {
    return PlyText::Raw(static_cast<float>(Sigmoid(model_.opacity_logits[g])));
  }

  TempFolder folder_;
  GaussianModel model_;
  std::string good_;
};

TEST_F(UsdcTest, AnEditChangesNothingElse) {
  const GaussianModel was = Read(good_);
  WriteSplat(folder_ / "out.usdc", was);
  EXPECT_EQ(ReadFile(folder_ / "out.usdc"), good_);
  GaussianModel edited = was;
  edited.sh[12 * 7 + 1] = 0.625F;
  WriteSplat(folder_ / "out.usdc", edited);
  const std::string out = ReadFile(folder_ / "out.usdc");
  ASSERT_EQ(out.size(), good_.size());
  size_t changed = 0;
  for (size_t i = 0; i < out.size(); ++i) changed += out[i] != good_[i];
  EXPECT_GT(changed, 0u);
  EXPECT_LE(changed, 4u);  // of one float
  EXPECT_EQ(ReadSplat(folder_ / "out.usdc").sh, edited.sh);
  WriteSplat(folder_ / "out.usd", edited);  // either text or a crate: as the source is
  EXPECT_EQ(ReadFile(folder_ / "out.usd"), out);
  GaussianModel fewer = RandomScene(3, 1);
  fewer.source = edited.source;
  WriteSplat(folder_ / "fewer.usdc", fewer);
  ExpectNear(fewer, ReadSplat(folder_ / "fewer.usdc"), {0, 2e-6, 1e-6, 0, 0, 1e-6});
}

TEST_F(UsdcTest, CompressedAndHalfArraysAreRead) {
  const uint64_t at = ArrayAt(Opacity(0));
  const auto compressed = [&](const std::string& values) {
    return Read(Moved(CrateType::kFloat, at, kCrateCompressed, CrateType::kFloat,
                      PlyText::Raw(uint64_t{20}) + values));
  };
  std::vector<int32_t> integers(20, 1);
  integers[3] = 0;
  const auto packed = [&] {
    const std::string bytes = PackCrateIntegers(integers);
    return PlyText::Raw(uint64_t{bytes.size()}) + bytes;
  };
  GaussianModel whole = compressed("i" + packed());
  EXPECT_LT(whole.opacity_logits[3], -10);
  EXPECT_GT(whole.opacity_logits[4], 10);
  const std::string table = "t" + PlyText::Raw(uint32_t{2}) + PlyText::Raw(0.25F);
  whole = compressed(table + PlyText::Raw(0.75F) + packed());
  EXPECT_NEAR(Sigmoid(whole.opacity_logits[3]), 0.25, 1e-6);
  EXPECT_NEAR(Sigmoid(whole.opacity_logits[19]), 0.75, 1e-6);
  // Colors are changed in place, opacities are not: then the stage is written anew.
  whole.sh[0] = 0.5F;
  WriteSplat(folder_ / "out.usdc", whole);
  EXPECT_EQ(ReadFile(folder_ / "out.usdc").size(), ReadFile(folder_ / "in.usdc").size());
  whole.opacity_logits[0] = 0;
  WriteSplat(folder_ / "out.usdc", whole);
  EXPECT_EQ(ReadFile(folder_ / "out.usdc").size(), good_.size());
  ExpectNear(whole, ReadSplat(folder_ / "out.usdc"), {0, 2e-6, 1e-6, 0, 0, 1e-6});

  std::string halves = PlyText::Raw(uint64_t{20});
  for (int i = 0; i < 20; ++i) halves += PlyText::Raw(FloatToHalf(0.5F + 0.01F * float(i)));
  GaussianModel half = Read(Moved(CrateType::kFloat, at, 0, CrateType::kHalf, halves));
  EXPECT_NEAR(Sigmoid(half.opacity_logits[19]), 0.69, 5e-4);  // half a step of halves
  half.opacity_logits[19] = 0;
  WriteSplat(folder_ / "out.usdc", half);
  EXPECT_EQ(ReadSplat(folder_ / "out.usdc").opacity_logits[19], 0);
}

// Two attributes may have one array, as writers that look for equal ones leave it.
TEST_F(UsdcTest, SharedArraysAreNotChangedInPlace) {
  const uint64_t extent = kCrateHeader;
  const std::string from =
      PlyText::Raw(kCrateArray | static_cast<uint64_t>(CrateType::kVec3f) << 48 | extent);
  const uint64_t means = ArrayAt(PlyText::Raw(model_.means[0]) + PlyText::Raw(-model_.means[1]));
  const std::string to =
      PlyText::Raw(kCrateArray | static_cast<uint64_t>(CrateType::kVec3f) << 48 | means);
  std::string shared = good_;
  shared.replace(shared.find(from), 8, to);
  GaussianModel model = Read(shared);
  model.means[0] += 1;
  WriteSplat(folder_ / "out.usdc", model);
  const std::string out = ReadFile(folder_ / "out.usdc");
  EXPECT_EQ(ReadSplat(folder_ / "out.usdc").means, model.means);
  EXPECT_NE(out.find(from), std::string::npos);  // an extent of its own again
}

// A crate whose `prims` prims all have one array of `count` zeros as their opacities.
std::string CrateOfOneArray(int32_t prims, uint64_t count) {
  const auto bytes_of = [](const std::string& packed) {
    return PlyText::Raw(uint64_t{packed.size()}) + packed;
  };
  const auto columns = [&](std::initializer_list<std::vector<int32_t>> lists) {
    std::string section = PlyText::Raw(uint64_t{lists.begin()->size()});
    for (const auto& list : lists) section += bytes_of(PackCrateIntegers(list));
    return section;
  };
  const std::string tokens =
      ";-)\0P\0opacities\0typeName\0default\0"s + std::string(kUsdSplatType) + "\0"s;
  const uint64_t reps[] = {
      kCrateInlined | static_cast<uint64_t>(CrateType::kToken) << 48 | 5,
      kCrateArray | static_cast<uint64_t>(CrateType::kFloat) << 48 | kCrateHeader};
  // The root, then prims with an attribute each; fields: none, the type, the array.
  std::vector<int32_t> paths = {0}, names = {0}, jumps = {-1}, fields = {0}, types = {7};
  for (int32_t i = 0; i < prims; ++i) {
    paths.insert(paths.end(), {2 * i + 1, 2 * i + 2});
    names.insert(names.end(), {1, -2});
    jumps.insert(jumps.end(), {i + 1 < prims ? 2 : -1, -2});
    fields.insert(fields.end(), {1, 3});
    types.insert(types.end(), {6, 1});
  }
  std::string field_section = columns({{3, 4}});
  field_section += bytes_of(PackCrateBytes({reinterpret_cast<const char*>(reps), sizeof reps}));
  const std::pair<const char*, std::string> sections[] = {
      {"TOKENS", PlyText::Raw(uint64_t{6}) + PlyText::Raw(uint64_t{tokens.size()}) +
                     bytes_of(PackCrateBytes(tokens))},
      {"STRINGS", std::string(8, '\0')},
      {"FIELDS", field_section},
      {"FIELDSETS", columns({{-1, 0, -1, 1, -1}})},
      {"PATHS", PlyText::Raw(uint64_t{paths.size()}) + columns({paths, names, jumps})},
      {"SPECS", columns({paths, fields, types})}};
  std::string crate = "PXR-USDC\0\x08"s;
  crate.resize(kCrateHeader);
  crate += PlyText::Raw(count) + std::string(4 * count, '\0');
  std::string table = PlyText::Raw(uint64_t{std::size(sections)});
  for (const auto& [name, section] : sections) {
    std::string padded = name;
    padded.resize(16);
    table += padded + PlyText::Raw(uint64_t{crate.size()}) + PlyText::Raw(uint64_t{section.size()});
    crate += section;
  }
  return crate.replace(16, 8, PlyText::Raw(uint64_t{crate.size()})) + table;
}

TEST_F(UsdcTest, MemoryIsBoundedHoweverManyAttributesNameAnArray) {
  // 40 kB a prim: 40 MB, and 256 times the file's 75 kB are 19 MB.
  EXPECT_THAT(Refusal(CrateOfOneArray(1000, 10'000)), HasSubstr("more than it can hold"));
  // A few may, and then it is the Gaussians that are missing.
  EXPECT_THAT(Refusal(CrateOfOneArray(10, 10'000)), HasSubstr("no Gaussians"));
}

TEST_F(UsdcTest, FaultsAreNamed) {
  std::string bad = good_;
  bad[9] = 6;
  EXPECT_THAT(Refusal(bad), HasSubstr("version 0.6 is not supported; supported: 0.7 to 0.13"));
  bad[9] = 99;
  EXPECT_THAT(Refusal(bad), HasSubstr("version 0.99"));
  bad = good_;
  bad.replace(16, 8, PlyText::Raw(uint64_t{1} << 60));
  EXPECT_THAT(Refusal(bad), HasSubstr("truncated"));
  bad = good_;
  bad.replace(bad.find("SPECS\0"s), 5, "SPOCK");
  EXPECT_THAT(Refusal(bad), HasSubstr("lacks its section SPECS"));
  bad = good_;
  bad.replace(ArrayAt(Opacity(0)), 8, PlyText::Raw(uint64_t{1} << 50));
  EXPECT_THAT(Refusal(bad), HasSubstr("values, more than it can hold"));
  bad.replace(ArrayAt(Opacity(0)), 8, PlyText::Raw(uint64_t{19}));
  EXPECT_THAT(Refusal(bad), HasSubstr("opacities has 19 values, not the 20 of 20 Gaussians"));
  for (size_t length = 1; length < good_.size(); length += 7) {
    SCOPED_TRACE(length);
    Refusal(good_.substr(0, length));
  }
}

}  // namespace
}  // namespace retint
