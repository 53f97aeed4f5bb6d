// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/widgets/side_strip.h"

#include <algorithm>

#include <QPainter>

namespace retint {
namespace {

constexpr int kWidth = 18;
constexpr double kArrow = 4;  // pixels, half of its height
constexpr int kTop = 14;      // of the arrow's middle

}  // namespace

SideStrip::SideStrip(Qt::Edge side, QWidget* parent) : QAbstractButton(parent), side_(side) {
  setAttribute(Qt::WA_Hover);   // paints when the mouse enters and leaves
  setFocusPolicy(Qt::NoFocus);  // every panel has a key
  setSizePolicy(QSizePolicy::Fixed, QSizePolicy::Expanding);
}

QSize SideStrip::sizeHint() const { return {std::max(kWidth, fontMetrics().height() + 2), 200}; }

void SideStrip::SetFolded(bool folded, const QStringList& panels) {
  folded_ = folded;
  panels_ = panels;
  const QString names = panels.join(", ");
  setToolTip(
      (folded ? tr("Show %1 (Tab: all panels)") : tr("Hide %1 (Tab: all panels)")).arg(names));
  setAccessibleName(names);
  update();
}

void SideStrip::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  if (underMouse()) {
    QColor over = palette().color(QPalette::Highlight);
    over.setAlpha(40);
    painter.fillRect(rect(), over);
  }
  painter.setRenderHint(QPainter::Antialiasing);
  const QColor text = palette().color(QPalette::WindowText);
  painter.setPen(QPen(text, 1.6, Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin));
  // To where a click moves the border.
  const double to = (side_ == Qt::LeftEdge) == folded_ ? 1 : -1;
  const QPointF tip(width() / 2.0 + to * kArrow / 2, kTop);
  painter.drawPolyline(
      QPolygonF({tip + QPointF(-to * kArrow, -kArrow), tip, tip + QPointF(-to * kArrow, kArrow)}));
  if (!folded_) return;
  painter.rotate(-90);
  const QRectF room(-height(), 0, height() - 2 * kTop, width());
  painter.setPen(text);
  painter.drawText(room, Qt::AlignRight | Qt::AlignVCenter,
                   fontMetrics().elidedText(panels_.join(QStringLiteral("   ·   ")), Qt::ElideLeft,
                                            int(room.width())));
}

}  // namespace retint
