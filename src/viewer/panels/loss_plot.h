// SPDX-License-Identifier: BSD-3-Clause
// The loss of a refit over its steps.
#pragma once

#include <vector>

#include <QWidget>

namespace retint {

class LossPlot : public QWidget {
  Q_OBJECT

 public:
  explicit LossPlot(QWidget* parent = nullptr);
  // Values that are not finite leave a gap. `per_point`: number of steps between two values.
  void SetLosses(std::vector<double> losses, int per_point = 1);
  const std::vector<double>& losses() const { return losses_; }
  QSize sizeHint() const override { return {260, 130}; }
  QSize minimumSizeHint() const override { return {160, 90}; }

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  std::vector<double> losses_;
  int per_point_ = 1;
};

}  // namespace retint
