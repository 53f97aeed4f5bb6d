// SPDX-License-Identifier: BSD-3-Clause
// The style of all controls: flat, round corners, lines of one color, one accent, Fusion's sizes.
#pragma once

#include <QProxyStyle>

namespace retint {

// Buttons with this property, and default buttons of dialogs, are filled with the accent color.
constexpr char kPrimary[] = "primary";

class FlatStyle : public QProxyStyle {
 public:
  FlatStyle();

  void drawPrimitive(PrimitiveElement element, const QStyleOption* option, QPainter* painter,
                     const QWidget* widget) const override;
  void drawControl(ControlElement element, const QStyleOption* option, QPainter* painter,
                   const QWidget* widget) const override;
  void drawComplexControl(ComplexControl control, const QStyleOptionComplex* option,
                          QPainter* painter, const QWidget* widget) const override;
  int styleHint(StyleHint hint, const QStyleOption* option, const QWidget* widget,
                QStyleHintReturn* answer) const override;

 private:
  void DrawCombo(const QStyleOptionComplex& option, QPainter& painter, const QWidget* widget) const;
  void DrawSpin(const QStyleOptionComplex& option, QPainter& painter, const QWidget* widget) const;
  void DrawSlider(const QStyleOptionComplex& option, QPainter& painter,
                  const QWidget* widget) const;
  void DrawScrollBar(const QStyleOptionComplex& option, QPainter& painter,
                     const QWidget* widget) const;
};

}  // namespace retint
