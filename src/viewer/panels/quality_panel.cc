// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/quality_panel.h"

#include <cmath>
#include <utility>

#include <QCheckBox>
#include <QHBoxLayout>
#include <QHeaderView>
#include <QLabel>
#include <QPushButton>
#include <QScrollBar>
#include <QSignalBlocker>
#include <QSlider>
#include <QTableWidget>
#include <QVBoxLayout>

#include "viewer/canvas/canvas.h"
#include "viewer/panels/guide.h"
#include "viewer/panels/jump_slider.h"
#include "viewer/panels/mask_view.h"
#include "viewer/scene/current_region.h"
#include "viewer/scene/scene_controller.h"
#include "viewer/widgets/long_text.h"

namespace retint {
namespace {

constexpr int kSplitSteps = 1000;

QString Figure(double value, int decimals) {
  return std::isfinite(value) ? QString::number(value, 'f', decimals) : QStringLiteral("–");
}

QString Significant(double value) {
  return std::isfinite(value) ? QString::number(value, 'g', 3) : QStringLiteral("–");
}

// In two lines where it differs, which fit a narrow column. There is none where too few points
// were found to measure it.
QString Change(double before, double after) {
  if (before == 0 && after == 0) return QStringLiteral("–");
  const QString from = Significant(before), to = Significant(after);
  return from == to ? from : from + QStringLiteral("\n→ ") + to;
}

// As high as its rows: the panel scrolls, not its tables.
void FitHeight(QTableWidget* table) {
  table->resizeRowsToContents();
  int height = table->horizontalHeader()->sizeHint().height() + 2 * table->frameWidth();
  for (int row = 0; row < table->rowCount(); ++row) height += table->rowHeight(row);
  const QScrollBar* across = table->horizontalScrollBar();
  if (across->maximum() > across->minimum()) height += across->sizeHint().height();
  table->setFixedHeight(height);
  table->setVisible(table->rowCount() > 0);
}

QTableWidget* MakeTable(const char* name, const QStringList& columns) {
  auto* table = new QTableWidget(0, int(columns.size()));
  table->setObjectName(name);
  table->setHorizontalHeaderLabels(columns);
  table->setEditTriggers(QTableWidget::NoEditTriggers);
  table->setSelectionBehavior(QTableWidget::SelectRows);
  table->setHorizontalScrollBarPolicy(Qt::ScrollBarAsNeeded);
  table->setVerticalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  table->setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  table->setTabKeyNavigation(false);
  table->horizontalHeader()->setSectionResizeMode(QHeaderView::Stretch);
  table->verticalHeader()->setSectionResizeMode(QHeaderView::ResizeToContents);
  // Columns get their width when the table is laid out, and rows their height from that.
  const auto fit = [table] { FitHeight(table); };
  for (QHeaderView* header : {table->horizontalHeader(), table->verticalHeader()}) {
    QObject::connect(header, &QHeaderView::sectionResized, table, fit, Qt::QueuedConnection);
  }
  QObject::connect(table->horizontalScrollBar(), &QScrollBar::rangeChanged, table, fit,
                   Qt::QueuedConnection);
  return table;
}

void SetRow(QTableWidget* table, int row, const QString& head, const QStringList& cells) {
  table->setVerticalHeaderItem(row, new QTableWidgetItem(head));
  for (int column = 0; column < cells.size(); ++column) {
    auto* item = new QTableWidgetItem(cells[column]);
    item->setTextAlignment(Qt::AlignRight | Qt::AlignVCenter);
    item->setToolTip(head + ": " + cells[column]);
    table->setItem(row, column, item);
  }
}

}  // namespace

QualityPanel::QualityPanel(SceneController* controller, Canvas* canvas, CurrentRegion* current)
    : controller_(controller), canvas_(canvas), current_(current) {
  setObjectName("quality_panel");
  mask_view_ = new MaskView(controller, canvas, current);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(6, 6, 6, 6);
  BuildSwitches(layout);
  measure_ = new QPushButton(tr("Measure this re&gion"));
  measure_->setObjectName("quality_measure");
  measure_->setToolTip(tr("Renders every view before and after the edit (Alt+G)"));
  connect(measure_, &QPushButton::clicked, this,
          [this] { controller_->results().Evaluate(current_->id()); });
  auto* line = new QHBoxLayout;
  line->addWidget(measure_, 1);
  line->addWidget(MakeGuideButton("Recolor an object"));
  layout->addLayout(line);
  of_ = new QLabel;
  of_->setWordWrap(true);
  layout->addWidget(of_);
  report_ = MakeTable("report_table", {tr("Fitted views"), tr("Held out")});
  layout->addWidget(report_);
  worst_ = MakeTable("worst_table", {tr("In dB"), tr("Out dB"), tr("Mask %")});
  worst_->setToolTip(
      tr("The worst views first: PSNR inside and outside the mask, and the share of the picture "
         "that it covers. Double-click or Return goes there"));
  connect(worst_, &QTableWidget::cellActivated, this, [this](int row, int) {
    canvas_->GoTo(worst_->verticalHeaderItem(row)->data(Qt::UserRole).toString().toStdString());
  });
  connect(worst_, &QTableWidget::cellDoubleClicked, this,
          [this] { canvas_->setFocus(Qt::MouseFocusReason); });
  layout->addWidget(worst_);
  registration_of_ = new QLabel;
  registration_of_->setWordWrap(true);
  layout->addWidget(registration_of_);
  registration_ =
      MakeTable("registration_table", {tr("Points"), tr("RMS"), tr("Held out"), tr("Moved")});
  registration_->verticalHeader()->hide();
  registration_->setToolTip(
      tr("Distances of the selection's depth to COLMAP's points, before → after it was moved onto "
         "them, in the scene's unit"));
  layout->addWidget(registration_);
  layout->addStretch();

  connect(canvas_, &Canvas::stateChanged, this, &QualityPanel::ShowCanvas);
  connect(&controller->results(), &SceneResults::qualityReady, this, &QualityPanel::ShowReport);
  connect(controller, &SceneController::regionsChanged, this, &QualityPanel::ShowRegion);
  connect(controller, &SceneController::opened, this, &QualityPanel::Clear);
  connect(controller, &SceneController::closed, this, &QualityPanel::Clear);
  connect(current_, &CurrentRegion::changed, this, &QualityPanel::ShowRegion);
  Clear();
}

void QualityPanel::BuildSwitches(QVBoxLayout* layout) {
  auto* line = new QHBoxLayout;
  layout->addLayout(line);
  const auto add = [&](const char* name, const QString& text, const QString& tip) {
    auto* box = new QCheckBox(text);
    box->setObjectName(name);
    box->setToolTip(tip);
    line->addWidget(box);
    return box;
  };
  split_ = add("split_switch", tr("&Before | after"),
               tr("The scene before the edits to the left of a line"));
  depth_ = add("depth_switch", tr("&Depth"), tr("Depth instead of color: near warm, far cold"));
  mask_ = add("mask_switch", tr("Mas&k"),
              tr("The current region's selection over the picture, hatched and outlined, once the "
                 "camera rests (Alt+K)"));
  at_ = new JumpSlider(Qt::Horizontal);
  at_->setObjectName("split_slider");
  at_->setRange(0, kSplitSteps);
  at_->setAccessibleName(tr("Where before ends and after begins"));
  at_->setToolTip(tr("Where before ends and after begins (arrows, Page Up, Page Down)"));
  layout->addWidget(at_);
  connect(split_, &QCheckBox::toggled, canvas_, &Canvas::SetSplit);
  connect(depth_, &QCheckBox::toggled, canvas_, &Canvas::SetDepth);
  connect(mask_, &QCheckBox::toggled, mask_view_, &MaskView::SetShown);
  // The mask and the points would hide each other: the later one shows.
  connect(mask_, &QCheckBox::toggled, this, [this](bool shown) {
    if (shown) canvas_->SetCloudShown(false);
  });
  connect(mask_, &QCheckBox::toggled, this, &QualityPanel::maskShown);
  connect(at_, &QSlider::valueChanged, this,
          [this](int value) { canvas_->SetSplitAt(double(value) / kSplitSteps); });
}

bool QualityPanel::mask_shown() const { return mask_->isChecked(); }

void QualityPanel::SetMaskShown(bool shown) { mask_->setChecked(shown); }

void QualityPanel::ShowCanvas() {
  const Canvas& canvas = *canvas_;
  if (canvas.cloud_shown()) mask_->setChecked(false);
  const QSignalBlocker quiet(split_), quiet_too(depth_), quiet_at(at_);
  split_->setChecked(canvas.split());
  depth_->setChecked(canvas.depth());
  at_->setEnabled(canvas.split());
  if (!at_->isSliderDown()) at_->setValue(int(std::lround(canvas.split_at() * kSplitSteps)));
}

void QualityPanel::ClearReport() {
  const bool measured = controller_->regions().Find(std::exchange(measured_, 0));
  for (QTableWidget* table : {report_, worst_}) {
    table->setRowCount(0);
    FitHeight(table);
  }
  of_->setText(measured ? tr("The edit has changed since it was measured.")
                        : tr("Not measured yet."));
}

void QualityPanel::Clear() {
  measured_ = 0;
  ClearReport();
  ShowCanvas();
  ShowRegion();
}

void QualityPanel::ShowRegion() {
  SceneController& controller = *controller_;
  if (measured_ != 0 && controller.results().EditKey(measured_) != measured_edit_) ClearReport();
  const Region* region = controller.regions().Find(current_->id());
  measure_->setEnabled(region != nullptr);
  for (QWidget* widget : std::initializer_list<QWidget*>{split_, depth_, mask_}) {
    widget->setEnabled(controller.IsOpen());
  }
  const auto selection = region ? region->selection : nullptr;
  if (selection && selection == shown_) return;
  shown_ = selection;
  registration_->setRowCount(0);
  if (!region) {
    registration_of_->setText(tr("Registration: choose a region."));
  } else if (region->selection->source.reports.empty()) {
    registration_of_->setText(tr("Registration: this region's masks come from elsewhere."));
  } else {
    const auto& reports = region->selection->source.reports;
    registration_of_->setText(tr("Registration to the sparse points, by painted view:"));
    for (const PaintedReport& report : reports) AddRegistration(report);
  }
  FitHeight(registration_);
}

// The view's name above its numbers, which have the width of the panel so.
void QualityPanel::AddRegistration(const PaintedReport& report) {
  const QString view = QString::fromStdString(report.view);
  const RegistrationSummary& moved = report.registration;
  const int row = registration_->rowCount();
  registration_->setRowCount(row + 2);
  auto* name = new QTableWidgetItem(view);
  name->setToolTip(view);
  registration_->setItem(row, 0, name);
  registration_->setSpan(row, 0, 1, registration_->columnCount());
  SetRow(
      registration_, row + 1, view,
      {QString::number(moved.points_used), Change(moved.rms_before, moved.rms_after),
       Change(moved.heldout_before, moved.heldout_after), moved.accepted ? tr("yes") : tr("no")});
  registration_->item(row + 1, 3)->setToolTip(QString::fromStdString(moved.reason));
}

void QualityPanel::ShowReport(RegionId id, const QualityReport& report) {
  const Region* region = controller_->regions().Find(id);
  if (!region) return;  // deleted meanwhile
  measured_ = id;
  measured_edit_ = controller_->results().EditKey(id);
  of_->setText(
      tr("%1, against its edited targets:").arg(Breakable(QString::fromStdString(region->name))));
  const auto cells = [&](double QualityNumbers::*member, int decimals) {
    QStringList list;
    for (const QualityNumbers* numbers : {&report.train, &report.heldout}) {
      list << (numbers->views > 0 ? Figure(numbers->*member, decimals) : QStringLiteral("–"));
    }
    return list;
  };
  report_->setRowCount(6);
  SetRow(report_, 0, tr("Views"),
         {QString::number(report.train.views), QString::number(report.heldout.views)});
  SetRow(report_, 1, tr("Inside before, dB"), cells(&QualityNumbers::psnr_inside_before, 2));
  SetRow(report_, 2, tr("Inside after, dB"), cells(&QualityNumbers::psnr_inside_after, 2));
  SetRow(report_, 3, tr("Outside, dB"), cells(&QualityNumbers::psnr_outside, 2));
  SetRow(report_, 4, tr("Bleed"), cells(&QualityNumbers::bleed, 5));
  SetRow(
      report_, 5, tr("Coefficients"),
      {tr("%1 … %2").arg(Significant(report.sh_after.min), Significant(report.sh_after.max)), {}});
  FitHeight(report_);
  worst_->setRowCount(int(report.worst.size()));
  for (int row = 0; row < int(report.worst.size()); ++row) {
    const ViewQuality& view = report.worst[size_t(row)];
    const QString name = QString::fromStdString(view.name);
    SetRow(worst_, row, view.heldout ? tr("%1 (held out)").arg(name) : name,
           {Figure(view.psnr_inside, 2), Figure(view.psnr_outside, 2),
            Figure(100 * view.coverage, 1)});
    worst_->verticalHeaderItem(row)->setData(Qt::UserRole, name);
  }
  FitHeight(worst_);
}

}  // namespace retint
