// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/option_form.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QFormLayout>
#include <QLabel>
#include <QSignalBlocker>
#include <QSpinBox>

namespace retint {
namespace {

constexpr int kDecimals = 6;
constexpr double kMost = 1e9;  // replaces a range's missing end

QString Text(const std::string& text) { return QString::fromStdString(text); }

QString WithCapital(QString text) {
  if (!text.isEmpty()) text[0] = text[0].toUpper();
  return text;
}

// "quad_side" of 3 pixels: "Quad side, pixels".
QString LabelOf(const Option& option) {
  if (!option.title.empty()) return Text(option.title);
  const QString label = WithCapital(Text(option.Label()));
  return option.unit.empty() ? label : label + ", " + Text(option.unit);
}

// A choice in words for the user.
QString ChoiceText(const std::string& name) {
  return name == "mm" ? OptionForm::tr("block sweeps") : Text(name);
}

QString ObjectName(const Option& option) {
  return Text(option.applies.empty() ? option.name : option.applies + "." + option.name);
}

// Shows 0.00025 and 3000 without trailing zeros.
class NumberBox : public QDoubleSpinBox {
 public:
  using QDoubleSpinBox::QDoubleSpinBox;
  QString textFromValue(double value) const override {
    QString text = QDoubleSpinBox::textFromValue(value);
    while (text.endsWith(locale().zeroDigit())) text.chop(1);
    if (text.endsWith(locale().decimalPoint())) text.chop(1);
    return text;
  }
};

QDoubleSpinBox* MakeNumberBox(const OptionRange& range) {
  auto* box = new NumberBox;
  const double step = std::pow(10, -kDecimals);
  box->setDecimals(kDecimals);
  box->setRange(std::max(range.min, -kMost) + (range.min_open ? step : 0),
                std::min(range.max, kMost) - (range.max_open ? step : 0));
  box->setStepType(QAbstractSpinBox::AdaptiveDecimalStepType);
  box->setKeyboardTracking(false);
  return box;
}

QSpinBox* MakeWholeBox(const OptionRange& range) {
  auto* box = new QSpinBox;
  constexpr double kInt = std::numeric_limits<int>::max();
  box->setRange(static_cast<int>(std::max(range.min, -kInt)),
                static_cast<int>(std::min(range.max, kInt)));
  box->setSingleStep(range.multiple_of);
  box->setKeyboardTracking(false);
  return box;
}

}  // namespace

OptionForm::OptionForm(std::vector<std::string> without, QWidget* parent)
    : QWidget(parent), without_(std::move(without)) {
  form_ = new QFormLayout(this);
  form_->setContentsMargins(0, 6, 0, 0);
  form_->setFieldGrowthPolicy(QFormLayout::AllNonFixedFieldsGrow);
}

void OptionForm::Show(const OptionList& list) {
  for (size_t i = controls_.size(); i < list.size(); ++i) AddRow(list[i], i);
  for (size_t i = 0; i < list.size(); ++i) {
    if (!controls_[i]) continue;
    ShowValue(controls_[i], list[i]);
    form_->setRowVisible(controls_[i], Applies(list, list[i]));
  }
}

void OptionForm::AddRow(const Option& option, size_t index) {
  controls_.push_back(nullptr);
  if (option.tier == OptionTier::kRare) return;
  if (std::ranges::find(without_, option.name) != without_.end()) return;
  QWidget* control = nullptr;
  if (std::holds_alternative<bool*>(option.member)) {
    auto* box = new QCheckBox(LabelOf(option));
    connect(box, &QCheckBox::toggled, this, [=, this](bool on) { Q_EMIT edited(index, on); });
    control = box;
  } else if (const auto* choice = std::get_if<OptionChoice>(&option.member)) {
    auto* box = new QComboBox;
    for (const std::string& name : choice->names) box->addItem(ChoiceText(name), Text(name));
    box->setSizeAdjustPolicy(QComboBox::AdjustToMinimumContentsLengthWithIcon);
    box->setMinimumContentsLength(8);
    connect(box, &QComboBox::activated, this,
            [=, this] { Q_EMIT edited(index, box->currentData().toString().toStdString()); });
    control = box;
  } else if (std::holds_alternative<double*>(option.member)) {
    auto* box = MakeNumberBox(option.range);
    connect(box, &QDoubleSpinBox::valueChanged, this,
            [=, this](double value) { Q_EMIT edited(index, value); });
    control = box;
  } else {
    auto* box = MakeWholeBox(option.range);
    connect(box, &QSpinBox::valueChanged, this,
            [=, this](int value) { Q_EMIT edited(index, int64_t{value}); });
    control = box;
  }
  control->setObjectName(ObjectName(option));
  control->setToolTip(WithCapital(Text(option.help)));
  control->setAccessibleName(LabelOf(option));
  if (qobject_cast<QCheckBox*>(control)) {
    form_->addRow(control);
  } else {
    auto* label = new QLabel(LabelOf(option));
    label->setBuddy(control);
    label->setToolTip(control->toolTip());
    form_->addRow(label, control);
  }
  controls_.back() = control;
}

void OptionForm::ShowValue(QWidget* control, const Option& option) {
  const QSignalBlocker quiet(control);
  const OptionValue value = option.Get();
  if (auto* box = qobject_cast<QCheckBox*>(control)) {
    box->setChecked(std::get<bool>(value));
  } else if (auto* choice = qobject_cast<QComboBox*>(control)) {
    choice->setCurrentIndex(choice->findData(Text(std::get<std::string>(value))));
  } else if (auto* number = qobject_cast<QDoubleSpinBox*>(control)) {
    number->setValue(std::get<double>(value));
  } else if (auto* whole = qobject_cast<QSpinBox*>(control)) {
    const auto* large = std::get_if<uint64_t>(&value);
    whole->setValue(large ? static_cast<int>(*large) : static_cast<int>(std::get<int64_t>(value)));
  }
}

}  // namespace retint
