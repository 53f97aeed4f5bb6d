// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/row_tree.h"

#include <QApplication>
#include <QKeyEvent>
#include <QMouseEvent>
#include <QPainter>

#include "viewer/panels/layer_style.h"

namespace retint {
namespace {

bool IsListKey(const QKeyEvent& event) {
  const bool plain = event.modifiers() == Qt::NoModifier;
  switch (event.key()) {
    case Qt::Key_Delete:
    case Qt::Key_F2:
    case Qt::Key_Space:
    case Qt::Key_Up:
    case Qt::Key_Down:
      return plain || event.modifiers() == Qt::AltModifier;
    case Qt::Key_D:
      return event.modifiers() == Qt::ControlModifier;
    default:
      return false;
  }
}

}  // namespace

RowTree::RowTree(QWidget* parent) : QTreeWidget(parent) {
  setStyle(new LayerStyle(this));
  setRootIsDecorated(false);
  setUniformRowHeights(true);
  setAllColumnsShowFocus(true);
  setSelectionMode(SingleSelection);
  setEditTriggers(DoubleClicked);
  setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
}

bool RowTree::event(QEvent* event) {
  // While the list has the focus, its keys win over the window's shortcuts.
  if (event->type() == QEvent::ShortcutOverride && IsListKey(*static_cast<QKeyEvent*>(event))) {
    event->accept();
    return true;
  }
  return QTreeWidget::event(event);
}

void RowTree::keyPressEvent(QKeyEvent* event) {
  if (state() == EditingState) return QTreeWidget::keyPressEvent(event);
  const bool alt = event->modifiers() == Qt::AltModifier;
  if (event->key() == Qt::Key_Delete) return Q_EMIT deletePressed();
  if (event->key() == Qt::Key_F2) return Q_EMIT renamePressed();
  if (event->key() == Qt::Key_D && event->modifiers() == Qt::ControlModifier) {
    return Q_EMIT duplicatePressed();
  }
  if (alt && event->key() == Qt::Key_Up) return Q_EMIT stepPressed(-1);
  if (alt && event->key() == Qt::Key_Down) return Q_EMIT stepPressed(1);
  if (event->key() == Qt::Key_Space && currentItem()) {
    QTreeWidgetItem* item = currentItem();
    item->setCheckState(0, item->checkState(0) == Qt::Checked ? Qt::Unchecked : Qt::Checked);
    return;
  }
  QTreeWidget::keyPressEvent(event);
}

void RowTree::mousePressEvent(QMouseEvent* event) {
  QTreeWidget::mousePressEvent(event);
  QTreeWidgetItem* item = itemAt(event->pos());
  drag_from_ = event->button() == Qt::LeftButton && item ? indexOfTopLevelItem(item) : -1;
  pressed_ = event->pos();
}

void RowTree::mouseMoveEvent(QMouseEvent* event) {
  if (drag_from_ < 0 || !(event->buttons() & Qt::LeftButton)) return;
  const bool far = (event->pos() - pressed_).manhattanLength() >= QApplication::startDragDistance();
  if (gap_ < 0 && !far) return;
  gap_ = GapAt(event->pos().y());
  setCursor(Qt::ClosedHandCursor);
  viewport()->update();
}

void RowTree::mouseReleaseEvent(QMouseEvent* event) {
  const int from = drag_from_, gap = gap_;
  drag_from_ = gap_ = -1;
  if (gap < 0) return QTreeWidget::mouseReleaseEvent(event);
  unsetCursor();
  viewport()->update();
  const int to = gap > from ? gap - 1 : gap;
  if (to != from) Q_EMIT rowMoved(from, to);
}

int RowTree::GapAt(int y) const {
  for (int row = 0; row < topLevelItemCount(); ++row) {
    if (y < visualItemRect(topLevelItem(row)).center().y()) return row;
  }
  return topLevelItemCount();
}

void RowTree::paintEvent(QPaintEvent* event) {
  QTreeWidget::paintEvent(event);
  if (gap_ < 0 || topLevelItemCount() == 0) return;
  const bool end = gap_ == topLevelItemCount();
  const QRect row = visualItemRect(topLevelItem(end ? gap_ - 1 : gap_));
  const int y = end ? row.bottom() : row.top();
  QPainter painter(viewport());
  painter.setPen(QPen(palette().color(QPalette::Highlight), 3));
  painter.drawLine(0, y, viewport()->width(), y);
}

}  // namespace retint
