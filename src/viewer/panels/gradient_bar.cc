// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/gradient_bar.h"

#include <algorithm>
#include <cmath>

#include <QKeyEvent>
#include <QMouseEvent>
#include <QPainter>

#include "viewer/panels/operation_views.h"

namespace retint {
namespace {

constexpr double kGap = 0.01;   // between neighbors
constexpr double kMargin = 7;   // pixels beside the bar, for half a handle
constexpr double kHandle = 12;  // its height and width, below the bar
constexpr size_t kMostStops = 16;

}  // namespace

GradientBar::GradientBar(QWidget* parent) : QWidget(parent) {
  setFocusPolicy(Qt::StrongFocus);
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  setAccessibleName(tr("Gradient"));
  setToolTip(tr(
      "From dark to light. Drag a stop (or arrows; Shift: further), double-click to add one, Del "
      "takes it away, Page Up and Page Down go to the next"));
}

void GradientBar::SetStops(const std::vector<float>& stops) {
  if (dragging_ || stops.size() < 8) return;
  stops_ = stops;
  if (current_ >= count()) SetCurrent(count() - 1);
  update();
}

void GradientBar::SetCurrent(size_t index) {
  current_ = index;
  update();
  Q_EMIT currentChanged();
}

QColor GradientBar::color() const { return ToColor({&stops_[4 * current_ + 1], 3}); }

void GradientBar::SetColor(const QColor& color, bool dragging) {
  float* stop = &stops_[4 * current_];
  stop[1] = color.redF(), stop[2] = color.greenF(), stop[3] = color.blueF();
  update();
  Q_EMIT changed(dragging);
}

bool GradientBar::CanAdd() const { return count() < kMostStops; }

void GradientBar::AddStop(double at) {
  if (!CanAdd()) return;
  ColorOperation gradient;
  gradient.kind = ColorOperationKind::kGradient;
  gradient.values = stops_;
  // The color of the gradient for a gray of that lightness.
  const QColor here = Edited({{gradient}, 1}, GrayOf(at));
  size_t next = 0;
  while (next < count() && double(stops_[4 * next]) < at) ++next;
  const double low = next == 0 ? -kGap : double(stops_[4 * next - 4]);
  const double high = next == count() ? 1 + kGap : double(stops_[4 * next]);
  if (high - low < 2 * kGap) return;  // no room in between
  const auto place = float(std::clamp(at, low + kGap, high - kGap));
  const float stop[4] = {place, here.redF(), here.greenF(), here.blueF()};
  stops_.insert(stops_.begin() + std::ptrdiff_t(4 * next), stop, stop + 4);
  SetCurrent(next);
  Q_EMIT changed(false);
}

void GradientBar::Reverse() {
  std::vector<float> reversed;
  for (size_t i = stops_.size(); i >= 4; i -= 4) {
    reversed.push_back(1 - stops_[i - 4]);
    reversed.insert(reversed.end(), stops_.begin() + std::ptrdiff_t(i - 3),
                    stops_.begin() + std::ptrdiff_t(i));
  }
  current_ = count() - 1 - current_;
  SetStops(reversed);
}

void GradientBar::RemoveStop() {
  if (!CanRemove()) return;
  const auto first = stops_.begin() + std::ptrdiff_t(4 * current_);
  stops_.erase(first, first + 4);
  SetCurrent(std::min(current_, count() - 1));
  Q_EMIT changed(false);
}

// Moves the current stop, at most to its neighbors.
void GradientBar::MoveTo(double place) {
  const double low = current_ == 0 ? 0 : double(stops_[4 * current_ - 4]) + kGap;
  const double high = current_ + 1 == count() ? 1 : double(stops_[4 * current_ + 4]) - kGap;
  if (low <= high) stops_[4 * current_] = float(std::clamp(place, low, high));
  update();
}

double GradientBar::XOf(double place) const { return kMargin + place * (width() - 2 * kMargin); }

double GradientBar::PlaceAt(double x) const {
  return std::clamp((x - kMargin) / std::max(1.0, width() - 2 * kMargin), 0.0, 1.0);
}

void GradientBar::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  const QRectF bar(kMargin, 1, width() - 2 * kMargin, height() - kHandle - 3);
  ColorOperation gradient;
  gradient.kind = ColorOperationKind::kGradient;
  gradient.values = stops_;
  const ColorEdit edit{{gradient}, 1};
  QLinearGradient shown(bar.topLeft(), bar.topRight());
  constexpr int kShown = 32;
  const CompiledEdit compiled(edit);
  for (int i = 0; i <= kShown; ++i) {
    const double at = double(i) / kShown;
    const QColor gray = GrayOf(at);
    const Eigen::Vector3f color =
        compiled.Apply(Eigen::Vector3f(gray.redF(), gray.greenF(), gray.blueF()));
    shown.setColorAt(at, ToColor({color.data(), 3}));
  }
  painter.fillRect(bar, shown);
  painter.setPen(palette().color(hasFocus() ? QPalette::Highlight : QPalette::Mid));
  painter.drawRect(bar);
  painter.setRenderHint(QPainter::Antialiasing);
  for (size_t i = 0; i < count(); ++i) {
    const double x = XOf(double(stops_[4 * i])), top = bar.bottom() + 1;
    const bool current = i == current_;
    painter.setPen(
        QPen(palette().color(current ? QPalette::Highlight : QPalette::Text), current ? 2.5 : 1));
    painter.setBrush(ToColor({&stops_[4 * i + 1], 3}));
    painter.drawPolygon(QPolygonF({{x, top},
                                   {x + kHandle / 2, top + kHandle / 2},
                                   {x + kHandle / 2, top + kHandle - 1},
                                   {x - kHandle / 2, top + kHandle - 1},
                                   {x - kHandle / 2, top + kHandle / 2}}));
  }
}

void GradientBar::mousePressEvent(QMouseEvent* event) {
  if (event->button() != Qt::LeftButton) return;
  const double x = event->position().x();
  size_t nearest = 0;
  for (size_t i = 1; i < count(); ++i) {
    if (std::abs(XOf(double(stops_[4 * i])) - x) < std::abs(XOf(double(stops_[4 * nearest])) - x)) {
      nearest = i;
    }
  }
  SetCurrent(nearest);
  dragging_ = std::abs(XOf(double(stops_[4 * nearest])) - x) <= kHandle;
}

void GradientBar::mouseMoveEvent(QMouseEvent* event) {
  if (!dragging_) return;
  MoveTo(PlaceAt(event->position().x()));
  Q_EMIT changed(true);
}

void GradientBar::mouseReleaseEvent(QMouseEvent* event) {
  if (event->button() != Qt::LeftButton || !dragging_) return;
  dragging_ = false;
  Q_EMIT changed(false);
}

void GradientBar::mouseDoubleClickEvent(QMouseEvent* event) {
  if (event->button() == Qt::LeftButton) AddStop(PlaceAt(event->position().x()));
}

void GradientBar::keyPressEvent(QKeyEvent* event) {
  const double step = event->modifiers() & Qt::ShiftModifier ? 0.1 : 0.01;
  const double here = double(stops_[4 * current_]);
  switch (event->key()) {
    case Qt::Key_Left:
      MoveTo(here - step);
      return Q_EMIT changed(false);
    case Qt::Key_Right:
      MoveTo(here + step);
      return Q_EMIT changed(false);
    case Qt::Key_PageUp:
      return SetCurrent((current_ + count() - 1) % count());
    case Qt::Key_PageDown:
      return SetCurrent((current_ + 1) % count());
    case Qt::Key_Delete:
      return RemoveStop();
    default:
      return QWidget::keyPressEvent(event);
  }
}

}  // namespace retint
