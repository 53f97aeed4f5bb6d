// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/mask_overlay.h"

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "scene/mask_pixels.h"

namespace retint {
namespace {

// Image columns (or rows) of the device pixels first - 1 .. first + count; -1 outside the image.
std::vector<int> Under(int first, int count, double scale, double offset, int size) {
  std::vector<int> under(static_cast<size_t>(count) + 2, -1);
  for (int i = 0; i < count + 2; ++i) {
    const double at = std::floor((first - 1 + i + 0.5 - offset) / scale);
    if (at >= 0 && at < size) under[static_cast<size_t>(i)] = static_cast<int>(at);
  }
  return under;
}

// The mask at the device pixels of a rectangle, row by row.
class MaskRows {
 public:
  MaskRows(const Mask& mask, const ImageTransform& transform, const QRect& rect)
      : mask_(mask),
        columns_(Under(rect.x(), rect.width(), transform.scale, transform.offset.x(), mask.width)),
        rows_(Under(rect.y(), rect.height(), transform.scale, transform.offset.y(), mask.height)) {
    Read(lines_[1]);
    Read(lines_[2]);
  }

  // Goes to the rectangle's next row; the first call to its first row.
  void Next() {
    std::swap(lines_[0], lines_[1]);
    std::swap(lines_[1], lines_[2]);
    Read(lines_[2]);
  }
  // The value at a column of this row, from the rectangle's left; 0 outside the image.
  uint8_t operator[](int i) const { return lines_[1][size_t(i) + 1]; }
  bool Inside(int i) const { return IsInside((*this)[i]); }
  bool InImage(int i) const { return rows_[read_ - 2] >= 0 && columns_[size_t(i) + 1] >= 0; }
  // Whether a neighbor above, below, left or right is on the other side of the border.
  bool IsEdge(int i) const {
    const auto c = size_t(i) + 1;
    const bool inside = Inside(i);
    return IsInside(lines_[0][c]) != inside || IsInside(lines_[2][c]) != inside ||
           IsInside(lines_[1][c - 1]) != inside || IsInside(lines_[1][c + 1]) != inside;
  }

 private:
  void Read(std::vector<uint8_t>& line) {
    line.assign(columns_.size(), 0);
    const int y = rows_[read_++];
    if (y < 0) return;
    for (size_t i = 0; i < columns_.size(); ++i) {
      if (columns_[i] >= 0) line[i] = mask_(columns_[i], y);
    }
  }

  const Mask& mask_;
  std::vector<int> columns_, rows_;
  std::array<std::vector<uint8_t>, 3>
      lines_;        // above, this row, below; one pixel more on each side
  size_t read_ = 0;  // next row to read
};

QRgb Tint(QColor color, double opacity) {
  color.setAlphaF(static_cast<float>(opacity));
  return qPremultiply(color.rgba());
}

}  // namespace

QImage ComposeOverlay(const Mask& mask, const ImageTransform& transform, const QRect& rect,
                      const OverlayStyle& style) {
  QImage overlay(rect.size(), QImage::Format_ARGB32_Premultiplied);
  if (rect.isEmpty()) return overlay;
  std::array<QRgb, 256> tint;
  for (int i = 0; i < 256; ++i) tint[size_t(i)] = Tint(style.color, style.opacity * i / 255);
  MaskRows rows(mask, transform, rect);
  for (int j = 0; j < rect.height(); ++j) {
    rows.Next();
    auto* out = reinterpret_cast<QRgb*>(overlay.scanLine(j));
    for (int i = 0; i < rect.width(); ++i) {
      if (style.outline && rows.IsEdge(i) && rows.InImage(i)) {
        out[i] = rows.Inside(i) ? qRgba(255, 255, 255, 255) : qRgba(0, 0, 0, 255);
      } else {
        out[i] = tint[rows[i]];
      }
    }
  }
  return overlay;
}

QImage ComposeVeil(const Mask& veil, const Mask& mask, const ImageTransform& transform,
                   const QRect& rect, const OverlayStyle& style) {
  constexpr double kFainter = 0.5;  // than the mask's tint
  QImage overlay(rect.size(), QImage::Format_ARGB32_Premultiplied);
  if (rect.isEmpty()) return overlay;
  overlay.fill(Qt::transparent);
  const QRgb line = style.color.rgba(), tint = Tint(style.color, kFainter * style.opacity);
  MaskRows veiled(veil, transform, rect), masked(mask, transform, rect);
  for (int j = 0; j < rect.height(); ++j) {
    veiled.Next();
    masked.Next();
    auto* out = reinterpret_cast<QRgb*>(overlay.scanLine(j));
    for (int i = 0; i < rect.width(); ++i) {
      if (!veiled.Inside(i) || masked.Inside(i)) continue;
      out[i] = style.outline && veiled.IsEdge(i) ? line : tint;
    }
  }
  return overlay;
}

QImage ComposeHatching(const Mask& mask, const ImageTransform& transform, const QRect& rect,
                       const QColor& color, double ratio) {
  constexpr double kPeriod = 10, kDark = 0.2, kLight = 0.5;  // pixels; of a period, from its start
  QImage overlay(rect.size(), QImage::Format_ARGB32_Premultiplied);
  if (rect.isEmpty()) return overlay;
  overlay.fill(Qt::transparent);
  MaskRows rows(mask, transform, rect);
  for (int j = 0; j < rect.height(); ++j) {
    rows.Next();
    auto* out = reinterpret_cast<QRgb*>(overlay.scanLine(j));
    for (int i = 0; i < rect.width(); ++i) {
      if (!rows.Inside(i)) continue;
      const double periods = (rect.x() + i + rect.y() + j) / (kPeriod * ratio);
      const double at = periods - std::floor(periods);
      if (at < kLight) out[i] = at < kDark ? qRgba(0, 0, 0, 255) : color.rgba();
    }
  }
  return overlay;
}

}  // namespace retint
