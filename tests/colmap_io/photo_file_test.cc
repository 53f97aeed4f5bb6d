// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/photo_file.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "base/error.h"
#include "base/files.h"
#include "colmap_io/image_io.h"
#include "colmap_io/mask_names.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
using testing::ThrowsMessage;

constexpr int kWidth = 70, kHeight = 45;  // whole blocks of no kind

cv::Mat Picture(int type) {
  cv::Mat pixels(kHeight, kWidth, type);
  cv::theRNG().state = 7;
  cv::randu(pixels, 0, CV_MAT_DEPTH(type) == CV_8U ? 256 : 65536);
  return pixels;
}

std::string Encoded(const std::string& extension, const cv::Mat& pixels,
                    const std::vector<int>& how = {}) {
  std::vector<uint8_t> bytes;
  cv::imencode(extension, pixels, bytes, how);
  return {bytes.begin(), bytes.end()};
}

std::string Segment(char marker, const std::string& data) {
  const size_t length = data.size() + 2;
  return std::string("\xFF") + marker + char(length >> 8) + char(length & 255) + data;
}

// Orientation 6, as a camera that is held upright writes it.
const std::string kExif =
    std::string("Exif\0\0", 6) + std::string(
                                     "II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0"
                                     "\0\0\0\0",
                                     26);

// A change of pixels on the left.
Image Darker(Image image) {
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < 20; ++x) {
      for (int c = 0; c < 3; ++c) image(x, y, c) *= 0.5F;
    }
  }
  return image;
}

TEST(PhotoFile, AJpegKeepsItsQualityItsSegmentsAndItsOtherBlocks) {
  const TempFolder folder;
  for (const int quality : {60, 95}) {
    for (const int progressive : {0, 1}) {
      SCOPED_TRACE(quality);
      std::string bytes =
          Encoded(".jpg", Picture(CV_8UC3),
                  {cv::IMWRITE_JPEG_QUALITY, quality, cv::IMWRITE_JPEG_PROGRESSIVE, progressive});
      const std::string exif = Segment('\xE1', kExif);
      const std::string icc = Segment('\xE2', std::string("ICC_PROFILE\0\1\1 profile", 22));
      const std::string mpf = Segment('\xE2', std::string("MPF\0 further pictures", 21));
      bytes.insert(2, exif + icc + mpf);
      WriteFile(folder / "a.jpg", bytes);
      const PhotoFile file(folder / "a.jpg", kWidth, kHeight);
      EXPECT_EQ(file.With(file.Shown()), std::nullopt);
      const auto edited = file.With(Darker(file.Shown()));
      ASSERT_TRUE(edited);
      EXPECT_THAT(*edited, HasSubstr(exif));
      EXPECT_THAT(*edited, HasSubstr(icc));
      EXPECT_THAT(*edited, Not(HasSubstr("MPF")));
      WriteFile(folder / "b.jpg", *edited);
      // The same tables: the file's values are those of any file of that quality.
      const Image8 was = ReadImage8(folder / "a.jpg"), is = ReadImage8(folder / "b.jpg");
      EXPECT_EQ(AsJpegHolds(was, bytes)->data, AsJpegHolds(was, *edited)->data);
      for (int y = 0; y < kHeight; ++y) {
        // From two blocks of 16 pixels on, of which the second is smoothed at its left.
        for (int x = 48; x < kWidth; ++x) {
          for (int c = 0; c < 3; ++c) ASSERT_EQ(was(x, y, c), is(x, y, c)) << x << " " << y;
        }
      }
      EXPECT_LT(is(5, 20, 0) + is(8, 20, 0), was(5, 20, 0) + was(8, 20, 0));
    }
  }
}

TEST(PhotoFile, APhotoThatItsCameraSeesTurnedIsStoredAsItWas) {
  const TempFolder folder;
  std::string bytes = Encoded(".jpg", cv::Mat(kHeight, kWidth, CV_8UC3, cv::Scalar(99, 99, 99)));
  bytes.insert(2, Segment('\xE1', kExif));
  WriteFile(folder / "a.jpg", bytes);
  const PhotoFile file(folder / "a.jpg", kHeight, kWidth);
  Image shown = file.Shown();
  ASSERT_EQ(shown.width, kHeight);
  for (int y = 0; y < 16; ++y) {  // the top as it is shown: the left as it is stored
    for (int x = 0; x < shown.width; ++x) {
      for (int c = 0; c < 3; ++c) shown(x, y, c) = 1;
    }
  }
  WriteFile(folder / "b.jpg", file.With(shown).value());
  const Image8 stored = ReadImage8(folder / "b.jpg");
  ASSERT_EQ(stored.width, kWidth);
  EXPECT_GT(stored(4, 20), 240);
  EXPECT_NEAR(stored(40, 20), 99, 3);
}

TEST(PhotoFile, APngKeepsItsDepthItsAlphaAndItsChunks) {
  const TempFolder folder;
  for (const int type : {CV_8UC3, CV_16UC3, CV_8UC4, CV_8UC1}) {
    std::string bytes = Encoded(".png", Picture(type));
    const std::string chunk(
        "\0\0\0\x0BtEXtAuthor\0Anna"
        "\xD8\xF5\x84\x54",
        23);
    bytes.insert(33, chunk);  // behind IHDR
    WriteFile(folder / "a.png", bytes);
    const PhotoFile file(folder / "a.png", kWidth, kHeight);
    EXPECT_EQ(file.With(file.Shown()), std::nullopt);
    const auto edited = file.With(Darker(file.Shown()));
    ASSERT_TRUE(edited);
    EXPECT_THAT(*edited, StartsWith("\x89PNG"));
    EXPECT_THAT(*edited, HasSubstr(chunk));
    WriteFile(folder / "b.png", *edited);
    const cv::Mat was = cv::imread((folder / "a.png").string(), cv::IMREAD_UNCHANGED);
    const cv::Mat is = cv::imread((folder / "b.png").string(), cv::IMREAD_UNCHANGED);
    EXPECT_EQ(was.depth(), is.depth());
    EXPECT_EQ(is.channels(), type == CV_8UC4 ? 4 : 3);
    const cv::Rect right(20, 0, kWidth - 20, kHeight);
    if (type != CV_8UC1) {
      EXPECT_EQ(cv::norm(was(right), is(right), cv::NORM_INF), 0);
    }
  }
}

TEST(MaskNames, FourNamesAreFoundAndNoFileIsTheMaskOfTwo) {
  const TempFolder folder;
  for (size_t k = 0; k < kMaskNames.size(); ++k) {
    const auto names = MaskNamesOf(kMaskNames[k]);
    EXPECT_EQ(names, static_cast<MaskNames>(k));
    const auto file = MaskFile(folder / std::string(kMaskNames[k]), "sub/a.b.jpg", names);
    WritePng(file, Mask(2, 2));
    EXPECT_EQ(FindMask(folder / std::string(kMaskNames[k]), "sub/a.b.jpg"), file);
  }
  EXPECT_EQ(MaskFile("m", "sub/a.b.jpg", MaskNames::kColmap), "m/sub/a.b.jpg.png");
  EXPECT_EQ(MaskFile("m", "sub/a.b.jpg", MaskNames::kStem), "m/sub/a.b.png");
  EXPECT_EQ(MaskFile("m", "sub/a.b.jpg", MaskNames::kMask), "m/sub/a.b.mask.png");
  EXPECT_EQ(MaskFile("m", "sub/a.b.jpg", MaskNames::kMetashape), "m/sub/a.b_mask.png");
  EXPECT_THAT(
      [&] {
        FindMasks(folder / "stem", {"sub/a.b.jpg", "sub/a.b.tif"});
      },
      ThrowsMessage<InputError>(HasSubstr("would be the mask of sub/a.b.jpg and of")));
  EXPECT_THAT([&] { FindMasks(folder / "stem", {"c.jpg"}); },
              ThrowsMessage<InputError>(
                  HasSubstr("expected e.g. c.jpg.png, c.png, c.mask.png or c_mask.png")));
}

}  // namespace
}  // namespace retint
