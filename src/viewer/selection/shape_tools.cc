// SPDX-License-Identifier: BSD-3-Clause
// Tools that draw the selection itself: brush, eraser, rectangle, lasso and polygon.
#include "viewer/selection/drawing_paint.h"
#include "viewer/selection/selection_canvas.h"
#include "viewer/selection/selection_tools.h"

namespace retint {
namespace {

void FillPolygon(SelectionCanvas& canvas, const Drawing& drawing) {
  canvas.Edited(canvas.editor().FillPolygon(drawing.points, drawing.combine));
}

}  // namespace

ToolActs Brush() {
  return {.gesture = Gesture::kBrush,
          .sliders = kSizeSlider | kHardnessSlider,
          .has_tip = true,
          .combine =
              [](Qt::KeyboardModifiers held, const MaskEditor& editor) {
                const Combine combine = CombineByKeys(held, editor);
                return combine == Combine::kReplace ? Combine::kAdd : combine;
              },
          .hint = "Drag to paint, Ctrl erases  ·  [ ] size  ·  Shift+Ctrl intersects"};
}

ToolActs Eraser() {
  return {.gesture = Gesture::kBrush,
          .sliders = kSizeSlider | kHardnessSlider,
          .has_tip = true,
          .combine = [](Qt::KeyboardModifiers, const MaskEditor&) { return Combine::kRemove; },
          .hint = "Drag to erase  ·  [ ] or Alt+wheel changes the size"};
}

ToolActs Rectangle() {
  return {.gesture = Gesture::kSpan,
          .finish =
              [](SelectionCanvas& canvas, const Drawing& drawing) {
                canvas.Edited(canvas.editor().FillRectangle(
                    drawing.points.front(), drawing.points.back(), drawing.combine));
              },
          .paint = PaintRectangle,
          .hint = "Drag a rectangle"};
}

ToolActs Lasso() {
  return {.gesture = Gesture::kPath, .finish = FillPolygon, .hint = "Drag around it"};
}

ToolActs Polygon() {
  return {.gesture = Gesture::kCorners,
          .finish = FillPolygon,
          .find_hint = [](const SelectionCanvas& canvas) {
            return canvas.tr("Click corners, Enter closes  ·  Backspace takes one back");
          }};
}

}  // namespace retint
