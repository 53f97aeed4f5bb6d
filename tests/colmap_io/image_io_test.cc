// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/image_io.h"

#include <fstream>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "base/files.h"
#include "colmap_io/photo.h"
#include "tests/colmap_io/tiny_model.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

// `pixels` (BGR order, as OpenCV has it) encoded by OpenCV.
std::string Encoded(const char* extension, const cv::Mat& pixels,
                    const std::vector<int>& params = {}) {
  std::vector<uint8_t> bytes;
  EXPECT_TRUE(cv::imencode(extension, pixels, bytes, params));
  return {bytes.begin(), bytes.end()};
}

void Put(const std::filesystem::path& path, const std::string& bytes) {
  std::filesystem::remove(path);  // file systems wait for the disk when a file is cut and rewritten
  std::ofstream(path, std::ios::binary) << bytes;
}

cv::Mat Noise(int width, int height, int channels = 3) {
  cv::Mat pixels(height, width, CV_8UC(channels));
  std::mt19937 random(5);
  for (size_t i = 0; i < pixels.total() * pixels.elemSize(); ++i) {
    pixels.data[i] = static_cast<uint8_t>(random());
  }
  return pixels;
}

TEST(ImageIoTest, PngKeepsEveryByteInRgbOrder) {
  const TempFolder folder;
  Image8 image(5, 3);
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = static_cast<uint8_t>(17 * i);
  WritePng(folder / "a.png", image);
  EXPECT_EQ(ReadImage8(folder / "a.png").data, image.data);
  // Against another reader: red is OpenCV's last channel.
  const cv::Mat other = cv::imread((folder / "a.png").string());
  EXPECT_EQ(other.at<cv::Vec3b>(2, 4)[2], image(4, 2, 0));
  EXPECT_EQ(other.at<cv::Vec3b>(2, 4)[0], image(4, 2, 2));
  const Image floats = ReadImage(folder / "a.png");
  EXPECT_EQ(floats.width, 5);
  EXPECT_EQ(floats.height, 3);
  for (size_t i = 0; i < image.data.size(); ++i) {
    ASSERT_EQ(floats.data[i], static_cast<float>(image.data[i]) / 255.0f);
  }
}

TEST(ImageIoTest, FloatsAreClampedAndRounded) {
  const TempFolder folder;
  Image image(2, 1);
  image.data = {-0.5f, 0.0f, 1.5f, 0.4999f / 255, 0.5001f / 255, std::nanf("")};
  WritePng(folder / "a.png", image);
  EXPECT_THAT(ReadImage8(folder / "a.png").data, ElementsAre(0, 0, 255, 0, 1, 0));
  ScalarImage scalar(3, 1);
  scalar.data = {0.25f, 1.0f, 2.0f};
  WritePng(folder / "s.png", scalar);
  EXPECT_THAT(ReadMask(folder / "s.png").data, ElementsAre(64, 255, 255));
  // 8 bits survive the way through floats.
  const Image8 all = [] {
    Image8 values(256, 1);
    for (int x = 0; x < 256; ++x) values(x, 0, 1) = static_cast<uint8_t>(x);
    return values;
  }();
  WritePng(folder / "b.png", all);
  WritePng(folder / "c.png", ReadImage(folder / "b.png"));
  EXPECT_EQ(ReadImage8(folder / "c.png").data, all.data);
}

TEST(ImageIoTest, SixteenBitsAndGreyAndAlpha) {
  const TempFolder folder;
  Put(folder / "16.png", Encoded(".png", cv::Mat(1, 1, CV_16UC3, cv::Scalar(65535, 32768, 0))));
  EXPECT_THAT(ReadImage(folder / "16.png").data, ElementsAre(0, 32768 / 65535.0f, 1));
  Put(folder / "grey.png", Encoded(".png", cv::Mat(1, 1, CV_8UC1, cv::Scalar(51))));
  EXPECT_THAT(ReadImage(folder / "grey.png").data, ElementsAre(0.2f, 0.2f, 0.2f));
  Put(folder / "alpha.png", Encoded(".png", cv::Mat(1, 1, CV_8UC4, cv::Scalar(1, 2, 3, 9))));
  EXPECT_THAT(ReadImage8(folder / "alpha.png").data, ElementsAre(3, 2, 1));
  EXPECT_FALSE(IsOpaque(folder / "alpha.png"));
  Put(folder / "opaque.png", Encoded(".png", cv::Mat(1, 1, CV_8UC4, cv::Scalar(1, 2, 3, 255))));
  EXPECT_TRUE(IsOpaque(folder / "opaque.png"));
  Put(folder / "deep.png", Encoded(".png", cv::Mat(1, 1, CV_16UC4, cv::Scalar(1, 2, 3, 65535))));
  EXPECT_TRUE(IsOpaque(folder / "deep.png"));
}

TEST(ImageIoTest, JpegIsWhatOpenCvDecodes) {
  const TempFolder folder;
  const cv::Mat noise = Noise(67, 45);
  for (const std::vector<int>& params :
       {std::vector<int>{}, std::vector<int>{cv::IMWRITE_JPEG_PROGRESSIVE, 1},
        std::vector<int>{cv::IMWRITE_JPEG_RST_INTERVAL, 2}}) {
    Put(folder / "a.jpg", Encoded(".jpg", noise, params));
    const cv::Mat other = cv::imread((folder / "a.jpg").string());
    const Image8 image = ReadImage8(folder / "a.jpg");
    ASSERT_EQ(image.width, 67);
    ASSERT_EQ(image.height, 45);
    for (int y = 0; y < 45; ++y) {
      for (int x = 0; x < 67; ++x) {
        ASSERT_EQ(image(x, y, 0), other.at<cv::Vec3b>(y, x)[2]);
        ASSERT_EQ(image(x, y, 2), other.at<cv::Vec3b>(y, x)[0]);
      }
    }
  }
  Put(folder / "grey.jpg", Encoded(".jpg", cv::Mat(20, 30, CV_8UC1, cv::Scalar(100))));
  EXPECT_THAT(ReadImage8(folder / "grey.jpg").data, ::testing::Each(100));
}

TEST(ImageIoTest, ExifOrientationIsIgnoredAsByColmap) {
  const TempFolder folder;
  const std::string jpeg = Encoded(".jpg", cv::Mat(20, 30, CV_8UC3, cv::Scalar(1, 2, 3)));
  // An APP1 segment whose only entry says "turned by 90 degrees" (orientation 6).
  const std::string exif(
      "\xFF\xE1\x00\x22"
      "Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0",
      36);
  Put(folder / "turned.jpg", jpeg.substr(0, 2) + exif + jpeg.substr(2));
  ASSERT_EQ(cv::imread((folder / "turned.jpg").string()).cols, 20) << "the segment is understood";
  EXPECT_EQ(ReadImage(folder / "turned.jpg").width, 30);
}

TEST(ImageIoTest, ManyPixelsInAFewBytesAreRead) {
  // The limit on a file's contents must not reject real encoders.
  const TempFolder folder;
  const cv::Mat flat(3000, 4000, CV_8UC1, cv::Scalar(128));
  Put(folder / "a.png", Encoded(".png", flat, {cv::IMWRITE_PNG_COMPRESSION, 9}));
  EXPECT_EQ(ReadMask(folder / "a.png").width, 4000);
  Put(folder / "a.jpg",
      Encoded(".jpg", flat, {cv::IMWRITE_JPEG_PROGRESSIVE, 1, cv::IMWRITE_JPEG_OPTIMIZE, 1}));
  EXPECT_EQ(ReadMask(folder / "a.jpg").width, 4000);
  cv::Mat bits(3000, 4000, CV_8UC1, cv::Scalar(255));
  Put(folder / "b.png",
      Encoded(".png", bits, {cv::IMWRITE_PNG_BILEVEL, 1, cv::IMWRITE_PNG_COMPRESSION, 9}));
  EXPECT_EQ(ReadMask(folder / "b.png").data.front(), 255);
}

// Each damaged file is one InputError naming it, and nothing goes to stderr.
void ExpectDamaged(const std::filesystem::path& path, const std::string& bytes,
                   const std::string& label) {
  Put(path, bytes);
  testing::internal::CaptureStderr();
  std::string what;
  try {
    ReadImage(path);
  } catch (const InputError& error) {
    what = error.what();
  }
  const std::string printed = testing::internal::GetCapturedStderr();
  EXPECT_EQ(printed, "") << label;
  EXPECT_THAT(what, HasSubstr(path.string())) << label << ": was read";
  EXPECT_EQ(what.find('\n'), std::string::npos) << what;
}

TEST(ImageIoTest, CutFilesAreRefusedInSilence) {
  const TempFolder folder;
  const std::string png = Encoded(".png", Noise(40, 30)), jpeg = Encoded(".jpg", Noise(40, 30));
  const std::string progressive = Encoded(".jpg", Noise(40, 30), {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  for (const auto& [name, bytes] : std::map<std::string, std::string>{
           {"a.png", png}, {"a.jpg", jpeg}, {"p.jpg", progressive}}) {
    for (size_t length = 0; length < bytes.size(); length += 1 + length / 29) {
      ExpectDamaged(folder / name, bytes.substr(0, length), name + std::to_string(length));
    }
    ExpectDamaged(folder / name, bytes.substr(0, bytes.size() - 1), name + " less 1");
  }
}

TEST(ImageIoTest, DamagedPngIsRefusedInSilence) {
  const TempFolder folder;
  const std::string png = Encoded(".png", Noise(40, 30));
  for (size_t at = 8; at < png.size(); at += 1 + at / 31) {
    std::string damaged = png;
    damaged[at] ^= 0x10;
    ExpectDamaged(folder / "a.png", damaged, "byte " + std::to_string(at));
  }
}

TEST(ImageIoTest, DamagedJpegPrintsNothing) {
  // Not every flipped bit of a JPEG can be told from a picture; none may print or crash.
  const TempFolder folder;
  const std::string jpeg = Encoded(".jpg", Noise(64, 48));
  int refused = 0, tried = 0;
  testing::internal::CaptureStderr();
  for (size_t at = 2; at < jpeg.size(); at += 5, ++tried) {
    std::string damaged = jpeg;
    damaged[at] ^= 0x55;
    Put(folder / "a.jpg", damaged);
    try {
      ReadImage(folder / "a.jpg");
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_GT(refused, tried / 100) << "the headers and tables at least";
}

TEST(ImageIoTest, SizesThatTheFileCannotHoldTakeNoMemory) {
  const TempFolder folder;
  const std::string jpeg = Encoded(".jpg", Noise(40, 30));
  std::string huge = jpeg;
  const size_t frame = huge.find("\xFF\xC0");
  ASSERT_NE(frame, std::string::npos);
  for (const size_t at : {5, 6, 7, 8}) huge[frame + at] = '\xFF';  // 65535 x 65535
  Put(folder / "a.jpg", huge);
  EXPECT_THAT([&] { ReadImage(folder / "a.jpg"); },
              ThrowsMessage<InputError>(HasSubstr("image size 65535x65535 does not fit the file")));
}

TEST(ImageIoTest, WhatIsNoPictureIsRefused) {
  const TempFolder folder;
  ExpectDamaged(folder / "a.png", "", "empty");
  ExpectDamaged(folder / "a.png", "just text", "text");
  EXPECT_THAT([&] { ReadImage(folder / "none.png"); },
              ThrowsMessage<InputError>(HasSubstr("No such file")));
  EXPECT_THAT([&] { ReadMask(folder.path()); }, ThrowsMessage<InputError>(HasSubstr("not a file")));
}

TEST(MaskIoTest, GreyIsItself) {
  const TempFolder folder;
  Mask mask(3, 1);
  mask.data = {0, 7, 255};
  WritePng(folder / "m.png", mask);
  EXPECT_EQ(ReadMask(folder / "m.png").data, mask.data);
}

TEST(MaskIoTest, PaintOfAnyColourCounts) {
  const TempFolder folder;
  cv::Mat pixels(1, 4, CV_8UC3, cv::Scalar(0, 0, 0));
  pixels.at<cv::Vec3b>(0, 1) = {0, 0, 255};
  pixels.at<cv::Vec3b>(0, 2) = {200, 10, 20};
  pixels.at<cv::Vec3b>(0, 3) = {255, 255, 255};
  Put(folder / "m.png", Encoded(".png", pixels));
  EXPECT_THAT(ReadMask(folder / "m.png").data, ElementsAre(0, 255, 200, 255));
}

TEST(MaskIoTest, AlphaThatVariesIsTheMask) {
  const TempFolder folder;
  cv::Mat pixels(1, 3, CV_8UC4, cv::Scalar(255, 255, 255, 0));
  pixels.at<cv::Vec4b>(0, 1) = {0, 0, 0, 255};  // black paint on a transparent layer
  pixels.at<cv::Vec4b>(0, 2) = {0, 0, 0, 90};
  Put(folder / "m.png", Encoded(".png", pixels));
  EXPECT_THAT(ReadMask(folder / "m.png").data, ElementsAre(0, 255, 90));
  // Opaque everywhere: the colours count.
  pixels.at<cv::Vec4b>(0, 0)[3] = pixels.at<cv::Vec4b>(0, 2)[3] = 255;
  Put(folder / "m.png", Encoded(".png", pixels));
  EXPECT_THAT(ReadMask(folder / "m.png").data, ElementsAre(255, 0, 0));
}

TEST(MaskIoTest, SixteenBitsBecomeEight) {
  const TempFolder folder;
  cv::Mat pixels(1, 3, CV_16UC1);
  pixels.at<uint16_t>(0, 0) = 0;
  pixels.at<uint16_t>(0, 1) = 257 * 100;
  pixels.at<uint16_t>(0, 2) = 65535;
  Put(folder / "m.png", Encoded(".png", pixels));
  EXPECT_THAT(ReadMask(folder / "m.png").data, ElementsAre(0, 100, 255));
}

TEST(MaskIoTest, WrongSizeAndEmptyMasksAreRefused) {
  const TempFolder folder;
  WritePng(folder / "m.png", Mask(4, 3));
  EXPECT_NO_THROW(ReadMask(folder / "m.png", 4, 3));
  EXPECT_THAT([&] { ReadMask(folder / "m.png", 3, 4); },
              ThrowsMessage<InputError>(HasSubstr("m.png: mask is 4x3, its view is 3x4")));
  EXPECT_THAT([&] { ReadBrushMask(folder / "m.png", 4, 3); },
              ThrowsMessage<InputError>(HasSubstr("m.png: mask is empty: no pixel is selected")));
  Mask one(4, 3);
  one(2, 1) = 1;
  WritePng(folder / "m.png", one);
  EXPECT_NO_THROW(ReadBrushMask(folder / "m.png", 4, 3));
}

TEST(MaskIoTest, RealMasksHaveTheirViewsSize) {
  RETINT_REQUIRE_DATA("fox/masks/0025.jpg.png");
  const Mask mask = ReadBrushMask(DataPath("fox/masks/0025.jpg.png"), 707, 1261);
  size_t selected = 0;
  for (const uint8_t value : mask.data) selected += value > 127;
  EXPECT_GT(selected, mask.NumPixels() / 100);
  EXPECT_LT(selected, mask.NumPixels() / 2);
}

TEST(MaskIoTest, MasksOfAFolderGoByViewName) {
  const TempFolder folder;
  const Reconstruction model = TinyModel();
  std::map<ViewId, Mask> masks;
  masks[2] = Mask(64, 48, 9);
  masks[3] = Mask(30, 20, 200);
  WriteMasks(folder / "masks", model, masks);
  EXPECT_TRUE(IsFile(folder / "masks/a.jpg.png"));
  EXPECT_TRUE(IsFile(folder / "masks/sub/b c.png.png"));
  const auto back = ReadMasks(folder / "masks", model);
  ASSERT_EQ(back.size(), 2u) << "view 10 has no file";
  EXPECT_EQ(back.at(2).data, masks[2].data);
  EXPECT_EQ(back.at(3).data, masks[3].data);
}

TEST(MaskIoTest, TheBrightestPaintOfABrushIsOpaque) {
  const TempFolder folder;
  cv::Mat navy(1, 3, CV_8UC3, cv::Scalar(0, 0, 0));  // BGR
  navy.at<cv::Vec3b>(0, 1) = {64, 0, 0};
  navy.at<cv::Vec3b>(0, 2) = {128, 0, 0};
  Put(folder / "navy.png", Encoded(".png", navy));
  EXPECT_THAT(ReadBrushMask(folder / "navy.png", 3, 1).data, ElementsAre(0, 128, 255));
  EXPECT_THAT(ReadMask(folder / "navy.png", 3, 1).data, ElementsAre(0, 64, 128));
  Mask soft(3, 1);
  soft.data = {0, 77, 255};
  WritePng(folder / "soft.png", soft);
  EXPECT_EQ(ReadBrushMask(folder / "soft.png", 3, 1).data, soft.data);
  Mask label(3, 1);
  label.data = {0, 1, 1};
  WritePng(folder / "label.png", label);
  EXPECT_THAT(ReadBrushMask(folder / "label.png", 3, 1).data, ElementsAre(0, 255, 255));
}

TEST(MaskIoTest, FoldersWithoutMasksAreRefused) {
  const TempFolder folder;
  EXPECT_THAT([&] { ReadMasks(folder / "none", TinyModel()); },
              ThrowsMessage<InputError>(HasSubstr("none: is not a folder")));
  EXPECT_THAT([&] { ReadMasks(folder.path(), TinyModel()); },
              ThrowsMessage<InputError>(
                  AllOf(HasSubstr("holds no mask of any view"), HasSubstr("a.jpg.png"))));
  WritePng(folder / "a.jpg.png", Mask(64, 47));
  EXPECT_THAT([&] { ReadMasks(folder.path(), TinyModel()); },
              ThrowsMessage<InputError>(HasSubstr("mask is 64x47, its view is 64x48")));
}

// With the subsampling of colors that is usual, and with none, which OpenCV has for two qualities.
TEST(ImageIoTest, APictureIsSavedAsAnotherJpegWas) {
  const TempFolder folder;
  const cv::Mat pixels = Noise(83, 47);
  Image8 picture(pixels.cols, pixels.rows);
  for (size_t i = 0; i < picture.data.size(); ++i)
    picture.data[i] = pixels.data[i / 3 * 3 + 2 - i % 3];
  const std::vector<std::vector<int>> kinds = {
      {cv::IMWRITE_JPEG_QUALITY, 90},
      {cv::IMWRITE_JPEG_QUALITY, 60, cv::IMWRITE_JPEG_PROGRESSIVE, 1},
      {cv::IMWRITE_JPEG_QUALITY, 80, cv::IMWRITE_JPEG_LUMA_QUALITY, 80,
       cv::IMWRITE_JPEG_CHROMA_QUALITY, 70}};
  for (const auto& kind : kinds) {
    Put(folder / "a.jpg", Encoded(".jpg", pixels, kind));
    const auto held = AsJpegHolds(picture, ReadFile(folder / "a.jpg"));
    ASSERT_TRUE(held);
    EXPECT_EQ(held->data, ReadImage8(folder / "a.jpg").data);
    EXPECT_NE(held->data, picture.data);
    const std::string bytes = ReadFile(folder / "a.jpg");
    for (const size_t kept : {size_t{0}, size_t{2}, size_t{40}}) {  // within its header
      EXPECT_FALSE(AsJpegHolds(picture, bytes.substr(0, kept)));
    }
  }
  Put(folder / "gray.jpg", Encoded(".jpg", Noise(83, 47, 1)));
  EXPECT_FALSE(AsJpegHolds(picture, ReadFile(folder / "gray.jpg")));
  Put(folder / "a.png", Encoded(".png", pixels));
  EXPECT_FALSE(AsJpegHolds(picture, ReadFile(folder / "a.png")));
}

TEST(ViewFileTest, StaysInsideItsFolder) {
  EXPECT_EQ(ViewFile("out", "sub/0001.jpg"), "out/sub/0001.jpg.png");
  EXPECT_EQ(ViewFile("out", "a.jpg", ".bin"), "out/a.jpg.bin");
  EXPECT_EQ(ViewFile("out", "sub/../a.jpg"), "out/a.jpg.png");
  EXPECT_EQ(ViewFile("out", "..a.jpg"), "out/..a.jpg.png");
  for (const char* name : {"../a.jpg", "sub/../../a.jpg", "/etc/a.jpg", "", "sub/", ".."}) {
    EXPECT_THAT([&] { ViewFile("out", name); },
                ThrowsMessage<InputError>(HasSubstr("leads outside the folder")))
        << name;
  }
}

TEST(ImageIoTest, WritingFailuresAreRunErrors) {
  const TempFolder folder;
  Put(folder / "file", "x");
  EXPECT_THAT([&] { WritePng(folder / "file/a.png", Mask(2, 2)); },
              ThrowsMessage<RunError>(HasSubstr("a.png")));
  EXPECT_THAT([&] { WritePng(folder / "a.png", Mask()); },
              ThrowsMessage<RunError>(HasSubstr("nothing to write")));
  EXPECT_FALSE(IsFile(folder / "a.png"));
}

// ---- The header decides before pixels are decoded. In these files the header announces pixels
// that are not there, so that decoding them would say something else.

void PutBig(std::string& bytes, size_t at, uint32_t value, size_t count) {
  for (size_t i = 0; i < count; ++i) {
    bytes[at + i] = static_cast<char>(value >> (8 * (count - 1 - i)));
  }
}

void PutLittle(std::string& bytes, size_t at, uint32_t value, size_t count) {
  for (size_t i = 0; i < count; ++i) bytes[at + i] = static_cast<char>(value >> (8 * i));
}

uint32_t Crc32(std::string_view bytes) {
  uint32_t crc = ~0u;
  for (const char byte : bytes) {
    crc ^= static_cast<uint8_t>(byte);
    for (int k = 0; k < 8; ++k) crc = crc & 1 ? 0xEDB88320u ^ (crc >> 1) : crc >> 1;
  }
  return ~crc;
}

// The place of a tag's value in a TIFF file of OpenCV, little-endian.
size_t TiffValue(const std::string& bytes, size_t tag) {
  const auto number = [&](size_t at, size_t count) {
    size_t value = 0;
    for (size_t i = count; i-- > 0;) value = value << 8 | static_cast<uint8_t>(bytes[at + i]);
    return value;
  };
  const size_t folder = number(4, 4);
  for (size_t k = 0; k < number(folder, 2); ++k) {
    if (number(folder + 2 + 12 * k, 2) == tag) return folder + 2 + 12 * k + 8;
  }
  ADD_FAILURE() << "no tag " << tag;
  return 0;
}

struct Announced {
  const char* extension;
  std::vector<int> params;
  void (*announce)(std::string& bytes, uint32_t side);
};

const Announced kAnnounced[] = {
    {".png",
     {},
     [](std::string& bytes, uint32_t side) {
       PutBig(bytes, 16, side, 4);
       PutBig(bytes, 20, side, 4);
       PutBig(bytes, 29, Crc32(std::string_view(bytes).substr(12, 17)), 4);
     }},
    {".jpg",
     {},
     [](std::string& bytes, uint32_t side) {
       const size_t frame = bytes.find("\xFF\xC0");
       ASSERT_NE(frame, std::string::npos);
       PutBig(bytes, frame + 5, side, 2);
       PutBig(bytes, frame + 7, side, 2);
     }},
    {".tiff",
     {},
     [](std::string& bytes, uint32_t side) {
       for (const size_t tag : {0x0100U, 0x0101U}) PutLittle(bytes, TiffValue(bytes, tag), side, 2);
     }},
    {".bmp",
     {},
     [](std::string& bytes, uint32_t side) {
       PutLittle(bytes, 18, side, 4);
       PutLittle(bytes, 22, side, 4);
     }},
    {".webp",
     {cv::IMWRITE_WEBP_QUALITY, 101},  // lossless
     [](std::string& bytes, uint32_t side) {
       const size_t at = bytes.find("VP8L");
       ASSERT_NE(at, std::string::npos);
       PutLittle(bytes, at + 9, (side - 1) | (side - 1) << 14, 4);
     }},
    {".webp",
     {cv::IMWRITE_WEBP_QUALITY, 80},
     [](std::string& bytes, uint32_t side) {
       const size_t at = bytes.find("VP8 ");
       ASSERT_NE(at, std::string::npos);
       PutLittle(bytes, at + 14, side, 2);
       PutLittle(bytes, at + 16, side, 2);
     }},
    {".ppm",
     {},
     [](std::string& bytes, uint32_t side) {
       const size_t at = bytes.find("20 12");
       ASSERT_NE(at, std::string::npos);
       bytes.replace(at, 5, std::to_string(side) + " " + std::to_string(side));
     }},
};

TEST(ImageIoTest, TheHeaderDecidesBeforeTheDecoder) {
  const TempFolder folder;
  for (const Announced& format : kAnnounced) {
    SCOPED_TRACE(format.extension);
    std::string bytes = Encoded(format.extension, Noise(20, 12), format.params);
    EXPECT_EQ(ImageSizeIn(bytes), std::pair(20, 12));
    format.announce(bytes, 700);
    EXPECT_EQ(ImageSizeIn(bytes), std::pair(700, 700));
    const auto path = folder / (std::string("a") + format.extension);
    Put(path, bytes);
    EXPECT_THAT([&] { ReadMask(path, 20, 12); },
                ThrowsMessage<InputError>(HasSubstr("mask is 700x700, its view is 20x12")));
    EXPECT_THAT([&] { ReadPhotoOfSize(path, 20, 12); },
                ThrowsMessage<InputError>(HasSubstr("photo is 700x700, its camera says 20x12")));
  }
}

// Headers alone: OpenCV writes no JPEG 2000 of this size.
TEST(ImageIoTest, TheHeaderOfJpeg2000DecidesToo) {
  const TempFolder folder;
  std::string file("\0\0\0\x0CjP  \r\n\x87\n\0\0\0\x16ihdr\0\0\0\0\0\0\0\0", 28);
  PutBig(file, 20, 700, 4);
  PutBig(file, 24, 600, 4);
  std::string codestream("\xFF\x4F\xFF\x51\0\x29\0\0\0\0\0\0\0\0\0\0", 16);
  PutBig(codestream, 8, 600, 4);
  PutBig(codestream, 12, 700, 4);
  for (const std::string& bytes : {file, codestream}) {
    Put(folder / "a.jp2", bytes);
    EXPECT_THAT([&] { ReadMask(folder / "a.jp2", 20, 12); },
                ThrowsMessage<InputError>(HasSubstr("mask is 600x700, its view is 20x12")));
  }
}

TEST(ImageIoTest, MorePixelsThanACameraHasAreNotDecoded) {
  const TempFolder folder;
  std::string bytes = Encoded(".bmp", Noise(20, 12));
  kAnnounced[3].announce(bytes, 30000);
  Put(folder / "a.bmp", bytes);
  for (const auto& read : std::vector<std::function<void()>>{
           [&] { ReadImage(folder / "a.bmp"); }, [&] { ReadImage8(folder / "a.bmp"); },
           [&] { ReadMask(folder / "a.bmp"); }, [&] { IsOpaque(folder / "a.bmp"); }}) {
    EXPECT_THAT(read,
                ThrowsMessage<InputError>(HasSubstr("is 30000x30000, more than 256 megapixels")));
  }
}

}  // namespace
}  // namespace retint
