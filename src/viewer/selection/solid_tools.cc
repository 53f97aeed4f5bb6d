// SPDX-License-Identifier: BSD-3-Clause
// Tools that select the surfaces within a solid: sphere and box.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <QLineF>
#include <QPainter>

#include "selection/depth_sampling.h"
#include "viewer/selection/drawing_paint.h"
#include "viewer/selection/selection_canvas.h"
#include "viewer/selection/selection_tools.h"

namespace retint {
namespace {

constexpr double kLeastMargin = 1e-3;  // of a box, so that a flat surface is in it

int Floor(double value) { return static_cast<int>(std::floor(value)); }

// In the world; none where there is no depth.
std::optional<Eigen::Vector3d> SurfaceAt(const ViewLayers& layers, const Eigen::Vector2d& at) {
  const int x = Floor(at.x()), y = Floor(at.y());
  if (!layers.Surface().Contains(x, y) || !HasDepth(layers.Surface(), x, y)) return std::nullopt;
  const Eigen::Vector3d in_cam = double(layers.Surface()(x, y)) * RayAt(layers, at);
  return layers.camera.cam_from_world.Inverse() * in_cam;
}

OutlineFinder::Work FindSphere(const ToolInput& input) {
  const Eigen::Vector2d from = input.points.front(), to = input.points.back();
  const ViewLayers& layers = *input.layers;
  const double depth = layers.Surface()(Floor(from.x()), Floor(from.y()));
  const double radius = depth * (RayAt(layers, to) - RayAt(layers, from)).norm();
  if (radius <= 0) return {};
  return [layers = input.layers, center = *SurfaceAt(layers, from), radius](Monitor&) {
    return InSphere(*layers, center, radius);
  };
}

// The box about the dragged box, `margin` of its size larger on each side.
std::optional<std::array<Eigen::Vector3d, 2>> BoxOf(const std::vector<Eigen::Vector3d>& points,
                                                    double margin) {
  if (points.empty()) return std::nullopt;
  Eigen::Vector3d low = points[0], high = points[0];
  for (const Eigen::Vector3d& point : points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  const Eigen::Vector3d size = high - low;
  if (size.maxCoeff() <= 0) return std::nullopt;
  const Eigen::Vector3d pad = (margin * size).cwiseMax(kLeastMargin * size.maxCoeff());
  return std::array<Eigen::Vector3d, 2>{low - pad, high + pad};
}

// Sets `mask` to 0 outside the rectangle of `points` (pixels). `margin` as above, relative to its
// longer side, and at least one pixel.
void ClipToDrag(const std::vector<Eigen::Vector2d>& points, double margin, Mask* mask) {
  Eigen::Array2d low = points.front(), high = low;
  for (const Eigen::Vector2d& point : points) {
    low = low.min(point.array());
    high = high.max(point.array());
  }
  const double pad = std::max(1.0, margin * (high - low).maxCoeff());
  for (int y = 0; y < mask->height; ++y) {
    for (int x = 0; x < mask->width; ++x) {
      const Eigen::Array2d at(x + 0.5, y + 0.5);
      if ((at < low - pad).any() || (at > high + pad).any()) (*mask)(x, y) = 0;
    }
  }
}

OutlineFinder::Work FindBox(const ToolInput& input) {
  const std::vector<Eigen::Vector2d>& points = input.points;
  std::vector<Eigen::Vector3d> surface;
  for (size_t i = 0; i + 1 < points.size(); ++i) {
    const Eigen::Vector2d step = points[i + 1] - points[i];
    const int count = std::max(1, static_cast<int>(std::ceil(step.norm())));
    for (int k = 0; k <= count; ++k) {
      if (const auto at = SurfaceAt(*input.layers, points[i] + step * k / count)) {
        surface.push_back(*at);
      }
    }
  }
  const double margin = input.options.box_margin;
  const auto box = BoxOf(surface, margin);
  if (!box) return {};
  return [layers = input.layers, box = *box, points, margin](Monitor&) {
    Mask mask = InBox(*layers, box[0], box[1]);
    ClipToDrag(points, margin, &mask);
    return mask;
  };
}

}  // namespace

ToolActs SphereAbout() {
  return {.gesture = Gesture::kSpan,
          .refuse =
              [](SelectionCanvas& canvas, const Eigen::Vector2d& at) {
                if (SurfaceAt(canvas.layers(), at)) return QString();
                return canvas.tr("There is no surface here: press on the object");
              },
          .find = FindSphere,
          .paint =
              [](QPainter& painter, const QPolygonF& points, double, bool) {
                const double radius = QLineF(points.first(), points.last()).length();
                PaintContrasted(painter, [&] {
                  painter.drawEllipse(points.first(), radius, radius);
                  painter.drawLine(points.first(), points.last());
                });
              },
          .hint = "Drag from the object  ·  as far as the sphere reaches"};
}

ToolActs BoxAbout() {
  return {.gesture = Gesture::kPath,
          .sliders = kMarginSlider,
          .find = FindBox,
          .hint = "Drag across the object  ·  the box holds what was under the cursor"};
}

}  // namespace retint
