// SPDX-License-Identifier: BSD-3-Clause
// The quality of an edit: before and after side by side, overlays on the picture, the report's
// figures, and how well the selection's depth fits the sparse points.
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
  void maskShown(bool shown);  // the mask is shown or hidden

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
  RegionId measured_ = 0;                         // of the report that is shown; 0: none
  std::string measured_edit_;                     // SceneResults::EditKey() at that time
  std::shared_ptr<const RegionSelection> shown_;  // of the registration that is shown
};

}  // namespace retint
