// SPDX-License-Identifier: BSD-3-Clause
// The current region's selection laid over the canvas. It is computed for the camera that rests,
// and hidden while the camera moves.
#pragma once

#include <QImage>
#include <QTimer>
#include <QWidget>

#include "editing/region.h"
#include "scene/camera.h"
#include "scene/image.h"

namespace retint {

class Canvas;
class CurrentRegion;
class SceneController;

class MaskView : public QWidget {
  Q_OBJECT

 public:
  // A child of the window's canvas that lets the mouse through.
  MaskView(SceneController* controller, Canvas* canvas, CurrentRegion* current);

  void SetShown(bool shown);
  bool shown() const { return shown_; }
  // The overlay is there, of this camera and region.
  bool IsReady() const { return shown_ && !picture_.isNull(); }

 Q_SIGNALS:
  void ready();

 protected:
  bool eventFilter(QObject* object, QEvent* event) override;
  void paintEvent(QPaintEvent* event) override;

 private:
  void Ask();
  void Forget();
  void Take(RegionId id, std::shared_ptr<const Mask> mask);

  SceneController* controller_;
  Canvas* canvas_;
  CurrentRegion* current_;
  bool shown_ = false;
  RegionId asked_ = 0;                         // 0: nothing is under way
  std::shared_ptr<const RegionSelection> of_;  // of the last request
  PosedCamera camera_;                         // of picture_ or of what was asked for
  QImage picture_;                             // ARGB, the mask's size; null: none
  QTimer rest_;
};

}  // namespace retint
