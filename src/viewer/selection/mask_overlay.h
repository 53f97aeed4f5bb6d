// SPDX-License-Identifier: BSD-3-Clause
// The mask as it is laid over the frozen view: a tint, and an outline so that color is not the
// only signal.
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

}  // namespace retint
