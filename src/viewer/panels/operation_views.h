// SPDX-License-Identifier: BSD-3-Clause
// How the editor speaks of the operations of an edit: their names, what one does in a few words,
// and the controls of their parameters.
#pragma once

#include <span>

#include <QColor>
#include <QString>

#include "recolor/color_edit.h"

namespace retint {

// A number of an operation as it is set by a slider and a box.
struct ParameterView {
  ColorOperationKind kind;
  const char* parameter;  // ColorParameter::name
  size_t index;           // of its values
  const char* label;
  double low, high;  // of the slider; the box goes as far as the operation allows (most())
  double step;       // of the box and of the slider's keys
  bool logarithmic;  // the slider
  const char* suffix;
  const char* tip;

  const ColorParameter& type() const;
  float Get(const ColorOperation& operation) const;
  void Set(ColorOperation& operation, double value) const;
  double Default() const;
  // Of the end of a range that is open as long as nobody set it: it shows as `high`, beyond which
  // there are no colors.
  bool HasOpenEnd() const;
  double most() const { return HasOpenEnd() ? high : double(type().max); }
};
// In the order in which they are shown.
std::span<const ParameterView> ParameterViews();

QString OperationTitle(ColorOperationKind kind);
QString OperationTitle(const ColorOperation& operation);  // tells curves and levels from other LUTs
// "Recolor to #3060ff", "Exposure +0.5".
QString OperationSummary(const ColorOperation& operation);
// One that can be added to a list as it is; `color` is what it makes of the region, where it makes
// one color. Not for kLut and kPicture, which need a file.
ColorOperation NewOperation(ColorOperationKind kind, const QColor& color);

// What was measured holds for one region, and for the operations before. Forgets it; a color that
// was named instead stays.
void ForgetMeasured(ColorOperation& operation);
// Gives an operation that waits for it what was measured for another; false where that does not
// fit.
bool TakeMeasured(ColorOperation& operation, const ColorOperation& measured);

// `values` [3], 0 to 1, as a color of the screen.
QColor ToColor(std::span<const float> values);
// The gray of an OKLab lightness, 0 to 1.
QColor GrayOf(double lightness);
// What the edit makes of a color; `base` itself while the edit waits for its region's main color.
QColor Edited(const ColorEdit& edit, const QColor& base);
// The one color that the edit asks for: that of the last recolor or tint of a list that ends in
// it. Invalid where there is none.
QColor NamedColor(const ColorEdit& edit);

}  // namespace retint
