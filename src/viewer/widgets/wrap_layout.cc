// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/widgets/wrap_layout.h"

#include <algorithm>
#include <iterator>
#include <span>

#include <QWidget>

namespace retint {
namespace {

QSize SizeOf(const QLayoutItem& item) {
  const QSize wanted = item.sizeHint();
  return {std::max(wanted.width(), item.minimumSize().width()), wanted.height()};
}

std::vector<QSize> SizesOf(const std::vector<QLayoutItem*>& items) {
  std::vector<QSize> sizes;
  for (const QLayoutItem* item : items) sizes.push_back(SizeOf(*item));
  return sizes;
}

bool Grows(const QLayoutItem* item) { return item->expandingDirections() & Qt::Horizontal; }

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

std::vector<QLayoutItem*> WrapLayout::Shown() const {
  std::vector<QLayoutItem*> shown;
  std::ranges::copy_if(items_, std::back_inserter(shown),
                       [](const QLayoutItem* item) { return !item->isEmpty(); });
  return shown;
}

std::vector<WrapLayout::Row> WrapLayout::Rows(const std::vector<QSize>& sizes, int width) const {
  const QMargins margins = contentsMargins();
  const int room = width - margins.left() - margins.right();
  std::vector<Row> rows;
  for (size_t i = 0; i < sizes.size(); ++i) {
    if (rows.empty() || rows.back().width + spacing() + sizes[i].width() > room) {
      rows.push_back({.first = i});
    }
    Row& row = rows.back();
    row.width += sizes[i].width() + (row.count > 0 ? spacing() : 0);
    row.height = std::max(row.height, sizes[i].height());
    ++row.count;
  }
  return rows;
}

int WrapLayout::HeightOf(const std::vector<Row>& rows) const {
  const QMargins margins = contentsMargins();
  int height = margins.top() + margins.bottom() - (rows.empty() ? 0 : spacing());
  for (const Row& row : rows) height += row.height + spacing();
  return height;
}

int WrapLayout::heightForWidth(int width) const { return HeightOf(Rows(SizesOf(Shown()), width)); }

QSize WrapLayout::sizeHint() const {
  const auto rows = Rows(SizesOf(Shown()), QWIDGETSIZE_MAX);
  const QSize size = rows.empty() ? QSize(0, 0) : QSize(rows[0].width, rows[0].height);
  return size.grownBy(contentsMargins());
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
  const std::vector<QLayoutItem*> shown = Shown();
  int y = room.top();
  for (const Row& row : Rows(SizesOf(shown), rect.width())) {
    const std::span<QLayoutItem* const> items = std::span(shown).subspan(row.first, row.count);
    int x = room.left(), left = std::max(0, room.width() - row.width);
    auto growing = int(std::ranges::count_if(items, Grows));
    for (QLayoutItem* item : items) {
      int width = std::min(SizeOf(*item).width(), room.width());
      if (growing > 0 && Grows(item)) {
        const int most = std::max(0, item->maximumSize().width() - width);
        const int more = std::min(left / growing--, most);
        width += more;
        left -= more;
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
