// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/selection_panel.h"

#include <algorithm>

#include <QCheckBox>
#include <QComboBox>
#include <QFormLayout>
#include <QLabel>
#include <QPushButton>
#include <QSettings>
#include <QVBoxLayout>

#include "base/error.h"
#include "editing/edit_options.h"
#include "viewer/canvas/canvas.h"
#include "viewer/panels/drawer.h"
#include "viewer/panels/guide.h"
#include "viewer/panels/option_form.h"
#include "viewer/scene/current_region.h"
#include "viewer/scene/scene_controller.h"
#include "viewer/selection/reach_choice.h"
#include "viewer/selection/selection_mode.h"
#include "viewer/widgets/long_text.h"

namespace retint {
namespace {

constexpr int kRestMs = 400;

struct Settings {
  SelectOptions select;
  ProjectorOptions project;
  void Describe(OptionList& list) {
    select.Describe(list);
    project.Describe(list);
  }
};

Settings Of(const SelectionMode& mode) { return {mode.select_options(), mode.projector_options()}; }

Settings OfPreset(const std::string& name) {
  const EditOptions preset = PresetOptions(name);
  return {preset.select, preset.projector};
}

// The newest results in a painted view.
QString ReportText(const PaintedReport& report) {
  QString text = SelectionPanel::tr("%1: depth of %2 % of the pixels, %3 points")
                     .arg(QString::fromStdString(report.view))
                     .arg(100 * report.valid_fraction, 0, 'f', 0)
                     .arg(report.cloud.kept);
  const RegistrationSummary& registration = report.registration;
  if (registration.accepted) {
    text += SelectionPanel::tr("; moved onto %1 sparse points").arg(registration.points_used);
  } else if (!registration.reason.empty()) {
    text +=
        "; " + SelectionPanel::tr("not moved: %1").arg(QString::fromStdString(registration.reason));
  }
  return text;
}

qsizetype GaussiansInside(const RegionSelection& selection) {
  constexpr float kInside = 0.5F;
  return std::ranges::count_if(selection.shares, [](float share) { return share >= kInside; });
}

}  // namespace

SelectionPanel::SelectionPanel(SceneController* controller, SelectionMode* mode, Canvas* canvas,
                               CurrentRegion* current)
    : controller_(controller), mode_(mode), canvas_(canvas), current_(current) {
  setObjectName("selection_panel");
  preset_ = new QComboBox;
  preset_->setObjectName("selection_preset");
  for (const std::string& name : Presets()) {
    QString title = QString::fromStdString(name);
    title[0] = title[0].toUpper();
    preset_->addItem(title, QString::fromStdString(name));
  }
  preset_->addItem(tr("Own settings"));
  preset_->setToolTip(
      tr("Retint: the defaults. Paper: as ReCoGS was published, with its solver and its targets in "
         "the Optimizer panel"));
  reach_ = new QComboBox;
  reach_->setObjectName("selection_reach");
  reach_->setSizeAdjustPolicy(QComboBox::AdjustToMinimumContentsLengthWithIcon);
  for (const PaintReach reach : kReaches) {
    reach_->addItem(ReachText(reach));
    reach_->setItemData(reach_->count() - 1, ReachTip(reach), Qt::ToolTipRole);
  }
  reach_->setToolTip(tr("How far paint goes, as in the bar above the view that you paint"));
  live_ = new QCheckBox(tr("Select &live"));
  live_->setObjectName("selection_live");
  live_->setToolTip(tr("A change selects the current region again, and shows its points"));
  live_->setChecked(QSettings().value("selection_live", true).toBool());
  again_ = new QPushButton(tr("Select &again"));
  again_->setObjectName("selection_again");
  again_->setToolTip(
      tr("Compute the current region's selection from its paint with these options"));
  result_ = new QLabel;
  result_->setObjectName("selection_result");
  result_->setWordWrap(true);
  form_ = new OptionForm({"projector", "completion"});  // reach_ replaces both
  form_->setObjectName("selection_options");
  details_ = new QLabel;
  details_->setObjectName("selection_details");
  details_->setWordWrap(true);
  auto* advanced = new QWidget;
  auto* inner = new QVBoxLayout(advanced);
  inner->setContentsMargins(0, 0, 0, 0);
  auto *top = new QFormLayout, *method = new QFormLayout;
  const auto add = [](QFormLayout* form, const QString& title, QWidget* control) {
    auto* label = new QLabel(title);
    label->setBuddy(control);
    form->addRow(label, control);
  };
  add(top, tr("Paint selects"), reach_);
  add(method, tr("Pre&set"), preset_);
  inner->addWidget(details_);
  inner->addLayout(method);
  inner->addWidget(form_);
  auto* line = new QHBoxLayout;
  line->addWidget(live_, 1);
  line->addWidget(again_);
  line->addWidget(MakeGuideButton("Tools that find the outline"));
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(6, 6, 6, 6);
  layout->addWidget(result_);
  layout->addLayout(top);
  layout->addLayout(line);
  layout->addWidget(new Drawer("selection_advanced", tr("Advanced"), advanced));
  layout->addWidget(advanced);
  layout->addStretch();
  rest_.setSingleShot(true);
  rest_.setInterval(kRestMs);
  connect(&rest_, &QTimer::timeout, this, [this] { SelectAgain(changed_of_); });
  connect(form_, &OptionForm::edited, this, &SelectionPanel::TakeOption);
  connect(preset_, &QComboBox::activated, this, &SelectionPanel::TakePreset);
  connect(reach_, &QComboBox::activated, this, &SelectionPanel::TakeReach);
  connect(mode_, &SelectionMode::reachChanged, this, &SelectionPanel::ShowOptions);
  connect(again_, &QPushButton::clicked, this, [this] { SelectAgain(current_->id()); });
  connect(live_, &QCheckBox::toggled, this,
          [](bool on) { QSettings().setValue("selection_live", on); });
  connect(controller_, &SceneController::regionsChanged, this, &SelectionPanel::ShowRegion);
  connect(current_, &CurrentRegion::changed, this, &SelectionPanel::ShowRegion);
  connect(controller_, &SceneController::selectedWith, this,
          [this](RegionId id, const SelectOptions& select, const ProjectorOptions& project) {
            const Region* region = controller_->regions().Find(id);
            if (region) made_with_[region->selection->id] = {select, project};
          });
  connect(controller_, &SceneController::selectedAgain, this,
          [this] { canvas_->SetCloudShown(true); });
  connect(controller_, &SceneController::closed, this, [this] {
    rest_.stop();
    made_with_.clear();
    ShowRegion();
  });
  ShowOptions();
  ShowRegion();
}

void SelectionPanel::ShowOptions() {
  Settings settings = Of(*mode_);
  form_->Show(Described(settings));
  const std::string key = OptionKey(Described(settings));
  int shown = preset_->count() - 1;
  for (int i = 0; i + 1 < preset_->count(); ++i) {
    Settings preset = OfPreset(preset_->itemData(i).toString().toStdString());
    if (OptionKey(Described(preset)) == key) shown = i;
  }
  preset_->setCurrentIndex(shown);
  const auto reach = ReachOf(settings.project);
  reach_->setCurrentIndex(reach ? int(std::ranges::find(kReaches, *reach) - kReaches) : -1);
}

void SelectionPanel::ShowRegion() {
  const Region* region = current_->region();
  const auto selection = region ? region->selection : nullptr;
  if (selection == shown_ && selection) return;
  if (selection && region->id == shown_of_) ComeBack(*selection);
  shown_ = selection;
  shown_of_ = region ? region->id : 0;
  const bool painted = region && !region->selection->source.painted.empty();
  again_->setEnabled(painted);
  details_->hide();
  if (!region) return result_->setText(tr("These settings are used when you accept your paint."));
  if (!painted) return result_->setText(tr("The masks of this region were not painted here."));
  const auto& source = region->selection->source;
  QStringList lines;
  for (const PaintedReport& report : source.reports) lines << ReportText(report);
  details_->setText(Breakable(lines.join("\n")));
  details_->setVisible(!lines.isEmpty());
  const int views = int(source.painted.size());
  const QString count = tr("%L1 Gaussians").arg(GaussiansInside(*region->selection));
  result_->setText(views == 1
                       ? tr("%1 selected, from your paint on one view").arg(count)
                       : tr("%1 selected, from your paint on %2 views").arg(count).arg(views));
}

// For a selection from before the scene was opened, the shown options count as its own.
void SelectionPanel::SetOptions(const Options& options) {
  if (const Region* region = current_->region()) {
    made_with_.try_emplace(region->selection->id,
                           Options{mode_->select_options(), mode_->projector_options()});
  }
  mode_->SetSelectOptions(options.select);
  mode_->SetProjectorOptions(options.project);
}

// Undo and redo restore a selection together with its options.
void SelectionPanel::ComeBack(const RegionSelection& selection) {
  const auto found = made_with_.find(selection.id);
  if (found == made_with_.end()) return;
  rest_.stop();
  mode_->SetSelectOptions(found->second.select);
  mode_->SetProjectorOptions(found->second.project);
  ShowOptions();
}

void SelectionPanel::TakeOption(size_t index, const OptionValue& value) {
  Settings settings = Of(*mode_);
  OptionList list;
  settings.Describe(list);
  try {
    list[index].Set(value);
    settings.select.Check();
    settings.project.Check();
  } catch (const Error& error) {
    Q_EMIT refused(tr("These options are not valid"), QString::fromUtf8(error.what()));
    return ShowOptions();
  }
  SetOptions({settings.select, settings.project});
  Changed();
}

// A preset is for the whole method, including the optimizer's options.
void SelectionPanel::TakePreset(int index) {
  const std::string name = preset_->itemData(index).toString().toStdString();
  if (name.empty()) return ShowOptions();
  const EditOptions preset = PresetOptions(name);
  SetOptions({preset.select, preset.projector});
  controller_->colors().SetRefitJob(preset.refit);
  Changed();
}

void SelectionPanel::TakeReach(int index) {
  Settings settings = Of(*mode_);
  SetReach(kReaches[index], &settings.project);
  SetOptions({settings.select, settings.project});
  Changed();
}

void SelectionPanel::Changed() {
  ShowOptions();
  changed_of_ = current_->id();
  if (live_->isChecked()) rest_.start();
}

void SelectionPanel::SelectAgain(RegionId id) {
  rest_.stop();
  const Region* region = controller_->regions().Find(id);
  if (!region || region->selection->source.painted.empty()) return;
  controller_->SelectAgain(id, mode_->select_options(), mode_->projector_options());
}

}  // namespace retint
