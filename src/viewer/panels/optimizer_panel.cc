// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/optimizer_panel.h"

#include <algorithm>
#include <utility>

#include <QCheckBox>
#include <QFormLayout>
#include <QGridLayout>
#include <QLabel>
#include <QProgressBar>
#include <QPushButton>
#include <QToolButton>
#include <QVBoxLayout>

#include "base/error.h"
#include "viewer/panels/drawer.h"
#include "viewer/panels/guide.h"
#include "viewer/panels/loss_plot.h"
#include "viewer/panels/option_form.h"
#include "viewer/scene/current_region.h"
#include "viewer/scene/scene_controller.h"
#include "viewer/widgets/long_text.h"

namespace retint {
namespace {

using State = BackgroundOptimizer::State;

constexpr int kAdamStepsPerLoss = 50;  // RefitSummary::losses

// Of the current region, in percent; -1: it ends when it converges.
int PercentOf(const OptimizerStatus& status, const RefitOptions& options) {
  const bool adam = options.solver == Solver::kAdam;
  const int most = adam ? options.adam.iterations / kAdamStepsPerLoss : options.mm.iterations;
  if (most <= 0) return -1;
  const int done = std::max(int(status.losses.size()) - 1, 0);
  return std::min(100 * done / most, 99);  // after the last step there is more work
}

QString StateText(const OptimizerStatus& status, const QString& region, int percent) {
  const QString far = percent < 0 ? QString() : OptimizerPanel::tr(" %1 %").arg(percent);
  switch (status.state) {
    case State::kIdle:
      return OptimizerPanel::tr("Nothing to refine");
    case State::kRunning:
      // It first computes the targets of all views, which takes a while.
      if (status.steps == 0) return OptimizerPanel::tr("Preparing %1…").arg(region);
      return OptimizerPanel::tr("Refining %1…").arg(region) + far;
    case State::kPaused:
      return OptimizerPanel::tr("Paused:") + far + " " + region;
    case State::kFinished:
      return OptimizerPanel::tr("✔ Refined");
    case State::kCancelled:
      return OptimizerPanel::tr("Refining was stopped");
    case State::kFailed:
      return OptimizerPanel::tr("⚠ Refining failed");
  }
  return {};
}

QString Decibels(double value) { return OptimizerPanel::tr("%1 dB").arg(value, 0, 'f', 2); }

}  // namespace

OptimizerPanel::OptimizerPanel(SceneController* controller, CurrentRegion* current)
    : controller_(controller), current_(current) {
  setObjectName("optimizer_panel");
  Build();
  Connect();
  ShowAfresh();
}

void OptimizerPanel::Build() {
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(6, 6, 6, 6);
  auto* line = new QHBoxLayout;
  BuildLine(line);
  layout->addLayout(line);
  QWidget* details = MakeDetails();
  layout->addWidget(new Drawer("optimizer_advanced", tr("Advanced"), details));
  layout->addWidget(details);
  layout->addStretch();
}

void OptimizerPanel::BuildLine(QHBoxLayout* line) {
  state_ = new ElidedLabel;
  state_->setObjectName("optimizer_state");
  progress_ = new QProgressBar;
  progress_->setObjectName("optimizer_progress");
  progress_->setTextVisible(false);
  constexpr QSize kBar(72, 8);
  progress_->setFixedSize(kBar);
  const auto button = [](const char* name, const QString& text, const QString& tip) {
    auto* made = new QToolButton;
    made->setObjectName(name);
    made->setText(text);
    made->setToolTip(tip);
    made->setAccessibleName(tip);
    made->setFocusPolicy(Qt::StrongFocus);
    return made;
  };
  toggle_ = button("optimizer_toggle", {}, tr("Start, pause or go on (Alt+P)"));
  stop_ = button("optimizer_stop", QStringLiteral("■"), tr("Stop refining; what was done stays"));
  line->addWidget(state_, 1);
  line->addWidget(progress_);
  line->addWidget(toggle_);
  line->addWidget(stop_);
  line->addWidget(MakeGuideButton("Recolor an object"));
}

// The contents of the drawer.
QWidget* OptimizerPanel::MakeDetails() {
  speed_ = new QLabel;
  speed_->setObjectName("optimizer_speed");
  plot_ = new LossPlot;
  plot_->setObjectName("loss_plot");
  const auto button = [](const char* name, const QString& text, const QString& tip) {
    auto* made = new QPushButton(text);
    made->setObjectName(name);
    made->setToolTip(tip);
    return made;
  };
  reset_ = button("optimizer_reset", tr("&Reset"),
                  tr("Drop every fit and begin again from the closed form (Alt+R)"));
  measure_ = button("optimizer_measure", tr("&Measure"),
                    tr("PSNR of the current region over all views, against its edited targets "
                       "(Alt+M)"));
  inside_ = new QLabel;
  inside_->setObjectName("psnr_inside");
  outside_ = new QLabel;
  outside_->setObjectName("psnr_outside");
  measured_ = new QLabel;
  measured_->setObjectName("psnr_views");
  measured_->setWordWrap(true);
  auto* details = new QWidget;
  auto* layout = new QVBoxLayout(details);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->addWidget(speed_);
  layout->addWidget(plot_);
  auto* buttons = new QHBoxLayout;
  for (QPushButton* one : {reset_, measure_}) buttons->addWidget(one);
  layout->addLayout(buttons);
  auto* figures = new QFormLayout;
  figures->addRow(tr("PSNR inside"), inside_);
  figures->addRow(tr("PSNR outside"), outside_);
  layout->addLayout(figures);
  layout->addWidget(measured_);
  BuildOptions();
  layout->addWidget(options_);
  return details;
}

void OptimizerPanel::Connect() {
  connect(toggle_, &QToolButton::clicked, this, &OptimizerPanel::Toggle);
  connect(stop_, &QToolButton::clicked, &controller_->colors(), &SceneColors::CancelRefit);
  connect(reset_, &QPushButton::clicked, this, &OptimizerPanel::Reset);
  connect(measure_, &QPushButton::clicked, this,
          [this] { controller_->results().Evaluate(current_->id()); });
  connect(&controller_->colors(), &SceneColors::optimizerChanged, this,
          &OptimizerPanel::ShowStatus);
  connect(controller_, &SceneController::regionsChanged, this, &OptimizerPanel::ShowStatus);
  connect(&controller_->colors(), &SceneColors::refitJobChanged, this, &OptimizerPanel::ShowJob);
  connect(&controller_->results(), &SceneResults::qualityReady, this,
          [this](RegionId id, const QualityReport& report) {
            ShowQuality(id, report, tr("measured over %1 views, for %2"));
          });
  connect(&controller_->results(), &SceneResults::qualityGlanced, this,
          [this](RegionId id, const QualityReport& report) {
            ShowQuality(id, report, tr("from %1 views, for %2; Measure uses all views"));
          });
  // After a fit, its quality is measured on a few views.
  connect(&controller_->colors(), &SceneColors::optimizerChanged, this, [this] {
    const State state = controller_->colors().optimizer().state;
    const bool active = controller_->colors().optimizer().Active();
    const bool ended = std::exchange(was_active_, active) && state == State::kFinished;
    if (ended && current_->id() != 0) controller_->results().Glance(current_->id());
  });
  connect(controller_, &SceneController::regionsChanged, this, [this] {
    if (measured_id_ == 0 || controller_->results().EditKey(measured_id_) == measured_edit_) return;
    ForgetQuality();
  });
  connect(controller_, &SceneController::opened, this, &OptimizerPanel::ShowAfresh);
  connect(controller_, &SceneController::closed, this, &OptimizerPanel::ShowAfresh);
  connect(current_, &CurrentRegion::changed, this, &OptimizerPanel::ShowStatus);
}

void OptimizerPanel::BuildOptions() {
  options_ = new OptionForm;
  options_->setObjectName("refit_options");
  options_->Show(Described(controller_->colors().refit_job()));
  connect(options_, &OptionForm::edited, this, &OptimizerPanel::TakeOption);
  automatic_ = new QCheckBox(tr("Start after each ed&it"));
  automatic_->setObjectName("automatic");
  automatic_->setToolTip(tr("Off: edits show in closed form until the optimizer is started"));
  options_->form()->addRow(automatic_);
  connect(automatic_, &QCheckBox::toggled, &controller_->colors(), &SceneColors::SetAutomaticRefit);
}

void OptimizerPanel::ShowAfresh() {
  ForgetQuality();
  ShowJob();
  ShowStatus();
}

void OptimizerPanel::ShowJob() {
  options_->Show(Described(controller_->colors().refit_job()));
  automatic_->setChecked(controller_->colors().automatic_refit());
}

void OptimizerPanel::TakeOption(size_t index, const OptionValue& value) {
  RefitJob job = controller_->colors().refit_job();
  OptionList list;
  job.Describe(list);
  try {
    list[index].Set(value);
    controller_->colors().SetRefitJob(job);
  } catch (const Error& error) {
    Q_EMIT refused(tr("These optimizer settings are not valid"), QString::fromUtf8(error.what()));
    return ShowJob();
  }
  ShowJob();
  if (controller_->colors().automatic_refit() && !controller_->regions().regions.empty()) {
    controller_->colors().StartRefit();
  }
}

void OptimizerPanel::ShowStatus() {
  automatic_->setChecked(controller_->colors().automatic_refit());
  const OptimizerStatus status = controller_->colors().optimizer();
  ShowLine(status);
  QString speed;
  if (status.steps > 0 && status.seconds > 0) {
    speed =
        tr("%1 steps, %2 a second").arg(status.steps).arg(status.steps / status.seconds, 0, 'g', 3);
  }
  speed_->setText(speed);
  const bool adam = controller_->colors().refit_job().options.solver == Solver::kAdam;
  // Without a running fit, those of the current region's fit.
  const Region* current = controller_->regions().Find(current_->id());
  const bool fitted = !status.Active() && current && current->fit;
  const std::vector<double>& losses = fitted ? current->fit->summary.losses : status.losses;
  const bool in_steps = fitted ? current->fit->summary.solver == "adam" : adam;
  plot_->SetLosses(losses, in_steps ? kAdamStepsPerLoss : 1);
  reset_->setEnabled(!controller_->regions().regions.empty());
  measure_->setEnabled(current != nullptr);
}

void OptimizerPanel::ShowLine(const OptimizerStatus& status) {
  const Region* region = controller_->regions().Find(status.region);
  const int percent = PercentOf(status, controller_->colors().refit_job().options);
  const QString name = region ? QString::fromStdString(region->name) : QString();
  state_->setText(StateText(status, name, percent));
  state_->setToolTip(QString::fromStdString(status.error));
  progress_->setVisible(status.Active() && percent >= 0);
  progress_->setValue(percent);
  const bool runs = status.state == State::kRunning;
  const QString text = runs ? QStringLiteral("❚❚") : QStringLiteral("▶");
  if (toggle_->text() != text) {
    toggle_->setText(text);
    toggle_->setShortcut(QKeySequence(tr("Alt+P")));  // setting the text removed it
  }
  toggle_->setEnabled(!controller_->regions().regions.empty());
  stop_->setVisible(status.Active());
}

void OptimizerPanel::Toggle() {
  switch (controller_->colors().optimizer().state) {
    case State::kRunning:
      return controller_->colors().PauseRefit();
    case State::kPaused:
      return controller_->colors().ResumeRefit();
    default:
      return controller_->colors().StartRefit();
  }
}

void OptimizerPanel::Reset() {
  controller_->colors().CancelRefit();
  controller_->Run({}, [](EditSession& session, Monitor&) { session.refits().DropFits(); });
  controller_->colors().StartRefit();
}

void OptimizerPanel::ForgetQuality() {
  measured_id_ = 0;
  inside_->setText(QStringLiteral("–"));
  outside_->setText(QStringLiteral("–"));
  measured_->setText(tr("not measured yet"));
}

void OptimizerPanel::ShowQuality(RegionId id, const QualityReport& report, const QString& over) {
  const Region* region = controller_->regions().Find(id);
  if (!region) return;  // deleted in the meantime
  measured_id_ = id;
  measured_edit_ = controller_->results().EditKey(id);
  const QualityNumbers& numbers = report.train;
  inside_->setText(
      tr("%1 (before: %2)")
          .arg(Decibels(numbers.psnr_inside_after), Decibels(numbers.psnr_inside_before)));
  outside_->setText(Decibels(numbers.psnr_outside));
  measured_->setText(over.arg(numbers.views).arg(QString::fromStdString(region->name)));
}

}  // namespace retint
