// SPDX-License-Identifier: BSD-3-Clause
#include "scene/contact_sheet.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.h"

namespace retint {
namespace {

constexpr uint8_t kPaper = 238;
constexpr std::array<float, 3> kMarker = {1.0F, 0.35F, 0.05F};

// Overlap of destination cell i (of `to` cells) with source pixels (of `from`), as first index and
// weights that sum to 1: box filter when shrinking, linear interpolation when growing.
struct Taps {
  int first = 0;
  std::vector<float> weights;
};

std::vector<Taps> MakeTaps(int from, int to) {
  const double step = static_cast<double>(from) / to;
  const double half = std::max(step, 1.0) / 2;  // at least a pixel wide
  std::vector<Taps> taps(static_cast<size_t>(to));
  for (int i = 0; i < to; ++i) {
    const double center = (i + 0.5) * step;
    const int begin = std::clamp(static_cast<int>(std::floor(center - half)), 0, from - 1);
    const int end = std::clamp(static_cast<int>(std::ceil(center + half)), begin + 1, from);
    Taps& tap = taps[static_cast<size_t>(i)];
    tap.first = begin;
    double sum = 0;
    for (int x = begin; x < end; ++x) {
      const double overlap = std::min(x + 1.0, center + half) - std::max<double>(x, center - half);
      tap.weights.push_back(static_cast<float>(std::max(overlap, 0.0)));
      sum += tap.weights.back();
    }
    for (float& weight : tap.weights) weight = static_cast<float>(weight / sum);
  }
  return taps;
}

void DrawResized(const Image8& image, int left, int top, int width, int height, Image8& canvas) {
  const std::vector<Taps> columns = MakeTaps(image.width, width);
  const std::vector<Taps> rows = MakeTaps(image.height, height);
  std::vector<float> narrow(static_cast<size_t>(width) * static_cast<size_t>(image.height) * 3);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Taps& taps = columns[static_cast<size_t>(x)];
      float* out =
          &narrow[(static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)) *
                  3];
      for (size_t i = 0; i < taps.weights.size(); ++i) {
        for (int c = 0; c < 3; ++c) {
          out[c] += taps.weights[i] * image(taps.first + static_cast<int>(i), y, c);
        }
      }
    }
  }
  for (int y = 0; y < height; ++y) {
    const Taps& taps = rows[static_cast<size_t>(y)];
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) {
        float value = 0;
        for (size_t i = 0; i < taps.weights.size(); ++i) {
          const size_t row = static_cast<size_t>(taps.first) + i;
          value += taps.weights[i] *
                   narrow[(row * static_cast<size_t>(width) + static_cast<size_t>(x)) * 3 +
                          static_cast<size_t>(c)];
        }
        canvas(left + x, top + y, c) = static_cast<uint8_t>(std::lround(value));
      }
    }
  }
}

}  // namespace

Image8 ContactSheet(const std::vector<std::vector<Image8>>& rows, int cell_width, int gap) {
  if (rows.empty() || rows[0].empty()) throw InputError("a contact sheet needs a picture");
  std::vector<int> heights;
  for (const auto& row : rows) {
    if (row.size() != rows[0].size()) throw InputError("a contact sheet's rows differ in length");
    for (const Image8& image : row) {
      if (image.Empty()) throw InputError("a contact sheet's picture is empty");
    }
    heights.push_back(std::max(1, static_cast<int>(std::lround(static_cast<double>(cell_width) *
                                                               row[0].height / row[0].width))));
  }
  const int columns = static_cast<int>(rows[0].size());
  int height = gap;
  for (const int row_height : heights) height += row_height + gap;
  Image8 sheet(columns * (cell_width + gap) + gap, height, kPaper);
  int top = gap;
  for (size_t r = 0; r < rows.size(); ++r) {
    for (int c = 0; c < columns; ++c) {
      DrawResized(rows[r][static_cast<size_t>(c)], gap + c * (cell_width + gap), top, cell_width,
                  heights[r], sheet);
    }
    top += heights[r] + gap;
  }
  return sheet;
}

Image8 ToImage8(const Image& image) {
  Image8 out(image.width, image.height);
  for (size_t i = 0; i < image.data.size(); ++i) {
    out.data[i] = static_cast<uint8_t>(std::lround(std::clamp(image.data[i], 0.0F, 1.0F) * 255.0F));
  }
  return out;
}

Image ToImage(const Image8& picture) {
  Image image(picture.width, picture.height);
  for (size_t i = 0; i < image.data.size(); ++i) {
    image.data[i] = static_cast<float>(picture.data[i]) / 255;
  }
  return image;
}

Image8 MaskOverlay(const Image& image, const Mask& mask) {
  Image out(image.width, image.height);
  for (size_t i = 0; i < image.NumPixels(); ++i) {
    const float* rgb = &image.data[3 * i];
    const float inside = static_cast<float>(mask.data[i]) / 255.0F;
    const float gray = 0.299F * rgb[0] + 0.587F * rgb[1] + 0.114F * rgb[2];
    for (size_t c = 0; c < 3; ++c) {
      const float outside = 0.45F * (0.6F * gray + 0.4F * rgb[c]);
      out.data[3 * i + c] = outside + inside * (0.55F * kMarker[c] + 0.6F * gray - outside);
    }
  }
  return ToImage8(out);
}

}  // namespace retint
