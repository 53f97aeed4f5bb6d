// SPDX-License-Identifier: BSD-3-Clause
// A number with its label, a slider, a box and a way back to its default. The slider is live while
// it is dragged, and so is the label, on which one drags sideways.
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
    bool logarithmic = false;  // the slider; low is above 0
  };

  // `name`: of the widget's parts, "NAME" the box, "NAME_slider", "NAME_reset".
  ParameterRow(const QString& name, const QString& label, const Range& range, const QString& suffix,
               const QString& tip, QWidget* parent = nullptr);
  double value() const;
  void SetValue(double value);  // says nothing
  // A width that the labels of several rows share.
  void SetLabelWidth(int width);
  int LabelWidth() const;

 Q_SIGNALS:
  // By the user; `dragging` while the mouse is down: more is to come.
  void changed(double value, bool dragging);
  void reset();  // the button was pressed; nothing was changed yet

 protected:
  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  int ToSlider(double value) const;
  double FromSlider(int position) const;
  void ShowReset();
  bool Shows(double value) const;  // as exactly as the box does

  const Range range_;
  QLabel* label_;
  QSlider* slider_;
  QDoubleSpinBox* box_;
  QToolButton* reset_;
  double scrub_x_ = 0;   // where the label was pressed, pixels
  int scrub_from_ = -1;  // of the slider then; -1: the label is not held
};

}  // namespace retint
