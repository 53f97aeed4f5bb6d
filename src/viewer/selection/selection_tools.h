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
  // These find the outline, as `retint mask` does (selection/mask_tools/).
  kScribble,
  kObject,  // a network of the user's own proposes it
  kWand,
  kScissors,
  kSphere,
  kBox,
  kLike,
  kRefine,
};

struct OutlineOptions {
  WandOptions wand;                   // its pixel is where one clicks
  double like = WandOptions().color;  // OKLab distance of "like this color"
  double box_margin = 0.1;            // of the size of the dragged box, on each side
  BrushOptions scribble = {4, 1};
};

// A shape while it is drawn; positions in the image. What a tool that finds the outline makes of
// it shows already, and is replaced as the drawing goes on.
struct Drawing {
  SelectionTool tool;
  Combine combine;
  std::vector<Eigen::Vector2d> points;
  uint64_t gesture;  // see OutlineFinder
};

// The wand and "like this color" follow the mouse until it is let go: to the right more tolerance,
// to the left less.
struct Tuning {
  Combine combine;
  Eigen::Vector2d at;  // image
  QPointF from;        // widget
  double tolerance;    // at the press
  uint64_t gesture;
  bool asked = false;
};

// A stroke on the object or beside it. What all of them together mean is found after each; strokes
// that were drawn meanwhile share a gesture and a step of the history.
struct Scribble {
  std::vector<Eigen::Vector2d> points;  // image
  double width;                         // pixels of the image
  bool outside;
  uint64_t gesture;
  bool object = false;  // for the network: a point, or two corners of a rectangle
  bool found = false;   // the mask shows it
  bool step = false;    // which was a step of the history
};

}  // namespace retint
