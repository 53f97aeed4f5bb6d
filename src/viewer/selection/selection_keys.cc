// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/selection_keys.h"

#include "viewer/selection/selection_canvas.h"

namespace retint {
namespace {

void ChangeOpacity(SelectionCanvas& canvas, double by) {
  canvas.SetOverlayOpacity(canvas.overlay_opacity() + by);
}

// The keys that choose a tool, then `others`.
std::vector<SelectionKey> AfterTools(const std::vector<SelectionKey>& others) {
  std::vector<SelectionKey> keys;
  for (const SelectionTool& tool : SelectionTools()) {
    const auto choose = [&tool](SelectionCanvas& canvas) { canvas.SetTool(tool); };
    for (const Qt::Key key : {tool.key, tool.other}) {
      if (key) keys.push_back({key, Qt::NoModifier, SelectionAct::kRun, choose, tool.listed});
    }
  }
  keys.insert(keys.end(), others.begin(), others.end());
  return keys;
}

}  // namespace

const std::vector<SelectionKey>& SelectionKeys() {
  using enum SelectionAct;
  constexpr auto kNone = Qt::NoModifier;
  constexpr auto kShift = Qt::ShiftModifier;
  constexpr auto kControl = Qt::ControlModifier;
  static const std::vector<SelectionKey> keys = AfterTools({
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
  });
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
