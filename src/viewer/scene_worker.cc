// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/scene_worker.h"

#include <utility>

#include "base/error.h"

namespace retint {

SceneWorker::SceneWorker(OnProgress on_progress, OnTask on_task)
    : on_progress_(std::move(on_progress)),
      on_task_(std::move(on_task)),
      thread_([this] { Loop(); }) {}

SceneWorker::~SceneWorker() {
  {
    std::lock_guard lock(mutex_);
    quit_ = true;
    tasks_.clear();
    if (monitor_) monitor_->Cancel();
  }
  changed_.notify_all();
  thread_.join();
}

void SceneWorker::Post(Task task) {
  {
    std::lock_guard lock(mutex_);
    tasks_.push_back(std::move(task));
  }
  changed_.notify_all();
}

void SceneWorker::Cancel() {
  std::deque<Task> dropped;
  {
    std::lock_guard lock(mutex_);
    if (monitor_) monitor_->Cancel();
    std::deque<Task> kept;
    for (Task& task : tasks_) (task.label.isEmpty() ? kept : dropped).push_back(std::move(task));
    tasks_ = std::move(kept);
  }
  for (const Task& task : dropped) {
    if (task.done) task.done(std::make_exception_ptr(Cancelled()));
  }
}

void SceneWorker::Loop() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return quit_ || !tasks_.empty(); });
    if (quit_) return;
    Task task = std::move(tasks_.front());
    tasks_.pop_front();
    const bool labeled = !task.label.isEmpty();
    const auto monitor = std::make_shared<Monitor>(labeled ? on_progress_ : OnProgress());
    if (labeled) monitor_ = monitor;
    lock.unlock();
    if (labeled) on_task_(task.label);
    std::exception_ptr error;
    try {
      task.work(*monitor);
    } catch (...) {
      error = std::current_exception();
    }
    if (labeled) on_task_({});
    if (task.done) task.done(error);
    task = {};  // what it holds may be large
    lock.lock();
    monitor_.reset();
  }
}

}  // namespace retint
