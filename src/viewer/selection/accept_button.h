// SPDX-License-Identifier: BSD-3-Clause
// A button to accept, near the end of the stroke, where the user looks.
#pragma once

#include <QPushButton>

namespace retint {

class SelectionCanvas;

class AcceptButton : public QPushButton {
  Q_OBJECT

 public:
  explicit AcceptButton(SelectionCanvas* canvas);  // its parent
  // Whether strokes are accepted now; otherwise the button hides.
  void SetPaintable(bool paintable);

 protected:
  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  void Offer(const QPointF& at);

  SelectionCanvas* canvas_;
  bool paintable_ = false;
};

}  // namespace retint
