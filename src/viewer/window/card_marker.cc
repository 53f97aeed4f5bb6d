// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/card_marker.h"

#include <algorithm>
#include <cmath>

#include <QMouseEvent>
#include <QPainter>
#include <QTransform>
#include <QWheelEvent>

#include "viewer/canvas/contrast.h"

namespace retint {
namespace {

constexpr double kGrab = 10;         // pixels around a corner
constexpr double kHandle = 4.5;      // radius
constexpr double kLeastDrag = 3;     // pixels; less is a click
constexpr double kMostZoom = 16;     // widget pixels of a photo's pixel
constexpr double kKeptInSight = 64;  // pixels

Eigen::Vector2d Vector(QPointF point) { return {point.x(), point.y()}; }
Eigen::Vector2d Vector(QSize size) { return {double(size.width()), double(size.height())}; }
QPointF Point(const Eigen::Vector2d& at) { return {at.x(), at.y()}; }

QPolygonF CornersOf(const QRectF& rectangle) {
  return QPolygonF(
      {rectangle.topLeft(), rectangle.topRight(), rectangle.bottomRight(), rectangle.bottomLeft()});
}

// Without a copy of the part: a large photo has 100 MB.
QImage ScaledPart(const QImage& photo, const QRect& part, double scale) {
  const uchar* first = photo.constScanLine(part.top()) + 4 * part.left();
  const QImage image(first, part.width(), part.height(), photo.bytesPerLine(), photo.format());
  const QSize size = (scale * QSizeF(part.size())).toSize().expandedTo({1, 1});
  return image.scaled(size, Qt::IgnoreAspectRatio,
                      scale < 1 ? Qt::SmoothTransformation : Qt::FastTransformation);
}

}  // namespace

CardMarker::CardMarker(QWidget* parent) : QWidget(parent) {
  setMouseTracking(true);
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Expanding);
}

void CardMarker::SetPhoto(const QImage& photo, const QString& text) {
  photo_ = photo;
  text_ = text;
  SetTransform(Fitted());
  SetCard(shape_, {});
}

void CardMarker::SetCard(Shape shape, const QPolygonF& corners) {
  shape_ = shape;
  corners_ = corners;
  dragged_ = -1;
  update();
}

ImageTransform CardMarker::Fitted() const {
  return ImageTransform::Fit(Vector(photo_.size()), Vector(size()));
}

void CardMarker::SetTransform(const ImageTransform& transform) {
  transform_ = transform;
  shown_ = {};
  update();
}

QPointF CardMarker::ToWidget(QPointF in_photo) const {
  return Point(transform_.ToWidget(Vector(in_photo)));
}

QPointF CardMarker::ToPhoto(QPointF in_widget) const {
  const Eigen::Vector2d at = transform_.ToImage(Vector(in_widget));
  return Point(at.array().round().max(0).min(Vector(photo_.size()).array()));
}

int CardMarker::CornerAt(QPointF in_widget) const {
  int nearest = -1;
  double within = kGrab;
  for (int i = 0; i < int(corners_.size()); ++i) {
    const QPointF apart = ToWidget(corners_[i]) - in_widget;
    const double distance = std::hypot(apart.x(), apart.y());
    if (distance <= within) nearest = i, within = distance;
  }
  return nearest;
}

// ---- Drawing

void CardMarker::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.fillRect(rect(), palette().color(QPalette::AlternateBase));
  if (photo_.isNull()) {
    painter.setPen(palette().color(QPalette::PlaceholderText));
    painter.drawText(rect(), Qt::AlignCenter | Qt::TextWordWrap, text_);
    return;
  }
  if (shown_.isNull()) {
    const QRectF all(Point(transform_.ToImage({0, 0})), Point(transform_.ToImage(Vector(size()))));
    const QRect seen = all.toAlignedRect() & photo_.rect();
    shown_ = QPixmap::fromImage(ScaledPart(photo_, seen, transform_.scale * devicePixelRatioF()));
    shown_.setDevicePixelRatio(devicePixelRatioF());
    shown_at_ = ToWidget(seen.topLeft());
  }
  painter.drawPixmap(shown_at_, shown_);
  if (corners_.isEmpty()) return;
  painter.setRenderHint(QPainter::Antialiasing);
  QPolygonF card;
  for (const QPointF& corner : corners_) card << ToWidget(corner);
  const QColor line = ContrastingColor({});
  for (const QPen& pen : {QPen(QColor(0, 0, 0, 160), 4), QPen(line, 2)}) {
    painter.setPen(pen);
    painter.drawPolygon(card);
  }
  if (shape_ == Shape::kPatches && !draws_) PaintPatches(painter, card);
  painter.setPen(QPen(Qt::black, 1));
  painter.setBrush(line);
  for (const QPointF& corner : card) painter.drawEllipse(corner, kHandle, kHandle);
}

// The longer side has six.
void CardMarker::PaintPatches(QPainter& painter, const QPolygonF& card) const {
  QTransform place;
  if (!QTransform::squareToQuad(card, place)) return;
  const auto length = [&](int from, int to) {
    const QPointF side = card[to] - card[from];
    return std::hypot(side.x(), side.y());
  };
  const bool wide = length(0, 1) + length(2, 3) >= length(1, 2) + length(3, 0);
  const int columns = wide ? 6 : 4, rows = wide ? 4 : 6;
  QColor faint = ContrastingColor({});
  faint.setAlpha(150);
  painter.setPen(QPen(faint, 1));
  for (int i = 1; i < columns; ++i) {
    const double x = double(i) / columns;
    painter.drawLine(place.map(QPointF(x, 0)), place.map(QPointF(x, 1)));
  }
  for (int i = 1; i < rows; ++i) {
    const double y = double(i) / rows;
    painter.drawLine(place.map(QPointF(0, y)), place.map(QPointF(1, y)));
  }
}

void CardMarker::resizeEvent(QResizeEvent*) { SetTransform(Fitted()); }

// ---- Mouse

void CardMarker::wheelEvent(QWheelEvent* event) {
  if (photo_.isNull()) return;
  ImageTransform zoomed = transform_;
  const double scale = zoomed.scale * std::pow(1.2, event->angleDelta().y() / 120.0);
  zoomed.ZoomAt(Vector(event->position()), std::min(scale, kMostZoom));
  zoomed.KeepVisible(Vector(photo_.size()), Vector(size()), kKeptInSight);
  const ImageTransform whole = Fitted();
  SetTransform(zoomed.scale > whole.scale ? zoomed : whole);
  event->accept();
}

void CardMarker::mousePressEvent(QMouseEvent* event) {
  if (event->button() != Qt::LeftButton || photo_.isNull()) return;
  before_ = corners_;
  dragged_ = CornerAt(event->position());
  draws_ = dragged_ < 0;
  if (!draws_) return;
  const QPointF at = ToPhoto(event->position());
  corners_ = QPolygonF({at, at, at, at});
  dragged_ = 2;
}

void CardMarker::mouseMoveEvent(QMouseEvent* event) {
  if (dragged_ < 0) {
    return setCursor(CornerAt(event->position()) < 0 ? Qt::CrossCursor : Qt::SizeAllCursor);
  }
  const QPointF to = ToPhoto(event->position());
  corners_[dragged_] = to;
  if (draws_ || shape_ == Shape::kRectangle) {
    // The opposite corner stays.
    const QPointF stays = corners_[(dragged_ + 2) % 4];
    const QPointF beside[] = {{stays.x(), to.y()}, {to.x(), stays.y()}};
    corners_[(dragged_ + 1) % 4] = beside[dragged_ % 2];
    corners_[(dragged_ + 3) % 4] = beside[1 - dragged_ % 2];
  }
  update();
  Q_EMIT changed();
}

void CardMarker::mouseReleaseEvent(QMouseEvent* event) {
  if (event->button() != Qt::LeftButton || dragged_ < 0) return;
  if (draws_) {
    const QRectF drawn = corners_.boundingRect();
    const bool click = transform_.scale * std::min(drawn.width(), drawn.height()) < kLeastDrag;
    corners_ = click ? before_ : CornersOf(drawn);
  }
  dragged_ = -1;
  draws_ = false;
  update();
  Q_EMIT changed();
}

}  // namespace retint
