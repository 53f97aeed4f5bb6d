// SPDX-License-Identifier: BSD-3-Clause
// An overlay of the current region's selection on the canvas. It is computed when the camera rests,
// and hidden while it moves.
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
  // A child of the window's canvas that ignores the mouse.
  MaskView(SceneController* controller, Canvas* canvas, CurrentRegion* current);

  void SetShown(bool shown);
  bool shown() const { return shown_; }
  // Whether the overlay is complete, for this camera and region.
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
  RegionId asked_ = 0;                         // 0: no request
  std::shared_ptr<const RegionSelection> of_;  // of the newest request
  PosedCamera camera_;                         // of picture_, or of the newest request
  QImage picture_;                             // ARGB, the mask's size; null: none
  QTimer rest_;
};

}  // namespace retint
