// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/tool_icons.h"

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

// A tilted bucket and its drop.
void DrawFlood(QPainter& painter, const QColor& ink) {
  painter.drawPolygon(QPolygonF({{9, 3}, {15.5, 9.5}, {9, 16}, {2.5, 9.5}}));
  QPainterPath paint;
  paint.moveTo(3.2, 10);
  paint.lineTo(15, 10);
  paint.lineTo(9, 16);
  paint.closeSubpath();
  painter.fillPath(paint, ink);
  QPainterPath drop;
  drop.moveTo(17, 11.5);
  drop.cubicTo(19.4, 15, 18.6, 16.5, 17, 16.5);
  drop.cubicTo(15.4, 16.5, 14.6, 15, 17, 11.5);
  painter.fillPath(drop, ink);
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
    case ToolIcon::kFlood:
      return DrawFlood(painter, ink);
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
