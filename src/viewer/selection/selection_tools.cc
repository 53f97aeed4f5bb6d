// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/selection_tools.h"

#include <algorithm>

namespace retint {

// shape_tools.cc
ToolActs Brush();
ToolActs Eraser();
ToolActs Rectangle();
ToolActs Lasso();
ToolActs Polygon();
// stroke_tools.cc
ToolActs Scribbles();
ToolActs ObjectByNetwork();
ToolActs SnapEdge();
// outline_tools.cc
ToolActs Wand();
ToolActs LikeThisColor();
ToolActs Scissors();
// solid_tools.cc
ToolActs SphereAbout();
ToolActs BoxAbout();

const std::vector<SelectionTool>& SelectionTools() {
  static const std::vector<SelectionTool> tools = {
      {"brush", "Brush", "Brush", Qt::Key_B, "drag to paint, with Ctrl to erase", "Brush", Brush()},
      {"eraser", "Eraser", "Eraser", Qt::Key_E, "drag to erase", "Eraser", Eraser()},
      {"rectangle", "Rectangle", "Rectangle", Qt::Key_R, "drag from corner to corner", "Rectangle",
       Rectangle()},
      {"lasso", "Lasso", "Lasso", Qt::Key_L, "drag around it", "Lasso", Lasso()},
      {"polygon", "Polygon", "Polygon", Qt::Key_P, "click corner by corner", "Polygon", Polygon()},
      {"scribble", "Scribbles", "Scribbles", Qt::Key_S,
       "strokes on the object, with Ctrl on what it is not; the outline is found",
       "Scribbles: strokes on the object, with Ctrl beside it", Scribbles()},
      {"object", "Object", "Object", Qt::Key_N,
       "click the object, or drag a rectangle about it; your own network outlines it",
       "Object: click it, or drag a rectangle about it; your own network outlines it",
       ObjectByNetwork()},
      {"wand", "Wand", "Magic wand", Qt::Key_W,
       "click a surface of one color; it ends at steps and where it turns away",
       "Magic wand: a surface of one color", Wand(), Qt::Key_O},
      {"scissors", "Scissors", "Intelligent scissors", Qt::Key_I,
       "click along the outline, which follows the edges between clicks",
       "Intelligent scissors: click along the outline", Scissors()},
      {"sphere", "Sphere", "Sphere", Qt::Key_H,
       "press on the object and drag as far as the sphere reaches",
       "Sphere about a point of a surface", SphereAbout()},
      {"box", "Box", "Box", Qt::Key_X,
       "drag across the object; the box holds the surface under the cursor",
       "Box about the surface dragged over", BoxAbout()},
      {"like", "Like", "Like this color", Qt::Key_K,
       "click a color; of what is selected, what has this color stays",
       "Like this color: of what is selected, what has a color", LikeThisColor()},
      {"refine", "Refine", "Snap edge", Qt::Key_F,
       "drag along the border, which moves to the edges under the brush; Shift+F: the whole "
       "border",
       "Snap edge: the border under the brush moves to the edges", SnapEdge()},
  };
  return tools;
}

const SelectionTool& FindTool(std::string_view id) {
  return *std::ranges::find(SelectionTools(), id, &SelectionTool::id);
}

Combine CombineByKeys(Qt::KeyboardModifiers held, const MaskEditor&) {
  const bool shift = held.testFlag(Qt::ShiftModifier), control = held.testFlag(Qt::ControlModifier);
  if (shift && control) return Combine::kIntersect;
  if (control) return Combine::kRemove;
  return shift ? Combine::kAdd : Combine::kReplace;
}

}  // namespace retint
