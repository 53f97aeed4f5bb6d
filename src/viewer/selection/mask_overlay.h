// SPDX-License-Identifier: BSD-3-Clause
// The mask as it is laid over the frozen view: a tint, and an outline so that color is not the
// only signal. Beside it, fainter, the other selected pixels.
#pragma once

#include <QColor>
#include <QImage>
#include <QRect>

#include "scene/image.h"
#include "viewer/selection/image_transform.h"

namespace retint {

struct OverlayStyle {
  QColor color = QColor(255, 140, 0);
  double opacity = 0.45;  // of the tint where the mask is 255
  bool outline = true;    // white just inside, black just outside, one device pixel each
};

// The part `rect` of the screen, in device pixels; `transform` maps image to device pixels. The
// cost is that of `rect`. ARGB32 premultiplied.
QImage ComposeOverlay(const Mask& mask, const ImageTransform& transform, const QRect& rect,
                      const OverlayStyle& style);

// The same of `veil`, another mask of the image's size, where `mask` is outside: a fainter tint,
// and a line of the color along the inside of its border.
QImage ComposeVeil(const Mask& veil, const Mask& mask, const ImageTransform& transform,
                   const QRect& rect, const OverlayStyle& style);

// Slanted lines of `color`, dark ones beside them, where `mask` is inside; 10 device pixels apart
// for each of `ratio`.
QImage ComposeHatching(const Mask& mask, const ImageTransform& transform, const QRect& rect,
                       const QColor& color, double ratio);

}  // namespace retint
