// SPDX-License-Identifier: BSD-3-Clause
// Whether a splat lies in the frame of its workspace and, where it does not, how it lies: what the
// open dialog asks before anything is opened. Lives on the GUI thread, works on one of its own; all
// signals come on the GUI thread.
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

  // Do renders and photos agree as the request has it? checked() or failed(). An earlier request is
  // cancelled and answers no more; so also below.
  void Check(const OpenRequest& request);
  // retint align, from where the request says that the splat lies: progressed(), then aligned() or
  // failed().
  void Align(const OpenRequest& request);
  // No answer comes any more, and the splat that was read is let go.
  void Cancel();

 Q_SIGNALS:
  void progressed(double fraction);  // in [0, 1]
  void checked(const SceneCheck& check);
  void aligned(const AlignResult& result);
  void unreadable(const QString& why);  // the splat
  void failed(const QString& message);

 private:
  struct Splat;  // as it was read last, for the next question

  template <typename Ask, typename Answer>
  void Post(const OpenRequest& request, Ask ask, Answer answer);

  std::shared_ptr<Splat> splat_;  // used on the worker alone
  int question_ = 0;              // the newest; answers to others are dropped
  std::unique_ptr<SceneWorker> worker_;
};

}  // namespace retint
