// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/canvas/canvas_overlays.h"

#include <algorithm>
#include <cmath>

#include <QAction>
#include <QApplication>
#include <QHBoxLayout>
#include <QMouseEvent>
#include <QPainter>
#include <QToolButton>

namespace retint {
namespace {

constexpr double kEnd = 8.5, kOtherEnd = 5;  // radii, pixels
const QColor kAxes[] = {{235, 87, 87}, {111, 176, 52}, {64, 140, 245}};

}  // namespace

ViewSwitch::ViewSwitch(const std::vector<QAction*>& actions, QWidget* parent) : QFrame(parent) {
  auto* layout = new QHBoxLayout(this);
  layout->setContentsMargins(3, 3, 3, 3);
  layout->setSpacing(2);
  for (QAction* action : actions) {
    auto* button = new QToolButton;
    button->setDefaultAction(action);
    button->setToolButtonStyle(Qt::ToolButtonIconOnly);
    button->setAutoRaise(true);
    button->setFocusPolicy(Qt::NoFocus);  // each has a key
    const int side = std::max(20, button->fontMetrics().height());
    button->setIconSize({side, side});
    layout->addWidget(button);
  }
}

void ViewSwitch::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.setRenderHint(QPainter::Antialiasing);
  QColor under = palette().color(QPalette::Window);
  under.setAlpha(235);
  painter.setPen(Qt::NoPen);
  painter.setBrush(under);
  painter.drawRoundedRect(rect(), 6, 6);
}

// ---- OrientationGizmo

OrientationGizmo::OrientationGizmo(Canvas* canvas) : QWidget(canvas), canvas_(canvas) {
  setObjectName("orientation_gizmo");
  setAttribute(Qt::WA_Hover);  // paints when the mouse enters and leaves
  setAccessibleName(tr("Orientation"));
  setToolTip(tr("Click an end to look from there; drag to orbit. Z is up"));
  setFixedSize(sizeHint());
  connect(canvas_, &Canvas::cameraChanged, this, qOverload<>(&QWidget::update));
}

std::vector<OrientationGizmo::End> OrientationGizmo::Ends() const {
  const Navigation& navigation = canvas_->navigation();
  const Eigen::Quaterniond rotation = navigation.Rendered().cam_from_world.rotation;
  const Eigen::Matrix3d axes = navigation.Axes();
  const double length = width() / 2.0 - kEnd - 2;
  std::vector<End> ends;
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool positive : {false, true}) {
      const Eigen::Vector3d seen = rotation * axes.col(axis) * (positive ? 1 : -1);
      ends.push_back(
          {axis, positive,
           QPointF(width() / 2.0 + length * seen.x(), height() / 2.0 + length * seen.y()),
           seen.z()});
    }
  }
  std::ranges::sort(ends, [](const End& a, const End& b) { return a.depth > b.depth; });
  return ends;
}

QPointF OrientationGizmo::EndOf(int axis, bool positive) const {
  for (const End& end : Ends()) {
    if (end.axis == axis && end.positive == positive) return end.at;
  }
  return {};
}

std::optional<OrientationGizmo::End> OrientationGizmo::EndAt(QPointF at) const {
  const std::vector<End> ends = Ends();
  for (auto end = ends.rbegin(); end != ends.rend(); ++end) {
    const QPointF from = end->at - at;
    if (std::hypot(from.x(), from.y()) <= kEnd) return *end;
  }
  return std::nullopt;
}

void OrientationGizmo::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.setRenderHint(QPainter::Antialiasing);
  painter.setPen(Qt::NoPen);
  painter.setBrush(QColor(0, 0, 0, underMouse() ? 130 : 80));
  painter.drawEllipse(rect());
  QFont font = this->font();
  font.setBold(true);
  font.setPixelSize(11);
  painter.setFont(font);
  const QPointF middle = QRectF(rect()).center();
  for (const End& end : Ends()) {
    QColor color = kAxes[end.axis];
    if (end.depth > 0) color = color.darker(130);  // behind
    if (end.positive) {
      painter.setPen(QPen(color, 2));
      painter.drawLine(middle, end.at);
      painter.setPen(Qt::NoPen);
      painter.setBrush(color);
      painter.drawEllipse(end.at, kEnd, kEnd);
      painter.setPen(Qt::black);
      painter.drawText(QRectF(end.at - QPointF(kEnd, kEnd), QSizeF(2 * kEnd, 2 * kEnd)),
                       Qt::AlignCenter, QString(QChar('X' + end.axis)));
    } else {
      QColor inside = color;
      inside.setAlpha(110);
      painter.setPen(QPen(color, 1.5));
      painter.setBrush(inside);
      painter.drawEllipse(end.at, kOtherEnd, kOtherEnd);
    }
  }
}

void OrientationGizmo::mousePressEvent(QMouseEvent* event) {
  pressed_ = mouse_ = event->position();
  drags_ = false;
}

void OrientationGizmo::mouseMoveEvent(QMouseEvent* event) {
  if (!(event->buttons() & Qt::LeftButton)) return;
  const QPointF moved = (event->position() - mouse_) * devicePixelRatioF();
  const QPointF all = event->position() - pressed_;
  drags_ = drags_ || std::hypot(all.x(), all.y()) >= QApplication::startDragDistance();
  if (!drags_) return;
  mouse_ = event->position();
  // A turn of the gizmo, not of the picture: a few times as fast.
  constexpr double kFaster = 4;
  canvas_->navigation().Orbit(kFaster * moved.x(), kFaster * moved.y());
  canvas_->CameraMoved();
}

void OrientationGizmo::mouseReleaseEvent(QMouseEvent* event) {
  if (event->button() != Qt::LeftButton || drags_) return;
  const auto end = EndAt(event->position());
  if (!end) return;
  canvas_->navigation().LookFrom(canvas_->navigation().Axes().col(end->axis) *
                                 (end->positive ? 1 : -1));
  canvas_->CameraMoved();
}

}  // namespace retint
