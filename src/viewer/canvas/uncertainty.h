// SPDX-License-Identifier: BSD-3-Clause
// The Gaussians that the paint of the current region leaves undecided. The worker finds them on
// demand; they are kept until the region's selection changes.
#pragma once

#include <memory>
#include <vector>

#include <QObject>

#include "selection/suggestion.h"
#include "viewer/scene/current_region.h"
#include "viewer/scene/scene_controller.h"

namespace retint {

class Uncertainty : public QObject {
  Q_OBJECT

 public:
  struct Found {
    uint64_t selection = 0;                               // that these belong to
    std::shared_ptr<const std::vector<float>> undecided;  // [N] 1 - confidence of the completion
    std::vector<ViewSuggestion> views;                    // to paint next, the best first
  };

  Uncertainty(SceneController* controller, CurrentRegion* current, QObject* parent = nullptr);

  // For the current region; null: not found yet.
  std::shared_ptr<const Found> found() const;
  // changed() or refused() follows. Does nothing if the result is known, or will come.
  void Find();
  SceneController::TaskId task() const { return task_; }  // of the last Find()

 Q_SIGNALS:
  void changed();  // found() has changed: it was found, or is outdated
  void refused(const QString& why);

 private:
  void Follow();

  SceneController* controller_;
  CurrentRegion* current_;
  uint64_t selection_ = 0;  // of the current region; 0: none
  SceneController::TaskId task_ = 0;
  uint64_t asked_ = 0;  // selection that the worker is looking at
  std::shared_ptr<const Found> found_;
};

}  // namespace retint
