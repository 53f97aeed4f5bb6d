// SPDX-License-Identifier: BSD-3-Clause
// The canvas's drawing on and around the rendered picture.
#include <algorithm>
#include <cmath>

#include <QPainter>
#include <QPainterPath>

#include "scene/camera_projection.h"
#include "viewer/canvas/canvas.h"

namespace retint {
namespace {

const QColor kSurround(30, 31, 34);
const QColor kLine(255, 255, 255, 170);
const QColor kAccent(255, 170, 0);
constexpr double kSmallestQuad = 5;  // pixels; below, a frustum is not drawn
constexpr double kAboutText = 8;     // pixels beside the text of a label

// Returns the box about the text.
QRectF DrawLabel(QPainter& painter, const QPointF& at, const QString& text, Qt::Alignment align) {
  const QFontMetricsF metrics(painter.font());
  QRectF box = metrics.boundingRect(text).adjusted(-kAboutText, -4, kAboutText, 4);
  box.moveTopLeft(align & Qt::AlignRight ? at - QPointF(box.width(), 0) : at);
  painter.setPen(Qt::NoPen);
  painter.setBrush(QColor(0, 0, 0, 160));
  painter.drawRoundedRect(box, 4, 4);
  painter.setPen(Qt::white);
  painter.drawText(box, Qt::AlignCenter, text);
  return box;
}

}  // namespace

QRectF Canvas::ImageRect(const PosedCamera& camera) const {
  const double ratio = devicePixelRatioF();
  const double w = camera.camera.width / ratio, h = camera.camera.height / ratio;
  return {(width() - w) / 2, (height() - h) / 2, w, h};
}

std::shared_ptr<const LensPicture> Canvas::Lens() const {
  const UserPicture* shown = picture();
  if (!shown) return nullptr;
  const Camera camera = navigation_.Rendered().camera;
  return controller_->facts()->Lens(*shown, camera.width, camera.height);
}

std::array<Eigen::Vector3d, 4> Canvas::CornersOf(const UserPicture& picture) const {
  const auto facts = controller_->facts();
  if (picture.faces.size() > 1) {
    // A picture of all directions has no corners: a board of the photo's shape, 90 degrees wide.
    const double half = double(picture.height) / picture.width;
    return {{{-1, -half, 1}, {1, -half, 1}, {1, half, 1}, {-1, half, 1}}};
  }
  const Camera camera = facts->Shown(picture).camera;
  const Camera flat = facts->Posed(*picture.faces.front()).camera;
  std::optional<CameraProjection> lens;
  if (!camera.IsPinhole()) lens.emplace(camera);
  std::array<Eigen::Vector3d, 4> corners;
  for (size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d share(i == 1 || i == 2, i >= 2);
    const auto pixel = [&](const Camera& of) -> Eigen::Vector2d {
      return share.cwiseProduct(Eigen::Vector2d(of.width, of.height));
    };
    const auto ray = lens ? lens->CamFromImg(pixel(camera)) : std::nullopt;
    // If a corner of the photo has no ray, that of the pinhole view.
    corners[i] = ray && ray->z() > 0 ? ray->hnormalized().homogeneous().eval()
                                     : flat.CamFromImg(pixel(flat)).value().homogeneous().eval();
  }
  return corners;
}

std::vector<Canvas::Frustum> Canvas::Frusta() const {
  std::vector<Frustum> frusta;
  const auto facts = controller_->facts();
  if (!facts) return frusta;
  const PosedCamera shown = navigation_.Rendered();
  std::optional<CameraProjection> lens;
  if (!shown.camera.IsPinhole()) lens.emplace(shown.camera);
  const QRectF rect = ImageRect(shown);
  const double ratio = devicePixelRatioF();
  const double near = 0.3 * frustum_size_;
  for (const UserPicture& picture : facts->pictures->all()) {
    const View* view = picture.faces.front();
    if (view == navigation_.view()) continue;
    const PosedCamera posed = facts->Shown(picture);
    const Eigen::Vector3d center = shown.cam_from_world * posed.Center();
    if (center.z() < near) continue;
    Frustum frustum{&picture, {}, {}, center.z()};
    bool inside = true;
    const auto project = [&](const Eigen::Vector3d& point) {
      const Eigen::Vector3d in_cam = shown.cam_from_world * point;
      const auto seen = lens ? lens->ImgFromCam(in_cam) : shown.camera.ImgFromCam(in_cam);
      if (!seen || in_cam.z() < near) {
        inside = false;
        return QPointF();
      }
      return rect.topLeft() + QPointF(seen->x(), seen->y()) / ratio;
    };
    frustum.apex = project(posed.Center());
    const std::array<Eigen::Vector3d, 4>& corners = corners_.at(view->camera_id);
    for (size_t i = 0; i < 4; ++i) {
      frustum.corners[i] = project(posed.cam_from_world.Inverse() * (frustum_size_ * corners[i]));
    }
    if (!inside) continue;
    const QRectF box = QPolygonF({frustum.apex, frustum.corners[0], frustum.corners[1],
                                  frustum.corners[2], frustum.corners[3]})
                           .boundingRect();
    if (!box.intersects(QRectF(this->rect())) ||
        std::max(box.width(), box.height()) < kSmallestQuad) {
      continue;
    }
    frusta.push_back(frustum);
  }
  std::sort(frusta.begin(), frusta.end(),
            [](const Frustum& a, const Frustum& b) { return a.depth > b.depth; });
  return frusta;
}

const UserPicture* Canvas::FrustumAt(const QPointF& at) const {
  const auto frusta = Frusta();
  for (auto it = frusta.rbegin(); it != frusta.rend(); ++it) {
    const auto& c = it->corners;
    if (QPolygonF({c[0], c[1], c[2], c[3]}).containsPoint(at, Qt::OddEvenFill)) return it->picture;
  }
  return nullptr;
}

void Canvas::PaintFrusta(QPainter& painter) const {
  painter.save();
  painter.setRenderHints(QPainter::Antialiasing | QPainter::SmoothPixmapTransform);
  for (const Frustum& frustum : Frusta()) {
    const QPolygonF quad(
        {frustum.corners[0], frustum.corners[1], frustum.corners[2], frustum.corners[3]});
    const std::string& name = frustum.picture->name;
    QImage picture = photos_->Thumbnail(name);
    if (const auto board = boards_.find(name); picture.isNull() && board != boards_.end()) {
      picture = board->second;
    }
    QTransform transform;
    const double w = picture.width(), h = picture.height();
    if (!picture.isNull() &&
        QTransform::quadToQuad(QPolygonF({{0, 0}, {w, 0}, {w, h}, {0, h}}), quad, transform)) {
      painter.save();
      painter.setTransform(transform, true);
      painter.setOpacity(0.85);
      painter.drawImage(QPointF(0, 0), picture);
      painter.restore();
    }
    painter.setPen(QPen(kLine, 1));
    painter.setBrush(Qt::NoBrush);
    painter.drawPolygon(quad);
    for (const QPointF& corner : frustum.corners) painter.drawLine(frustum.apex, corner);
  }
  painter.restore();
}

void Canvas::PaintSplit(QPainter& painter, const QRectF& rect) const {
  const double x = rect.left() + split_at_ * rect.width();
  painter.save();
  painter.setClipRect(QRectF(rect.topLeft(), QPointF(x, rect.bottom())));
  painter.drawImage(rect, frame_->before);
  painter.restore();
  painter.setRenderHint(QPainter::Antialiasing);
  painter.setPen(QPen(QColor(0, 0, 0, 140), 4));
  painter.drawLine(QPointF(x, rect.top()), QPointF(x, rect.bottom()));
  painter.setPen(QPen(Qt::white, 2));
  painter.drawLine(QPointF(x, rect.top()), QPointF(x, rect.bottom()));
  // The grip: two arrows in a disc.
  const QPointF middle(x, rect.center().y());
  painter.setBrush(Qt::white);
  painter.setPen(QPen(QColor(0, 0, 0, 140), 1));
  painter.drawEllipse(middle, 13, 13);
  painter.setPen(Qt::NoPen);
  painter.setBrush(QColor(60, 60, 60));
  for (const double side : {-1.0, 1.0}) {
    painter.drawPolygon(QPolygonF({middle + QPointF(side * 9, 0), middle + QPointF(side * 3, -5),
                                   middle + QPointF(side * 3, 5)}));
  }
  const double bottom = rect.bottom() - 32;
  DrawLabel(painter, {x - 12, bottom}, tr("before"), Qt::AlignRight);
  DrawLabel(painter, {x + 12, bottom}, tr("after"), Qt::AlignLeft);
}

void Canvas::PaintLabels(QPainter& painter) const {
  painter.setRenderHint(QPainter::Antialiasing);
  const QRectF rect = ImageRect(navigation_.Rendered());
  const UserPicture* shown = picture();
  const double top = std::max(0.0, rect.top()) + 10, left = std::max(0.0, rect.left()) + 10;
  QString mode;
  if (picking_) {
    mode = tr("pick a color");
  } else if (showing_photo()) {
    mode = tr("photo");
  } else if (lacks_photo()) {
    mode = tr("no photo");
  } else if (original_) {
    mode = tr("before the edits");
  } else if (what_ == RenderWhat::kDepth) {
    mode = tr("depth");
  } else if (fly_mode_) {
    mode = tr("fly");
  }
  constexpr double kControls = 200;        // the room of those at the right
  const double end = width() - kControls;  // of the room for the name
  const QString title = shown ? QString::fromStdString(shown->name) : tr("free camera");
  const QString fitting =
      QFontMetricsF(painter.font()).elidedText(title, Qt::ElideMiddle, end - left - 2 * kAboutText);
  QRectF last = DrawLabel(painter, {left, top}, fitting, Qt::AlignLeft);
  for (const QString& note : {mode, CloudNote()}) {
    if (note.isEmpty()) continue;
    last = DrawLabel(painter, last.bottomLeft() + QPointF(0, 6), note, Qt::AlignLeft);
  }
}

// The color that a click would take, beside the cursor.
void Canvas::PaintPicked(QPainter& painter) const {
  const QColor color = ColorAt(mouse_);
  if (!color.isValid()) return;
  constexpr int kSide = 34;
  const double x = mouse_.x() + 16 + kSide > width() ? mouse_.x() - 16 - kSide : mouse_.x() + 16;
  const double y = mouse_.y() + 16 + kSide > height() ? mouse_.y() - 16 - kSide : mouse_.y() + 16;
  painter.setPen(QPen(Qt::white, 3));
  painter.setBrush(color);
  painter.drawRoundedRect(QRectF(x, y, kSide, kSide), 4, 4);
  painter.setPen(QPen(Qt::black, 1));
  painter.setBrush(Qt::NoBrush);
  painter.drawRoundedRect(QRectF(x, y, kSide, kSide), 4, 4);
}

void Canvas::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.fillRect(rect(), kSurround);
  if (!frame_) return;
  const QRectF area = ImageRect(frame_->camera);
  // Smooth only where pixels do not map one to one.
  painter.setRenderHint(QPainter::SmoothPixmapTransform, frame_->scale != 1);
  if (showing_photo()) {
    painter.setRenderHint(QPainter::SmoothPixmapTransform);
    painter.drawImage(ImageRect(navigation_.Rendered()), photos_->Photo(picture()->name));
  } else {
    painter.drawImage(area, frame_->image);
    if (ShowsSplit() && !frame_->before.isNull()) PaintSplit(painter, area);
    if (frusta_) PaintFrusta(painter);
  }
  PaintLabels(painter);
  if (picking_) PaintPicked(painter);
}

}  // namespace retint
