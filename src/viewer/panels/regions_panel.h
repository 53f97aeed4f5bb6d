// SPDX-License-Identifier: BSD-3-Clause
// The list of regions and its commands. The first region is applied first.
#pragma once

#include <optional>
#include <string>

#include <QColor>
#include <QWidget>

#include "editing/region.h"
#include "viewer/canvas/contrast.h"

class QLabel;
class QMenu;
class QPoint;
class QSlider;
class QSpinBox;
class QToolButton;
class QTreeWidgetItem;

namespace retint {

class EditPanel;
class Canvas;
class CurrentRegion;
class SceneController;
class RowTree;

class RegionsPanel : public QWidget {
  Q_OBJECT

 public:
  enum Column { kName, kSolo, kColor, kStrength, kColumns };

  RegionsPanel(SceneController* controller, Canvas* canvas, CurrentRegion* current);

  RowTree& list() { return *list_; }
  EditPanel& edit() { return *edit_; }
  QSlider& strength() { return *strength_; }
  // Measures the main color of the current region if it has no edit yet. Then the first color that
  // the user drags shows at once.
  void MeasureAhead();
  // Selection mode forbids picking a color and painting another region.
  void SetSelecting(bool selecting);

 Q_SIGNALS:
  void paintWanted(retint::RegionId id);  // 0: a new region
  void elsewhereWanted(bool photo);       // see EditPanel
  void splitWanted();                     // see EditPanel
  void masksWanted();                     // asks to save masks of the current region

 private:
  void BuildButtons();
  void BuildEditors();
  void Refresh();
  void FitList();
  void ShowCurrent();
  void FillRow(QTreeWidgetItem* item, const Region& region, bool solo);
  void OnItemChanged(QTreeWidgetItem* item, int column);
  void OnEdit(const ColorEdit& chosen, bool dragging);
  void SendWaiting();
  QColor BaseOf(const Region& region);
  void OnStrength(int percent);
  void Step(int by);
  void FillMenu(QMenu* menu);
  void MeasurePalette(int count, int before);
  void Rename();
  const Region* Current() const;
  RegionId IdOf(const QTreeWidgetItem* item) const;

  SceneController* controller_;
  Canvas* canvas_;
  CurrentRegion* current_;
  RowTree* list_;
  QLabel* empty_;
  QWidget *buttons_, *editors_;
  QToolButton *paint_, *extend_, *remove_;
  EditPanel* edit_;
  QSlider* strength_;
  QSpinBox* percent_;
  QLabel* title_;  // of the shown edit
  int drags_ = 0;  // gives each drag a name in the history
  bool filling_ = false, selecting_ = false;
  // The newest edit, while the worker measures the main color for the one before.
  struct Waiting {
    RegionId region;
    ColorEdit edit;
    std::string key;
  };
  std::optional<Waiting> waiting_;
  // For a region without an edit: a recolor with a measured main color.
  struct Ahead {
    RegionId region;
    ColorOperation recolor;
  };
  std::optional<Ahead> ahead_;
  RegionColors colors_;
};

}  // namespace retint
