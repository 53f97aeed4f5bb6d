// SPDX-License-Identifier: BSD-3-Clause
// Photos as cameras and other tools store them.
#include "colmap_io/photo.h"

#include <zlib.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

// After <cstdio>, whose FILE it uses without including it.
#include <jpeglib.h>
#include <cstdio>

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

// Left third red, the rest black; top row white.
Image8 Picture(int width, int height) {
  Image8 image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) {
        image(x, y, c) = uint8_t(y < height / 4 ? 255 : (x < width / 3 && c == 0 ? 255 : 0));
      }
    }
  }
  return image;
}

std::string JpegBytes(const Image8& image) {
  cv::Mat bgr(image.height, image.width, CV_8UC3);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      for (int c = 0; c < 3; ++c) bgr.at<cv::Vec3b>(y, x)[2 - c] = image(x, y, c);
    }
  }
  std::vector<uint8_t> bytes;
  cv::imencode(".jpg", bgr, bytes, {cv::IMWRITE_JPEG_QUALITY, 100});
  return {bytes.begin(), bytes.end()};
}

std::string Number(uint32_t value, int bytes, bool big) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += char(value >> (8 * (big ? bytes - 1 - i : i)) & 255);
  return text;
}

// The TIFF of an EXIF that gives the orientation and nothing else.
std::string Exif(int orientation, bool big) {
  const auto number = [&](uint32_t value, int bytes) { return Number(value, bytes, big); };
  return (big ? "MM" : "II") + number(42, 2) + number(8, 4) + number(1, 2) +  // of one entry:
         number(0x0112, 2) + number(3, 2) + number(1, 4) + number(uint32_t(orientation), 2) +
         number(0, 2) + number(0, 4);
}

const std::string kExif("Exif\0\0", 6);

// The bytes with an EXIF segment that gives the orientation.
std::string WithOrientation(const std::string& jpeg, int orientation, bool big) {
  const std::string segment = kExif + Exif(orientation, big);
  return jpeg.substr(0, 2) + "\xFF\xE1" + Number(uint32_t(segment.size() + 2), 2, true) + segment +
         jpeg.substr(2);
}

// The same as the chunk of a PNG file, behind its header.
std::string PngWithOrientation(const std::string& png, const std::string& exif) {
  const std::string chunk = "eXIf" + exif;
  const auto sum = crc32(0, reinterpret_cast<const Bytef*>(chunk.data()), uInt(chunk.size()));
  return png.substr(0, 33) + Number(uint32_t(exif.size()), 4, true) + chunk +
         Number(uint32_t(sum), 4, true) + png.substr(33);
}

// A WebP file of one picture becomes an extended one, which may have EXIF (RFC 9649, 2.7).
std::string WebpWithOrientation(const std::string& webp, int width, int height,
                                const std::string& exif) {
  const auto number = [](size_t value, int bytes) {
    return Number(uint32_t(value), bytes, /*big=*/false);
  };
  const std::string body = "WEBPVP8X" + number(10, 4) + number(8, 4) +
                           number(size_t(width - 1), 3) + number(size_t(height - 1), 3) +
                           webp.substr(12) + "EXIF" + number(exif.size(), 4) + exif;
  return "RIFF" + number(body.size(), 4) + body;
}

TEST(Photo, SizesAreReadFromTheHeader) {
  const TempFolder folder;
  WritePng(folder / "a.png", Image8(31, 17));
  WriteFile(folder / "a.jpg", WithOrientation(JpegBytes(Image8(40, 24)), 6, true));
  WriteFile(folder / "text", "not a picture");
  EXPECT_EQ(ReadImageSize(folder / "a.png"), std::pair(31, 17));
  EXPECT_EQ(ReadImageSize(folder / "a.jpg"), std::pair(40, 24));
  EXPECT_EQ(ReadImageSize(folder / "text"), std::nullopt);
  EXPECT_EQ(ReadImageSize(folder / "missing"), std::nullopt);
}

TEST(Photo, StoredPixelsCountAndExifOnlyWhereTheyDoNotFit) {
  const TempFolder folder;
  const Image8 stored = Picture(48, 32);
  for (const bool big : {true, false}) {
    WriteFile(folder / "p.jpg", WithOrientation(JpegBytes(stored), 6, big));
    // COLMAP ignores the tag: a camera of the stored size sees the stored pixels.
    const Image same = ReadPhotoOfSize(folder / "p.jpg", 48, 32);
    EXPECT_GT(same(40, 2, 2), 0.9F);  // the white top
    EXPECT_GT(same(4, 20, 0), 0.9F);  // the red left
    EXPECT_LT(same(4, 20, 2), 0.1F);
    // A camera that stands upright sees it turned clockwise: the top is on the right, the left
    // at the top.
    const Image turned = ReadPhotoOfSize(folder / "p.jpg", 32, 48);
    EXPECT_GT(turned(30, 40, 2), 0.9F);
    EXPECT_GT(turned(10, 4, 0), 0.9F);
    EXPECT_LT(turned(10, 4, 2), 0.1F);
    EXPECT_LT(turned(10, 40, 0), 0.1F);
  }
  // Counterclockwise: the top is on the left, the left at the bottom.
  WriteFile(folder / "p.jpg", WithOrientation(JpegBytes(stored), 8, true));
  const Image left = ReadPhotoOfSize(folder / "p.jpg", 32, 48);
  EXPECT_GT(left(2, 10, 2), 0.9F);
  EXPECT_GT(left(20, 44, 0), 0.9F);
  // Without the tag it is another picture.
  WriteFile(folder / "p.jpg", JpegBytes(stored));
  EXPECT_THAT([&] { ReadPhotoOfSize(folder / "p.jpg", 32, 48); },
              ThrowsMessage<InputError>(HasSubstr("photo is 48x32, its camera says 32x48")));
}

TEST(Photo, PngAndWebpFilesAreTurnedToo) {
  const TempFolder folder;
  const Image8 stored = Picture(48, 32);
  WritePng(folder / "stored.png", stored);
  std::vector<uint8_t> webp;
  cv::imencode(".webp", cv::imread((folder / "stored.png").string()), webp,
               {cv::IMWRITE_WEBP_QUALITY, 101});  // without loss
  WriteFile(folder / "p.png", PngWithOrientation(ReadFile(folder / "stored.png"), Exif(6, true)));
  // Some programs write the bytes before the TIFF in a JPEG.
  for (const std::string& before : {std::string(), kExif}) {
    const std::string exif = before + Exif(6, before.empty());
    WriteFile(folder / "p.webp",
              WebpWithOrientation({webp.begin(), webp.end()}, stored.width, stored.height, exif));
    for (const char* name : {"p.png", "p.webp"}) {
      EXPECT_EQ(ReadImage8(folder / name).data, stored.data) << name;
      const Image turned = ReadPhotoOfSize(folder / name, 32, 48);
      EXPECT_EQ(turned(30, 40, 2), 1.0F) << name;  // the white top is on the right
      EXPECT_EQ(turned(10, 4, 0), 1.0F) << name;   // the red left at the top
      EXPECT_EQ(turned(10, 4, 2), 0.0F) << name;
    }
  }
}

// Without compression, in one strip.
std::string TiffBytes(const Image8& image, int orientation) {
  constexpr int kEntries = 10;
  constexpr uint32_t kBitsAt = 8 + 2 + 12 * kEntries + 4, kPixelsAt = kBitsAt + 6;
  std::string tiff("II*\0\x08\0\0\0", 8);
  const auto number = [&](uint32_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) tiff += char(value >> (8 * i) & 255);
  };
  const auto entry = [&](uint32_t tag, uint32_t count, uint32_t value) {
    constexpr uint32_t kShort = 3, kLong = 4;
    const bool is_long = tag == 273 || tag == 279;
    number(tag, 2);
    number(is_long ? kLong : kShort, 2);
    number(count, 4);
    number(value, 4);
  };
  number(kEntries, 2);
  entry(256, 1, uint32_t(image.width));
  entry(257, 1, uint32_t(image.height));
  entry(258, 3, kBitsAt);
  entry(259, 1, 1);  // not compressed
  entry(262, 1, 2);  // RGB
  entry(273, 1, kPixelsAt);
  entry(274, 1, uint32_t(orientation));
  entry(277, 1, 3);
  entry(278, 1, uint32_t(image.height));
  entry(279, 1, uint32_t(image.data.size()));
  number(0, 4);
  for (int channel = 0; channel < 3; ++channel) number(8, 2);
  return tiff + std::string(image.data.begin(), image.data.end());
}

TEST(Photo, TiffFilesAreReadAsStoredAndTurnedOnlyWhereTheyDoNotFit) {
  const TempFolder folder;
  const Image8 stored = Picture(48, 32);
  for (int orientation = 1; orientation <= 8; ++orientation) {
    WriteFile(folder / "p.tif", TiffBytes(stored, orientation));
    EXPECT_EQ(ReadImage8(folder / "p.tif").data, stored.data) << orientation;
    EXPECT_EQ(ReadMask(folder / "p.tif").width, 48) << orientation;
  }
  WriteFile(folder / "p.tif", TiffBytes(stored, 6));
  const Image turned = ReadPhotoOfSize(folder / "p.tif", 32, 48);
  EXPECT_EQ(turned(30, 40, 2), 1.0F);  // the white top is on the right
  EXPECT_EQ(turned(10, 4, 0), 1.0F);   // the red left at the top
  EXPECT_EQ(turned(10, 4, 2), 0.0F);
}

TEST(Photo, OtherSizesOfTheSameShapeAreScaled) {
  const TempFolder folder;
  WritePng(folder / "p.png", Picture(96, 64));
  const Image half = ReadPhotoOfSize(folder / "p.png", 48, 32);
  EXPECT_EQ(half.width, 48);
  // Areas are averaged: the edges lie on whole pixels of the small picture.
  EXPECT_EQ(half(15, 20, 0), 1.0F);
  EXPECT_EQ(half(16, 20, 0), 0.0F);
  EXPECT_EQ(half(40, 7, 1), 1.0F);
  EXPECT_EQ(half(40, 8, 1), 0.0F);
  const Image twice = ReadPhotoOfSize(folder / "p.png", 192, 128);
  EXPECT_EQ(twice(20, 100, 0), 1.0F);
  // A third, rounded to whole pixels.
  EXPECT_EQ(ReadPhotoOfSize(folder / "p.png", 32, 21).height, 21);
  EXPECT_THROW(ReadPhotoOfSize(folder / "p.png", 32, 18), InputError);
  // A thirteenth of a large photo, rounded down; three pixels less is another shape.
  WritePng(folder / "p.png", Image8(1040, 1013));
  EXPECT_EQ(ReadPhotoOfSize(folder / "p.png", 80, 77).height, 77);
  EXPECT_THROW(ReadPhotoOfSize(folder / "p.png", 80, 75), InputError);
}

// Bytes of a JPEG of four inks, one value each.
std::string InkJpeg(const uint8_t (&ink)[4], bool adobe) {
  constexpr int kSide = 16;
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  unsigned char* memory = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&jpeg, &memory, &size);
  jpeg.image_width = jpeg.image_height = kSide;
  jpeg.input_components = 4;
  jpeg.in_color_space = JCS_CMYK;
  jpeg_set_defaults(&jpeg);
  jpeg.write_Adobe_marker = adobe;
  jpeg_start_compress(&jpeg, TRUE);
  std::vector<JSAMPLE> row;
  for (int x = 0; x < kSide; ++x) row.insert(row.end(), ink, ink + 4);
  JSAMPROW rows = row.data();
  for (int y = 0; y < kSide; ++y) jpeg_write_scanlines(&jpeg, &rows, 1);
  jpeg_finish_compress(&jpeg);
  std::string bytes(reinterpret_cast<char*>(memory), size);
  jpeg_destroy_compress(&jpeg);
  std::free(memory);
  return bytes;
}

TEST(Photo, FourInksBecomeRgb) {
  const TempFolder folder;
  // Half cyan, no magenta, all yellow, a fifth black: light 0.5 x 0.8, 0.8, 0.
  WriteFile(folder / "plain.jpg", InkJpeg({128, 0, 255, 51}, false));
  WriteFile(folder / "adobe.jpg", InkJpeg({127, 255, 0, 204}, true));
  for (const char* name : {"plain.jpg", "adobe.jpg"}) {
    const Image image = ReadImage(folder / name);
    // A few steps of 8 bits for JPEG's rounding.
    EXPECT_NEAR(image(8, 8, 0), 0.4, 0.02) << name;
    EXPECT_NEAR(image(8, 8, 1), 0.8, 0.02) << name;
    EXPECT_NEAR(image(8, 8, 2), 0.0, 0.02) << name;
  }
}

TEST(Photo, SixteenBitsArePhotosToo) {
  const TempFolder folder;
  const cv::Mat deep(10, 12, CV_16UC3, cv::Scalar(0, 32768, 65535));  // BGR
  for (const char* name : {"p.png", "p.tiff"}) {
    cv::imwrite((folder / name).string(), deep);
    const Image image = ReadPhotoOfSize(folder / name, 12, 10);
    EXPECT_EQ(image(3, 3, 0), 1.0F) << name;
    EXPECT_NEAR(image(3, 3, 1), 32768.0 / 65535, 1e-6) << name;
    EXPECT_EQ(image(3, 3, 2), 0.0F) << name;
  }
}

}  // namespace
}  // namespace retint
