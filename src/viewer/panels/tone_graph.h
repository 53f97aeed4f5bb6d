// SPDX-License-Identifier: BSD-3-Clause
// Curves or levels to drag, before the histogram of the region. Curves: click to add a point, drag
// it, Del or a double-click takes it away. Levels: three handles below. Arrows move the current
// point, Shift further; Page Up and Page Down go to the next.
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
  void SetHistogram(std::vector<float> bins);  // each in [0, 1]; empty: not known
  bool HasHistogram() const { return !bins_.empty(); }
  size_t current() const { return current_; }
  bool CanRemove() const;  // the current point
  void AddPoint();         // in the widest gap, by the user
  void RemovePoint();

  QPointF PlaceOf(TonePoint point) const;  // in the widget, of a point of the tone
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
  bool Insert(TonePoint point);  // false: no room for it
  void MoveCurrent(TonePoint to, bool dragging);
  void PaintHistogram(QPainter& painter) const;
  void PaintHandles(QPainter& painter) const;

  Tone tone_;
  std::vector<float> bins_;
  size_t current_ = 0;
  bool dragging_ = false, moved_ = false;  // moved_: while it was dragged
};

}  // namespace retint
