// SPDX-License-Identifier: BSD-3-Clause
// The page of palettes.
#include <algorithm>
#include <utility>

#include <QIcon>
#include <QLabel>
#include <QPainter>
#include <QSignalBlocker>
#include <QSpinBox>
#include <QToolButton>
#include <QVBoxLayout>

#include "recolor/palette.h"
#include "viewer/panels/edit_pages.h"
#include "viewer/widgets/wrap_layout.h"

namespace retint {
namespace {

using Kind = ColorOperationKind;

constexpr QSize kPair(36, 18);

// Its color on the left, its new color on the right.
QIcon PairIcon(const QColor& from, const QColor& to, const QPalette& palette) {
  QPixmap picture(kPair);
  QPainter painter(&picture);
  const int middle = kPair.width() / 2;
  painter.fillRect(0, 0, middle, kPair.height(), from);
  painter.fillRect(middle, 0, kPair.width() - middle, kPair.height(), to);
  painter.setPen(palette.color(QPalette::Text));
  painter.drawRect(0, 0, kPair.width() - 1, kPair.height() - 1);
  return QIcon(picture);
}

}  // namespace

PalettePage::PalettePage() : EditPage({Kind::kPalette}) {
  count_ = new QSpinBox;
  count_->setObjectName("palette_count");
  count_->setRange(1, kMaxPaletteColors);
  count_->setKeyboardTracking(false);
  count_->setToolTip(tr("How many main colors are told apart"));
  auto* label = new QLabel(tr("Main colors"));
  label->setBuddy(count_);
  stay_ = new QToolButton;
  stay_->setObjectName("palette_stay");
  stay_->setText(tr("Stays"));
  stay_->setToolTip(tr("Leave this main color as it is"));
  measure_ = new QToolButton;
  measure_->setObjectName("palette_measure");
  measure_->setText(tr("Measure"));
  measure_->setToolTip(tr("Find the main colors of the region again"));
  for (QToolButton* button : {stay_, measure_}) button->setFocusPolicy(Qt::StrongFocus);
  pairs_ = new QWidget;
  auto* wrap = new WrapLayout(pairs_);
  wrap->setContentsMargins(0, 0, 0, 0);
  wrap->setSpacing(2);
  QSizePolicy policy(QSizePolicy::Preferred, QSizePolicy::Minimum);
  policy.setHeightForWidth(true);
  pairs_->setSizePolicy(policy);
  note_ = new QLabel;
  note_->setObjectName("palette_note");
  note_->setWordWrap(true);
  rows()->addWidget(MakeWrappingLine({label, count_, stay_, measure_}));
  rows()->addWidget(pairs_);
  rows()->addWidget(note_);
  connect(count_, &QSpinBox::valueChanged, this, &PalettePage::Ask);
  connect(stay_, &QToolButton::clicked, this, [this] {
    ColorOperation operation = Operation(Kind::kPalette);
    std::fill_n(operation.values.begin() + std::ptrdiff_t(current_ * kPairValues + 3), 3, kUnset);
    Q_EMIT changed(operation, false);
  });
  // As many as last time: another selection may have more colors.
  connect(measure_, &QToolButton::clicked, this,
          [this] { Ask(std::max(asked_, count_->value())); });
}

void PalettePage::Ask(int count) {
  asked_ = count;
  asked_of_ = subject_;
  waits_ = true;
  Q_EMIT measureWanted(count);
  ShowMore();
}

void PalettePage::TakeMeasured(const ColorOperation& palette) {
  waits_ = false;
  const ColorOperation* old = shown(Kind::kPalette);
  if (!old) {
    measured_ = palette;
    ShowMore();
    return Q_EMIT colorChanged();
  }
  // The most frequent colors keep their new colors.
  ColorOperation operation = palette;
  operation.strength = old->strength;
  const size_t both = std::min(operation.values.size(), old->values.size());
  for (size_t i = 0; i < both; ++i) {
    if (i % kPairValues >= 3) operation.values[i] = old->values[i];
  }
  if (operation == *old) return ShowMore();
  Q_EMIT changed(operation, false);
}

// The edit's palette, otherwise the one that was measured.
ColorOperation PalettePage::Drawn() const {
  return !shown(Kind::kPalette) && measured_ ? *measured_ : Operation(Kind::kPalette);
}

bool PalettePage::IsMeasured() const {
  return (shown(Kind::kPalette) || measured_) && !Drawn().NeedsMeasuring();
}

QColor PalettePage::color() const {
  if (!IsMeasured()) return {};
  const ColorOperation drawn = Drawn();
  const float* pair =
      &drawn.values[std::min(current_ * kPairValues, drawn.values.size() - kPairValues)];
  return ToColor({pair[3] != kUnset ? pair + 3 : pair, 3});
}

void PalettePage::ChooseColor(const QColor& color, bool dragging) {
  ColorOperation operation = Drawn();
  float* to = &operation.values[current_ * kPairValues + 3];
  to[0] = color.redF(), to[1] = color.greenF(), to[2] = color.blueF();
  Q_EMIT changed(operation, dragging);
}

void PalettePage::SetCurrent(size_t pair) {
  current_ = pair;
  ShowMore();
  Q_EMIT colorChanged();
}

void PalettePage::ShowMore() {
  if (std::exchange(asked_of_, subject_) != subject_) {
    asked_ = 0;
    waits_ = false;
    measured_.reset();
  }
  const ColorOperation* operation = shown(Kind::kPalette);
  const ColorOperation drawn = Drawn();
  const bool measured = IsMeasured();
  const size_t count = measured ? drawn.values.size() / kPairValues : 0;
  {
    const QSignalBlocker quiet(count_);
    if (!waits_) count_->setValue(int(drawn.values.size() / kPairValues));
  }
  while (buttons_.size() < count) {
    auto* button = new QToolButton;
    button->setObjectName(QStringLiteral("palette%1").arg(buttons_.size()));
    button->setCheckable(true);
    button->setIconSize(kPair);
    button->setFocusPolicy(Qt::StrongFocus);
    pairs_->layout()->addWidget(button);
    connect(button, &QToolButton::clicked, this,
            [this, pair = buttons_.size()] { SetCurrent(pair); });
    buttons_.push_back(button);
  }
  current_ = std::min(current_, std::max<size_t>(count, 1) - 1);
  for (size_t i = 0; i < buttons_.size(); ++i) {
    QToolButton* button = buttons_[i];
    button->setVisible(i < count);
    if (i >= count) continue;
    const float* pair = &drawn.values[i * kPairValues];
    const QColor from = ToColor({pair, 3});
    const bool stays = pair[3] == kUnset;
    const QColor to = stays ? from : ToColor({pair + 3, 3});
    button->setIcon(PairIcon(from, to, palette()));
    button->setToolTip(stays ? tr("%1 stays").arg(from.name())
                             : tr("%1 becomes %2").arg(from.name(), to.name()));
    button->setAccessibleName(button->toolTip());
    button->setChecked(i == current_);
  }
  pairs_->updateGeometry();
  stay_->setEnabled(measured && drawn.values[current_ * kPairValues + 3] != kUnset);
  const bool waits = waits_ || (operation && !measured);
  QString note = waits      ? tr("Measuring the main colors…")
                 : measured ? tr("Choose a main color, then what it becomes.")
                            : tr("Measure the region's main colors to begin.");
  if (measured && !waits && int(count) < asked_) {
    note = tr("Found %1 of %2: shades of one color count as one, and what few pixels have does not "
              "count.")
               .arg(count)
               .arg(asked_) +
           " " + note;
  }
  note_->setText(note);
}

}  // namespace retint
