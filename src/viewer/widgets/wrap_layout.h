// SPDX-License-Identifier: BSD-3-Clause
// A row of widgets that continues in a second row if the window is too narrow. Widgets that can
// grow share the rest of a row.
#pragma once

#include <vector>

#include <QLayout>

namespace retint {

class WrapLayout : public QLayout {
 public:
  explicit WrapLayout(QWidget* parent = nullptr) : QLayout(parent) {}
  ~WrapLayout() override;

  void addItem(QLayoutItem* item) override { items_.push_back(item); }
  QLayoutItem* itemAt(int index) const override;
  QLayoutItem* takeAt(int index) override;
  int count() const override { return int(items_.size()); }
  Qt::Orientations expandingDirections() const override { return Qt::Horizontal; }
  bool hasHeightForWidth() const override { return true; }
  int heightForWidth(int width) const override;
  QSize sizeHint() const override;     // one row
  QSize minimumSize() const override;  // as narrow as the widest widget
  void setGeometry(const QRect& rect) override;

 private:
  struct Row {
    size_t first = 0, count = 0;  // of its items
    int width = 0, height = 0;
  };
  // Of things of these sizes, within the margins of a `width`.
  std::vector<Row> Rows(const std::vector<QSize>& sizes, int width) const;
  int HeightOf(const std::vector<Row>& rows) const;
  std::vector<QLayoutItem*> Shown() const;

  std::vector<QLayoutItem*> items_;
};

// The same as a widget, for a layout of rows. The first widget takes the rest of its row.
QWidget* MakeWrappingLine(const std::vector<QWidget*>& widgets);

}  // namespace retint
