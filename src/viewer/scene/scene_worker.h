// SPDX-License-Identifier: BSD-3-Clause
// A thread that runs tasks one after the other, in the order of their posting.
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include <QString>

#include "base/monitor.h"

namespace retint {

class SceneWorker {
 public:
  struct Task {
    QString label;                                 // empty: takes no time, cannot be cancelled
    std::function<void(Monitor&)> work;            // may throw
    std::function<void(std::exception_ptr)> done;  // gets null if it worked; called on the worker
  };
  using OnProgress = std::function<void(const Progress&)>;  // called on the worker
  using OnTask = std::function<void(const QString&)>;       // a labeled task begins; "": it ends

  SceneWorker(OnProgress on_progress, OnTask on_task);
  ~SceneWorker();  // cancels and joins; drops waiting tasks

  // Returns the monitor of its work, which can cancel only this task.
  std::shared_ptr<Monitor> Post(Task task);
  // Cancels the current labeled task and all waiting ones. A waiting task then never starts; its
  // done() is called in its turn.
  void Cancel();

 private:
  struct Posted {
    Task task;
    std::shared_ptr<Monitor> monitor;
  };
  void Loop();

  const OnProgress on_progress_;
  const OnTask on_task_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Posted> waiting_;
  std::shared_ptr<Monitor> running_;  // of the current labeled task
  bool quit_ = false;
  std::thread thread_;  // last: it starts when all members above exist
};

}  // namespace retint
