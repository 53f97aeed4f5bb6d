// SPDX-License-Identifier: BSD-3-Clause
// A widget to choose a color live: an area at one hue, a strip of hues, numbers, earlier colors,
// and an eyedropper. All parts work with the keyboard: arrows move the mark, with Shift they move
// it farther.
#pragma once

#include <QColor>
#include <QImage>
#include <QTimer>
#include <QWidget>

#include "viewer/panels/color_models.h"

class QButtonGroup;
class QGridLayout;
class QLineEdit;
class QSpinBox;
class QToolButton;

namespace retint {

class SwatchRow;

// The colors of one hue; ColorModel says which value is to the right, and which is up. Places
// without a color are hatched.
class ColorSquare : public QWidget {
  Q_OBJECT

 public:
  explicit ColorSquare(QWidget* parent = nullptr);
  void SetModel(const ColorModel& model);
  void SetPlace(const ColorPlace& place);
  const ColorPlace& place() const { return place_; }
  QSize sizeHint() const override { return {180, 120}; }
  QSize minimumSizeHint() const override { return {100, 80}; }

 Q_SIGNALS:
  void dragged();   // by the user, who still drags
  void released();  // by the user

 protected:
  void changeEvent(QEvent* event) override;
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;

 private:
  void TakeMouse(const QPointF& at);
  void Draw();
  const ColorModel* model_;
  QImage picture_;  // of the hue, made on demand
  double picture_hue_ = -1;
  ColorPlace place_;
};

// Hues from left to right.
class HueStrip : public QWidget {
  Q_OBJECT

 public:
  explicit HueStrip(QWidget* parent = nullptr);
  void SetModel(const ColorModel& model);
  void SetHue(double hue);  // [0, 1)
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
  const ColorModel* model_;
  double hue_ = 0;
};

class ColorPicker : public QWidget {
  Q_OBJECT

 public:
  explicit ColorPicker(QWidget* parent = nullptr);

  QColor color() const { return color_; }
  // Shows a color, without a signal. If it has no hue or saturation, these do not change.
  void SetColor(const QColor& color);
  // Does as if the user had chosen it.
  void Choose(const QColor& color);
  void SetCanPick(bool can);  // whether the owner can answer pickWanted()

  ColorSquare& square() { return *square_; }
  HueStrip& hues() { return *hues_; }

 Q_SIGNALS:
  // By the user. `dragging`: the mouse is down and more changes will follow.
  void changed(const QColor& color, bool dragging);
  void pickWanted();  // a color of the picture

 private:
  void BuildTop(QGridLayout* layout);
  void SetModel(int index);
  void Place(const QColor& color);
  void FromSquare(bool dragging);
  void FromNumbers();
  void FromText();
  void ShowNumbers();
  void Changed(bool dragging);

  QColor color_;
  bool dragging_ = false;
  int model_ = 0;  // of ColorModels()
  QButtonGroup* models_;
  QToolButton* pipette_;
  ColorSquare* square_;
  HueStrip* hues_;
  QSpinBox* channels_[3];
  QLineEdit* text_;
  SwatchRow *recent_, *swatches_;
  QTimer rest_;  // before a chosen color becomes a recent one
};

}  // namespace retint
