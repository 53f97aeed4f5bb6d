// SPDX-License-Identifier: BSD-3-Clause
// A color chosen live: a square of saturation and value, a strip of hues, and the numbers. Every
// part can be worked with the keyboard: arrows move, Shift moves further.
#pragma once

#include <QColor>
#include <QImage>
#include <QWidget>

class QLineEdit;
class QSpinBox;

namespace retint {

// Saturation to the right, value upwards, of one hue.
class ColorSquare : public QWidget {
  Q_OBJECT

 public:
  explicit ColorSquare(QWidget* parent = nullptr);
  void SetHue(double hue);                          // [0, 1)
  void SetValues(double saturation, double value);  // [0, 1]
  double saturation() const { return saturation_; }
  double value() const { return value_; }
  QSize sizeHint() const override { return {180, 120}; }
  QSize minimumSizeHint() const override { return {100, 80}; }

 Q_SIGNALS:
  void dragged();   // by the user, still going on
  void released();  // by the user

 protected:
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;

 private:
  void TakeMouse(const QPointF& at);
  QImage picture_;  // of the hue, made when it is painted
  double picture_hue_ = -1;
  double hue_ = 0, saturation_ = 0, value_ = 1;
};

// Hues from left to right.
class HueStrip : public QWidget {
  Q_OBJECT

 public:
  explicit HueStrip(QWidget* parent = nullptr);
  void SetHue(double hue);
  double hue() const { return hue_; }
  QSize sizeHint() const override { return {180, 20}; }
  QSize minimumSizeHint() const override { return {100, 18}; }

 Q_SIGNALS:
  void dragged();
  void released();

 protected:
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;

 private:
  void TakeMouse(const QPointF& at);
  double hue_ = 0;
};

class ColorPicker : public QWidget {
  Q_OBJECT

 public:
  explicit ColorPicker(QWidget* parent = nullptr);

  QColor color() const { return color_; }
  // Shows a color; says nothing. Hue and saturation stay where the color has none.
  void SetColor(const QColor& color);
  bool IsDragging() const { return dragging_; }

  ColorSquare& square() { return *square_; }
  HueStrip& hues() { return *hues_; }

 Q_SIGNALS:
  // By the user; `dragging` while the mouse is down: more is to come.
  void changed(const QColor& color, bool dragging);

 private:
  void FromSquare(bool dragging);
  void FromNumbers();
  void FromText();
  void ShowNumbers();

  QColor color_;
  bool dragging_ = false;
  ColorSquare* square_;
  HueStrip* hues_;
  QSpinBox* channels_[3];
  QLineEdit* text_;
};

}  // namespace retint
