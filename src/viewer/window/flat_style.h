// SPDX-License-Identifier: BSD-3-Clause
// Looks of every control: flat, round corners, lines of one color, one accent. Sizes are Fusion's.
#pragma once

#include <QProxyStyle>

namespace retint {

// A button with this property, and the default button of a dialog, is filled with the accent.
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
