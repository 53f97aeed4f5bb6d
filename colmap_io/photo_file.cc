// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/photo_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "colmap_io/jpeg_decode.h"
#include "colmap_io/photo.h"
#include "scene/contact_sheet.h"

namespace retint {
namespace {

constexpr std::string_view kPngStart("\x89PNG\r\n\x1a\n", 8);

bool IsPng(std::string_view bytes) { return bytes.starts_with(kPngStart); }

uint32_t BigEndian(std::string_view bytes, size_t at) {
  uint32_t value = 0;
  for (size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<uint8_t>(bytes[at + i]);
  return value;
}

// Calls visit(name, chunk) for the whole chunks of a PNG file (PNG 3, 5.3), length and checksum
// included.
template <typename Visit>
void VisitChunks(std::string_view png, const Visit& visit) {
  for (size_t at = kPngStart.size(); at + 12 <= png.size();) {
    const size_t size = size_t{12} + BigEndian(png, at);
    if (size > png.size() - at) return;
    visit(png.substr(at + 4, 4), png.substr(at, size));
    at += size;
  }
}

// `encoded` with the metadata of `like`, in front of the pixels, where every kind of it may be.
// Chunks that describe the stored values themselves (transparent color, palette, significant bits)
// are left out, because the values differ.
std::string WithChunksOf(std::string_view like, std::string_view encoded, bool profile) {
  constexpr std::array<std::string_view, 4> kColor = {"cICP", "iCCP", "sRGB", "cHRM"};
  constexpr std::array<std::string_view, 7> kOther = {"gAMA", "pHYs", "eXIf", "tEXt",
                                                      "zTXt", "iTXt", "tIME"};
  const auto is_in = [](const auto& list, std::string_view name) {
    return std::find(list.begin(), list.end(), name) != list.end();
  };
  std::string kept;
  VisitChunks(like, [&](std::string_view name, std::string_view chunk) {
    if (is_in(kOther, name) || (profile && is_in(kColor, name))) kept += chunk;
  });
  std::string out(kPngStart);
  bool inserted = false;
  VisitChunks(encoded, [&](std::string_view name, std::string_view chunk) {
    if (is_in(kOther, name) || is_in(kColor, name)) return;
    if (name != "IHDR" && !inserted) {
      out += kept;
      inserted = true;
    }
    out += chunk;
  });
  return out;
}

// RGB in [0, 1] of BGR(A) or gray of either depth.
template <typename Value>
Image RgbOf(const cv::Mat& pixels) {
  constexpr float kFull = std::numeric_limits<Value>::max();
  const int channels = pixels.channels();
  Image image(pixels.cols, pixels.rows);
  for (int y = 0; y < image.height; ++y) {
    const Value* from = pixels.ptr<Value>(y);
    for (int x = 0; x < image.width; ++x, from += channels) {
      for (int c = 0; c < 3; ++c) image(x, y, c) = float(from[channels >= 3 ? 2 - c : 0]) / kFull;
    }
  }
  return image;
}

// As With(): the pixels with other colors, as BGR or BGRA if `image` is not gray any more; nullopt
// if none changes.
template <typename Value>
std::optional<cv::Mat> WithColors(const cv::Mat& pixels, const Image& image) {
  constexpr float kFull = std::numeric_limits<Value>::max();
  const int channels = pixels.channels();
  const bool is_gray = channels < 3, has_alpha = channels == 2 || channels == 4;
  const int out_channels = has_alpha ? 4 : 3;
  cv::Mat out(pixels.rows, pixels.cols, CV_MAKETYPE(pixels.depth(), out_channels));
  bool changes = false;
  for (int y = 0; y < image.height; ++y) {
    const Value* from = pixels.ptr<Value>(y);
    Value* to = out.ptr<Value>(y);
    for (int x = 0; x < image.width; ++x, from += channels, to += out_channels) {
      for (int c = 0; c < 3; ++c) {
        const float value = std::clamp(image(x, y, c), 0.0F, 1.0F);
        to[2 - c] = static_cast<Value>(std::isnan(value) ? 0.0F : value * kFull + 0.5F);
        changes |= to[2 - c] != from[is_gray ? 0 : 2 - c];
      }
      if (has_alpha) to[3] = from[channels - 1];
    }
  }
  return changes ? std::optional(out) : std::nullopt;
}

}  // namespace

struct PhotoFile::Pixels {
  Image8 jpeg;    // of a JPEG
  cv::Mat other;  // of other formats, as they are stored
};

PhotoFile::PhotoFile(const std::filesystem::path& path, int width, int height) : path_(path) {
  Pixels pixels;
  bytes_ = ReadFile(path);
  // Faults are ReadImage()'s, and found before more memory is taken.
  if (IsJpeg(bytes_)) {
    pixels.jpeg = ReadImage8(path);
  } else {
    ReadImage8(path);
    std::string stored = bytes_;
    KeepTiffAsStored(&stored);
    const cv::Mat raw(1, static_cast<int>(stored.size()), CV_8U, stored.data());
    pixels.other = cv::imdecode(raw, cv::IMREAD_UNCHANGED);
  }
  orientation_ = TurnForCamera(path, bytes_, width, height);
  pixels_ = std::make_unique<const Pixels>(std::move(pixels));
}

PhotoFile::~PhotoFile() = default;

bool PhotoFile::KeepsMetadata() const { return IsJpeg(bytes_) || IsPng(bytes_); }

Image PhotoFile::Shown() const {
  const cv::Mat& other = pixels_->other;
  Image stored;
  if (other.empty()) {
    const Image8& jpeg = pixels_->jpeg;
    stored = Image(jpeg.width, jpeg.height);
    std::transform(jpeg.data.begin(), jpeg.data.end(), stored.data.begin(),
                   [](uint8_t value) { return float(value) / 255.0F; });
  } else {
    stored = other.depth() == CV_8U ? RgbOf<uint8_t>(other) : RgbOf<uint16_t>(other);
  }
  return orientation_ >= 5 ? Turned(stored, orientation_) : stored;
}

std::optional<std::string> PhotoFile::With(const Image& shown) const {
  const Image turned = orientation_ >= 5 ? TurnedBack(shown, orientation_) : Image();
  const Image& image = orientation_ >= 5 ? turned : shown;
  const cv::Mat& other = pixels_->other;
  if (other.empty()) {
    const Image8& held = pixels_->jpeg;
    const Image8 edited = ToImage8(image);
    if (edited.data == held.data) return std::nullopt;
    return WithPixels(edited, held, bytes_, path_);
  }
  const auto edited = other.depth() == CV_8U ? WithColors<uint8_t>(other, image)
                                             : WithColors<uint16_t>(other, image);
  if (!edited) return std::nullopt;
  std::string extension = path_.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (IsPng(bytes_)) extension = ".png";
  std::vector<uint8_t> encoded;
  bool is_encoded = false;
  try {
    // More than 100: without loss, also of WebP.
    is_encoded = cv::imencode(extension, *edited, encoded, {cv::IMWRITE_WEBP_QUALITY, 101});
  } catch (const cv::Exception&) {
    is_encoded = false;
  }
  if (!is_encoded) throw RunError(path_.string() + ": cannot encode the edited photo");
  std::string bytes(encoded.begin(), encoded.end());
  return IsPng(bytes_) ? WithChunksOf(bytes_, bytes, other.channels() >= 3) : bytes;
}

}  // namespace retint
