// SPDX-License-Identifier: BSD-3-Clause
// A number with its label, a slider, a box and a button to reset it. Dragging the slider, or the
// label sideways, changes the value live.
#pragma once

#include <QWidget>

class QDoubleSpinBox;
class QLabel;
class QSlider;
class QToolButton;

namespace retint {

class ParameterRow : public QWidget {
  Q_OBJECT

 public:
  struct Range {
    double low = 0, high = 1;  // of the slider
    double min = 0, max = 1;   // of the box
    double step = 0.01, initial = 0;
    bool logarithmic = false;  // the slider; needs low above 0
  };

  // `name` names the widget's parts: "NAME" is the box; "NAME_slider", "NAME_reset".
  ParameterRow(const QString& name, const QString& label, const Range& range, const QString& suffix,
               const QString& tip, QWidget* parent = nullptr);
  double value() const;
  void SetValue(double value);  // without a signal
  // A common width for the labels of several rows.
  void SetLabelWidth(int width);
  int LabelWidth() const;

 Q_SIGNALS:
  // By the user. `dragging`: the mouse is down and more changes will follow.
  void changed(double value, bool dragging);
  void reset();  // the button was pressed; nothing has changed yet

 protected:
  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  int ToSlider(double value) const;
  double FromSlider(int position) const;
  void ShowReset();
  bool Shows(double value) const;  // to the precision of the box

  const Range range_;
  QLabel* label_;
  QSlider* slider_;
  QDoubleSpinBox* box_;
  QToolButton* reset_;
  double scrub_x_ = 0;   // where the label was pressed, pixels
  int scrub_from_ = -1;  // slider position at that time; -1: the label is not held
};

}  // namespace retint
