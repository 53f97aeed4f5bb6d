// SPDX-License-Identifier: BSD-3-Clause
// Icons of the selection tools, drawn in the palette's color so that they suit light and dark.
#pragma once

#include <QIcon>
#include <QPalette>

namespace retint {

enum class ToolIcon {
  kBrush,
  kEraser,
  kRectangle,
  kLasso,
  kPolygon,
  kScribble,
  kWand,
  kScissors,
  kSphere,
  kBox,
  kLike,
  kRefine,
  kUndo,
  kRedo,
  kGrow,
  kShrink,
  kInvert,
  kAll,
  kNone,
};

QIcon MakeToolIcon(ToolIcon icon, const QPalette& palette);

}  // namespace retint
