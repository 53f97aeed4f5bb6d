// SPDX-License-Identifier: BSD-3-Clause
// The tools of the selection canvas: a table with one row each, and the current drawing.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include <QPointF>
#include <QPolygonF>
#include <QString>

#include "selection/mask_tools/pixel_tools.h"
#include "viewer/selection/mask_editor.h"
#include "viewer/selection/outline_finder.h"

class QPainter;

namespace retint {

class SelectionCanvas;

struct OutlineOptions {
  WandOptions wand;                   // its pixel is the clicked one
  double like = WandOptions().color;  // OKLab distance of "like this color"
  double box_margin = 0.1;            // of the dragged box's size, on each side
  BrushOptions scribble = {4, 1};
};

// An unfinished shape; positions in the image.
struct Drawing {
  Combine combine;
  std::vector<Eigen::Vector2d> points;
  uint64_t gesture;  // see OutlineFinder
};

// A Gesture::kTune: more tolerance to the right, less to the left.
struct Tuning {
  Combine combine;
  Eigen::Vector2d at;  // image
  QPointF from;        // widget
  double tolerance;    // at the press
  uint64_t gesture;
  bool asked = false;
};

// A stroke on the object or beside it. After each one, an outline is found for all of them. Strokes
// drawn during a search share a gesture and a step of the history.
struct Scribble {
  std::vector<Eigen::Vector2d> points;  // image
  double width;                         // pixels of the image
  bool outside;
  uint64_t gesture;
  bool object = false;  // for the network: one point, or two corners of a rectangle
  bool found = false;   // the mask includes it
  bool step = false;    // this was a step of the history
};

enum class Gesture {
  kBrush,    // paints in the mask while the button is down
  kPath,     // a drag, all of its points
  kSpan,     // a drag, its first and last point
  kCorners,  // clicks, until Enter or a click on the first one
  kTune,     // a click; dragging from there changes a tolerance until the release
};

// The sliders of a tool, beside the overlay's.
enum ToolSlider : unsigned {
  kSizeSlider = 1,
  kHardnessSlider = 2,
  kToleranceSlider = 4,
  kDepthSlider = 8,
  kTurnSlider = 16,
  kMarginSlider = 32,
};

// The modifiers' meaning: Shift adds, Ctrl removes, both intersect; none replaces.
Combine CombineByKeys(Qt::KeyboardModifiers held, const MaskEditor& editor);

struct ToolInput {
  std::shared_ptr<const ViewLayers> layers;
  const OutlineOptions& options;
  const std::vector<Eigen::Vector2d>& points;  // drawn so far, pixels of the image
};

// What a tool does. A function that is null does nothing.
struct ToolActs {
  Gesture gesture;
  unsigned sliders = 0;  // of ToolSlider
  bool has_tip = false;  // it draws with the brush, which shows at the cursor
  // Its drawings are strokes of one list, see Scribble: lines if it has a tip, else prompts for the
  // network.
  bool keeps_strokes = false;
  Combine (*combine)(Qt::KeyboardModifiers held, const MaskEditor& editor) = CombineByKeys;
  // Why it cannot begin here; empty if it can.
  QString (*refuse)(SelectionCanvas& canvas, const Eigen::Vector2d& at) = nullptr;
  double& (*tolerance)(OutlineOptions& options) = nullptr;  // that kTune changes
  // The search for a mask, on another thread; called after each change of the drawing. An empty
  // function: these points select nothing yet.
  OutlineFinder::Work (*find)(const ToolInput& input) = nullptr;
  void (*finish)(SelectionCanvas& canvas, const Drawing& drawing) = nullptr;
  // Draws the shape, in widget pixels, instead of a line through its points. `tip`: width of the
  // brush.
  void (*paint)(QPainter& painter, const QPolygonF& points, double tip, bool removes) = nullptr;
  // The next step, before the modifiers if it CombineByKeys(); or a function that finds all of it.
  // The first part is short; "  ·  " separates parts that may be left out.
  const char* hint = "";
  QString (*find_hint)(const SelectionCanvas& canvas) = nullptr;
};

struct SelectionTool {
  const char* id;            // names its drawing, widgets/icons/ID.svg
  const char *name, *title;  // of the button: for tests and screen readers, and in its tip
  Qt::Key key;
  const char* tip;     // after the title
  const char* listed;  // in the list of keys
  ToolActs acts;
  Qt::Key other = Qt::Key(0);  // 0: no other key
};

// In the order of their buttons and of the list of keys. The first one is the brush.
const std::vector<SelectionTool>& SelectionTools();
const SelectionTool& FindTool(std::string_view id);  // one that exists

}  // namespace retint
