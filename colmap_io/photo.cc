// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/photo.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "scene/image_checks.h"

namespace retint {
namespace {

// Cursor over bytes of either order; 0 beyond the end.
struct Bytes {
  std::string_view data;
  bool big = true;
  uint32_t At(size_t offset, size_t count) const {
    if (offset > data.size() || count > data.size() - offset) return 0;
    uint32_t value = 0;
    for (size_t i = 0; i < count; ++i) {
      value = value << 8 | static_cast<uint8_t>(data[offset + (big ? i : count - 1 - i)]);
    }
    return value;
  }
};

// Calls visit(marker, segment) for the segments before the first scan of a JPEG file (ITU T.81,
// annex B), until it returns true.
template <typename Visit>
void VisitSegments(std::string_view bytes, const Visit& visit) {
  const Bytes file{bytes};
  size_t at = 2;
  while (at + 4 <= bytes.size() && file.At(at, 1) == 0xFF) {
    const uint32_t marker = file.At(at + 1, 1);
    if (marker == 0xFF) {  // fill byte
      ++at;
      continue;
    }
    const size_t length = file.At(at + 2, 2);
    if (marker == 0xDA || length < 2 || length > bytes.size() - at - 2) return;
    if (visit(marker, bytes.substr(at + 4, length - 2))) return;
    at += 2 + length;
  }
}

bool IsJpeg(std::string_view bytes) { return bytes.starts_with("\xFF\xD8\xFF"); }

bool IsBigTiff(std::string_view bytes) {
  return bytes.starts_with(std::string_view("II+\0", 4)) ||
         bytes.starts_with(std::string_view("MM\0+", 4));
}

bool IsTiff(std::string_view bytes) {
  return bytes.starts_with(std::string_view("II*\0", 4)) ||
         bytes.starts_with(std::string_view("MM\0*", 4));
}

// The place of a tag's value in the tag itself, of the first picture of a TIFF file (TIFF 6.0,
// section 2) or a BigTIFF file; nullopt if it has no such tag.
std::optional<size_t> TiffValueAt(std::string_view tiff, uint32_t tag) {
  const Bytes data{tiff, tiff.starts_with("MM")};
  const bool wide = IsBigTiff(tiff);
  const size_t count_bytes = wide ? 8 : 2, entry_bytes = wide ? 20 : 12, value = wide ? 12 : 8;
  const size_t folder = wide ? data.At(8, 8) : data.At(4, 4);
  const size_t entries = std::min<size_t>(data.At(folder, count_bytes), 65535);
  for (size_t k = 0; k < entries; ++k) {
    const size_t entry = folder + count_bytes + entry_bytes * k;
    if (data.At(entry, 2) == tag && entry + value + 2 <= tiff.size()) return entry + value;
  }
  return std::nullopt;
}

std::optional<size_t> OrientationAt(std::string_view tiff) { return TiffValueAt(tiff, 0x0112); }

// 1 to 8; 1 where it is not told.
int OrientationIn(std::string_view tiff) {
  const auto at = OrientationAt(tiff);
  const uint32_t value = at ? Bytes{tiff, tiff.starts_with("MM")}.At(*at, 2) : 1;
  return value >= 1 && value <= 8 ? static_cast<int>(value) : 1;
}

bool IsPng(std::string_view bytes) { return bytes.starts_with("\x89PNG\r\n\x1a\n"); }

bool IsWebp(std::string_view bytes) {
  return bytes.starts_with("RIFF") && bytes.substr(std::min<size_t>(8, bytes.size()), 4) == "WEBP";
}

// The data of a PNG file's first chunk of that name (PNG 3, 5.3); empty if it has no such chunk.
std::string_view PngChunk(std::string_view bytes, std::string_view name) {
  const Bytes file{bytes};
  for (size_t at = 8; at + 8 <= bytes.size(); at += 12 + size_t{file.At(at, 4)}) {
    if (bytes.substr(at + 4, 4) == name) return bytes.substr(at + 8, file.At(at, 4));
  }
  return {};
}

// The same of a WebP file (RFC 9649, 2.3).
std::string_view WebpChunk(std::string_view bytes, std::string_view name) {
  const Bytes file{bytes, /*big=*/false};
  for (size_t at = 12; at + 8 <= bytes.size();) {
    const size_t length = file.At(at + 4, 4);
    if (bytes.substr(at, 4) == name) return bytes.substr(at + 8, length);
    at += 8 + length + length % 2;
  }
  return {};
}

std::optional<std::pair<int, int>> TiffSize(std::string_view bytes) {
  constexpr uint32_t kWidth = 0x0100, kHeight = 0x0101, kShort = 3;
  const auto width = TiffValueAt(bytes, kWidth), height = TiffValueAt(bytes, kHeight);
  if (!width || !height) return std::nullopt;
  const Bytes data{bytes, bytes.starts_with("MM")};
  const size_t type = IsBigTiff(bytes) ? 10 : 6;  // before the value
  const auto value = [&](size_t at) {
    return int(data.At(at, data.At(at - type, 2) == kShort ? 2 : 4));
  };
  return std::pair(value(*width), value(*height));
}

constexpr std::string_view kJpeg2000File("\0\0\0\x0CjP  ", 8);
constexpr std::string_view kJpeg2000Codestream("\xFF\x4F\xFF\x51");

// RFC 9649, 2.7, 3.4 and RFC 6386, 9.1.
std::optional<std::pair<int, int>> WebpSize(std::string_view bytes) {
  const auto plus_one = [](uint32_t value) { return int(value) + 1; };
  if (const auto chunk = WebpChunk(bytes, "VP8X"); chunk.size() >= 10) {
    const Bytes data{chunk, /*big=*/false};
    return std::pair(plus_one(data.At(4, 3)), plus_one(data.At(7, 3)));
  }
  if (const auto chunk = WebpChunk(bytes, "VP8L"); chunk.size() >= 5) {
    const uint32_t bits = Bytes{chunk, /*big=*/false}.At(1, 4);
    return std::pair(plus_one(bits & 0x3FFF), plus_one(bits >> 14 & 0x3FFF));
  }
  if (const auto chunk = WebpChunk(bytes, "VP8 "); chunk.size() >= 10) {
    const Bytes data{chunk, /*big=*/false};
    return std::pair(int(data.At(6, 2) & 0x3FFF), int(data.At(8, 2) & 0x3FFF));
  }
  return std::nullopt;
}

// Netpbm: "P6", width and height as text, between white space and comments.
std::optional<std::pair<int, int>> PnmSize(std::string_view bytes) {
  int64_t numbers[2] = {0, 0};
  size_t at = 2, count = 0;
  while (at < bytes.size() && count < 2) {
    const char c = bytes[at];
    if (c == '#') {
      at = std::min(bytes.find('\n', at), bytes.size());
    } else if (c >= '0' && c <= '9') {
      int64_t& number = numbers[count];
      for (; at < bytes.size() && bytes[at] >= '0' && bytes[at] <= '9'; ++at) {
        number = std::min<int64_t>(10 * number + (bytes[at] - '0'), INT32_MAX);
      }
      ++count;
    } else {
      ++at;
    }
  }
  return std::pair(int(numbers[0]), int(numbers[1]));
}

// ISO/IEC 15444-1: the image header box of a file, the SIZ marker of a bare codestream.
std::optional<std::pair<int, int>> Jpeg2000Size(std::string_view bytes) {
  const Bytes data{bytes};
  const auto side = [&](size_t at) { return int(std::min<uint32_t>(data.At(at, 4), INT32_MAX)); };
  if (bytes.starts_with(kJpeg2000Codestream)) return std::pair(side(8), side(12));
  const size_t box = bytes.substr(0, 256).find("ihdr");
  if (box == std::string_view::npos) return std::nullopt;
  return std::pair(side(box + 8), side(box + 4));
}

// The TIFF file inside a picture's EXIF (Exif 2.32, 4.6.4); empty if it has no EXIF.
std::string_view ExifOf(std::string_view bytes) {
  constexpr std::string_view kExif("Exif\0\0", 6);
  std::string_view exif;
  if (IsJpeg(bytes)) {
    VisitSegments(bytes, [&](uint32_t marker, std::string_view segment) {
      const bool found = marker == 0xE1 && segment.starts_with(kExif);
      if (found) exif = segment;
      return found;
    });
  } else if (IsPng(bytes)) {
    exif = PngChunk(bytes, "eXIf");
  } else if (IsWebp(bytes)) {
    exif = WebpChunk(bytes, "EXIF");
  }
  // A JPEG file has this before it, and some programs write it in the others, too.
  return exif.starts_with(kExif) ? exif.substr(kExif.size()) : exif;
}

// As the file tells that its rows and columns are to be shown, 1 to 8.
int Orientation(std::string_view bytes) {
  return OrientationIn(IsTiff(bytes) ? bytes : ExifOf(bytes));
}

// The stored pixel that is shown at (x, y), by EXIF's orientation.
std::pair<int, int> StoredPixel(int x, int y, int width, int height, int orientation) {
  const bool swapped = orientation >= 5;
  int u = swapped ? y : x, v = swapped ? x : y;
  if (orientation == 2 || orientation == 3 || orientation == 7 || orientation == 8) {
    u = width - 1 - u;
  }
  if (orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7) {
    v = height - 1 - v;
  }
  return {u, v};
}

// Up to the change by rounding both sides of the smaller picture to whole pixels.
bool SameShape(int width, int height, int other_width, int other_height) {
  const int64_t cross = int64_t{width} * other_height - int64_t{other_width} * height;
  return std::abs(cross) <= std::max(int64_t{width} + height, int64_t{other_width} + other_height);
}

Image Resized(const Image& image, int width, int height) {
  Image out(width, height);
  const cv::Mat from(image.height, image.width, CV_32FC3, const_cast<float*>(image.data.data()));
  cv::Mat to(height, width, CV_32FC3, out.data.data());
  cv::resize(from, to, to.size(), 0, 0, image.width > width ? cv::INTER_AREA : cv::INTER_LINEAR);
  return out;
}

}  // namespace

std::optional<std::pair<int, int>> ImageSizeIn(std::string_view bytes) {
  std::optional<std::pair<int, int>> size;
  const Bytes file{bytes}, little{bytes, /*big=*/false};
  if (IsPng(bytes)) {
    size.emplace(int(file.At(16, 4)), int(file.At(20, 4)));
  } else if (IsJpeg(bytes)) {
    VisitSegments(bytes, [&](uint32_t marker, std::string_view segment) {
      const bool frame =
          marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
      const Bytes header{segment};
      if (frame) size.emplace(int(header.At(3, 2)), int(header.At(1, 2)));
      return frame;
    });
  } else if (IsTiff(bytes) || IsBigTiff(bytes)) {
    size = TiffSize(bytes);
  } else if (IsWebp(bytes)) {
    size = WebpSize(bytes);
  } else if (bytes.starts_with("BM") && bytes.size() >= 26) {  // Windows bitmap, OS/2's first
    const bool first = little.At(14, 4) == 12;
    // Negative: from the top.
    const int64_t height = std::abs(int64_t{static_cast<int32_t>(little.At(22, 4))});
    size = first ? std::pair(int(little.At(18, 2)), int(little.At(20, 2)))
                 : std::pair(int(little.At(18, 4)), int(std::min<int64_t>(height, INT32_MAX)));
  } else if (bytes.size() > 2 && bytes[0] == 'P' && bytes[1] >= '1' && bytes[1] <= '6') {
    size = PnmSize(bytes);
  } else if (bytes.starts_with(kJpeg2000File) || bytes.starts_with(kJpeg2000Codestream)) {
    size = Jpeg2000Size(bytes);
  }
  if (size && (size->first <= 0 || size->second <= 0)) size.reset();
  return size;
}

std::optional<std::pair<int, int>> ReadImageSize(const std::filesystem::path& path) {
  try {
    return ImageSizeIn(ReadFile(path));
  } catch (const InputError&) {
    return std::nullopt;
  }
}

void KeepTiffAsStored(std::string* bytes) {
  const auto at = IsTiff(*bytes) ? OrientationAt(*bytes) : std::nullopt;
  if (!at) return;
  const bool big = bytes->starts_with("MM");
  (*bytes)[*at] = big ? '\0' : '\1';
  (*bytes)[*at + 1] = big ? '\1' : '\0';
}

int TurnForCamera(const std::filesystem::path& path, std::string_view bytes, int width,
                  int height) {
  const auto size = ImageSizeIn(bytes);
  if (!size || SameShape(size->first, size->second, width, height)) return 1;
  const int orientation = Orientation(bytes);
  if (orientation >= 5 && SameShape(size->second, size->first, width, height)) return orientation;
  throw InputError(path, "photo is " + SizeText(size->first, size->second) + ", its camera says " +
                             SizeText(width, height) + ": it is another picture, or was cropped");
}

Image Turned(const Image& stored, int orientation) {
  const bool swapped = orientation >= 5;
  Image shown(swapped ? stored.height : stored.width, swapped ? stored.width : stored.height);
  for (int y = 0; y < shown.height; ++y) {
    for (int x = 0; x < shown.width; ++x) {
      const auto [u, v] = StoredPixel(x, y, stored.width, stored.height, orientation);
      for (int c = 0; c < 3; ++c) shown(x, y, c) = stored(u, v, c);
    }
  }
  return shown;
}

Image TurnedBack(const Image& shown, int orientation) {
  const bool swapped = orientation >= 5;
  Image stored(swapped ? shown.height : shown.width, swapped ? shown.width : shown.height);
  for (int y = 0; y < shown.height; ++y) {
    for (int x = 0; x < shown.width; ++x) {
      const auto [u, v] = StoredPixel(x, y, stored.width, stored.height, orientation);
      for (int c = 0; c < 3; ++c) stored(u, v, c) = shown(x, y, c);
    }
  }
  return stored;
}

Image ReadPhotoOfSize(const std::filesystem::path& path, int width, int height) {
  int orientation = 1;
  Image photo = ReadImage(path, [&](int photo_width, int photo_height) {
    if (SameShape(photo_width, photo_height, width, height)) return;
    orientation = Orientation(ReadFile(path));
    if (orientation >= 5 && SameShape(photo_height, photo_width, width, height)) return;
    throw InputError(path, "photo is " + SizeText(photo_width, photo_height) +
                               ", its camera says " + SizeText(width, height) +
                               ": it is another picture, or was cropped");
  });
  if (orientation >= 5) photo = Turned(photo, orientation);
  if (photo.width == width && photo.height == height) return photo;
  return Resized(photo, width, height);
}

}  // namespace retint
