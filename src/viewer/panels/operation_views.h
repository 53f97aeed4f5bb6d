// SPDX-License-Identifier: BSD-3-Clause
// How the editor shows operations: their names, short summaries, and controls for their
// parameters.
#pragma once

#include <span>

#include <QColor>
#include <QString>

#include "recolor/color_edit.h"

namespace retint {

// A number of an operation, set by a slider and a box.
struct ParameterView {
  ColorOperationKind kind;
  const char* parameter;  // ColorParameter::name
  size_t index;           // of its values
  const char* label;
  double low, high;  // of the slider; the box has the operation's own limits, see most()
  double step;       // of the box and of the slider's keys
  bool logarithmic;  // the slider
  const char* suffix;
  const char* tip;

  const ColorParameter& type() const;
  float Get(const ColorOperation& operation) const;
  void Set(ColorOperation& operation, double value) const;
  double Default() const;
  // True for the end of a range that is unset, so open. It shows as `high`, because there are no
  // colors beyond.
  bool HasOpenEnd() const;
  double most() const { return HasOpenEnd() ? high : double(type().max); }
};
// In the order of display.
std::span<const ParameterView> ParameterViews();
// The operations that share the page Grade, in the order in which they are shown.
std::span<const ColorOperationKind> GradeKinds();

QString OperationTitle(ColorOperationKind kind);
QString OperationTitle(const ColorOperation& operation);  // names curves and levels, not LUTs
// "Recolor to #3060ff", "Exposure +0.5".
QString OperationSummary(const ColorOperation& operation);
// An operation that can be added to a list. `color`: the result that it gives the region, if it has
// a single one. Not for kLut and kPicture, which need a file.
ColorOperation NewOperation(ColorOperationKind kind, const QColor& color);

// Forgets measured colors, which belong to one region and the operations before. A color that the
// user named stays.
void ForgetMeasured(ColorOperation& operation);
// Fills in the colors that `operation` waits for from a measured one; false if they do not
// fit.
bool TakeMeasured(ColorOperation& operation, const ColorOperation& measured);

// `values` [3] in [0, 1] as a screen color.
QColor ToColor(std::span<const float> values);
// The gray of an OKLab lightness, 0 to 1.
QColor GrayOf(double lightness);
// The edit's result for a color; `base` while the edit waits for its region's main color.
QColor Edited(const ColorEdit& edit, const QColor& base);
// The single color that the edit gives: that of a recolor or tint at the end of the list. Invalid
// if there is none.
QColor NamedColor(const ColorEdit& edit);

}  // namespace retint
