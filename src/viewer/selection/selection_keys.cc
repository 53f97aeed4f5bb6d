// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/selection_keys.h"

#include "viewer/selection/selection_canvas.h"

namespace retint {
namespace {

template <SelectionTool kTool>
void Choose(SelectionCanvas& canvas) {
  canvas.SetTool(kTool);
}

void ChangeOpacity(SelectionCanvas& canvas, double by) {
  canvas.SetOverlayOpacity(canvas.overlay_opacity() + by);
}

}  // namespace

const std::vector<SelectionKey>& SelectionKeys() {
  using enum SelectionAct;
  constexpr auto kNone = Qt::NoModifier;
  constexpr auto kShift = Qt::ShiftModifier;
  constexpr auto kControl = Qt::ControlModifier;
  constexpr const char* kWandText = "Magic wand: a surface of one color";
  static const std::vector<SelectionKey> keys = {
      {Qt::Key_B, kNone, kRun, Choose<SelectionTool::kBrush>, "Brush"},
      {Qt::Key_E, kNone, kRun, Choose<SelectionTool::kEraser>, "Eraser"},
      {Qt::Key_R, kNone, kRun, Choose<SelectionTool::kRectangle>, "Rectangle"},
      {Qt::Key_L, kNone, kRun, Choose<SelectionTool::kLasso>, "Lasso"},
      {Qt::Key_P, kNone, kRun, Choose<SelectionTool::kPolygon>, "Polygon"},
      {Qt::Key_S, kNone, kRun, Choose<SelectionTool::kScribble>,
       "Scribbles: strokes on the object, with Ctrl beside it"},
      {Qt::Key_N, kNone, kRun, Choose<SelectionTool::kObject>,
       "Object: click it, or drag a rectangle about it; your own network outlines it"},
      {Qt::Key_W, kNone, kRun, Choose<SelectionTool::kWand>, kWandText},
      {Qt::Key_O, kNone, kRun, Choose<SelectionTool::kWand>, kWandText},
      {Qt::Key_I, kNone, kRun, Choose<SelectionTool::kScissors>,
       "Intelligent scissors: click along the outline"},
      {Qt::Key_H, kNone, kRun, Choose<SelectionTool::kSphere>, "Sphere about a point of a surface"},
      {Qt::Key_X, kNone, kRun, Choose<SelectionTool::kBox>, "Box about the surface dragged over"},
      {Qt::Key_K, kNone, kRun, Choose<SelectionTool::kLike>,
       "Like this color: of what is selected, what has a color"},
      {Qt::Key_F, kNone, kRun, Choose<SelectionTool::kRefine>,
       "Snap edge: the border under the brush moves to the edges"},
      {Qt::Key_F, kShift, kRun, [](SelectionCanvas& c) { c.RefineBorder(); },
       "Refine the whole border, within the brush's radius"},
      {Qt::Key_BracketLeft, kNone, kRun, [](SelectionCanvas& c) { c.ScaleBrush(-1); },
       "Smaller brush"},
      {Qt::Key_BracketRight, kNone, kRun, [](SelectionCanvas& c) { c.ScaleBrush(1); },
       "Larger brush"},
      {Qt::Key_A, kControl, kRun, [](SelectionCanvas& c) { c.SelectAll(); }, "All"},
      {Qt::Key_A, kControl | kShift, kRun, [](SelectionCanvas& c) { c.SelectNone(); }, "Nothing"},
      {Qt::Key_I, kControl, kRun, [](SelectionCanvas& c) { c.Invert(); }, "Invert"},
      {Qt::Key_G, kNone, kRun, [](SelectionCanvas& c) { c.GrowBy(1); }, "Grow by a pixel"},
      {Qt::Key_G, kShift, kRun, [](SelectionCanvas& c) { c.GrowBy(-1); }, "Shrink by a pixel"},
      {Qt::Key_Z, kControl, kRun, [](SelectionCanvas& c) { c.Undo(); }, "Undo a stroke"},
      {Qt::Key_Z, kControl | kShift, kRun, [](SelectionCanvas& c) { c.Redo(); }, "Redo a stroke"},
      {Qt::Key_Y, kControl, kRun, [](SelectionCanvas& c) { c.Redo(); }, "Redo a stroke"},
      {Qt::Key_Backspace, kNone, kTakeBack, nullptr, "Take back the last point of what is drawn"},
      {Qt::Key_Comma, kNone, kRun, [](SelectionCanvas& c) { ChangeOpacity(c, -0.1); },
       "Fainter overlay"},
      {Qt::Key_Period, kNone, kRun, [](SelectionCanvas& c) { ChangeOpacity(c, 0.1); },
       "Stronger overlay"},
      {Qt::Key_Backslash, kNone, kHideOverlay, nullptr, "Without the overlay (hold)"},
      {Qt::Key_0, kNone, kRun, [](SelectionCanvas& c) { c.FitView(); }, "The whole view"},
      {Qt::Key_1, kNone, kRun, [](SelectionCanvas& c) { c.ActualSize(); },
       "A pixel of the view on a pixel of the screen"},
      {Qt::Key_Space, kNone, kPan, nullptr, "Pan (hold and drag)"},
      {Qt::Key_Return, kNone, kAccept, nullptr, "Close the outline, else accept"},
      {Qt::Key_Enter, kNone, kAccept, nullptr, "Close the outline, else accept"},
      {Qt::Key_Escape, kNone, kLeave, nullptr, "Give up what is drawn, then the tool, then leave"},
  };
  return keys;
}

const SelectionKey* FindSelectionKey(const QKeyEvent& event) {
  const auto modifiers = event.modifiers() & ~Qt::KeypadModifier;
  for (const SelectionKey& key : SelectionKeys()) {
    if (key.key != event.key()) continue;
    if (key.act != SelectionAct::kRun || key.modifiers == modifiers) return &key;
  }
  return nullptr;
}

}  // namespace retint
