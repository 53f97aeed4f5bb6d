// SPDX-License-Identifier: BSD-3-Clause
// The mask over the frozen view: a tint, and an outline, so that color is not the only signal.
// Other selected pixels are fainter.
#pragma once

#include <QColor>
#include <QImage>
#include <QRect>

#include "scene/image.h"
#include "viewer/selection/image_transform.h"

namespace retint {

struct OverlayStyle {
  QColor color = QColor(255, 140, 0);
  double opacity = 0.45;  // of the tint at a mask value of 255
  bool outline = true;    // white just inside, black just outside, one device pixel each
};

// The part `rect` of the screen, in device pixels. `transform` maps the image to device pixels. The
// cost depends only on `rect`. ARGB32 premultiplied.
QImage ComposeOverlay(const Mask& mask, const ImageTransform& transform, const QRect& rect,
                      const OverlayStyle& style);

// The same for `veil`, a mask of the image's size, outside `mask`: a fainter tint, and a line along
// the inside of its border.
QImage ComposeVeil(const Mask& veil, const Mask& mask, const ImageTransform& transform,
                   const QRect& rect, const OverlayStyle& style);

// Slanted lines of `color` with dark ones beside them, inside `mask`. They are 10 * `ratio` device
// pixels apart.
QImage ComposeHatching(const Mask& mask, const ImageTransform& transform, const QRect& rect,
                       const QColor& color, double ratio);

}  // namespace retint
