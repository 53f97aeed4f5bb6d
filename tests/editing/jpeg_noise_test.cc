// SPDX-License-Identifier: BSD-3-Clause
// Pictures that were saved as JPEG or lossy WebP files. The file's own errors do not count as a
// change, but paint does.
#include "editing/jpeg_noise.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include <gtest/gtest.h>

#include "base/color_difference.h"
#include "colmap_io/image_io.h"
#include "colmap_io/webp_copy.h"
#include "editing/picture_changes.h"
#include "scene/contact_sheet.h"
#include "tests/support/data.h"

namespace retint {
namespace {

constexpr int kSide = 192;

// Discs in strong colors on a texture: edges at which a JPEG file has much noise.
Image Scene() {
  Image image(kSide, kSide);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const double texture = 0.5 + 0.2 * std::sin(x * 0.9) * std::sin(y * 0.7);
      const bool disc = std::hypot(x % 64 - 32, y % 64 - 32) < 20;
      const bool red = (x / 64 + y / 64) % 2 == 0;
      const double color[3] = {disc && red ? 0.8 : 0.2, disc && !red ? 0.6 : 0.1, 0.2};
      for (int c = 0; c < 3; ++c) {
        image(x, y, c) = float(std::round(255 * (disc ? color[c] : texture)) / 255);
      }
    }
  }
  return image;
}

// The picture as a JPEG file of some quality, and the changes in it.
enum class Format { kJpeg, kWebp };

void Save(const std::filesystem::path& file, const Image8& picture, int quality, Format format) {
  std::string bytes;
  if (format == Format::kJpeg) {
    bytes = EncodeJpeg(picture, quality);
  } else {
    const std::vector<uint8_t> webp = EncodeWebp(picture, quality);
    bytes.assign(webp.begin(), webp.end());
    EXPECT_TRUE(IsLossyWebp(bytes));
  }
  std::ofstream(file, std::ios::binary).write(bytes.data(), std::streamsize(bytes.size()));
}

Mask ChangedIn(const Image8& painted, const Image& view, int quality, Format format) {
  const TempFolder folder;
  const auto file = folder / "painted";
  Save(file, painted, quality, format);
  const Image8 read = ReadImage8(file);
  ScalarImage difference(view.width, view.height);
  for (size_t p = 0; p < difference.data.size(); ++p) {
    float color[3];
    for (size_t c = 0; c < 3; ++c) color[c] = float(read.data[3 * p + c]) / 255;
    difference.data[p] =
        float(ColorDifference(CieLabFromSrgb(color), CieLabFromSrgb(&view.data[3 * p])));
  }
  return ChangedPixels(difference, LeastChanges(read, view, file));
}

TEST(JpegNoise, AnUntouchedFileHasNoChange) {
  const Image view = Scene();
  for (const Format format : {Format::kJpeg, Format::kWebp}) {
    for (const int quality : {75, 90, 95}) {
      const Mask changed = ChangedIn(ToImage8(view), view, quality, format);
      EXPECT_EQ(std::count(changed.data.begin(), changed.data.end(), 255), 0) << quality;
    }
  }
}

// A line two pixels wide, and a tinted disc, of which the noise at the disc's edge may hide a rim.
TEST(JpegNoise, PaintIsFoundAndWhatIsAroundItIsNot) {
  const Image view = Scene();
  const auto on_line = [](int x, int y) { return x >= 20 && x < 170 && (y == 66 || y == 67); };
  const auto on_tint = [](int x, int y) { return std::hypot(x - 96, y - 96) < 18; };
  const auto in_tint = [](int x, int y) { return std::hypot(x - 96, y - 96) < 14; };
  Image8 painted = ToImage8(view);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      for (int c = 0; c < 3 && on_line(x, y); ++c) painted(x, y, c) = c == 2 ? 230 : 20;
      for (int c = 0; c < 2 && on_tint(x, y); ++c) painted(x, y, c) = uint8_t(painted(x, y, c) / 2);
    }
  }
  for (const int quality : {75, 90}) {
    const Mask changed = ChangedIn(painted, view, quality, Format::kJpeg);
    int missed = 0, beyond = 0;
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        if (on_line(x, y) || in_tint(x, y)) missed += changed(x, y) ? 0 : 1;
        bool near = false;  // chroma of two pixels, its interpolation, and ChangedPixels()'s one
        for (int i = 0; i < 81; ++i) {
          near |= on_line(x + i % 9 - 4, y + i / 9 - 4) || on_tint(x + i % 9 - 4, y + i / 9 - 4);
        }
        beyond += changed(x, y) && !near ? 1 : 0;
      }
    }
    EXPECT_EQ(missed, 0) << quality;
    EXPECT_EQ(beyond, 0) << quality;
  }
}

// Blocks of a WebP file have 16 pixels, and its filters reach some farther.
TEST(JpegNoise, PaintInALossyWebpIsFoundToo) {
  const Image view = Scene();
  const auto on_disc = [](int x, int y, int radius) { return std::hypot(x - 96, y - 96) < radius; };
  Image8 painted = ToImage8(view);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      for (int c = 0; c < 3 && on_disc(x, y, 20); ++c) painted(x, y, c) = c == 2 ? 230 : 20;
    }
  }
  for (const int quality : {75, 90}) {
    const Mask changed = ChangedIn(painted, view, quality, Format::kWebp);
    int missed = 0, beyond = 0;
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        if (on_disc(x, y, 14)) missed += changed(x, y) ? 0 : 1;
        if (!on_disc(x, y, 44)) beyond += changed(x, y) ? 1 : 0;
      }
    }
    EXPECT_EQ(missed, 0) << quality;
    EXPECT_EQ(beyond, 0) << quality;
  }
}

}  // namespace
}  // namespace retint
