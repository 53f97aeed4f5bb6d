// SPDX-License-Identifier: BSD-3-Clause
// Controls over the corner of the canvas, for its contents and the point of view.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include <QFrame>
#include <QPointF>

#include "viewer/canvas/canvas.h"

class QAction;

namespace retint {

// Buttons side by side, one for each action.
class ViewSwitch : public QFrame {
  Q_OBJECT

 public:
  ViewSwitch(const std::vector<QAction*>& actions, QWidget* parent);

 protected:
  void paintEvent(QPaintEvent* event) override;
};

// The scene's axes from the camera: Z is up, X and Y are level. A click on an end looks from there,
// a drag orbits.
class OrientationGizmo : public QWidget {
  Q_OBJECT

 public:
  explicit OrientationGizmo(Canvas* canvas);
  // Where the end of an axis (0 to 2) lies in the widget.
  QPointF EndOf(int axis, bool positive) const;
  QSize sizeHint() const override { return {76, 76}; }

 protected:
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;

 private:
  struct End {
    int axis;
    bool positive;
    QPointF at;
    double depth;  // along the camera's axis; positive: away from it
  };
  std::vector<End> Ends() const;  // the farthest first
  std::optional<End> EndAt(QPointF at) const;

  Canvas* canvas_;
  QPointF pressed_, mouse_;
  bool drags_ = false;
};

}  // namespace retint
