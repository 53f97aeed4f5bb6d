// SPDX-License-Identifier: BSD-3-Clause
// A list of things in an order: regions, the operations of an edit.
#pragma once

#include <QTreeWidget>

namespace retint {

// Rows that the user can drag to another place, with keys for list commands.
class RowTree : public QTreeWidget {
  Q_OBJECT

 public:
  explicit RowTree(QWidget* parent = nullptr);

 Q_SIGNALS:
  void rowMoved(int from, int to);  // `to`: index in the list without the row
  void deletePressed();
  void duplicatePressed();
  void renamePressed();
  void stepPressed(int by);  // -1 up, 1 down

 protected:
  bool event(QEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void paintEvent(QPaintEvent* event) override;

 private:
  int GapAt(int y) const;  // 0: before the first row
  int drag_from_ = -1, gap_ = -1;
  QPoint pressed_;
};

}  // namespace retint
