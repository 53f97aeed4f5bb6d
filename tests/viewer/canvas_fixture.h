// SPDX-License-Identifier: BSD-3-Clause
// A selection canvas with a picture, and the hand that paints on it.
#pragma once

#include <cmath>
#include <memory>

#include <QMouseEvent>
#include <QTest>
#include <QWheelEvent>

#include "viewer/selection/selection_canvas.h"

namespace retint {

class CanvasFixture : public QObject {
 protected:
  std::unique_ptr<SelectionCanvas> canvas_;

  // The widget pixel over the center of an image pixel.
  QPoint At(int x, int y) const {
    const Eigen::Vector2d at = canvas_->transform().ToWidget({x + 0.5, y + 0.5});
    return {static_cast<int>(std::floor(at.x())), static_cast<int>(std::floor(at.y()))};
  }
  QString Tool() const { return canvas_->tool().id; }
  int Mask(int x, int y) const { return canvas_->editor().mask()(x, y); }
  size_t Inside() const { return canvas_->editor().CountInside(); }
  void Move(QPoint to, Qt::MouseButton button = Qt::NoButton,
            Qt::KeyboardModifiers modifiers = Qt::NoModifier) {
    QMouseEvent move(QEvent::MouseMove, to, canvas_->mapToGlobal(to), Qt::NoButton,
                     button == Qt::NoButton ? Qt::MouseButtons() : Qt::MouseButtons(button),
                     modifiers);
    QCoreApplication::sendEvent(canvas_.get(), &move);
  }
  void Drag(const QList<QPoint>& path, Qt::KeyboardModifiers modifiers = Qt::NoModifier,
            Qt::MouseButton button = Qt::LeftButton) {
    QTest::mousePress(canvas_.get(), button, modifiers, path.front());
    for (const QPoint& at : path) Move(at, button, modifiers);
    QTest::mouseRelease(canvas_.get(), button, modifiers, path.back());
  }
  void Click(QPoint at, Qt::KeyboardModifiers modifiers = Qt::NoModifier) {
    QTest::mouseClick(canvas_.get(), Qt::LeftButton, modifiers, at);
  }
  void Key(Qt::Key key, Qt::KeyboardModifiers modifiers = Qt::NoModifier) {
    QTest::keyClick(canvas_.get(), key, modifiers);
  }
  void Wheel(QPoint at, QPoint angle, Qt::KeyboardModifiers modifiers = Qt::NoModifier) {
    QWheelEvent event(at, canvas_->mapToGlobal(at), {}, angle, Qt::NoButton, modifiers,
                      Qt::NoScrollPhase, false);
    QCoreApplication::sendEvent(canvas_.get(), &event);
  }
  QImage Shot() { return canvas_->grab().toImage(); }

  // Seen by a pinhole camera at the world's origin whose focal length is the picture's width.
  static ViewLayers LayersOf(const QImage& image, const DepthMap& depth) {
    ViewLayers layers;
    const int w = image.width(), h = image.height();
    layers.camera.camera = Camera::Pinhole(1, w, h, w, w, w / 2.0, h / 2.0);
    layers.color = Image(w, h);
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < w; ++x) {
        const QColor color = image.pixelColor(x, y);
        layers.color(x, y, 0) = color.redF();
        layers.color(x, y, 1) = color.greenF();
        layers.color(x, y, 2) = color.blueF();
      }
    }
    layers.depth = depth;
    return layers;
  }

  // A canvas of its own with nothing selected, `zoom` times as large as the picture.
  void Show(const QImage& image, const DepthMap& depth, int zoom) {
    canvas_ = std::make_unique<SelectionCanvas>();
    canvas_->resize(zoom * image.size());
    canvas_->SetView(image, LayersOf(image, depth), retint::Mask(image.width(), image.height()));
    canvas_->show();
    QVERIFY(QTest::qWaitForWindowExposed(canvas_.get()));
    canvas_->SetBrush({4, 1});
    canvas_->setFocus();
  }
};

}  // namespace retint
