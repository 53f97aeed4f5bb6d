// SPDX-License-Identifier: BSD-3-Clause
// Previews the selection of a stroke while the user draws: renders PaintShares() of the paint so
// far. The painted view shows it as a veil, then other views as small pictures, one after the
// other. If strokes come faster than pictures, only the newest waits. Other work waits for at most
// one round of pictures.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <QImage>
#include <QObject>
#include <QString>

#include "viewer/scene/scene_controller.h"

namespace retint {

class SelectionMode;

class StrokePreview : public QObject {
  Q_OBJECT

 public:
  // Views and photos with a thumbnail on the screen.
  using Visible = std::function<std::vector<std::string>()>;

  StrokePreview(SceneController* controller, SelectionMode* mode, QObject* parent = nullptr);
  void SetVisible(Visible visible) { visible_ = std::move(visible); }
  bool enabled() const { return enabled_; }
  void SetEnabled(bool enabled);  // false: no preview
  // The number of rounds of pictures so far.
  int rounds() const { return rounds_; }
  bool IsBusy() const { return busy_; }

 Q_SIGNALS:
  // The selection in a view or a photo; transparent elsewhere.
  void shown(const QString& view, const QImage& overlay);
  void finished();  // all visible views show the newest paint
  void cleared();   // the mode has ended, or there is no paint

 private:
  struct Round;
  void Ask();
  void Take(const std::shared_ptr<Round>& round);

  SceneController* controller_;
  SelectionMode* mode_;
  Visible visible_;
  bool enabled_ = true, busy_ = false, again_ = false, any_ = false;
  int rounds_ = 0;
  size_t first_ = 0;  // first view of the next round
};

}  // namespace retint
