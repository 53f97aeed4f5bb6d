// SPDX-License-Identifier: BSD-3-Clause
// Shapes over a picture; positions and widths in widget pixels.
#pragma once

#include <functional>

class QPainter;
class QPolygonF;

namespace retint {

// `draw` in dark and light side by side: visible on any picture.
void PaintContrasted(QPainter& painter, const std::function<void()>& draw);
void PaintLine(QPainter& painter, const QPolygonF& points);
// These have the form of ToolActs::paint. The rectangle is that of the first and the last point.
void PaintRectangle(QPainter& painter, const QPolygonF& points, double tip = 0,
                    bool removes = false);
// A stroke inside or outside the object, with a sign, so that color is not the only signal.
void PaintStroke(QPainter& painter, const QPolygonF& points, double tip, bool outside);

}  // namespace retint
