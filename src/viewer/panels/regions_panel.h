// SPDX-License-Identifier: BSD-3-Clause
// The list of regions and what is done to them. The first of the list is applied first.
#pragma once

#include <string>

#include <QTreeWidget>
#include <QWidget>

#include "session/region.h"

class QLabel;
class QSlider;
class QSpinBox;
class QToolButton;

namespace retint {

class ColorPicker;
class MainWindow;
class SceneController;

// Rows that are dragged to another place; the keys of a list of things.
class RegionTree : public QTreeWidget {
  Q_OBJECT

 public:
  explicit RegionTree(QWidget* parent = nullptr);

 Q_SIGNALS:
  void rowMoved(int from, int to);  // to its place in the list without it
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

class RegionsPanel : public QWidget {
  Q_OBJECT

 public:
  enum Column { kName, kSolo, kColor, kStrength, kColumns };

  explicit RegionsPanel(MainWindow* window);

  RegionTree& list() { return *list_; }
  ColorPicker& picker() { return *picker_; }
  QSlider& strength() { return *strength_; }

 private:
  void BuildButtons();
  void BuildEditors();
  void Refresh();
  void ShowCurrent();
  void FillRow(QTreeWidgetItem* item, const Region& region, bool solo);
  void OnItemChanged(QTreeWidgetItem* item, int column);
  void OnColor(const QColor& color, bool dragging);
  void OnStrength(int percent);
  void Step(int by);
  const Region* Current() const;
  RegionId IdOf(const QTreeWidgetItem* item) const;

  MainWindow* window_;
  SceneController* controller_;
  RegionTree* list_;
  QLabel* empty_;
  QWidget *buttons_, *editors_;
  QToolButton *paint_, *extend_, *duplicate_, *remove_, *up_, *down_;
  ColorPicker* picker_;
  QSlider* strength_;
  QSpinBox* percent_;
  QLabel* title_;  // what the picker is for
  int drags_ = 0;  // names a drag for the history
  bool filling_ = false;
};

// What a region's edit multiplies white by, as a color of the screen.
QColor TintColor(const ColorEdit& edit);

}  // namespace retint
