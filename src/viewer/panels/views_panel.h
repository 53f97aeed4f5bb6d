// SPDX-License-Identifier: BSD-3-Clause
// The training views as pictures (SceneFacts): their photos, and once colors were changed, renders
// of the colors on the screen. While one paints, the stroke's selection is laid over them. A badge
// says how much of each the current region's mask covers.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <QThreadPool>
#include <QTimer>
#include <QWidget>

#include "editing/region.h"
#include "recolor/quality_report.h"
#include "viewer/scene/scene_controller.h"

class QComboBox;
class QLabel;
class QListWidget;
class QListWidgetItem;
class QPushButton;

namespace retint {

class Canvas;
class CurrentRegion;
class PhotoLoader;
class SceneController;
class StrokePreview;
class Uncertainty;

class ViewsPanel : public QWidget {
  Q_OBJECT

 public:
  ViewsPanel(SceneController* controller, Canvas* canvas, PhotoLoader* photos,
             CurrentRegion* current, Uncertainty* uncertainty, StrokePreview* preview);
  ~ViewsPanel() override;
  QListWidget& list() { return *list_; }
  // The views are in the order in which to go on painting the current region.
  bool IsToPaintNext() const { return in_force_ == kToPaintNext; }

 Q_SIGNALS:
  void menuWanted(const QPoint& at);  // on the screen; the canvas shows the view that it is for

 private:
  enum Order { kByName, kByCoverage, kToPaintNext, kWorstFirst };

  void Build();
  void Connect(StrokePreview* preview);
  void Fill();  // of another scene
  void AskThumbnails();
  void ShowThumbnail(const QString& name);
  void RenderNext();  // of the pictures on the screen one that does not show the colors as they are
  void CountCoverage();
  void TakeCoverage(uint64_t selection, std::map<std::string, double> coverage);
  void TakeQuality(RegionId id, const QualityReport& report);
  void TakeUncertainty();
  std::vector<std::string> Visible() const;  // whose pictures are on the screen
  void ChooseOrder(int order);
  void SetOrder(Order order);  // now that all is there that it needs
  void Stay();                 // with the order that is in force
  void ForgetQuality();        // of an edit that is there no more
  void Sort();
  void Label(QListWidgetItem* item);
  void Follow();  // marks the one that the canvas shows
  void Jump(QListWidgetItem* item);
  QListWidgetItem* ItemOf(const std::string& name) const;

  SceneController* controller_;
  Canvas* canvas_;
  PhotoLoader* photos_;
  CurrentRegion* current_;
  Uncertainty* uncertainty_;
  QComboBox* order_;  // the wanted pictures
  Order in_force_ = kByName;
  QListWidget* list_;
  QLabel* note_;
  std::map<std::string, QListWidgetItem*> items_;
  std::map<std::string, double> coverage_;  // in [0, 1], of counted_
  std::map<std::string, ViewQuality> quality_;
  std::string measured_edit_;              // SceneResults::EditKey() of quality_
  std::map<std::string, double> settles_;  // share of the uncertain part, in [0, 1]
  uint64_t counted_ = 0;                   // selection, 0: none
  // Of a picture, which sh_version() it shows; none: the photo.
  std::map<std::string, uint64_t> rendered_;
  bool rendering_ = false;
  QTimer rest_;
  QThreadPool pool_;
};

}  // namespace retint
