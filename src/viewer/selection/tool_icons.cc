// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/tool_icons.h"

#include <cmath>
#include <utility>

#include <QPainter>
#include <QPainterPath>
#include <QPixmap>

namespace retint {
namespace {

// Each on a field of 20 x 20.

void DrawBrush(QPainter& painter, const QColor& ink) {
  QPainterPath handle;
  handle.moveTo(17, 2.5);
  handle.lineTo(17.5, 3);
  handle.lineTo(10.6, 12.2);
  handle.lineTo(8, 9.6);
  handle.closeSubpath();
  painter.drawPath(handle);
  QPainterPath tip;
  tip.moveTo(7, 10.8);
  tip.cubicTo(3.4, 10.8, 5.4, 14.8, 2.2, 16.4);
  tip.cubicTo(5.6, 18, 10, 16.8, 9.4, 13.2);
  tip.closeSubpath();
  painter.fillPath(tip, ink);
}

void DrawEraser(QPainter& painter, const QColor& ink) {
  QPainterPath body;
  body.moveTo(11.5, 3);
  body.lineTo(17, 8.5);
  body.lineTo(9.5, 16);
  body.lineTo(6.5, 16);
  body.lineTo(3, 12.5);
  body.lineTo(3, 11.5);
  body.closeSubpath();
  painter.drawPath(body);
  QPainterPath end;
  end.moveTo(6.8, 7.8);
  end.lineTo(12.3, 13.2);
  end.lineTo(9.5, 16);
  end.lineTo(6.5, 16);
  end.lineTo(3, 12.5);
  end.lineTo(3, 11.5);
  end.closeSubpath();
  painter.fillPath(end, ink);
  painter.drawLine(QPointF(9.5, 16.8), QPointF(17, 16.8));
}

void DrawLasso(QPainter& painter) {
  QPainterPath loop;
  loop.addEllipse(QRectF(3, 3, 14, 9));
  painter.drawPath(loop);
  QPainterPath rope;
  rope.moveTo(6, 11.5);
  rope.cubicTo(3.5, 14, 8, 14, 6, 17.5);
  painter.drawPath(rope);
}

void DrawPolygon(QPainter& painter, const QColor& ink) {
  const QPolygonF outline({{4, 6}, {12, 3}, {17, 10}, {12, 17}, {5, 14}});
  painter.drawPolygon(outline);
  for (const QPointF& corner : outline) {
    painter.fillRect(QRectF(corner.x() - 1.6, corner.y() - 1.6, 3.2, 3.2), ink);
  }
}

void DrawScribble(QPainter& painter) {
  QPainterPath stroke;
  stroke.moveTo(2.5, 12);
  stroke.cubicTo(4, 4, 7, 4, 7.5, 9);
  stroke.cubicTo(8, 14, 11, 14, 12, 8.5);
  painter.drawPath(stroke);
  painter.drawLine(QPointF(12, 15.5), QPointF(18, 15.5));
  painter.drawLine(QPointF(14, 5), QPointF(18, 5));
  painter.drawLine(QPointF(16, 3), QPointF(16, 7));
}

// A stick and the star at its end.
void DrawWand(QPainter& painter, const QColor& ink) {
  painter.drawLine(QPointF(3, 17), QPointF(11, 9));
  QPolygonF star;
  for (int i = 0; i < 8; ++i) {
    const double angle = i * 0.785398, radius = i % 2 == 0 ? 5 : 1.8;
    star << QPointF(13.5 + radius * std::cos(angle), 6.5 + radius * std::sin(angle));
  }
  QPainterPath path;
  path.addPolygon(star);
  painter.fillPath(path, ink);
}

void DrawScissors(QPainter& painter) {
  painter.drawEllipse(QPointF(5.5, 15), 2.4, 2.4);
  painter.drawEllipse(QPointF(14.5, 15), 2.4, 2.4);
  painter.drawLine(QPointF(6.6, 12.8), QPointF(13.5, 2.5));
  painter.drawLine(QPointF(13.4, 12.8), QPointF(6.5, 2.5));
}

void DrawSphere(QPainter& painter) {
  painter.drawEllipse(QPointF(10, 10), 7, 7);
  painter.drawArc(QRectF(3, 7.5, 14, 5), 180 * 16, 180 * 16);
}

void DrawBox(QPainter& painter) {
  painter.drawPolygon(
      QPolygonF({{10, 2.5}, {16.5, 6}, {16.5, 14}, {10, 17.5}, {3.5, 14}, {3.5, 6}}));
  painter.drawPolyline(QPolygonF({{3.5, 6}, {10, 9.5}, {16.5, 6}}));
  painter.drawLine(QPointF(10, 9.5), QPointF(10, 17.5));
}

// The tube of an eyedropper.
void DrawLike(QPainter& painter, const QColor& ink) {
  painter.drawPolygon(QPolygonF({{11, 6}, {14, 9}, {6.5, 16.5}, {3.5, 16.5}, {3.5, 13.5}}));
  QPainterPath head;
  head.addPolygon(QPolygonF({{10, 5}, {14.5, 2.2}, {17.8, 5.5}, {15, 10}}));
  head.closeSubpath();
  painter.fillPath(head, ink);
}

// A rough line and the edge that it moves to.
void DrawRefine(QPainter& painter, const QColor& ink) {
  painter.drawPolyline(QPolygonF({{3, 4}, {7, 7}, {4, 10}, {8, 13}, {5, 17}}));
  QPainterPath edge;
  edge.moveTo(15, 3);
  edge.cubicTo(10.5, 7, 16.5, 13, 13, 17.5);
  painter.setPen(QPen(ink, 2.2));
  painter.drawPath(edge);
}

void DrawTurn(QPainter& painter, const QColor& ink, bool back) {
  if (!back) {
    painter.translate(20, 0);
    painter.scale(-1, 1);
  }
  QPainterPath arrow;
  arrow.moveTo(5, 8);
  arrow.cubicTo(10, 4.5, 17, 7, 16.5, 15.5);
  painter.drawPath(arrow);
  painter.setPen(Qt::NoPen);
  painter.setBrush(ink);
  painter.drawPolygon(QPolygonF({{2.5, 9.5}, {8, 3.8}, {9, 10}}));
}

void DrawGrow(QPainter& painter, const QColor& ink, bool grow) {
  painter.setPen(QPen(ink, 1.3, Qt::DotLine));
  painter.drawEllipse(QPointF(10, 10), 7.5, 7.5);
  painter.setPen(QPen(ink, 1.6));
  painter.drawLine(QPointF(6.5, 10), QPointF(13.5, 10));
  if (grow) painter.drawLine(QPointF(10, 6.5), QPointF(10, 13.5));
}

void DrawInvert(QPainter& painter, const QColor& ink) {
  painter.drawRect(QRectF(3, 3, 14, 14));
  QPainterPath half;
  half.moveTo(3, 17);
  half.lineTo(17, 3);
  half.lineTo(17, 17);
  half.closeSubpath();
  painter.fillPath(half, ink);
}

void Draw(QPainter& painter, ToolIcon icon, const QColor& ink) {
  switch (icon) {
    case ToolIcon::kBrush:
      return DrawBrush(painter, ink);
    case ToolIcon::kEraser:
      return DrawEraser(painter, ink);
    case ToolIcon::kRectangle:
      painter.setPen(QPen(ink, 1.5, Qt::DashLine));
      painter.drawRect(QRectF(3, 4.5, 14, 11));
      return;
    case ToolIcon::kLasso:
      return DrawLasso(painter);
    case ToolIcon::kPolygon:
      return DrawPolygon(painter, ink);
    case ToolIcon::kScribble:
      return DrawScribble(painter);
    case ToolIcon::kWand:
      return DrawWand(painter, ink);
    case ToolIcon::kScissors:
      return DrawScissors(painter);
    case ToolIcon::kSphere:
      return DrawSphere(painter);
    case ToolIcon::kBox:
      return DrawBox(painter);
    case ToolIcon::kLike:
      return DrawLike(painter, ink);
    case ToolIcon::kRefine:
      return DrawRefine(painter, ink);
    case ToolIcon::kUndo:
    case ToolIcon::kRedo:
      return DrawTurn(painter, ink, icon == ToolIcon::kUndo);
    case ToolIcon::kGrow:
    case ToolIcon::kShrink:
      return DrawGrow(painter, ink, icon == ToolIcon::kGrow);
    case ToolIcon::kInvert:
      return DrawInvert(painter, ink);
    case ToolIcon::kAll:
      painter.fillRect(QRectF(3, 3, 14, 14), ink);
      return;
    case ToolIcon::kNone:
      painter.drawRect(QRectF(3, 3, 14, 14));
      return;
  }
}

}  // namespace

QIcon MakeToolIcon(ToolIcon icon, const QPalette& palette) {
  QIcon result;
  for (const auto& [mode, group] : {std::pair{QIcon::Normal, QPalette::Active},
                                    std::pair{QIcon::Disabled, QPalette::Disabled}}) {
    for (const int size : {20, 40}) {
      QPixmap pixmap(size, size);
      pixmap.fill(Qt::transparent);
      QPainter painter(&pixmap);
      painter.setRenderHint(QPainter::Antialiasing);
      painter.scale(size / 20.0, size / 20.0);
      const QColor ink = palette.color(group, QPalette::ButtonText);
      painter.setPen(QPen(ink, 1.5, Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin));
      Draw(painter, icon, ink);
      painter.end();
      result.addPixmap(pixmap, mode);
    }
  }
  return result;
}

}  // namespace retint
