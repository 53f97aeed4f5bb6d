// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/parameter_row.h"

#include <algorithm>
#include <cmath>

#include <QDoubleSpinBox>
#include <QHBoxLayout>
#include <QLabel>
#include <QMouseEvent>
#include <QSignalBlocker>
#include <QToolButton>

#include "viewer/panels/jump_slider.h"

namespace retint {
namespace {

constexpr int kSteps = 400;  // of a slider

int DecimalsOf(double step) { return std::clamp(int(std::ceil(-std::log10(step) - 1e-9)), 0, 3); }

}  // namespace

ParameterRow::ParameterRow(const QString& name, const QString& label, const Range& range,
                           const QString& suffix, const QString& tip, QWidget* parent)
    : QWidget(parent), range_(range) {
  label_ = new QLabel(label);
  label_->setCursor(Qt::SizeHorCursor);
  label_->installEventFilter(this);
  slider_ = new JumpSlider(Qt::Horizontal);
  slider_->setObjectName(name + "_slider");
  slider_->setRange(0, kSteps);
  slider_->setPageStep(kSteps / 10);
  slider_->setMinimumWidth(60);
  const double share = range.logarithmic ? 0.01 : range.step / (range.high - range.low);
  slider_->setSingleStep(std::max(1, int(std::lround(share * kSteps))));
  box_ = new QDoubleSpinBox;
  box_->setObjectName(name);
  // One digit more than a step has, because the slider stops between steps.
  box_->setDecimals(range.step >= 1 ? 0 : DecimalsOf(range.step));
  box_->setRange(range.min, range.max);
  box_->setSingleStep(range.step);
  box_->setSuffix(suffix);
  box_->setKeyboardTracking(false);
  box_->setButtonSymbols(QAbstractSpinBox::NoButtons);
  box_->setAlignment(Qt::AlignRight);
  box_->setFixedWidth(box_->fontMetrics().horizontalAdvance("-00.00 EV") + 14);
  reset_ = new QToolButton;
  reset_->setObjectName(name + "_reset");
  reset_->setText(QStringLiteral("↺"));
  reset_->setAutoRaise(true);
  reset_->setFocusPolicy(Qt::StrongFocus);
  reset_->setAccessibleName(tr("Reset %1").arg(label));
  reset_->setToolTip(tr("Back to %1").arg(box_->textFromValue(range.initial) + suffix));
  label_->setBuddy(box_);
  for (QWidget* part : std::initializer_list<QWidget*>{slider_, box_}) {
    part->setAccessibleName(label);
    part->setFocusPolicy(Qt::StrongFocus);
  }
  setToolTip(tip);
  auto* layout = new QHBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  layout->setSpacing(4);
  layout->addWidget(label_);
  layout->addWidget(slider_, 1);
  layout->addWidget(box_);
  layout->addWidget(reset_);
  connect(slider_, &QSlider::valueChanged, this, [this](int position) {
    {
      const QSignalBlocker quiet(box_);
      box_->setValue(FromSlider(position));
    }
    ShowReset();
    Q_EMIT changed(box_->value(), slider_->isSliderDown());
  });
  connect(slider_, &QSlider::sliderReleased, this,
          [this] { Q_EMIT changed(box_->value(), false); });
  connect(box_, &QDoubleSpinBox::valueChanged, this, [this](double value) {
    SetValue(value);
    Q_EMIT changed(value, false);
  });
  connect(reset_, &QToolButton::clicked, this, [this] {
    // The button becomes disabled: without this, the focus would go to the next row.
    if (reset_->hasFocus()) slider_->setFocus();
    Q_EMIT reset();
  });
  SetValue(range.initial);
}

double ParameterRow::value() const { return box_->value(); }

void ParameterRow::SetValue(double value) {
  const QSignalBlocker quiet_slider(slider_), quiet_box(box_);
  // Setting even the same number would delete the text that the user types.
  if (!Shows(value)) box_->setValue(value);
  if (!slider_->isSliderDown()) slider_->setValue(ToSlider(value));
  ShowReset();
}

bool ParameterRow::eventFilter(QObject*, QEvent* event) {
  const auto* mouse = static_cast<QMouseEvent*>(event);
  switch (event->type()) {
    case QEvent::MouseButtonPress:
      if (mouse->button() != Qt::LeftButton) return false;
      scrub_from_ = ToSlider(value());
      scrub_x_ = mouse->position().x();
      return true;
    case QEvent::MouseMove:
    case QEvent::MouseButtonRelease: {
      if (scrub_from_ < 0) return false;
      const bool ends = event->type() == QEvent::MouseButtonRelease;
      const int by = int(std::lround(mouse->position().x() - scrub_x_));
      const int to = std::clamp(scrub_from_ + by, 0, kSteps);
      // A click changes nothing, even if the value lies between the slider's steps.
      const bool moves = to != ToSlider(value());
      if (moves) SetValue(FromSlider(to));
      if (moves || (ends && to != scrub_from_)) Q_EMIT changed(value(), !ends);
      if (ends) scrub_from_ = -1;
      return true;
    }
    default:
      return false;
  }
}

void ParameterRow::ShowReset() { reset_->setEnabled(!Shows(range_.initial)); }

bool ParameterRow::Shows(double value) const {
  return std::abs(box_->value() - value) < 0.5 * std::pow(10, -box_->decimals());
}

void ParameterRow::SetLabelWidth(int width) { label_->setMinimumWidth(width); }

int ParameterRow::LabelWidth() const { return label_->sizeHint().width(); }

int ParameterRow::ToSlider(double value) const {
  value = std::clamp(value, range_.low, range_.high);
  const double share = range_.logarithmic
                           ? std::log(value / range_.low) / std::log(range_.high / range_.low)
                           : (value - range_.low) / (range_.high - range_.low);
  return int(std::lround(share * kSteps));
}

double ParameterRow::FromSlider(int position) const {
  const double share = double(position) / kSteps;
  return range_.logarithmic ? range_.low * std::pow(range_.high / range_.low, share)
                            : range_.low + share * (range_.high - range_.low);
}

}  // namespace retint
