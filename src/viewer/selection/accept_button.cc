// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/accept_button.h"

#include <algorithm>

#include <QMouseEvent>
#include <QTimer>

#include "viewer/selection/selection_canvas.h"

namespace retint {
namespace {

constexpr int kAway = 24;  // pixels; the next stroke may begin where this one ended

// The place behind `wanted`, or before it if there is no room.
int Beside(double wanted, int size, int room) {
  const int behind = int(wanted) + kAway;
  const int before = int(wanted) - kAway - size;
  return std::clamp(behind + size <= room ? behind : before, 0, std::max(0, room - size));
}

}  // namespace

AcceptButton::AcceptButton(SelectionCanvas* canvas)
    : QPushButton(tr("Accept  ↵"), canvas), canvas_(canvas) {
  setObjectName("acceptHere");
  setToolTip(tr("Find the selection in every view (Enter)"));
  setFocusPolicy(Qt::NoFocus);  // the canvas keeps the keyboard
  setProperty("primary", true);
  setCursor(Qt::ArrowCursor);
  hide();
  canvas->installEventFilter(this);
  connect(canvas, &SelectionCanvas::edited, this, [this] {
    if (!canvas_->IsFinding() && !canvas_->editor().AnyInside()) hide();
  });
}

void AcceptButton::SetPaintable(bool paintable) {
  paintable_ = paintable;
  if (!paintable) hide();
}

void AcceptButton::Offer(const QPointF& at) {
  const bool any = canvas_->IsFinding() || canvas_->editor().AnyInside();
  if (!paintable_ || !any) return hide();
  adjustSize();
  move(Beside(at.x(), width(), canvas_->width()), Beside(at.y(), height(), canvas_->height()));
  show();
}

bool AcceptButton::eventFilter(QObject* object, QEvent* event) {
  const bool presses = event->type() == QEvent::MouseButtonPress;
  if (object == canvas_ && (presses || event->type() == QEvent::MouseButtonRelease)) {
    const auto* mouse = static_cast<QMouseEvent*>(event);
    if (presses) hide();
    if (!presses && mouse->button() == Qt::LeftButton) {
      // After the canvas has handled the event.
      QTimer::singleShot(0, this, [this, at = mouse->position()] { Offer(at); });
    }
  }
  return QPushButton::eventFilter(object, event);
}

}  // namespace retint
