// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/layer_style.h"

#include <algorithm>

#include <QPainter>
#include <QPainterPath>
#include <QStyleFactory>
#include <QStyleOptionViewItem>

namespace retint {
namespace {

void PaintEye(QPainter& painter, const QRectF& box, bool open) {
  const QRectF eye = box.adjusted(0, box.height() / 5, 0, -box.height() / 5);
  QPainterPath lids(QPointF(eye.left(), eye.center().y()));
  lids.quadTo({eye.center().x(), eye.top() - eye.height() / 3}, {eye.right(), eye.center().y()});
  lids.quadTo({eye.center().x(), eye.bottom() + eye.height() / 3}, {eye.left(), eye.center().y()});
  painter.drawPath(lids);
  if (open) {
    painter.setBrush(painter.pen().color());
    painter.drawEllipse(eye.center(), box.width() / 7, box.width() / 7);
  } else {
    painter.drawLine(box.bottomLeft(), box.topRight());
  }
}

// A frame with an S, filled if it is on.
void PaintSolo(QPainter& painter, const QRectF& box, const QColor& below, bool on) {
  if (on) painter.setBrush(painter.pen().color());
  painter.drawRoundedRect(box, 3, 3);
  if (on) painter.setPen(below);
  QFont font = painter.font();
  font.setBold(true);
  font.setPixelSize(std::max(int(box.height() * 0.75), 1));
  painter.setFont(font);
  painter.drawText(box, Qt::AlignCenter, QStringLiteral("S"));
}

}  // namespace

int LayerHeight(const QWidget& list) {
  constexpr int kIcon = 16, kAround = 6;
  return std::max(list.fontMetrics().height(), kIcon) + kAround;
}

LayerStyle::LayerStyle(QObject* parent) : QProxyStyle(QStyleFactory::create("Fusion")) {
  setParent(parent);
}

void LayerStyle::drawPrimitive(PrimitiveElement element, const QStyleOption* option,
                               QPainter* painter, const QWidget* widget) const {
  const auto* item = qstyleoption_cast<const QStyleOptionViewItem*>(option);
  if (element != PE_IndicatorItemViewItemCheck || !item) {
    return QProxyStyle::drawPrimitive(element, option, painter, widget);
  }
  const bool on = option->state & State_On, chosen = option->state & State_Selected;
  const QPalette& colors = option->palette;
  const auto group = option->state & State_Active ? QPalette::Active : QPalette::Inactive;
  QColor ink = colors.color(group, chosen ? QPalette::HighlightedText : QPalette::Text);
  const QColor below = colors.color(group, chosen ? QPalette::Highlight : QPalette::Base);
  constexpr double kOff = 0.55;  // opacity of a box that is off
  if (!on) ink.setAlphaF(float(kOff));
  const double side = std::min(option->rect.width(), option->rect.height());
  QRectF box(0, 0, side, side);
  box.moveCenter(QRectF(option->rect).center());
  painter->save();
  painter->setRenderHint(QPainter::Antialiasing);
  painter->setPen(QPen(ink, 1.5));
  if (item->index.column() == 0) {
    PaintEye(*painter, box, on);
  } else {
    PaintSolo(*painter, box.adjusted(1, 1, -1, -1), below, on);
  }
  painter->restore();
}

}  // namespace retint
