// SPDX-License-Identifier: BSD-3-Clause
// The stops of a gradient on a bar from black to white. Drag a stop, double-click to add one. Del
// removes the current stop, arrows move it, Page Up and Page Down choose the next.
#pragma once

#include <vector>

#include <QColor>
#include <QWidget>

namespace retint {

class GradientBar : public QWidget {
  Q_OBJECT

 public:
  explicit GradientBar(QWidget* parent = nullptr);

  // [stops, 4]: place, red, green, blue, all 0 to 1, places ascending; at least two.
  void SetStops(const std::vector<float>& stops);
  const std::vector<float>& stops() const { return stops_; }
  size_t current() const { return current_; }
  QColor color() const;  // of the current stop
  // Does as if the user had done it.
  void SetColor(const QColor& color, bool dragging);
  void AddStop(double at);  // with the color at that place
  void RemoveStop();        // the current one, if more than two are left
  void Reverse();           // keeps the current stop; without a signal
  bool CanAdd() const;
  bool CanRemove() const { return stops_.size() > 8; }

  QSize sizeHint() const override { return {180, 40}; }
  QSize minimumSizeHint() const override { return {100, 36}; }

 Q_SIGNALS:
  void changed(bool dragging);  // stops(), by the user
  void currentChanged();

 protected:
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void mouseDoubleClickEvent(QMouseEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;

 private:
  size_t count() const { return stops_.size() / 4; }
  double PlaceAt(double x) const;
  double XOf(double place) const;
  void MoveTo(double place);
  void SetCurrent(size_t index);

  std::vector<float> stops_ = {0, 0, 0, 0, 1, 1, 1, 1};
  size_t current_ = 0;
  bool dragging_ = false;
};

}  // namespace retint
