// SPDX-License-Identifier: BSD-3-Clause
// How far paint reaches, as one click: "This surface", "The whole object", "Exactly my strokes".
#pragma once

#include <optional>

#include <QString>
#include <QWidget>

#include "selection/paint_reach.h"

class QButtonGroup;

namespace retint {

inline constexpr PaintReach kReaches[] = {PaintReach::kSurface, PaintReach::kObject,
                                          PaintReach::kExact};
QString ReachText(PaintReach reach);
QString ReachTip(PaintReach reach);

class ReachChoice : public QWidget {
  Q_OBJECT

 public:
  explicit ReachChoice(QWidget* parent = nullptr);
  // nullopt: no button is down, because the options match none of the choices.
  void Show(std::optional<PaintReach> reach);

 Q_SIGNALS:
  void chosen(retint::PaintReach reach);  // by the user

 private:
  QButtonGroup* buttons_;
};

}  // namespace retint
