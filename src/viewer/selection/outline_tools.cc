// SPDX-License-Identifier: BSD-3-Clause
// Tools that follow the colors of the picture: wand, "like this color" and scissors.
#include <algorithm>
#include <cmath>

#include "selection/mask_tools/scissors.h"
#include "viewer/selection/drawing_paint.h"
#include "viewer/selection/selection_canvas.h"
#include "viewer/selection/selection_tools.h"

namespace retint {
namespace {

int Floor(double value) { return static_cast<int>(std::floor(value)); }

OutlineFinder::Work CutAlong(const ToolInput& input) {
  const Image& color = input.layers->color;
  const std::vector<Eigen::Vector2d>& points = input.points;
  std::vector<Eigen::Vector2i> anchors;  // the last point follows the cursor
  for (size_t i = 0; i + 1 < points.size(); ++i) {
    anchors.emplace_back(std::clamp(Floor(points[i].x()), 0, color.width - 1),
                         std::clamp(Floor(points[i].y()), 0, color.height - 1));
    if (i > 0 && anchors.back() == anchors[anchors.size() - 2]) anchors.pop_back();
  }
  if (anchors.size() < 3) return {};
  return [layers = input.layers, anchors](Monitor&) { return CutOut(layers->color, anchors); };
}

QString ScissorsHint(const SelectionCanvas& canvas) {
  if (canvas.NumCorners() == 0) {
    return canvas.tr("Click on the outline, then along it  ·  it follows the edges");
  }
  if (canvas.NumCorners() < 3) {
    return canvas.tr("Click on along the outline") +
           canvas.tr("  ·  three points at least  ·  Backspace takes one back");
  }
  return canvas.tr("Click on, Enter closes  ·  Backspace takes one back");
}

}  // namespace

ToolActs Wand() {
  return {.gesture = Gesture::kTune,
          .sliders = kToleranceSlider | kDepthSlider | kTurnSlider,
          .tolerance = [](OutlineOptions& options) -> double& { return options.wand.color; },
          .find = [](const ToolInput& input) -> OutlineFinder::Work {
            return [layers = input.layers, wand = input.options.wand](Monitor&) {
              return MagicWand(*layers, wand);
            };
          },
          .hint = "Click a surface  ·  drag right for more, left for less"};
}

ToolActs LikeThisColor() {
  return {.gesture = Gesture::kTune,
          .sliders = kToleranceSlider,
          .combine =
              [](Qt::KeyboardModifiers held, const MaskEditor& editor) {
                const Combine combine = CombineByKeys(held, editor);
                // Within the selection, if there is one.
                const bool within = combine == Combine::kReplace && editor.AnyInside();
                return within ? Combine::kIntersect : combine;
              },
          .tolerance = [](OutlineOptions& options) -> double& { return options.like; },
          .find = [](const ToolInput& input) -> OutlineFinder::Work {
            const int x = Floor(input.points[0].x()), y = Floor(input.points[0].y());
            return [layers = input.layers, x, y, tolerance = input.options.like](Monitor&) {
              return LikeColor(*layers, ColorAt(*layers, x, y), tolerance);
            };
          },
          .hint =
              "Click the color that stays  ·  drag right or left for more or less  ·  Shift adds, "
              "Ctrl removes"};
}

ToolActs Scissors() {
  return {.gesture = Gesture::kCorners,
          .find = CutAlong,
          .finish =
              [](SelectionCanvas& canvas, const Drawing& drawing) {
                if (drawing.points.size() < 3) {
                  canvas.NotFound(canvas.tr("An outline needs three points at least"));
                }
              },
          .paint =
              [](QPainter& painter, const QPolygonF& points, double, bool) {
                // Between corners, the border of the selection shows their path.
                PaintLine(painter, points.size() > 3 ? QPolygonF(points.last(2)) : points);
              },
          .find_hint = ScissorsHint};
}

}  // namespace retint
