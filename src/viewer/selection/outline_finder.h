// SPDX-License-Identifier: BSD-3-Clause
// Runs searches for an outline (selection/mask_tools/) off the GUI thread, one after the other.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <QObject>
#include <QString>
#include <QThreadPool>

#include "base/monitor.h"
#include "scene/image.h"

namespace retint {

class OutlineFinder : public QObject {
  Q_OBJECT

 public:
  using Work = std::function<Mask(Monitor& monitor)>;
  using Done = std::function<void(const Mask& found)>;

  explicit OutlineFinder(QObject* parent = nullptr);
  ~OutlineFinder() override;  // cancels the running search and waits for it

  // `done` with what `work` found, or failed(), follows on the GUI thread, after those of what was
  // asked for before. A waiting search of the same gesture is replaced, so that a drag is answered
  // as often as the machine can.
  void Find(uint64_t gesture, Work work, Done done);
  // Nothing that was asked for is answered any more.
  void Cancel();
  bool IsBusy() const { return !waiting_.empty() || running_; }

 Q_SIGNALS:
  void failed(const QString& message);
  void busyChanged();

 private:
  struct Request {
    uint64_t gesture;
    Work work;
    Done done;
  };
  void StartNext();

  std::vector<Request> waiting_;
  std::shared_ptr<Monitor> running_;  // null: nothing runs that is still wanted
  QThreadPool pool_;                  // of one thread
};

}  // namespace retint
