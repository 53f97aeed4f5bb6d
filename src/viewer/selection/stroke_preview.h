// SPDX-License-Identifier: BSD-3-Clause
// Shows what a stroke selects while it is drawn: PaintShares() of the paint so far, rendered as the
// veil of the view that is painted, then small in other views, one after the other. If strokes come
// faster than pictures, the newest waits and those between are dropped; nobody waits for more than
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
  // The views and photos whose small pictures are on the screen.
  using Visible = std::function<std::vector<std::string>()>;

  StrokePreview(SceneController* controller, SelectionMode* mode, QObject* parent = nullptr);
  void SetVisible(Visible visible) { visible_ = std::move(visible); }
  bool enabled() const { return enabled_; }
  void SetEnabled(bool enabled);  // false: shows nothing
  // How many rounds of pictures there were.
  int rounds() const { return rounds_; }
  bool IsBusy() const { return busy_; }

 Q_SIGNALS:
  // The selection in a view or a photo, transparent elsewhere.
  void shown(const QString& view, const QImage& overlay);
  void finished();  // every view that was visible shows the newest paint
  void cleared();   // the mode is over, or nothing is painted

 private:
  struct Round;
  void Ask();
  void Take(const std::shared_ptr<Round>& round);

  SceneController* controller_;
  SelectionMode* mode_;
  Visible visible_;
  bool enabled_ = true, busy_ = false, again_ = false, any_ = false;
  int rounds_ = 0;
  size_t first_ = 0;  // view that the next round begins with
};

}  // namespace retint
