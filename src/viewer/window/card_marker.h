// SPDX-License-Identifier: BSD-3-Clause
// A photo in which the user marks a card: a drag draws a rectangle, a drag of a corner moves that
// corner, the wheel zooms.
#pragma once

#include <QImage>
#include <QPixmap>
#include <QPolygonF>
#include <QWidget>

#include "viewer/selection/image_transform.h"

namespace retint {

class CardMarker : public QWidget {
  Q_OBJECT

 public:
  enum class Shape {
    kRectangle,  // stays one when a corner moves
    kPatches     // any four corners, with a grid of 6 x 4 patches inside
  };

  explicit CardMarker(QWidget* parent = nullptr);

  // Forgets the card. `photo`: QImage::Format_RGB32; null: `text` shows instead.
  void SetPhoto(const QImage& photo, const QString& text = {});
  const QImage& photo() const { return photo_; }
  void SetCard(Shape shape, const QPolygonF& corners);
  // Four, in turn, in pixels of the photo; empty: not marked.
  const QPolygonF& corners() const { return corners_; }

  QPointF ToWidget(QPointF in_photo) const;
  QSize sizeHint() const override { return {560, 400}; }
  QSize minimumSizeHint() const override { return {240, 180}; }

 Q_SIGNALS:
  void changed();  // corners(), by the user

 protected:
  void paintEvent(QPaintEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;

 private:
  QPointF ToPhoto(QPointF in_widget) const;  // the nearest corner of a pixel
  int CornerAt(QPointF in_widget) const;     // -1: none
  ImageTransform Fitted() const;
  void SetTransform(const ImageTransform& transform);
  void PaintPatches(QPainter& painter, const QPolygonF& card) const;

  QImage photo_;
  QPixmap shown_;  // the part of the photo in the widget; null: to be scaled
  QPointF shown_at_;
  QString text_;
  ImageTransform transform_;
  Shape shape_ = Shape::kRectangle;
  QPolygonF corners_, before_;  // before_: the drag
  int dragged_ = -1;            // corner; -1: none
  bool draws_ = false;          // the drag draws a new rectangle
};

}  // namespace retint
