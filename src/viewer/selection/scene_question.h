// SPDX-License-Identifier: BSD-3-Clause
// Asks the scene about the outline of the strokes while it is on the screen. This view may leave
// some pixels undecided. If other views decide them differently, they are hatched, and a banner
// asks which outline is right. It is the user's, unless the user takes the scene's. The user
// accepts the shown one.
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
  ~SceneQuestion() override;  // nobody waits for an answer

  // Ends the question: the outline has changed, or the user no longer paints.
  void Withdraw();
  bool IsAsking() const;
  void AskTheUser(const SceneAnswer& answer);
  Banner& banner() { return *banner_; }

 Q_SIGNALS:
  void answered();  // by the scene: a banner asks, or there is no question

 private:
  void Look();  // checks whether there is an outline to ask about
  void AskTheScene();

  SceneController* controller_;
  SelectionMode* mode_;
  Banner* banner_;
  QTimer rest_;                       // waits until the strokes rest, before it occupies the worker
  std::shared_ptr<Monitor> running_;  // of the question to the scene; null: none
};

}  // namespace retint
