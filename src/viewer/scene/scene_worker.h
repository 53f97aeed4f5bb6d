// SPDX-License-Identifier: BSD-3-Clause
// A thread that runs tasks one after the other, in the order in which they were posted.
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
    std::function<void(std::exception_ptr)> done;  // null: it worked; called on the worker
  };
  using OnProgress = std::function<void(const Progress&)>;  // called on the worker
  using OnTask = std::function<void(const QString&)>;       // a labeled task begins, "": ends

  SceneWorker(OnProgress on_progress, OnTask on_task);
  ~SceneWorker();  // cancels and joins; tasks that wait are dropped

  // Returns the monitor of its work, with which this task alone can be cancelled.
  std::shared_ptr<Monitor> Post(Task task);
  // Cancels the labeled task that runs and those that wait. What is cancelled before its turn is
  // not begun, and its done() hears of that in its turn.
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
  std::shared_ptr<Monitor> running_;  // of the labeled task that runs
  bool quit_ = false;
  std::thread thread_;  // last: starts when everything above exists
};

}  // namespace retint
