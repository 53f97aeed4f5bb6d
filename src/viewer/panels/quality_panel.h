// SPDX-License-Identifier: BSD-3-Clause
// How good an edit is: before and after side by side, what lies over the picture, the report in
// figures, and how well the selection's depth met the sparse points.
#pragma once

#include <memory>
#include <string>

#include <QWidget>

#include "editing/region.h"
#include "recolor/quality_report.h"

class QCheckBox;
class QLabel;
class QPushButton;
class QSlider;
class QTableWidget;
class QVBoxLayout;

namespace retint {

class Canvas;
class CurrentRegion;
class SceneController;
class MaskView;

class QualityPanel : public QWidget {
  Q_OBJECT

 public:
  QualityPanel(SceneController* controller, Canvas* canvas, CurrentRegion* current);
  MaskView& mask_view() { return *mask_view_; }
  bool mask_shown() const;
  void SetMaskShown(bool shown);

 Q_SIGNALS:
  void maskShown(bool shown);  // or is not any more

 private:
  void BuildSwitches(QVBoxLayout* layout);
  void ShowCanvas();
  void ShowRegion();
  void AddRegistration(const PaintedReport& report);
  void ShowReport(RegionId id, const QualityReport& report);
  void ClearReport();
  void Clear();

  SceneController* controller_;
  Canvas* canvas_;
  CurrentRegion* current_;
  MaskView* mask_view_;
  QCheckBox *split_, *depth_, *mask_;
  QSlider* at_;
  QPushButton* measure_;
  QTableWidget *report_, *worst_, *registration_;
  QLabel *of_, *registration_of_;
  RegionId measured_ = 0;                         // whose report shows; 0: none
  std::string measured_edit_;                     // SceneResults::EditKey() then
  std::shared_ptr<const RegionSelection> shown_;  // whose registration shows
};

}  // namespace retint
