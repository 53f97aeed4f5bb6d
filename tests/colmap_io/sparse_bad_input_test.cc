// SPDX-License-Identifier: BSD-3-Clause
// Damaged models: each answered by one InputError that names the file, none by a crash or by taking
// memory that the file does not hold.
#include <cstring>
#include <fstream>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "colmap_io/sparse.h"
#include "tests/colmap_io/tiny_model.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

// Without WriteFile's fsync, which thousands of damaged files would wait for.
void Put(const std::filesystem::path& path, const std::string& bytes) {
  std::filesystem::remove(path);  // file systems wait for the disk when a file is cut and rewritten
  std::ofstream(path, std::ios::binary) << bytes;
}

constexpr const char* kParts[] = {"cameras", "images", "points3D"};

class SparseBadInputTest : public ::testing::Test {
 protected:
  void SetUp() override {
    WriteReconstructionBinary(Binary(), TinyModel());
    WriteReconstructionText(Text(), TinyModel());
  }
  std::filesystem::path Binary() const { return folder_ / "b"; }
  std::filesystem::path Text() const { return folder_ / "t"; }

  // Overwrites the bytes at `offset` of a binary part.
  template <typename T>
  void Patch(const char* part, size_t offset, T value) {
    const auto path = Binary() / (std::string(part) + ".bin");
    std::string bytes = ReadFile(path);
    ASSERT_LE(offset + sizeof(T), bytes.size());
    std::memcpy(bytes.data() + offset, &value, sizeof(T));
    Put(path, bytes);
  }
  // Replaces `from`, which must be there, in a text part.
  void Replace(const char* part, const std::string& from, const std::string& to) {
    const auto path = Text() / (std::string(part) + ".txt");
    std::string text = ReadFile(path);
    const size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    Put(path, text.replace(at, from.size(), to));
  }
  template <typename Matcher>
  void ExpectRefused(const std::filesystem::path& model, const Matcher& message) {
    EXPECT_THAT([&] { ReadReconstruction(model); }, ThrowsMessage<InputError>(message));
  }

  // Read without one record, of which a warning tells.
  template <typename Matcher>
  void ExpectLeftOut(const std::filesystem::path& model, const Matcher& message) {
    const Reconstruction whole = TinyModel();
    std::vector<std::string> warnings;
    const Reconstruction read = ReadReconstruction(model, &warnings);
    EXPECT_EQ(read.cameras.size() + read.views.size() + read.points.size() + 1,
              whole.cameras.size() + whole.views.size() + whole.points.size());
    EXPECT_THAT(warnings, Contains(AllOf(message, HasSubstr("; it is left out"))));
  }

  TempFolder folder_;
};

TEST_F(SparseBadInputTest, CutAnywhereInABinaryFile) {
  for (const char* part : kParts) {
    const auto path = Binary() / (std::string(part) + ".bin");
    const std::string whole = ReadFile(path);
    for (size_t length = 0; length < whole.size(); ++length) {
      Put(path, whole.substr(0, length));
      try {
        ReadReconstruction(Binary());
        FAIL() << part << " cut to " << length << " of " << whole.size() << " bytes was read";
      } catch (const InputError& error) {
        ExpectOneLineNaming(error, path.string() + ": truncated");
      }
    }
    Put(path, whole);
  }
}

TEST_F(SparseBadInputTest, CutAnywhereInATextFile) {
  // Text cut at a blank can be complete in itself; it must then be told by the count in its
  // comment, unless only the last record's tail is gone.
  for (const char* part : kParts) {
    const auto path = Text() / (std::string(part) + ".txt");
    const std::string whole = ReadFile(path);
    const size_t last_record = whole.rfind('\n', whole.size() - 3) + 1;
    for (size_t length = whole.find("\n# Number") + 20; length < whole.size(); ++length) {
      Put(path, whole.substr(0, length));
      std::vector<std::string> warnings;
      try {
        ReadReconstruction(Text(), &warnings);
        if (length <= last_record && std::strcmp(part, "images") != 0) {
          EXPECT_FALSE(warnings.empty()) << part << " cut to " << length;
        }
      } catch (const InputError& error) {
        ExpectOneLineNaming(error, path.string() + ":");
      }
    }
    Put(path, whole);
  }
}

TEST_F(SparseBadInputTest, DamagedBytesAreReadOrRefused) {
  // Whatever the bytes, the answer is a model or an InputError: anything else fails the test.
  std::mt19937 random(7);
  for (const char* part : kParts) {
    const auto path = Binary() / (std::string(part) + ".bin");
    const std::string whole = ReadFile(path);
    for (size_t at = 0; at < whole.size(); ++at) {
      for (const int value : {0x00, 0x7F, 0xFF, static_cast<int>(random() & 255)}) {
        std::string damaged = whole;
        damaged[at] = static_cast<char>(value);
        Put(path, damaged);
        try {
          ReadReconstruction(Binary());
        } catch (const InputError& error) {
          ExpectOneLineNaming(error, path.string());
        }
      }
    }
    Put(path, whole);
  }
}

TEST_F(SparseBadInputTest, CountsThatExceedTheFile) {
  // Records in the file's head; the second would make count * size overflow.
  for (const char* part : kParts) {
    for (const uint64_t count : {uint64_t{1000}, uint64_t{1} << 61, ~uint64_t{0}}) {
      SetUp();
      Patch(part, 0, count);
      ExpectRefused(Binary(), AllOf(HasSubstr(std::string(part) + ".bin: truncated: "),
                                    HasSubstr(std::to_string(count))));
    }
  }
  // Observations of the first image: after count, id, pose, camera and "a.jpg".
  SetUp();
  Patch("images", 8 + 4 + 56 + 4 + 6, ~uint64_t{0} / 3);
  ExpectRefused(Binary(), HasSubstr("images.bin: truncated: "));
  // Track of the first point.
  SetUp();
  Patch("points3D", 8 + 8 + 24 + 3 + 8, uint64_t{1} << 62);
  ExpectRefused(Binary(), HasSubstr("track elements of point 7"));
}

TEST_F(SparseBadInputTest, NameWithoutEnd) {
  std::string bytes = ReadFile(Binary() / "images.bin");
  bytes.resize(8 + 4 + 56 + 4 + 3);
  bytes.append(200, 'x');
  Put(Binary() / "images.bin", bytes);
  ExpectRefused(Binary(), HasSubstr("images.bin: truncated: "));
}

TEST_F(SparseBadInputTest, UnknownModelId) {
  for (const int32_t id : {-1, 18, 1 << 30}) {
    Patch("cameras", 8 + 4, id);
    ExpectRefused(Binary(),
                  HasSubstr("cameras.bin: camera 1 has unknown model id " + std::to_string(id)));
  }
  Replace("cameras", "SIMPLE_PINHOLE", "KANNALA");
  ExpectRefused(Text(), HasSubstr("cameras.txt:5: camera 4 has unknown model \"KANNALA\""));
}

TEST_F(SparseBadInputTest, WrongNumberOfParameters) {
  Replace("cameras", "51.5 32 24", "51.5 32");
  ExpectRefused(Text(), HasSubstr("cameras.txt:4: camera 1: PINHOLE takes 4 parameters, not 3"));
  SetUp();
  Replace("cameras", "51.5 32 24", "51.5 32 24 0");
  ExpectRefused(Text(), HasSubstr("cameras.txt:4: camera 1: PINHOLE takes 4 parameters, not 5"));
}

TEST_F(SparseBadInputTest, SizesOutOfRange) {
  for (const uint64_t width : {uint64_t{0}, uint64_t{1} << 32, ~uint64_t{0}}) {
    Patch("cameras", 8 + 8, width);
    ExpectRefused(Binary(), AllOf(HasSubstr("cameras.bin"), HasSubstr("is out of range")));
  }
  Patch("cameras", 8 + 8, uint64_t{1'000'000});
  Patch("cameras", 8 + 16, uint64_t{1'000'000});
  ExpectRefused(Binary(), HasSubstr("image size 1000000x1000000 is out of range"));
  Replace("cameras", "64 48", "64 -48");
  ExpectRefused(Text(), HasSubstr("cameras.txt:4: HEIGHT is not an integer: \"-48\""));
}

TEST_F(SparseBadInputTest, FocalLengthMustBePositive) {
  Patch("cameras", 8 + 24, 0.0);
  ExpectRefused(Binary(), HasSubstr("camera 1: focal length is not positive"));
}

TEST_F(SparseBadInputTest, NotANumberAnywhere) {
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  const struct {
    const char* part;
    size_t offset;
    const char* what;
  } kPlaces[] = {
      {"cameras", 8 + 24 + 8, "camera 1: camera parameter"},
      {"images", 8 + 4 + 8, "image 2: rotation"},
      {"images", 8 + 4 + 32 + 16, "image 2: translation"},
      {"images", 8 + 4 + 56 + 4 + 6 + 8 + 24 + 8, "image 2: observation 1"},
      {"points3D", 8 + 8 + 8, "point 7: point coordinate"},
      {"points3D", 8 + 8 + 24 + 3, "point 7: point error"},
  };
  for (const auto& place : kPlaces) {
    for (const double value : {nan, infinity, -infinity}) {
      SetUp();
      Patch(place.part, place.offset, value);
      const auto message =
          AllOf(HasSubstr(std::string(place.part) + ".bin: " + place.what), HasSubstr("(byte "));
      if (place.part == kParts[0]) {
        ExpectRefused(Binary(), message);  // two images have it
      } else {
        ExpectLeftOut(Binary(), message);
      }
    }
  }
}

TEST_F(SparseBadInputTest, NotANumberAnywhereInText) {
  const struct {
    const char *part, *from, *to, *message;
    bool refused = true;
  } kCases[] = {
      {"cameras", "51.5", "nan", "cameras.txt:4: PARAMS is NaN"},
      {"cameras", "51.5", "1e400", "cameras.txt:4: PARAMS is out of range"},
      {"images", "-2.5", "inf", "images.txt:5: TZ is infinite", false},
      {"images", "10.5", "-NAN", "images.txt:6: POINTS2D X is NaN", false},
      {"points3D", "30000000000", "Infinity", "points3D.txt:4: Z is infinite", false},
      {"points3D", "30000000000", "3e999", "points3D.txt:4: Z is out of range", false},
      {"points3D", "30000000000", "3e10x", "points3D.txt:4: Z is not a number: \"3e10x\""},
      {"points3D", "255", "256", "points3D.txt:4: R is not an integer: \"256\""},
      {"points3D", "255", "-1", "points3D.txt:4: R is not an integer"},
      {"points3D", " 3 0\n", " 3\n", "points3D.txt:5: TRACK POINT2D_IDX is missing"},
      {"images", "1 2 9", "1 2", "images.txt:8: POINTS2D POINT3D_ID is missing"},
      {"images", "1 2 9", "1 2 -2", "images.txt:8: POINT3D_ID is not an integer: \"-2\""},
      {"images", " a.jpg", "", "images.txt:5: NAME is missing"},
      {"images", "2 0.8", "2, 0.8", "not by commas"},
  };
  for (const auto& item : kCases) {
    SetUp();
    Replace(item.part, item.from, item.to);
    if (item.refused) {
      ExpectRefused(Text(), HasSubstr(item.message));
    } else {
      ExpectLeftOut(Text(), HasSubstr(item.message));
    }
  }
}

TEST_F(SparseBadInputTest, ImagesOnOneLineEach) {
  // A frequent slip in hand-made files: the empty second lines left out.
  Put(Text() / "images.txt", "1 1 0 0 0 0 0 0 1 a.jpg\n2 1 0 0 0 0 0 0 1 b.jpg\n");
  ExpectRefused(Text(), HasSubstr("images.txt:2: "));
}

TEST_F(SparseBadInputTest, ZeroRotation) {
  for (const size_t offset : {12, 28}) Patch("images", offset, 0.0);
  ExpectLeftOut(Binary(), HasSubstr("images.bin: image 2 has a zero rotation"));
  // Without another image, the file ends there.
  Put(Text() / "images.txt", "2 0 0 0 0 0 0 0 1 a.jpg\n\n");
  ExpectRefused(Text(), HasSubstr("images.txt:1: image 2 has a zero rotation"));
}

TEST_F(SparseBadInputTest, CamerasThatNoImageHasMayBeBad) {
  Reconstruction more = TinyModel();
  Camera unused = more.cameras.begin()->second;
  unused.id = 90;
  more.cameras.emplace(unused.id, unused);
  WriteReconstructionBinary(Binary(), more);
  WriteReconstructionText(Text(), more);
  const auto expect = [&](const std::filesystem::path& folder, const std::string& message) {
    std::vector<std::string> warnings;
    EXPECT_EQ(ReadReconstruction(folder, &warnings).cameras, TinyModel().cameras);
    EXPECT_THAT(warnings, testing::ElementsAre(HasSubstr(message)));
  };
  const size_t last = ReadFile(Binary() / "cameras.bin").size() - 4 * sizeof(double);
  Patch("cameras", last, 0.0);
  expect(Binary(), "cameras.bin: camera 90: focal length is not positive");
  Replace("cameras", "\n90 PINHOLE", "\n90 CATADIOPTRIC");
  expect(Text(), "cameras.txt:6: camera 90 has unknown model \"CATADIOPTRIC\"");
}

TEST_F(SparseBadInputTest, ManyBadRecordsAreCounted) {
  std::string text = ReadFile(Text() / "points3D.txt");
  for (int id = 100; id < 107; ++id) text += std::to_string(id) + " nan 0 0 1 2 3 0.5\n";
  Put(Text() / "points3D.txt", text);
  std::vector<std::string> warnings;
  EXPECT_EQ(ReadReconstruction(Text(), &warnings).points.size(), TinyModel().points.size());
  ASSERT_EQ(warnings.size(), 4u);
  EXPECT_THAT(warnings[3], HasSubstr("points3D.txt: 4 more records left out"));
}

TEST_F(SparseBadInputTest, IdsAndNamesThatComeTwice) {
  Patch("points3D", 8 + 59, uint64_t{7});
  ExpectRefused(Binary(), HasSubstr("points3D.bin: point 7 twice"));
  Replace("images", "\n3 0.8", "\n2 0.8");
  ExpectRefused(Text(), HasSubstr("images.txt:7: image 2 twice"));
  SetUp();
  Replace("cameras", "\n4 SIMPLE", "\n1 SIMPLE");
  ExpectRefused(Text(), HasSubstr("cameras.txt:5: camera 1 twice"));
  SetUp();
  Replace("images", "sub/b c.png", "a.jpg");
  ExpectRefused(Text(), HasSubstr("images.txt: two images are named \"a.jpg\""));
}

TEST_F(SparseBadInputTest, ImageWithoutName) {
  Patch("images", 8 + 4 + 56 + 4, '\0');
  ExpectRefused(Binary(), HasSubstr("image 2 has no name"));
}

TEST_F(SparseBadInputTest, BytesAfterTheEndAreToldNotRefused) {
  Put(Binary() / "points3D.bin", ReadFile(Binary() / "points3D.bin") + "more");
  std::vector<std::string> warnings;
  EXPECT_EQ(ReadReconstruction(Binary(), &warnings).points.size(), 2u);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0], HasSubstr("points3D.bin: 4 bytes after the last record are ignored"));
}

TEST_F(SparseBadInputTest, MissingFiles) {
  ExpectRefused(folder_ / "none", HasSubstr("none: is not a folder"));
  std::filesystem::create_directory(folder_ / "empty");
  ExpectRefused(folder_ / "empty", HasSubstr("empty: holds no COLMAP model"));
  std::filesystem::remove(Binary() / "images.bin");
  ExpectRefused(Binary(), HasSubstr("images.bin: is missing"));
  std::filesystem::remove(Text() / "cameras.txt");
  ExpectRefused(Text(), HasSubstr("cameras.txt: is missing"));
}

}  // namespace
}  // namespace retint
