// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/mask_overlay.h"

#include <array>
#include <cmath>
#include <vector>

namespace retint {
namespace {

// Image columns (or rows) under the device pixels first - 1 .. first + count; -1 beside the image.
std::vector<int> Under(int first, int count, double scale, double offset, int size) {
  std::vector<int> under(static_cast<size_t>(count) + 2, -1);
  for (int i = 0; i < count + 2; ++i) {
    const double at = std::floor((first - 1 + i + 0.5 - offset) / scale);
    if (at >= 0 && at < size) under[static_cast<size_t>(i)] = static_cast<int>(at);
  }
  return under;
}

}  // namespace

QImage ComposeOverlay(const Mask& mask, const ImageTransform& transform, const QRect& rect,
                      const OverlayStyle& style) {
  QImage overlay(rect.size(), QImage::Format_ARGB32_Premultiplied);
  if (rect.isEmpty()) return overlay;
  const int width = rect.width(), height = rect.height();
  const auto columns = Under(rect.x(), width, transform.scale, transform.offset.x(), mask.width);
  const auto rows = Under(rect.y(), height, transform.scale, transform.offset.y(), mask.height);
  std::array<QRgb, 256> tint;
  for (int i = 0; i < 256; ++i) {
    QColor color = style.color;
    color.setAlphaF(static_cast<float>(style.opacity * i / 255));
    tint[static_cast<size_t>(i)] = qPremultiply(color.rgba());
  }
  // Mask values of three device rows, with a pixel to either side.
  std::array<std::vector<uint8_t>, 3> values;
  const auto sample = [&](int row, std::vector<uint8_t>& line) {
    line.assign(columns.size(), 0);
    const int y = rows[static_cast<size_t>(row)];
    if (y < 0) return;
    for (size_t i = 0; i < columns.size(); ++i) {
      if (columns[i] >= 0) line[i] = mask(columns[i], y);
    }
  };
  sample(0, values[0]);
  sample(1, values[1]);
  for (int j = 0; j < height; ++j) {
    sample(j + 2, values[2]);
    auto* out = reinterpret_cast<QRgb*>(overlay.scanLine(j));
    const bool in_image = rows[static_cast<size_t>(j) + 1] >= 0;
    for (int i = 0; i < width; ++i) {
      const auto c = static_cast<size_t>(i) + 1;
      const bool inside = values[1][c] >= 128;
      const bool edge = (values[0][c] >= 128) != inside || (values[2][c] >= 128) != inside ||
                        (values[1][c - 1] >= 128) != inside || (values[1][c + 1] >= 128) != inside;
      if (edge && style.outline && in_image && columns[c] >= 0) {
        out[i] = inside ? qRgba(255, 255, 255, 255) : qRgba(0, 0, 0, 255);
      } else {
        out[i] = tint[values[1][c]];
      }
    }
    std::swap(values[0], values[1]);
    std::swap(values[1], values[2]);
  }
  return overlay;
}

}  // namespace retint
