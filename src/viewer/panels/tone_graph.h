// SPDX-License-Identifier: BSD-3-Clause
// Curves or levels in front of the region's histogram. Curves: click to add a point, drag it, press
// Del or double-click to remove it. Levels have three handles below. Arrows move the current point,
// with Shift farther. Page Up and Page Down choose the next.
#pragma once

#include <QWidget>

#include "recolor/tone.h"

namespace retint {

class ToneGraph : public QWidget {
  Q_OBJECT

 public:
  explicit ToneGraph(Tone::Kind kind, QWidget* parent = nullptr);

  const Tone& tone() const { return tone_; }
  void SetTone(const Tone& tone);
  void SetHistogram(std::vector<float> bins);  // each in [0, 1]; empty: unknown
  bool HasHistogram() const { return !bins_.empty(); }
  size_t current() const { return current_; }
  bool CanRemove() const;  // the current point
  void AddPoint();         // by the user, in the widest gap
  void RemovePoint();

  QPointF PlaceOf(TonePoint point) const;  // place of a point of the tone, in the widget
  QSize sizeHint() const override { return {180, 150}; }
  QSize minimumSizeHint() const override { return {120, 110}; }

 Q_SIGNALS:
  void changed(bool dragging);  // tone(), by the user
  void currentChanged();

 protected:
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void mouseDoubleClickEvent(QMouseEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;

 private:
  bool is_levels() const { return tone_.kind == Tone::Kind::kLevels; }
  QRectF Frame() const;  // of the curve
  TonePoint PointAt(QPointF place) const;
  int Nearest(QPointF place, double within) const;  // -1: none
  void SetCurrent(size_t point);
  bool Insert(TonePoint point);  // false: there is no room
  void MoveCurrent(TonePoint to, bool dragging);
  void PaintHistogram(QPainter& painter) const;
  void PaintHandles(QPainter& painter) const;

  Tone tone_;
  std::vector<float> bins_;
  size_t current_ = 0;
  bool dragging_ = false, moved_ = false;  // moved_: during this drag
};

}  // namespace retint
