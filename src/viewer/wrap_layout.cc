// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/wrap_layout.h"

#include <algorithm>

#include <QWidget>

namespace retint {
namespace {

int WidthOf(const QLayoutItem& item) {
  return std::max(item.sizeHint().width(), item.minimumSize().width());
}

}  // namespace

WrapLayout::~WrapLayout() {
  for (QLayoutItem* item : items_) delete item;
}

QLayoutItem* WrapLayout::itemAt(int index) const {
  return index >= 0 && index < count() ? items_[size_t(index)] : nullptr;
}

QLayoutItem* WrapLayout::takeAt(int index) {
  QLayoutItem* item = itemAt(index);
  if (item) items_.erase(items_.begin() + index);
  return item;
}

std::vector<WrapLayout::Row> WrapLayout::Rows(int width) const {
  std::vector<Row> rows;
  for (QLayoutItem* item : items_) {
    if (item->isEmpty()) continue;  // hidden
    const int wanted = WidthOf(*item);
    if (rows.empty() || rows.back().width + spacing() + wanted > width) rows.emplace_back();
    Row& row = rows.back();
    row.width += wanted + (row.items.empty() ? 0 : spacing());
    row.height = std::max(row.height, item->sizeHint().height());
    row.growing += item->expandingDirections() & Qt::Horizontal ? 1 : 0;
    row.items.push_back(item);
  }
  return rows;
}

int WrapLayout::heightForWidth(int width) const {
  const QMargins margins = contentsMargins();
  int height = margins.top() + margins.bottom() - spacing();
  for (const Row& row : Rows(width - margins.left() - margins.right())) {
    height += row.height + spacing();
  }
  return std::max(height, margins.top() + margins.bottom());
}

int WrapLayout::HeightOf(const std::vector<QWidget*>& widgets, int width) const {
  const QMargins margins = contentsMargins();
  const int room = width - margins.left() - margins.right();
  int height = margins.top() + margins.bottom() - spacing(), row_width = 0, row_height = 0;
  for (const QWidget* widget : widgets) {
    const QSize wanted = widget->sizeHint().expandedTo(widget->minimumSizeHint());
    if (row_width > 0 && row_width + spacing() + wanted.width() > room) {
      height += row_height + spacing();
      row_width = row_height = 0;
    }
    row_width += wanted.width() + (row_width > 0 ? spacing() : 0);
    row_height = std::max(row_height, wanted.height());
  }
  return height + row_height + spacing();
}

QSize WrapLayout::sizeHint() const {
  const QMargins margins = contentsMargins();
  const auto rows = Rows(QWIDGETSIZE_MAX);
  const QSize size = rows.empty() ? QSize() : QSize(rows[0].width, rows[0].height);
  return size.expandedTo({0, 0}).grownBy(margins);
}

QSize WrapLayout::minimumSize() const {
  QSize size(0, 0);
  for (const QLayoutItem* item : items_) {
    if (!item->isEmpty()) size = size.expandedTo(item->minimumSize());
  }
  return size.grownBy(contentsMargins());
}

void WrapLayout::setGeometry(const QRect& rect) {
  QLayout::setGeometry(rect);
  const QRect room = rect.marginsRemoved(contentsMargins());
  int y = room.top();
  for (const Row& row : Rows(room.width())) {
    int x = room.left(), left = std::max(0, room.width() - row.width), growing = row.growing;
    for (QLayoutItem* item : row.items) {
      int width = std::min(WidthOf(*item), room.width());
      if (growing > 0 && item->expandingDirections() & Qt::Horizontal) {
        width += left / growing;
        left -= left / growing--;
      }
      item->setGeometry({x, y, width, row.height});
      x += width + spacing();
    }
    y += row.height + spacing();
  }
}

QWidget* MakeWrappingLine(const std::vector<QWidget*>& widgets) {
  auto* line = new QWidget;
  auto* layout = new WrapLayout(line);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->setSpacing(4);
  for (QWidget* widget : widgets) layout->addWidget(widget);
  if (!widgets.empty()) {
    const QSizePolicy::Policy vertical = widgets.front()->sizePolicy().verticalPolicy();
    widgets.front()->setSizePolicy(QSizePolicy::Expanding, vertical);
  }
  QSizePolicy policy(QSizePolicy::Preferred, QSizePolicy::Minimum);
  policy.setHeightForWidth(true);
  line->setSizePolicy(policy);
  return line;
}

}  // namespace retint
