// SPDX-License-Identifier: BSD-3-Clause
// The background optimizer: what it is at, how far it came, and its options.
#pragma once

#include <QElapsedTimer>
#include <QWidget>

#include "recolor/quality_report.h"
#include "session/region.h"

class QCheckBox;
class QComboBox;
class QDoubleSpinBox;
class QFormLayout;
class QLabel;
class QPushButton;
class QSpinBox;

namespace retint {

class LossPlot;
class MainWindow;
class SceneController;

class OptimizerPanel : public QWidget {
  Q_OBJECT

 public:
  explicit OptimizerPanel(MainWindow* window);

 private:
  void BuildOptions();
  void ShowStatus();
  void ShowJob();
  void TakeJob();
  void Toggle();  // start, pause or resume
  void Reset();
  void ForgetQuality();
  void ShowQuality(RegionId id, const QualityReport& report, const QString& over);

  MainWindow* window_;
  SceneController* controller_;
  QLabel *state_, *speed_, *inside_, *outside_, *measured_;
  LossPlot* plot_;
  QPushButton *toggle_, *reset_, *measure_;
  QWidget* options_;
  QFormLayout* form_;
  QComboBox *solver_, *target_;
  QSpinBox* iterations_;
  QDoubleSpinBox *tolerance_, *outside_weight_, *learning_rate_;
  QCheckBox* automatic_;
  RegionId measured_id_ = 0;  // whose quality shows; 0: none
  bool filling_ = false, was_active_ = false;
};

}  // namespace retint
