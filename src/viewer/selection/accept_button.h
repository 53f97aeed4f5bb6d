// SPDX-License-Identifier: BSD-3-Clause
// Accept, beside the end of the stroke: the step that comes next, where the eye is.
#pragma once

#include <QPushButton>

namespace retint {

class SelectionCanvas;

class AcceptButton : public QPushButton {
  Q_OBJECT

 public:
  explicit AcceptButton(SelectionCanvas* canvas);  // its parent
  // Whether strokes are taken now; the button hides where not.
  void SetPaintable(bool paintable);

 protected:
  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  void Offer(const QPointF& at);

  SelectionCanvas* canvas_;
  bool paintable_ = false;
};

}  // namespace retint
