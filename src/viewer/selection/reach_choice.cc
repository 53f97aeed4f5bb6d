// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/reach_choice.h"

#include <QAbstractButton>
#include <QButtonGroup>
#include <QHBoxLayout>
#include <QToolButton>

namespace retint {
namespace {

const char* NameOf(PaintReach reach) {
  switch (reach) {
    case PaintReach::kSurface:
      return "reachSurface";
    case PaintReach::kObject:
      return "reachObject";
    case PaintReach::kExact:
      return "reachExact";
  }
  return "";
}

}  // namespace

QString ReachText(PaintReach reach) {
  switch (reach) {
    case PaintReach::kSurface:
      return ReachChoice::tr("This surface");
    case PaintReach::kObject:
      return ReachChoice::tr("The whole object");
    case PaintReach::kExact:
      return ReachChoice::tr("Exactly what I painted");
  }
  return {};
}

QString ReachTip(PaintReach reach) {
  switch (reach) {
    case PaintReach::kSurface:
      return ReachChoice::tr(
          "Other views get the surface that you painted. Sides that you did not see stay as they "
          "are. For walls, floors and parts of things");
    case PaintReach::kObject:
      return ReachChoice::tr(
          "Sides that you did not see are selected too, if they belong to what you painted");
    case PaintReach::kExact:
      return ReachChoice::tr(
          "Other views get your paint where they see the same surface, and nothing beside it. For "
          "stripes and letters");
  }
  return {};
}

ReachChoice::ReachChoice(QWidget* parent) : QWidget(parent) {
  setAccessibleName(tr("How far paint goes"));
  auto* row = new QHBoxLayout(this);
  row->setContentsMargins(0, 0, 0, 0);
  row->setSpacing(0);
  buttons_ = new QButtonGroup(this);
  for (const PaintReach reach : kReaches) {
    auto* button = new QToolButton;
    button->setObjectName(NameOf(reach));
    button->setText(ReachText(reach));
    button->setAccessibleName(ReachText(reach));
    button->setToolTip(ReachTip(reach));
    button->setCheckable(true);
    button->setFocusPolicy(Qt::TabFocus);
    buttons_->addButton(button, static_cast<int>(reach));
    row->addWidget(button);
  }
  setSizePolicy(QSizePolicy::Fixed, QSizePolicy::Fixed);
  connect(buttons_, &QButtonGroup::idClicked, this,
          [this](int id) { Q_EMIT chosen(static_cast<PaintReach>(id)); });
}

void ReachChoice::Show(std::optional<PaintReach> reach) {
  buttons_->setExclusive(false);
  for (QAbstractButton* button : buttons_->buttons()) {
    button->setChecked(reach && buttons_->id(button) == static_cast<int>(*reach));
  }
  buttons_->setExclusive(true);
}

}  // namespace retint
