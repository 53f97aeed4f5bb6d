// SPDX-License-Identifier: BSD-3-Clause
// The background optimizer: its current work, its progress, and its options.
#pragma once

#include <string>

#include <QElapsedTimer>
#include <QWidget>

#include "base/option.h"
#include "editing/region.h"
#include "recolor/quality_report.h"

class QCheckBox;
class QLabel;
class QPushButton;

namespace retint {

class LossPlot;
class CurrentRegion;
class SceneController;
class OptionForm;

class OptimizerPanel : public QWidget {
  Q_OBJECT

 public:
  OptimizerPanel(SceneController* controller, CurrentRegion* current);

 Q_SIGNALS:
  void refused(const QString& title, const QString& message);

 private:
  void Build();
  void BuildOptions();
  void Connect();
  void ShowAfresh();  // of another scene
  void ShowStatus();
  void ShowJob();
  void TakeOption(size_t index, const OptionValue& value);
  void Toggle();  // start, pause or resume
  void Reset();
  void ForgetQuality();
  void ShowQuality(RegionId id, const QualityReport& report, const QString& over);

  SceneController* controller_;
  CurrentRegion* current_;
  QLabel *state_, *speed_, *inside_, *outside_, *measured_;
  LossPlot* plot_;
  QPushButton *toggle_, *reset_, *measure_;
  OptionForm* options_;
  QCheckBox* automatic_;
  RegionId measured_id_ = 0;   // whose quality shows; 0: none
  std::string measured_edit_;  // SceneController::EditKey() then
  bool was_active_ = false;
};

}  // namespace retint
