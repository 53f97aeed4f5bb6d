// SPDX-License-Identifier: BSD-3-Clause
// The background optimizer: a line with its progress, and a drawer with figures and options.
#pragma once

#include <string>

#include <QElapsedTimer>
#include <QWidget>

#include "base/option.h"
#include "editing/region.h"
#include "recolor/quality_report.h"

class QCheckBox;
class QHBoxLayout;
class QLabel;
class QProgressBar;
class QPushButton;
class QToolButton;

namespace retint {

class LossPlot;
class CurrentRegion;
class SceneController;
struct OptimizerStatus;
class OptionForm;

class OptimizerPanel : public QWidget {
  Q_OBJECT

 public:
  OptimizerPanel(SceneController* controller, CurrentRegion* current);

 Q_SIGNALS:
  void refused(const QString& title, const QString& message);

 private:
  void Build();
  void BuildLine(QHBoxLayout* line);
  QWidget* MakeDetails();
  void BuildOptions();
  void Connect();
  void ShowAfresh();  // shows another scene
  void ShowStatus();
  void ShowLine(const OptimizerStatus& status);
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
  QProgressBar* progress_;
  QToolButton *toggle_, *stop_;
  QPushButton *reset_, *measure_;
  OptionForm* options_;
  QCheckBox* automatic_;
  RegionId measured_id_ = 0;   // of the quality that is shown; 0: none
  std::string measured_edit_;  // SceneResults::EditKey() at that time
  bool was_active_ = false;
};

}  // namespace retint
