// SPDX-License-Identifier: BSD-3-Clause
// The tools of the selection canvas, and the current drawing.
#pragma once

#include <cstdint>
#include <vector>

#include <QPointF>

#include "selection/mask_tools/pixel_tools.h"
#include "viewer/selection/mask_editor.h"

namespace retint {

enum class SelectionTool {
  kBrush,
  kEraser,
  kRectangle,
  kLasso,
  kPolygon,
  // These find an outline, as `retint mask` does (selection/mask_tools/).
  kScribble,
  kObject,  // the user's own network proposes it
  kWand,
  kScissors,
  kSphere,
  kBox,
  kLike,
  kRefine,
};

struct OutlineOptions {
  WandOptions wand;                   // its pixel is the clicked one
  double like = WandOptions().color;  // OKLab distance of "like this color"
  double box_margin = 0.1;            // of the dragged box's size, on each side
  BrushOptions scribble = {4, 1};
};

// An unfinished shape; positions in the image. Tools that find an outline already show the result
// for the drawing so far.
struct Drawing {
  SelectionTool tool;
  Combine combine;
  std::vector<Eigen::Vector2d> points;
  uint64_t gesture;  // see OutlineFinder
};

// Wand and "like this color" follow the mouse until its release: more tolerance to the right, less
// to the left.
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

}  // namespace retint
