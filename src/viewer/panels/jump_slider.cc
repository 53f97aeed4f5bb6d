// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/jump_slider.h"

#include <QMouseEvent>
#include <QStyle>
#include <QStyleOptionSlider>

namespace retint {

void JumpSlider::mousePressEvent(QMouseEvent* event) {
  if (event->button() != Qt::LeftButton) return QSlider::mousePressEvent(event);
  QStyleOptionSlider option;
  const auto part = [&](QStyle::SubControl control) {
    initStyleOption(&option);
    return style()->subControlRect(QStyle::CC_Slider, &option, control, this);
  };
  const QPoint at = event->position().toPoint();
  if (part(QStyle::SC_SliderHandle).contains(at)) return QSlider::mousePressEvent(event);
  const QRect groove = part(QStyle::SC_SliderGroove);
  const int handle = part(QStyle::SC_SliderHandle).width();
  setSliderDown(true);  // the press starts a drag, of which this is the first step
  setSliderPosition(QStyle::sliderValueFromPosition(minimum(), maximum(),
                                                    at.x() - groove.x() - handle / 2,
                                                    groove.width() - handle, option.upsideDown));
  // Pressed at its middle, the handle stays under the mouse.
  const QPointF held = part(QStyle::SC_SliderHandle).center();
  QMouseEvent press(event->type(), held, mapToGlobal(held), event->button(), event->buttons(),
                    event->modifiers());
  QSlider::mousePressEvent(&press);
}

}  // namespace retint
