// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/tone_graph.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <QKeyEvent>
#include <QMouseEvent>
#include <QPainter>
#include <QPainterPath>

namespace retint {
namespace {

constexpr double kMargin = 6;    // pixels around the frame, for points on its border
constexpr double kStrip = 14;    // below the frame, for the handles of levels
constexpr double kGrab = 9;      // pixels from a point
constexpr double kRadius = 4.5;  // of a point
constexpr double kStep = 0.01, kFarStep = 0.1;

}  // namespace

ToneGraph::ToneGraph(Tone::Kind kind, QWidget* parent)
    : QWidget(parent), tone_(Tone::Neutral(kind)) {
  setFocusPolicy(Qt::StrongFocus);
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  setCursor(Qt::CrossCursor);
  const bool levels = is_levels();
  setAccessibleName(levels ? tr("Levels") : tr("Curve"));
  setToolTip(levels
                 ? tr("Drag black, middle and white below the histogram of the region (arrows; "
                      "Page Up and Page Down: the next)")
                 : tr("Brightness before at the bottom, after at the left, over the histogram of "
                      "the region. Click to add a point and drag it; Del takes it away (arrows "
                      "move it; Page Up and Page Down: the next)"));
}

void ToneGraph::SetTone(const Tone& tone) {
  tone_ = tone;
  SetCurrent(std::min(current_, tone_.points.size() - 1));
  update();
}

void ToneGraph::SetHistogram(std::vector<float> bins) {
  bins_ = std::move(bins);
  update();
}

QRectF ToneGraph::Frame() const {
  return QRectF(rect()).adjusted(kMargin, kMargin, -kMargin, -kMargin - (is_levels() ? kStrip : 0));
}

QPointF ToneGraph::PlaceOf(TonePoint point) const {
  const QRectF frame = Frame();
  const double x = frame.left() + point.in * frame.width();
  if (is_levels()) return {x, frame.bottom() + kStrip / 2};
  return {x, frame.bottom() - point.out * frame.height()};
}

TonePoint ToneGraph::PointAt(QPointF place) const {
  const QRectF frame = Frame();
  return {(place.x() - frame.left()) / frame.width(),
          (frame.bottom() - place.y()) / frame.height()};
}

int ToneGraph::Nearest(QPointF place, double within) const {
  int nearest = -1;
  for (size_t i = 0; i < tone_.points.size(); ++i) {
    const QPointF from = PlaceOf(tone_.points[i]) - place;
    const double distance = is_levels() ? std::abs(from.x()) : std::hypot(from.x(), from.y());
    if (distance <= within) nearest = int(i), within = distance;
  }
  return nearest;
}

bool ToneGraph::CanRemove() const {
  return !is_levels() && current_ > 0 && current_ + 1 < tone_.points.size();
}

void ToneGraph::SetCurrent(size_t point) {
  if (point == current_) return;
  current_ = point;
  update();
  Q_EMIT currentChanged();
}

bool ToneGraph::Insert(TonePoint point) {
  auto& points = tone_.points;
  const auto at =
      std::ranges::find_if(points, [&](const TonePoint& one) { return one.in > point.in; });
  if (at == points.begin() || at == points.end()) return false;
  const double gap = std::min(at->in - point.in, point.in - std::prev(at)->in);
  if (gap < Tone::kLeastGap || points.size() >= Tone::kMostPoints) return false;
  const auto index = size_t(at - points.begin());
  points.insert(at, {point.in, std::clamp(point.out, 0.0, 1.0)});
  current_ = index;
  update();
  Q_EMIT currentChanged();
  return true;
}

void ToneGraph::AddPoint() {
  const auto& points = tone_.points;
  size_t widest = 1;
  const auto width = [&](size_t i) { return points[i].in - points[i - 1].in; };
  for (size_t i = 2; i < points.size(); ++i) {
    if (width(i) > width(widest)) widest = i;
  }
  const double x = (points[widest].in + points[widest - 1].in) / 2;
  if (Insert({x, tone_.At(x)})) Q_EMIT changed(false);
}

void ToneGraph::RemovePoint() {
  if (!CanRemove()) return;
  tone_.points.erase(tone_.points.begin() + std::ptrdiff_t(current_));
  update();
  Q_EMIT currentChanged();
  Q_EMIT changed(false);
}

void ToneGraph::MoveCurrent(TonePoint to, bool dragging) {
  const Tone old = tone_;
  tone_.Move(current_, to);
  if (tone_ == old) return;
  moved_ = true;
  update();
  Q_EMIT changed(dragging);
}

// ---- Input

void ToneGraph::mousePressEvent(QMouseEvent* event) {
  if (event->button() != Qt::LeftButton) return;
  const double everywhere = std::numeric_limits<double>::max();
  const int nearest = Nearest(event->position(), is_levels() ? everywhere : kGrab);
  moved_ = nearest < 0 && Insert(PointAt(event->position()));
  dragging_ = nearest >= 0 || moved_;
  if (nearest >= 0) return SetCurrent(size_t(nearest));
  if (moved_) Q_EMIT changed(true);
}

void ToneGraph::mouseMoveEvent(QMouseEvent* event) {
  if (!dragging_ || !(event->buttons() & Qt::LeftButton)) return;
  TonePoint to = PointAt(event->position());
  if (is_levels()) to.out = tone_.points[current_].out;
  MoveCurrent(to, true);
}

void ToneGraph::mouseReleaseEvent(QMouseEvent* event) {
  if (event->button() != Qt::LeftButton || !std::exchange(dragging_, false)) return;
  if (moved_) Q_EMIT changed(false);
}

void ToneGraph::mouseDoubleClickEvent(QMouseEvent* event) {
  if (Nearest(event->position(), kGrab) == int(current_)) RemovePoint();
}

void ToneGraph::keyPressEvent(QKeyEvent* event) {
  const double step = event->modifiers() & Qt::ShiftModifier ? kFarStep : kStep;
  const size_t count = tone_.points.size();
  TonePoint to = tone_.points[current_];
  switch (event->key()) {
    case Qt::Key_Left:
      to.in -= step;
      break;
    case Qt::Key_Right:
      to.in += step;
      break;
    case Qt::Key_Up:
      to.out += step;
      break;
    case Qt::Key_Down:
      to.out -= step;
      break;
    case Qt::Key_PageUp:
      return SetCurrent((current_ + count - 1) % count);
    case Qt::Key_PageDown:
      return SetCurrent((current_ + 1) % count);
    case Qt::Key_Delete:
      return RemovePoint();
    default:
      return QWidget::keyPressEvent(event);
  }
  MoveCurrent(to, false);
}

// ---- Drawing

void ToneGraph::PaintHistogram(QPainter& painter) const {
  if (bins_.empty()) return;
  const QRectF frame = Frame();
  QPainterPath path(frame.bottomLeft());
  const double width = frame.width() / double(bins_.size());
  for (size_t i = 0; i < bins_.size(); ++i) {
    // The square root shows rare colors too.
    const double y = frame.bottom() - std::sqrt(double(bins_[i])) * frame.height();
    path.lineTo(frame.left() + double(i) * width, y);
    path.lineTo(frame.left() + double(i + 1) * width, y);
  }
  path.lineTo(frame.bottomRight());
  QColor color = palette().color(QPalette::Text);
  color.setAlpha(70);
  painter.fillPath(path, color);
}

void ToneGraph::PaintHandles(QPainter& painter) const {
  const QColor accent = palette().color(QPalette::Highlight);
  for (size_t i = 0; i < tone_.points.size(); ++i) {
    const QPointF at = PlaceOf(tone_.points[i]);
    const bool chosen = i == current_ && hasFocus();
    painter.setPen(QPen(chosen ? accent : palette().color(QPalette::Text), chosen ? 2 : 1.2));
    if (is_levels()) {
      const int gray = i == 0 ? 0 : i == 1 ? 128 : 255;
      painter.setBrush(QColor(gray, gray, gray));
      painter.drawPolygon(QPolygonF({at + QPointF(0, -kStrip / 2), at + QPointF(5.5, kStrip / 2),
                                     at + QPointF(-5.5, kStrip / 2)}));
    } else {
      painter.setBrush(i == current_ ? accent : palette().color(QPalette::Base));
      painter.drawEllipse(at, kRadius, kRadius);
    }
  }
}

void ToneGraph::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  const QRectF frame = Frame();
  painter.fillRect(frame, palette().color(QPalette::Base));
  PaintHistogram(painter);
  QColor line = palette().color(QPalette::Text);
  line.setAlpha(40);
  painter.setPen(QPen(line, 1));
  for (const double share : {0.25, 0.5, 0.75}) {
    const double x = frame.left() + share * frame.width(), y = frame.top() + share * frame.height();
    painter.drawLine(QPointF(x, frame.top()), QPointF(x, frame.bottom()));
    painter.drawLine(QPointF(frame.left(), y), QPointF(frame.right(), y));
  }
  painter.drawRect(frame);
  painter.setRenderHint(QPainter::Antialiasing);
  painter.drawLine(frame.bottomLeft(), frame.topRight());
  QPolygonF curve;
  for (int i = 0; i <= int(frame.width()); ++i) {
    const double in = i / frame.width();
    curve << QPointF(frame.left() + i, frame.bottom() - tone_.At(in) * frame.height());
  }
  painter.setPen(QPen(palette().color(QPalette::Highlight), 2));
  painter.setBrush(Qt::NoBrush);
  painter.drawPolyline(curve);
  PaintHandles(painter);
}

}  // namespace retint
