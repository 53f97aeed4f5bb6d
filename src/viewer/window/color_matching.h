// SPDX-License-Identifier: BSD-3-Clause
// Edit > Match colors: asks for the reference, compares with it in the background, says what was
// found, and adds a region if the user agrees.
#pragma once

#include <QObject>
#include <QPointer>

#include "editing/match_scene.h"
#include "viewer/scene/scene_controller.h"
#include "viewer/window/match_dialog.h"
#include "viewer/window/window_parts.h"

namespace retint {

class PhotoLoader;

class ColorMatching : public QObject {
  Q_OBJECT

 public:
  ColorMatching(const WindowParts& parts, PhotoLoader* photos, QWidget* window);

  void Start();
  // Shows why a comparison failed, over the dialog with all its entries; false for another task.
  bool Explain(quint64 task, const QString& message);

 Q_SIGNALS:
  void matched(retint::RegionId id);

 private:
  void MatchTo(const MatchRecipe& recipe);
  void Show(const SceneMatch& match);

  QWidget* window_;
  const WindowParts parts_;
  PhotoLoader* photos_;
  QPointer<MatchDialog> dialog_;            // of the open scene; null before the first match
  SceneController::TaskId comparison_ = 0;  // the newest; 0: none
};

}  // namespace retint
