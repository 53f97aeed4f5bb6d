// SPDX-License-Identifier: BSD-3-Clause
// What the paint of the current region has not decided: found by the worker when somebody asks, and
// kept until the region's selection is another.
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
    uint64_t selection = 0;                               // it is of
    std::shared_ptr<const std::vector<float>> undecided;  // [N] 1 - confidence of the completion
    std::vector<ViewSuggestion> views;                    // the views to paint next, the best first
  };

  Uncertainty(SceneController* controller, CurrentRegion* current, QObject* parent = nullptr);

  // Of the current region; null: not found yet.
  std::shared_ptr<const Found> found() const;
  // changed() follows, or refused(). Nothing happens where it is found already, or on its way.
  void Find();
  SceneController::TaskId task() const { return task_; }  // of the last Find()

 Q_SIGNALS:
  void changed();  // found(): it was found, or is another selection's
  void refused(const QString& why);

 private:
  void Follow();

  SceneController* controller_;
  CurrentRegion* current_;
  uint64_t selection_ = 0;  // of the current region; 0: none
  SceneController::TaskId task_ = 0;
  uint64_t asked_ = 0;  // selection that is on its way
  std::shared_ptr<const Found> found_;
};

}  // namespace retint
