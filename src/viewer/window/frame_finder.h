// SPDX-License-Identifier: BSD-3-Clause
// Finds out whether a splat lies in the frame of its workspace, and its pose if it does not. The
// open dialog asks before it opens a scene. Lives on the GUI thread and works on its own; signals
// are on the GUI thread.
#pragma once

#include <filesystem>
#include <memory>

#include <QObject>
#include <QString>

#include "opening/align.h"
#include "opening/scene_check.h"
#include "viewer/scene/scene_controller.h"

namespace retint {

class SceneWorker;

class FrameFinder : public QObject {
  Q_OBJECT

 public:
  explicit FrameFinder(QObject* parent = nullptr);
  ~FrameFinder() override;  // cancels and joins

  // Do renders and photos agree for this request? Emits checked() or failed(). Cancels an earlier
  // request, which is never answered; so do the other calls.
  void Check(const OpenRequest& request);
  // Runs retint align from the request's pose of the splat: progressed(), then aligned() or
  // failed().
  void Align(const OpenRequest& request);
  // Ends all answers, and frees the splat that was read.
  void Cancel();

 Q_SIGNALS:
  void progressed(double fraction);  // in [0, 1]
  void checked(const SceneCheck& check);
  void aligned(const AlignResult& result);
  void unreadable(const QString& why);  // the splat
  void failed(const QString& message);

 private:
  struct Splat;  // the last one read, for the next request

  template <typename Ask, typename Answer>
  void Post(const OpenRequest& request, Ask ask, Answer answer);

  std::shared_ptr<Splat> splat_;  // used only on the worker
  int question_ = 0;              // newest request; answers to earlier ones are dropped
  std::unique_ptr<SceneWorker> worker_;
};

}  // namespace retint
