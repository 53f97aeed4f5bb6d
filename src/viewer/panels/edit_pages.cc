// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/edit_pages.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <QCheckBox>
#include <QDoubleSpinBox>
#include <QGridLayout>
#include <QLabel>
#include <QSignalBlocker>
#include <QToolButton>

#include "viewer/panels/color_models.h"
#include "viewer/panels/gradient_bar.h"
#include "viewer/panels/parameter_row.h"
#include "viewer/widgets/wrap_layout.h"

namespace retint {
namespace {

using Kind = ColorOperationKind;

// "adjust.hue", with an index if a parameter has several values.
QString NameOf(const ParameterView& view) {
  QString name = QStringLiteral("%1.%2").arg(TypeOf(view.kind).name, view.parameter);
  if (view.type().count > 1) name += QString::number(view.index);
  return name;
}

QToolButton* MakeButton(const char* name, const QString& text, const QString& tip) {
  auto* button = new QToolButton;
  button->setObjectName(name);
  button->setText(text);
  button->setToolTip(tip);
  button->setFocusPolicy(Qt::StrongFocus);
  return button;
}

void SetColorOf(ColorOperation& operation, const char* parameter, const QColor& color) {
  const std::span<float> values = operation.Get(parameter);
  values[0] = color.redF(), values[1] = color.greenF(), values[2] = color.blueF();
}

}  // namespace

// --- EditPage ------------------------------------------------------------------------------------

EditPage::EditPage(Kinds kinds) : kinds_(std::move(kinds)) {
  layout_ = new QVBoxLayout(this);
  layout_->setContentsMargins(0, 0, 0, 0);
  layout_->setSpacing(3);
}

bool EditPage::Shows(const ColorOperation& operation) const {
  return std::ranges::find(kinds_, operation.kind) != kinds_.end();
}

ColorOperation EditPage::Operation(Kind kind) const {
  const ColorOperation* found = shown(kind);
  return found ? *found : NewOperation(kind, base_);
}

void EditPage::AddRows(Kind kind) {
  for (const ParameterView& view : ParameterViews()) {
    if (view.kind != kind) continue;
    const ParameterRow::Range range{view.low,  view.high,      view.type().min, view.most(),
                                    view.step, view.Default(), view.logarithmic};
    auto* row = new ParameterRow(NameOf(view), tr(view.label), range, view.suffix, tr(view.tip));
    layout_->addWidget(row);
    parameters_.push_back({&view, row});
    connect(row, &ParameterRow::changed, this, [this, &view](double value, bool dragging) {
      ColorOperation operation = Operation(view.kind);
      view.Set(operation, value);
      Q_EMIT changed(operation, dragging);
    });
    connect(row, &ParameterRow::reset, this, [this, &view] {
      if (!shown(view.kind)) return;
      ColorOperation operation = Operation(view.kind);
      view.Set(operation, view.Default());
      // An operation without effect leaves the list.
      ColorOperation neutral = NewOperation(view.kind, base_);
      neutral.strength = operation.strength;
      if (view.kind != Kind::kRecolor && operation == neutral) {
        Q_EMIT removed(view.kind);
      } else {
        Q_EMIT changed(operation, false);
      }
    });
  }
  int width = 0;
  for (const Row& row : parameters_) width = std::max(width, row.row->LabelWidth());
  for (const Row& row : parameters_) row.row->SetLabelWidth(width);
}

void EditPage::AddBox(Kind kind) {
  auto* box = new QCheckBox(OperationTitle(kind));
  box->setObjectName(QStringLiteral("%1.on").arg(TypeOf(kind).name));
  box->setToolTip(tr(TypeOf(kind).help));
  layout_->addWidget(box);
  boxes_.emplace_back(kind, box);
  connect(box, &QCheckBox::toggled, this, [this, kind](bool on) {
    if (on) {
      Q_EMIT changed(Operation(kind), false);
    } else {
      Q_EMIT removed(kind);
    }
  });
}

QToolButton* EditPage::MakePick(const char* name, const QString& text, const QString& tip) {
  pick_ = MakeButton(name, text, tip);
  connect(pick_, &QToolButton::clicked, this, &EditPage::pickWanted);
  return pick_;
}

void EditPage::Show(const Find& find) {
  find_ = find;
  if (pick_) pick_->setEnabled(can_pick_);
  for (const Row& row : parameters_) {
    const ColorOperation* operation = shown(row.view->kind);
    row.row->SetValue(operation ? double(row.view->Get(*operation)) : row.view->Default());
  }
  for (const auto& [kind, box] : boxes_) {
    const QSignalBlocker quiet(box);
    box->setChecked(shown(kind) != nullptr);
  }
  ShowMore();
}

// --- RecolorPage ---------------------------------------------------------------------------------

RecolorPage::RecolorPage() : EditPage({Kind::kRecolor}) {
  from_ = new QLabel;
  from_->setObjectName("recolor_from");
  from_->setTextFormat(Qt::RichText);
  MakePick("recolor_pick_from", tr("Pick"),
           tr("Take the color that is replaced from the picture, with a click"));
  measure_ = MakeButton("recolor_measure", tr("Measure"),
                        tr("Find the main color of the region again, and replace that one"));
  rows()->addWidget(MakeWrappingLine({from_, pick_, measure_}));
  AddRows(Kind::kRecolor);
  connect(measure_, &QToolButton::clicked, this, [this] {
    ColorOperation operation = Operation(Kind::kRecolor);
    std::ranges::fill(operation.Get("from"), kUnset);
    operation.Get("brightest")[0] = kUnset;
    Q_EMIT changed(operation, false);
  });
}

QColor RecolorPage::color() const {
  const ColorOperation* operation = shown(Kind::kRecolor);
  return operation ? ToColor(operation->Get("to")) : base_;
}

void RecolorPage::ChooseColor(const QColor& color, bool dragging) {
  ColorOperation operation = Operation(Kind::kRecolor);
  SetColorOf(operation, "to", color);
  Q_EMIT changed(operation, dragging);
}

void RecolorPage::TakePicked(const QColor& color) {
  ColorOperation operation = Operation(Kind::kRecolor);
  SetColorOf(operation, "from", color);
  operation.Get("brightest")[0] = kUnset;
  Q_EMIT changed(operation, false);
}

void RecolorPage::ShowMore() {
  const ColorOperation* operation = shown(Kind::kRecolor);
  measure_->setEnabled(operation != nullptr);
  if (!operation) pick_->setEnabled(false);
  if (!operation) return from_->setText(tr("Replaces the region's main color"));
  if (!operation->IsSet("from")) return from_->setText(tr("Measuring the main color…"));
  const QString from = ToColor(operation->Get("from")).name();
  from_->setText(
      tr("Replaces %1")
          .arg(
              QStringLiteral("<span style='background-color:%1'>&nbsp;&nbsp;&nbsp;&nbsp;</span> %1")
                  .arg(from)));
}

// --- TintPage ------------------------------------------------------------------------------------

TintPage::TintPage() : EditPage({Kind::kTint}) { AddRows(Kind::kTint); }

QColor TintPage::color() const {
  const ColorOperation* operation = shown(Kind::kTint);
  return operation ? ToColor(operation->values) : QColor(Qt::white);
}

void TintPage::ChooseColor(const QColor& color, bool dragging) {
  ColorOperation operation = Operation(Kind::kTint);
  SetColorOf(operation, "color", color);
  Q_EMIT changed(operation, dragging);
}

// --- AdjustPage ----------------------------------------------------------------------------------

AdjustPage::AdjustPage() : EditPage({Kind::kAdjust}) {
  AddRows(Kind::kAdjust);
  ranged_ = new QCheckBox(tr("Only a range of colors"));
  ranged_->setObjectName("adjust_ranged");
  ranged_->setToolTip(tr("Leaves colors outside a range of hues, chroma and lightness alone"));
  MakePick("adjust_pick", tr("Pick"),
           tr("Take the range of hues around a color of the picture, with a click"));
  constexpr int kBefore = 3;  // hue, chroma and lightness
  rows()->insertWidget(kBefore, MakeWrappingLine({ranged_, pick_}));
  connect(ranged_, &QCheckBox::toggled, this, [this](bool on) {
    ShowRange();
    if (on || !shown(Kind::kAdjust)) return;
    const ColorOperation old = Operation(Kind::kAdjust);
    ColorOperation whole =
        ColorOperation::Make(Kind::kAdjust, {old.values[0], old.values[1], old.values[2]});
    whole.strength = old.strength;
    if (!(whole == old)) Q_EMIT changed(whole, false);
  });
  ShowRange();
}

void AdjustPage::ShowRange() {
  for (size_t i = 3; i < parameters_.size(); ++i) {
    parameters_[i].row->setVisible(ranged_->isChecked());
  }
  pick_->setVisible(ranged_->isChecked());
}

void AdjustPage::ShowMore() {
  const ColorOperation operation = Operation(Kind::kAdjust);
  const ColorOperation whole = ColorOperation::Make(Kind::kAdjust);
  const bool ranged =
      !std::equal(operation.values.begin() + 3, operation.values.end(), whole.values.begin() + 3);
  // A box set by hand stays as long as the edit is of the same subject.
  const bool another = std::exchange(ranged_of_, subject_) != subject_;
  const QSignalBlocker quiet(ranged_);
  ranged_->setChecked(ranged || (ranged_->isChecked() && !another));
  ShowRange();
}

void AdjustPage::TakePicked(const QColor& color) {
  constexpr double kReach = 25, kGray = 0.03;  // degrees; chroma
  const ColorPlace place = ColorModels()[1].place(color, {});
  ColorOperation operation = Operation(Kind::kAdjust);
  const ColorOperation whole = ColorOperation::Make(Kind::kAdjust);
  std::copy(whole.values.begin() + 3, whole.values.end(), operation.values.begin() + 3);
  if (place.across * kMostChroma < kGray) {  // without a hue
    operation.Get("chromas")[1] = float(kGray);
  } else {
    const auto around = [&](double by) {
      return float(std::fmod(place.hue * 360 + by + 360, 360));
    };
    operation.Get("hues")[0] = around(-kReach);
    operation.Get("hues")[1] = around(kReach);
  }
  Q_EMIT changed(operation, false);
}

// --- GradePage -----------------------------------------------------------------------------------

GradePage::GradePage() : EditPage({GradeKinds().begin(), GradeKinds().end()}) {
  for (const Kind kind : kinds()) {
    if (kind == Kind::kSoftClip || TypeOf(kind).parameters.empty()) AddBox(kind);
    AddRows(kind);
    if (kind != Kind::kWhiteBalance) continue;
    QToolButton* gray = MakePick("white_balance_pick", tr("This should be gray"),
                                 tr("Take a color from the picture, with a click. Temperature and "
                                    "tint are set so that it becomes gray"));
    rows()->addWidget(gray, 0, Qt::AlignRight);
    note_ = new QLabel;
    note_->setObjectName("white_balance_note");
    note_->setWordWrap(true);
    rows()->addWidget(note_);
  }
}

void GradePage::TakePicked(const QColor& color) {
  const Eigen::Vector3f rgb(color.redF(), color.greenF(), color.blueF());
  balance_ = WhiteBalanceOfGray({rgb.data(), 3});
  ColorOperation operation = Operation(Kind::kWhiteBalance);
  operation.Get("temperature")[0] = balance_.temperature;
  operation.Get("tint")[0] = balance_.tint;
  Q_EMIT changed(operation, false);
}

void GradePage::ShowMore() {
  const ColorOperation* operation = shown(Kind::kWhiteBalance);
  const bool is_found = operation && operation->Get("temperature")[0] == balance_.temperature &&
                        operation->Get("tint")[0] == balance_.tint;
  note_->setText(QStringLiteral("⚠ ") + QString::fromStdString(balance_.warning));
  note_->setVisible(is_found && !balance_.warning.empty());
}

// --- GradientPage --------------------------------------------------------------------------------

GradientPage::GradientPage() : EditPage({Kind::kGradient}) {
  bar_ = new GradientBar;
  bar_->setObjectName("gradient_bar");
  rows()->addWidget(bar_);
  auto* line = new QHBoxLayout;
  add_ = MakeButton("gradient_add", tr("Add a stop"), tr("Add a stop (or double-click the bar)"));
  remove_ =
      MakeButton("gradient_remove", tr("Remove stop"), tr("Take the current stop away (Del)"));
  reverse_ = MakeButton("gradient_reverse", tr("Reverse"), tr("Light becomes dark"));
  for (QToolButton* button : {add_, remove_, reverse_}) line->addWidget(button);
  line->addStretch();
  rows()->addLayout(line);
  connect(bar_, &GradientBar::changed, this, &GradientPage::Send);
  connect(bar_, &GradientBar::currentChanged, this, [this] {
    remove_->setEnabled(bar_->CanRemove());
    Q_EMIT colorChanged();
  });
  connect(remove_, &QToolButton::clicked, bar_, &GradientBar::RemoveStop);
  // In the widest gap.
  connect(add_, &QToolButton::clicked, this, [this] {
    const std::vector<float>& stops = bar_->stops();
    size_t widest = 4;
    const auto width = [&](size_t i) { return stops[i] - stops[i - 4]; };
    for (size_t i = 8; i < stops.size(); i += 4) {
      if (width(i) > width(widest)) widest = i;
    }
    bar_->AddStop(double(stops[widest] + stops[widest - 4]) / 2);
  });
  connect(reverse_, &QToolButton::clicked, this, [this] {
    bar_->Reverse();
    Send(false);
  });
}

QColor GradientPage::color() const { return bar_->color(); }

void GradientPage::ChooseColor(const QColor& color, bool dragging) {
  bar_->SetColor(color, dragging);
}

void GradientPage::Send(bool dragging) {
  ColorOperation operation = Operation(Kind::kGradient);
  operation.values = bar_->stops();
  Q_EMIT changed(operation, dragging);
}

void GradientPage::ShowMore() {
  bar_->SetStops(Operation(Kind::kGradient).values);
  add_->setEnabled(bar_->CanAdd());
  remove_->setEnabled(bar_->CanRemove());
}

// --- MatrixPage ----------------------------------------------------------------------------------

MatrixPage::MatrixPage() : EditPage({Kind::kMatrix}) {
  auto* grid = new QGridLayout;
  grid->setSpacing(2);
  constexpr int kColumns = 4;
  for (int i = 0; i < 3 * kColumns; ++i) {
    auto* cell = new QDoubleSpinBox;
    cell->setObjectName(QStringLiteral("matrix%1").arg(i));
    cell->setDecimals(3);
    cell->setRange(-100, 100);
    cell->setSingleStep(0.05);
    cell->setKeyboardTracking(false);
    cell->setButtonSymbols(QAbstractSpinBox::NoButtons);
    cell->setAccessibleName(tr("Row %1, column %2").arg(i / kColumns + 1).arg(i % kColumns + 1));
    grid->addWidget(cell, i / kColumns, i % kColumns);
    cells_.push_back(cell);
    connect(cell, &QDoubleSpinBox::valueChanged, this, [this, i](double value) {
      ColorOperation operation = Operation(Kind::kMatrix);
      operation.values[size_t(i)] = float(value);
      Q_EMIT changed(operation, false);
    });
  }
  rows()->addLayout(grid);
}

void MatrixPage::ShowMore() {
  const ColorOperation operation = Operation(Kind::kMatrix);
  for (size_t i = 0; i < cells_.size(); ++i) {
    const QSignalBlocker quiet(cells_[i]);
    cells_[i]->setValue(double(operation.values[i]));
  }
}

}  // namespace retint
