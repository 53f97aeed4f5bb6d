// SPDX-License-Identifier: BSD-3-Clause
// Paints the selection canvas.
#include <algorithm>
#include <cmath>
#include <utility>

#include <QPaintEvent>
#include <QPainter>
#include <QPolygonF>

#include "viewer/canvas/contrast.h"
#include "viewer/selection/drawing_paint.h"
#include "viewer/selection/selection_canvas.h"

namespace retint {
namespace {

constexpr double kLeastOutline = 3;  // widget pixels; a smaller brush is a cross

QPointF ToPoint(const Eigen::Vector2d& point) { return {point.x(), point.y()}; }

}  // namespace

QRect SelectionCanvas::WidgetRect(const GridRect& rect) const {
  const Eigen::Vector2d a = transform_.ToWidget({double(rect.x), double(rect.y)});
  const Eigen::Vector2d b = transform_.ToWidget({double(rect.x1()), double(rect.y1())});
  return QRectF(ToPoint(a), ToPoint(b)).toAlignedRect().adjusted(-2, -2, 2, 2);
}

void SelectionCanvas::paintEvent(QPaintEvent* event) {
  QPainter painter(this);
  const QRect clip = event->rect();
  painter.fillRect(clip, QColor(38, 38, 40));
  if (image_.isNull()) return;
  const QRectF target(ToPoint(transform_.offset), QSizeF(image_.size()) * transform_.scale);
  // Pixels that are large enough to be painted singly have sharp edges.
  painter.setRenderHint(QPainter::SmoothPixmapTransform, transform_.scale < 4);
  painter.drawImage(target, image_);
  if (!ready_) return;
  if (!overlay_hidden_) PaintOverlay(painter, clip);
  painter.setPen(QPen(QColor(255, 255, 255, 60), 1));
  painter.drawRect(target.adjusted(-0.5, -0.5, 0.5, 0.5));
  painter.setRenderHint(QPainter::Antialiasing);
  if (!overlay_hidden_) PaintScribbles(painter);
  PaintDrawing(painter);
  PaintBrush(painter);
}

void SelectionCanvas::PaintOverlay(QPainter& painter, const QRect& clip) {
  const double ratio = devicePixelRatioF();
  ImageTransform to_device = transform_;
  to_device.scale *= ratio;
  to_device.offset *= ratio;
  const QRect device =
      QRectF(QPointF(clip.topLeft()) * ratio, QSizeF(clip.size()) * ratio).toAlignedRect();
  const auto lay = [&](QImage overlay) {
    overlay.setDevicePixelRatio(ratio);
    painter.drawImage(QPointF(device.topLeft()) / ratio, overlay);
  };
  if (!veil_->mask().Empty()) {
    painter.setOpacity(veil_->opacity());
    lay(ComposeVeil(veil_->mask(), editor_.mask(), to_device, device, style_));
    painter.setOpacity(1);
  }
  lay(ComposeOverlay(editor_.mask(), to_device, device, style_));
  if (!hatched_.Empty()) {
    lay(ComposeHatching(hatched_, to_device, device, ContrastingColor(style_.color), ratio));
  }
}

void SelectionCanvas::PaintDrawing(QPainter& painter) const {
  if (!drawing_) return;
  QPolygonF outline;
  for (const auto& point : drawing_->points) outline << ToPoint(transform_.ToWidget(point));
  painter.setBrush(Qt::NoBrush);
  if (acts().paint) {
    const double tip = 2 * brush().radius * transform_.scale;
    acts().paint(painter, outline, tip, drawing_->combine == Combine::kRemove);
  } else {
    PaintLine(painter, outline);
  }
  if (!HasCorners()) return;
  painter.setPen(QPen(Qt::black, 1));
  for (int i = 0; i + 1 < outline.size(); ++i) {
    painter.setBrush(i == 0 ? QColor(90, 200, 255) : QColor(Qt::white));
    const double half = i == 0 ? 5 : 3;  // a click on the first closes the polygon
    painter.drawEllipse(outline[i], half, half);
  }
}

void SelectionCanvas::PaintScribbles(QPainter& painter) const {
  for (const Scribble& scribble : scribbles_) {
    QPolygonF line;
    for (const auto& point : scribble.points) line << ToPoint(transform_.ToWidget(point));
    if (scribble.object && line.size() > 1) {
      PaintRectangle(painter, line);
    } else {
      PaintStroke(painter, line, scribble.width * transform_.scale, scribble.outside);
    }
  }
}

void SelectionCanvas::PaintBrush(QPainter& painter) const {
  if (!cursor_ || pan_from_ || space_ || !paintable_) return;
  painter.setBrush(Qt::NoBrush);
  const double radius = brush().radius * transform_.scale;
  if (acts().has_tip) {
    PaintContrasted(painter, [&] {
      if (radius >= kLeastOutline) painter.drawEllipse(*cursor_, radius, radius);
    });
    const double core = radius * brush_.hardness;
    if (IsBrush() && brush_.hardness < 1 && core >= kLeastOutline) {
      painter.setPen(QPen(QColor(255, 255, 255, 160), 1, Qt::DotLine));
      painter.drawEllipse(*cursor_, core, core);
    }
  }
  // The effect of the stroke beside the cursor: + adds, - removes, x intersects.
  const Combine combine = acts().combine(modifiers_, editor_);
  if (combine == Combine::kReplace || (IsBrush() && combine == Combine::kAdd)) return;
  const double side = 4;
  const QPointF at = *cursor_ + QPointF(13, 13);
  PaintContrasted(painter, [&] {
    if (combine == Combine::kIntersect) {
      painter.drawLine(at + QPointF(-side, -side), at + QPointF(side, side));
      painter.drawLine(at + QPointF(-side, side), at + QPointF(side, -side));
      return;
    }
    painter.drawLine(at + QPointF(-side, 0), at + QPointF(side, 0));
    if (combine == Combine::kAdd) painter.drawLine(at + QPointF(0, -side), at + QPointF(0, side));
  });
}

void SelectionCanvas::UpdateBrushOutline() {
  QRect now;
  if (cursor_) {
    const double tip = acts().has_tip ? brush().radius * transform_.scale : 0;
    const double reach = std::max(24.0, tip + 4);
    now = QRectF(cursor_->x() - reach, cursor_->y() - reach, 2 * reach, 2 * reach).toAlignedRect();
  }
  update(brush_rect_);
  update(now);
  brush_rect_ = now;
}

void SelectionCanvas::UpdateCursor() {
  if (pan_from_) {
    setCursor(Qt::ClosedHandCursor);
  } else if (space_) {
    setCursor(Qt::OpenHandCursor);
  } else if (!ready_ || !paintable_) {
    setCursor(Qt::BusyCursor);
  } else if (IsFinding() && !drawing_ && !tuning_) {
    setCursor(QCursor(Qt::WaitCursor));
  } else {
    setCursor(Qt::CrossCursor);
  }
}

}  // namespace retint
