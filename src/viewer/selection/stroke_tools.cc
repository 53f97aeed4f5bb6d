// SPDX-License-Identifier: BSD-3-Clause
// Tools that find an outline for strokes: scribbles, points for a network, and the edge under the
// brush.
#include <QPainter>

#include "viewer/selection/drawing_paint.h"
#include "viewer/selection/selection_canvas.h"
#include "viewer/selection/selection_tools.h"

namespace retint {
namespace {

QString ScribbleHint(const SelectionCanvas& canvas) {
  const std::vector<Scribble>& drawn = canvas.scribbles();
  if (drawn.empty()) {
    return canvas.tr("Draw a stroke on the object") +
           canvas.tr("  ·  its outline is found  ·  Shift adds it to what is selected");
  }
  if (drawn.size() == 1 && !drawn[0].outside) {
    return canvas.tr("Too much? Draw there with Ctrl") + canvas.tr("  ·  Enter accepts");
  }
  return canvas.tr("Draw what is missing, Ctrl removes") +
         canvas.tr("  ·  Enter accepts  ·  Ctrl+Z takes a stroke back");
}

QString ObjectHint(const SelectionCanvas& canvas) {
  if (canvas.scribbles().empty()) {
    return canvas.tr("Click the object") +
           canvas.tr("  ·  or drag a rectangle about it  ·  your network outlines it");
  }
  return canvas.tr("Click what is missing, Ctrl removes") +
         canvas.tr("  ·  Enter accepts  ·  Scribbles correct it, too");
}

void AddStroke(SelectionCanvas& canvas, const Drawing& drawing) { canvas.AddStroke(drawing); }

}  // namespace

ToolActs Scribbles() {
  return {.gesture = Gesture::kPath,
          .sliders = kSizeSlider,
          .has_tip = true,
          .keeps_strokes = true,
          .finish = AddStroke,
          .paint = PaintStroke,
          .find_hint = ScribbleHint};
}

ToolActs ObjectByNetwork() {
  return {.gesture = Gesture::kSpan,
          .keeps_strokes = true,
          .refuse = [](SelectionCanvas& canvas,
                       const Eigen::Vector2d&) { return canvas.NetworkProblem(); },
          .finish = AddStroke,
          .paint = PaintRectangle,
          .find_hint = ObjectHint};
}

ToolActs SnapEdge() {
  return {.gesture = Gesture::kPath,
          .sliders = kSizeSlider,
          .has_tip = true,
          .combine = [](Qt::KeyboardModifiers, const MaskEditor&) { return Combine::kReplace; },
          .finish = [](SelectionCanvas& canvas,
                       const Drawing& drawing) { canvas.RefineAlong(drawing.points); },
          .paint =
              [](QPainter& painter, const QPolygonF& points, double tip, bool) {
                painter.setPen(QPen(QColor(255, 255, 255, 90), tip, Qt::SolidLine, Qt::RoundCap,
                                    Qt::RoundJoin));
                painter.drawPolyline(points);
              },
          .hint =
              "Drag along the border  ·  it moves to the edges  ·  [ ] size  ·  Shift+F: the whole "
              "border"};
}

}  // namespace retint
