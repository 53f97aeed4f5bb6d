// SPDX-License-Identifier: BSD-3-Clause
// Asks the scene about the outline that strokes found, while it is on the screen. If other views
// show otherwise what this view leaves open, the difference is hatched, and a banner asks whose
// outline holds. It is the user's, unless the user takes the scene's: what shows is what is
// accepted.
#pragma once

#include <memory>

#include <QObject>
#include <QTimer>

#include "base/monitor.h"
#include "scene/image.h"
#include "selecting/scene_answer.h"

namespace retint {

class Banner;
class SceneController;
class SelectionMode;

class SceneQuestion : public QObject {
  Q_OBJECT

 public:
  SceneQuestion(SceneController* controller, SelectionMode* mode);
  ~SceneQuestion() override;  // nobody waits for an answer any more

  // The outline is another one, or nobody paints: the question is over.
  void Withdraw();
  bool IsAsking() const;
  void AskTheUser(const SceneAnswer& answer);
  Banner& banner() { return *banner_; }

 Q_SIGNALS:
  void answered();  // by the scene: a banner asks, or there is nothing to ask

 private:
  void Look();  // whether there is an outline to ask about
  void AskTheScene();

  SceneController* controller_;
  SelectionMode* mode_;
  Banner* banner_;
  QTimer rest_;                       // of the strokes, before the worker is kept busy
  std::shared_ptr<Monitor> running_;  // of the question that the scene is at; null: none
};

}  // namespace retint
