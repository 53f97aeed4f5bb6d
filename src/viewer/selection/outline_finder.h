// SPDX-License-Identifier: BSD-3-Clause
// Runs searches for an outline (selection/mask_tools/) on another thread, one after the other.
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

  // Runs `work`, then passes its result to `done` on the GUI thread, or emits failed(). Requests
  // are answered in order. A request replaces a waiting one of the same gesture, so that a drag
  // gets answers as often as the machine can give them.
  void Find(uint64_t gesture, Work work, Done done);
  // Ends the answers to all requests.
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
  std::shared_ptr<Monitor> running_;  // null: no wanted search is running
  QThreadPool pool_;                  // with one thread
};

}  // namespace retint
