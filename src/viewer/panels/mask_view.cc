// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/mask_view.h"

#include <QEvent>
#include <QPainter>

#include "scene/mask_pixels.h"
#include "viewer/canvas/canvas.h"
#include "viewer/canvas/contrast.h"
#include "viewer/scene/current_region.h"
#include "viewer/scene/scene_controller.h"

namespace retint {
namespace {

constexpr int kRestMs = 200;
constexpr int kStripe = 8;  // pixels; hatched, so that color is not the only signal

// In a color that stands out from the part of `shown` that it covers.
QImage Overlay(const Mask& mask, const QImage& shown) {
  QColor under;
  if (shown.size() == QSize(mask.width, mask.height)) {
    under = MeanColor(shown, [&](int x, int y) { return IsInside(mask(x, y)); });
  }
  const QColor color = ContrastingColor(under);
  QImage picture(mask.width, mask.height, QImage::Format_ARGB32_Premultiplied);
  picture.fill(Qt::transparent);
  const auto inside = [&](int x, int y) { return mask.Contains(x, y) && IsInside(mask(x, y)); };
  for (int y = 0; y < mask.height; ++y) {
    auto* row = reinterpret_cast<QRgb*>(picture.scanLine(y));
    for (int x = 0; x < mask.width; ++x) {
      if (!inside(x, y)) continue;
      const bool edge =
          !inside(x - 1, y) || !inside(x + 1, y) || !inside(x, y - 1) || !inside(x, y + 1);
      const bool stripe = (x + y) % (2 * kStripe) < 3;
      if (edge) {
        row[x] = qRgba(255, 255, 255, 255);
      } else {
        row[x] = qPremultiply(qRgba(color.red(), color.green(), color.blue(), stripe ? 190 : 70));
      }
    }
  }
  return picture;
}

}  // namespace

MaskView::MaskView(SceneController* controller, Canvas* canvas, CurrentRegion* current)
    : QWidget(canvas), controller_(controller), canvas_(canvas), current_(current) {
  setObjectName("mask_view");
  setAttribute(Qt::WA_TransparentForMouseEvents);
  setAttribute(Qt::WA_NoSystemBackground);
  setFocusPolicy(Qt::NoFocus);
  canvas_->installEventFilter(this);
  rest_.setSingleShot(true);
  rest_.setInterval(kRestMs);
  connect(&rest_, &QTimer::timeout, this, &MaskView::Ask);
  connect(controller, &SceneController::selectionSeen, this, &MaskView::Take);
  // An answer that will not come any more must not keep the next question from being asked.
  const auto unanswered = [this] {
    asked_ = 0;
    Forget();
  };
  connect(controller, &SceneController::closed, this, unanswered);
  connect(controller, &SceneController::opened, this, unanswered);
  connect(controller, &SceneController::cancelled, this, [=, this] {
    if (asked_ != 0) unanswered();
  });
  connect(controller, &SceneController::failed, this, [=, this] {
    if (asked_ != 0) unanswered();
  });
  connect(controller, &SceneController::regionsChanged, this, [this] {
    const Region* region = controller_->regions().Find(current_->id());
    if (region && region->selection != of_) Forget();  // undone, or painted again
  });
  connect(current_, &CurrentRegion::changed, this, &MaskView::Forget);
  connect(canvas_, &Canvas::cameraChanged, this, [this] {
    if (camera_ != canvas_->navigation().Rendered()) Forget();
  });
  hide();
}

void MaskView::SetShown(bool shown) {
  shown_ = shown;
  setVisible(shown);
  setGeometry(canvas_->rect());
  Forget();
}

void MaskView::Forget() {
  picture_ = {};
  update();
  if (shown_) rest_.start();
}

void MaskView::Ask() {
  const RegionId id = current_->id();
  if (!shown_ || id == 0 || !controller_->IsOpen()) return;
  if (asked_ != 0) return rest_.start();  // one at a time
  const Region* region = controller_->regions().Find(id);
  if (!region) return;
  asked_ = id;
  of_ = region->selection;
  camera_ = canvas_->navigation().Rendered();
  controller_->SeeSelection(id, camera_, canvas_->Lens());
}

void MaskView::Take(RegionId id, std::shared_ptr<const Mask> mask) {
  const Camera& asked = camera_.camera;
  if (id != asked_ || !mask || mask->width != asked.width || mask->height != asked.height) {
    return;  // somebody else asked
  }
  asked_ = 0;
  const bool wanted = shown_ && id == current_->id() && camera_ == canvas_->navigation().Rendered();
  if (!wanted) return rest_.start();
  const auto frame = canvas_->frame();
  picture_ = Overlay(*mask, frame ? frame->image : QImage());
  update();
  Q_EMIT ready();
}

bool MaskView::eventFilter(QObject* object, QEvent* event) {
  if (event->type() == QEvent::Resize) {
    setGeometry(canvas_->rect());
    Forget();
  }
  return QWidget::eventFilter(object, event);
}

void MaskView::paintEvent(QPaintEvent*) {
  if (picture_.isNull()) return;
  QPainter painter(this);
  painter.setRenderHint(QPainter::SmoothPixmapTransform);
  painter.drawImage(canvas_->ImageRect(camera_), picture_);
  canvas_->PaintLabels(painter);  // those of the canvas lie below the mask
}

}  // namespace retint
