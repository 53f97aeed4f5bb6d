// SPDX-License-Identifier: BSD-3-Clause
// A slider that jumps to a click, and follows the mouse from there.
#pragma once

#include <QSlider>

namespace retint {

class JumpSlider : public QSlider {
 public:
  using QSlider::QSlider;

 protected:
  void mousePressEvent(QMouseEvent* event) override;
};

}  // namespace retint
