// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/canvas/canvas.h"

#include <algorithm>
#include <cmath>

#include <QApplication>
#include <QContextMenuEvent>
#include <QKeyEvent>
#include <QMouseEvent>
#include <QWheelEvent>

namespace retint {
namespace {

constexpr int kRestMs = 90;          // without a movement, before the sharp frame is asked for
constexpr int kNewsMs = 250;         // between frames that only show the optimizer's progress
constexpr int kFlyMs = 15;           // between steps of flying
constexpr double kHatchPixels = 10;  // between the lines
constexpr double kSplitGrab = 8;     // pixels to either side of the line

}  // namespace

Canvas::Canvas(SceneController* controller, RenderThread* renderer, PhotoLoader* photos,
               QWidget* parent)
    : QWidget(parent), controller_(controller), renderer_(renderer), photos_(photos) {
  setFocusPolicy(Qt::StrongFocus);
  setMouseTracking(true);
  setAttribute(Qt::WA_OpaquePaintEvent);
  setMinimumSize(160, 120);
  setAccessibleName(tr("Scene"));
  rest_.setSingleShot(true);
  rest_.setInterval(kRestMs);
  connect(&rest_, &QTimer::timeout, this, [this] {
    if (!IsSharp()) return Request(false);
    moving_ = false;
    since_frame_.invalidate();
  });
  news_.setSingleShot(true);
  news_.setInterval(kNewsMs);
  connect(&news_, &QTimer::timeout, this, [this] {
    if (std::exchange(more_news_, false)) Request(moving_);
  });
  fly_.setInterval(kFlyMs);
  connect(&fly_, &QTimer::timeout, this, &Canvas::FlyStep);
  connect(controller_, &SceneController::opened, this, &Canvas::OnScene);
  connect(controller_, &SceneController::closed, this, &Canvas::OnScene);
  connect(&controller_->colors(), &SceneColors::shChanged, this, &Canvas::OnSh);
  connect(renderer_, &RenderThread::frameReady, this, &Canvas::OnFrame);
  connect(renderer_, &RenderThread::probed, this, &Canvas::OnProbed);
  connect(photos_, &PhotoLoader::thumbnailReady, this, [this] {
    if (frusta_) update();
  });
  connect(photos_, &PhotoLoader::photoReady, this, [this] {
    if (!photo_) return;
    SayMissingPhoto();
    update();
  });
}

void Canvas::OnScene() {
  frame_.reset();
  cloud_.reset();
  flying_.clear();
  photo_ = original_ = picking_ = false;
  frame_seconds_ = 0;
  const auto facts = facts_ = controller_->facts();
  photos_->SetScene(facts);
  renderer_->SetScene(facts);
  if (facts) {
    navigation_.SetScene(facts->workspace->reconstruction);
    const std::vector<UserPicture>& pictures = facts->pictures->all();
    if (!pictures.empty()) {
      const UserPicture& first = pictures.front();
      navigation_.SetHome(*first.faces.front(), facts->Shown(first));
    }
    const std::vector<const View*> standpoints = facts->Standpoints();
    double sum = 0;
    for (const View* view : standpoints) {
      sum += (view->cam_from_world.OriginInSource() - navigation_.center()).norm();
    }
    frustum_size_ = 0.07 * sum / static_cast<double>(std::max<size_t>(1, standpoints.size()));
    corners_.clear();
    boards_.clear();
    for (const UserPicture& picture : pictures) {
      const CameraId camera = picture.faces.front()->camera_id;
      if (!corners_.contains(camera)) corners_[camera] = CornersOf(picture);
    }
    UpdateViewport();
    Request(false);
    Q_EMIT cameraChanged();
  }
  update();
}

void Canvas::OnSh() {
  if (!controller_->IsOpen() || original_) return;
  if (controller_->colors().optimizer().Active()) {
    // Sharp at once, but not so often that rendering slows the optimizer down.
    if (news_.isActive()) {
      more_news_ = true;
    } else {
      Request(moving_);
      news_.start();
    }
    return;
  }
  // A color that is being dragged wants an answer soon.
  Request(true);
  rest_.start();
}

void Canvas::UpdateViewport() {
  const double ratio = devicePixelRatioF();
  navigation_.SetViewport(int(std::lround(width() * ratio)), int(std::lround(height() * ratio)));
}

void Canvas::CameraMoved() {
  if (!controller_->IsOpen()) return;
  Request(true);
  rest_.start();
  Q_EMIT cameraChanged();
}

void Canvas::Request(bool moving) {
  if (!controller_->IsOpen()) return;
  moving_ = moving;
  more_news_ = false;                      // this frame shows them
  if (!moving) since_frame_.invalidate();  // the movement is over
  FrameRequest request;
  request.serial = ++serial_;
  request.camera = navigation_.Rendered();
  request.lens = Lens();
  request.what = Shown();
  request.moving = moving;
  request.sh = original_ ? controller_->colors().original_sh() : controller_->colors().sh();
  if (!original_) request.sh_active = controller_->colors().sh_active();
  if (ShowsSplit()) request.before = controller_->colors().original_sh();
  if (cloud_shown_ && !original_ && !picking_) request.cloud = cloud_;
  if (hatching_ && uncertain_ && !original_ && !picking_) {
    request.hatching = Hatching{uncertain_, kHatchPixels * devicePixelRatioF()};
  }
  renderer_->Request(request);
}

void Canvas::OnFrame(std::shared_ptr<const Frame> frame) {
  if (!controller_->IsOpen() || frame->sh->size() != controller_->colors().sh()->size()) return;
  // Colors and the window's size bring small frames too, which say nothing about moving.
  const bool turned = frame_ && (frame_->camera.cam_from_world.translation !=
                                     frame->camera.cam_from_world.translation ||
                                 frame_->camera.cam_from_world.rotation.coeffs() !=
                                     frame->camera.cam_from_world.rotation.coeffs());
  if (frame->moving && moving_ && turned) {
    if (since_frame_.isValid()) {
      // The mean of the times, not of the rates: frames that waited come all at once.
      const double now = 1e-9 * double(since_frame_.nsecsElapsed());
      frame_seconds_ = frame_seconds_ > 0 ? 0.9 * frame_seconds_ + 0.1 * now : now;
    }
    since_frame_.start();
  } else {
    since_frame_.invalidate();
  }
  frame_ = std::move(frame);
  update();
  Q_EMIT frameShown();
}

bool Canvas::IsSharp() const {
  return frame_ && frame_->scale == 1 && frame_->serial == serial_ && !more_news_;
}

// ---- Showing

void Canvas::SetDepth(bool depth) {
  what_ = depth ? RenderWhat::kDepth : RenderWhat::kRgb;
  Request(false);
  Q_EMIT stateChanged();
}

void Canvas::SetFrusta(bool frusta) {
  frusta_ = frusta;
  update();
  Q_EMIT stateChanged();
}

void Canvas::SetSplit(bool split) {
  split_ = split;
  Request(false);
  UpdateCursor();
  Q_EMIT stateChanged();
}

void Canvas::SetSplitAt(double at) {
  split_at_ = std::clamp(at, 0.0, 1.0);
  update();
}

void Canvas::SetFlyMode(bool fly) {
  fly_mode_ = fly;
  update();
  Q_EMIT stateChanged();
}

void Canvas::SetCloud(std::shared_ptr<const OverlayCloud> cloud) {
  cloud_ = std::move(cloud);
  if (cloud_ && devicePixelRatioF() != 1) {
    // Its squares are as large on a fine screen.
    auto scaled = std::make_shared<OverlayCloud>(*cloud_);
    scaled->quad_pixels *= devicePixelRatioF();
    cloud_ = std::move(scaled);
  }
  Request(false);
}

void Canvas::SetCloudShown(bool shown) {
  if (shown == cloud_shown_) return;
  cloud_shown_ = shown;
  Request(false);
  Q_EMIT stateChanged();
}

void Canvas::SetCloudNote(const QString& note) {
  if (note == cloud_note_) return;
  cloud_note_ = note;
  update();
}

QString Canvas::CloudNote() const {
  const bool shows = cloud_ && !cloud_->points.empty() && cloud_shown_ && !original_ && !picking_ &&
                     !showing_photo();
  return shows ? cloud_note_ : QString();
}

void Canvas::SetUncertain(std::shared_ptr<const std::vector<float>> shares) {
  if (shares == uncertain_) return;
  uncertain_ = std::move(shares);
  if (hatching_) Request(false);
}

void Canvas::SetHatching(bool hatching) {
  if (hatching == hatching_) return;
  hatching_ = hatching;
  Request(false);
  Q_EMIT stateChanged();
}

void Canvas::SetBoard(const std::string& name, const QImage& render) {
  boards_[name] = render;
  if (frusta_) update();
}

bool Canvas::showing_photo() const {
  return photo_ && picture() && !photos_->Photo(picture()->name).isNull();
}

bool Canvas::lacks_photo() const {
  return photo_ && picture() && photos_->IsUnreadable(picture()->name);
}

void Canvas::SayMissingPhoto() {
  if (!lacks_photo()) return;
  const View& view = *navigation_.view();
  const Workspace& workspace = *controller_->facts()->workspace;
  const QString path = QString::fromStdString(workspace.PhotoPath(view).string());
  Q_EMIT hint(workspace.HasPhoto(view) ? tr("The photo of this view cannot be read: %1").arg(path)
                                       : tr("The photo of this view is missing: %1").arg(path));
}

void Canvas::SetHeld(const Command& command, bool down) {
  const std::string_view id = command.id;
  const bool no_photos =
      controller_->IsOpen() && controller_->facts()->workspace->has_virtual_views;
  if (id == "show.photo" && !no_photos) {
    photo_ = down;
    if (down && controller_->IsOpen() && !navigation_.view()) {
      Q_EMIT hint(tr("Photos are shown from training views: %1 goes to the nearest")
                      .arg(KeyText("view.next")));
    }
    SayMissingPhoto();
    update();
  } else if (id == "show.original" || id == "show.photo") {
    original_ = down;
    Request(false);
  } else {
    if (down) {
      flying_.insert(std::string(id));
    } else {
      flying_.erase(std::string(id));
    }
    if (flying_.empty()) {
      fly_.stop();
    } else if (!fly_.isActive()) {
      fly_clock_.start();
      fly_.start();
    }
  }
}

// ---- Input

void Canvas::resizeEvent(QResizeEvent* event) {
  QWidget::resizeEvent(event);
  UpdateViewport();
  if (!controller_->IsOpen()) return;
  Request(true);
  rest_.start();
}

void Canvas::hideEvent(QHideEvent* event) {
  QWidget::hideEvent(event);
  if (!event->spontaneous()) SetPicking(false);
}

RenderWhat Canvas::Shown() const { return picking_ ? RenderWhat::kRgb : what_; }

bool Canvas::ShowsSplit() const { return split_ && !original_ && Shown() == RenderWhat::kRgb; }

bool Canvas::OnSplitHandle(const QPointF& at) const {
  if (!ShowsSplit() || !frame_) return false;
  const QRectF rect = ImageRect(frame_->camera);
  return rect.contains(at) &&
         std::abs(at.x() - (rect.left() + split_at_ * rect.width())) <= kSplitGrab;
}

void Canvas::SetPicking(bool picking) {
  if (picking == picking_ || (picking && !controller_->IsOpen())) return;
  picking_ = picking;
  Request(false);
  if (picking) {
    pick_from_ = serial_;
    setFocus();
    Q_EMIT hint(tr("Click the color to take; hold %1 for the photo, Esc to leave it")
                    .arg(KeyText("show.photo")));
  } else {
    Q_EMIT hint({});
  }
  UpdateCursor();
  update();
  Q_EMIT stateChanged();
}

QColor Canvas::ColorAt(const QPointF& at) const {
  if (!frame_) return {};
  const QImage photo = showing_photo() ? photos_->Photo(picture()->name) : QImage();
  if (photo.isNull() && frame_->serial < pick_from_) return {};  // of the picture before picking
  const bool before = photo.isNull() && ShowsSplit() && !frame_->before.isNull();
  QRectF rect = ImageRect(photo.isNull() ? frame_->camera : navigation_.Rendered());
  if (!rect.contains(at)) return {};
  const QPointF share((at.x() - rect.left()) / rect.width(), (at.y() - rect.top()) / rect.height());
  const QImage& image = !photo.isNull()                   ? photo
                        : before && share.x() < split_at_ ? frame_->before
                                                          : frame_->image;
  return QColor(image.pixel(std::min(int(share.x() * image.width()), image.width() - 1),
                            std::min(int(share.y() * image.height()), image.height() - 1)));
}

void Canvas::UpdateCursor() {
  if (picking_) return setCursor(Qt::CrossCursor);
  setCursor(split_drag_ || OnSplitHandle(mouse_) ? Qt::SplitHCursor : Qt::ArrowCursor);
}

void Canvas::mousePressEvent(QMouseEvent* event) {
  mouse_ = pressed_ = event->position();
  dragged_ = false;
  if (!controller_->IsOpen()) return;
  if (picking_ && event->button() == Qt::LeftButton) {
    const QColor color = ColorAt(mouse_);
    const bool waits = !color.isValid() && frame_ && frame_->serial < pick_from_;
    if (!waits) SetPicking(false);
    if (color.isValid()) Q_EMIT picked(color);
    return;
  }
  if (event->button() == Qt::LeftButton && OnSplitHandle(mouse_)) {
    split_drag_ = true;
    return;
  }
  gesture_ = GestureOf(event->button(), event->modifiers());
  if (gesture_ == MouseGesture::kOrbit && fly_mode_) gesture_ = MouseGesture::kLook;
  if (gesture_ == MouseGesture::kOrbit) Probe(mouse_, ProbeFor::kPivot);
}

void Canvas::mouseMoveEvent(QMouseEvent* event) {
  const QPointF moved = (event->position() - mouse_) * devicePixelRatioF();
  mouse_ = event->position();
  if (split_drag_) {
    const QRectF rect = ImageRect(frame_->camera);
    SetSplitAt((mouse_.x() - rect.left()) / rect.width());
    return;
  }
  UpdateCursor();
  if (picking_) update();
  const QPointF all = mouse_ - pressed_;
  dragged_ = dragged_ || std::hypot(all.x(), all.y()) >= QApplication::startDragDistance();
  if (!gesture_ || moved.isNull()) return;
  switch (*gesture_) {
    case MouseGesture::kOrbit:
      navigation_.Orbit(moved.x(), moved.y());
      break;
    case MouseGesture::kPan:
      navigation_.Pan(moved.x(), moved.y());
      break;
    case MouseGesture::kZoom:
      navigation_.Zoom(-0.05 * moved.y() / devicePixelRatioF());
      break;
    case MouseGesture::kLook:
      navigation_.Look(moved.x(), moved.y());
      break;
  }
  CameraMoved();
}

void Canvas::mouseReleaseEvent(QMouseEvent* event) {
  gesture_.reset();
  if (event->button() == Qt::RightButton && !dragged_ && controller_->IsOpen() && !picking_) {
    Q_EMIT menuWanted(event->globalPosition().toPoint());
  }
  split_drag_ = false;
  UpdateCursor();
}

void Canvas::mouseDoubleClickEvent(QMouseEvent* event) {
  if (!controller_->IsOpen() || event->button() != Qt::LeftButton) return;
  if (frusta_) {
    if (const UserPicture* at = FrustumAt(event->position())) {
      GoTo(at->name);
      return;
    }
  }
  Probe(event->position(), ProbeFor::kFocus);
}

// By a key. With the mouse a right drag pans, so that the menu comes when the button is let go.
void Canvas::contextMenuEvent(QContextMenuEvent* event) {
  if (event->reason() == QContextMenuEvent::Mouse || !controller_->IsOpen()) return;
  Q_EMIT menuWanted(mapToGlobal(rect().center()));
}

void Canvas::wheelEvent(QWheelEvent* event) {
  if (!controller_->IsOpen() || event->angleDelta().y() == 0) return;
  navigation_.Zoom(event->angleDelta().y() / 120.0);
  CameraMoved();
  event->accept();
}

// Flying goes before the menus' and panels' letters with Alt, and Alt alone while one flies before
// the menu bar. A command that has a key with just these modifiers keeps it.
bool Canvas::event(QEvent* event) {
  if (event->type() == QEvent::ShortcutOverride) {
    const auto* key = static_cast<QKeyEvent*>(event);
    const bool slower = key->key() == Qt::Key_Alt && !flying_.empty();
    if (slower ||
        (HeldCommand(key->key(), key->modifiers()) && !IsShortcut(key->keyCombination()))) {
      event->accept();
      return true;
    }
  }
  return QWidget::event(event);
}

void Canvas::keyPressEvent(QKeyEvent* event) {
  const Command* command = HeldCommand(event->key(), event->modifiers());
  fly_factor_ = event->modifiers() & Qt::ShiftModifier ? 10
                : event->modifiers() & Qt::AltModifier ? 0.1
                                                       : 1;
  if (!command) {
    QWidget::keyPressEvent(event);
    return;
  }
  if (!event->isAutoRepeat()) SetHeld(*command, true);
}

void Canvas::keyReleaseEvent(QKeyEvent* event) {
  const Qt::KeyboardModifiers modifiers = event->modifiers();
  fly_factor_ = modifiers & Qt::ShiftModifier ? 10 : modifiers & Qt::AltModifier ? 0.1 : 1;
  const Command* command = HeldCommand(event->key(), Qt::NoModifier);
  if (!command) {
    QWidget::keyReleaseEvent(event);
    return;
  }
  if (!event->isAutoRepeat()) SetHeld(*command, false);
}

void Canvas::focusOutEvent(QFocusEvent* event) {
  QWidget::focusOutEvent(event);
  // Releases will go elsewhere.
  flying_.clear();
  fly_.stop();
  photo_ = false;
  if (std::exchange(original_, false)) Request(false);
  update();
}

}  // namespace retint
