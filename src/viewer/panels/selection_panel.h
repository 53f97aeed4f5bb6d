// SPDX-License-Identifier: BSD-3-Clause
// How paint becomes a selection: depth method, cloud, registration and masks, with presets. While
// "live" is on, a change selects the current region again, and shows its points.
#pragma once

#include <map>
#include <memory>

#include <QTimer>
#include <QWidget>

#include "base/option.h"
#include "editing/region.h"
#include "selecting/select_options.h"

class QCheckBox;
class QComboBox;
class QLabel;
class QPushButton;

namespace retint {

class Canvas;
class CurrentRegion;
class OptionForm;
class SceneController;
class SelectionMode;

class SelectionPanel : public QWidget {
  Q_OBJECT

 public:
  SelectionPanel(SceneController* controller, SelectionMode* mode, Canvas* canvas,
                 CurrentRegion* current);

 Q_SIGNALS:
  void refused(const QString& title, const QString& message);

 private:
  struct Options {
    SelectOptions select;
    ProjectorOptions project;
  };
  void ShowOptions();
  void SetOptions(const Options& options);
  void ComeBack(const RegionSelection& selection);
  void ShowRegion();
  void TakeOption(size_t index, const OptionValue& value);
  void TakePreset(int index);
  void TakeReach(int index);
  void Changed();
  void SelectAgain(RegionId id);

  SceneController* controller_;
  SelectionMode* mode_;  // holds the options for its next Accept()
  Canvas* canvas_;
  CurrentRegion* current_;
  QComboBox *preset_, *reach_;
  QCheckBox* live_;
  QPushButton* again_;
  QLabel *result_, *details_;
  OptionForm* form_;
  std::shared_ptr<const RegionSelection> shown_;  // selection that result_ describes
  RegionId shown_of_ = 0;                         // its region
  std::map<uint64_t, Options> made_with_;         // by selection, if known
  QTimer rest_;                                   // waits for more changes before selecting again
  RegionId changed_of_ = 0;                       // region for which the options were changed
};

}  // namespace retint
