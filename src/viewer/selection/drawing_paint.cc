// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/drawing_paint.h"

#include <algorithm>
#include <utility>

#include <QPainter>
#include <QPolygonF>

namespace retint {

void PaintContrasted(QPainter& painter, const std::function<void()>& draw) {
  painter.setBrush(Qt::NoBrush);
  painter.setPen(QPen(QColor(0, 0, 0, 200), 3));
  draw();
  painter.setPen(QPen(Qt::white, 1));
  draw();
}

void PaintLine(QPainter& painter, const QPolygonF& points) {
  PaintContrasted(painter, [&] { painter.drawPolyline(points); });
}

void PaintRectangle(QPainter& painter, const QPolygonF& points, double, bool) {
  const QRectF rectangle = QRectF(points.first(), points.last()).normalized();
  PaintContrasted(painter, [&] { painter.drawRect(rectangle); });
}

void PaintStroke(QPainter& painter, const QPolygonF& points, double tip, bool outside) {
  const QColor color = outside ? QColor(230, 60, 50) : QColor(40, 190, 90);
  painter.setBrush(Qt::NoBrush);
  for (const auto& [pen, by] : {std::pair{QColor(0, 0, 0, 200), 2.0}, std::pair{color, 0.0}}) {
    painter.setPen(QPen(pen, std::max(2.0, tip) + by, Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin));
    painter.drawPolyline(points);
  }
  const QPointF at = points.first();
  constexpr double kDisc = 7, kSide = 4;
  painter.setPen(QPen(Qt::black, 1));
  painter.setBrush(color);
  painter.drawEllipse(at, kDisc, kDisc);
  painter.setPen(QPen(Qt::white, 2));
  painter.drawLine(at - QPointF(kSide, 0), at + QPointF(kSide, 0));
  if (!outside) painter.drawLine(at - QPointF(0, kSide), at + QPointF(0, kSide));
}

}  // namespace retint
