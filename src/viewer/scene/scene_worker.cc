// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/scene/scene_worker.h"

#include <utility>

namespace retint {

SceneWorker::SceneWorker(OnProgress on_progress, OnTask on_task)
    : on_progress_(std::move(on_progress)),
      on_task_(std::move(on_task)),
      thread_([this] { Loop(); }) {}

SceneWorker::~SceneWorker() {
  {
    std::lock_guard lock(mutex_);
    quit_ = true;
    waiting_.clear();
    if (running_) running_->Cancel();
  }
  changed_.notify_all();
  thread_.join();
}

std::shared_ptr<Monitor> SceneWorker::Post(Task task) {
  const auto monitor =
      std::make_shared<Monitor>(task.label.isEmpty() ? OnProgress() : on_progress_);
  {
    std::lock_guard lock(mutex_);
    waiting_.push_back({std::move(task), monitor});
  }
  changed_.notify_all();
  return monitor;
}

void SceneWorker::Cancel() {
  std::lock_guard lock(mutex_);
  if (running_) running_->Cancel();
  for (const auto& [task, monitor] : waiting_) {
    if (!task.label.isEmpty()) monitor->Cancel();
  }
}

void SceneWorker::Loop() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return quit_ || !waiting_.empty(); });
    if (quit_) return;
    auto [task, monitor] = std::move(waiting_.front());
    waiting_.pop_front();
    const bool labeled = !task.label.isEmpty();
    if (labeled) running_ = monitor;
    lock.unlock();
    const bool told = labeled && !monitor->IsCancelled();
    if (told) on_task_(task.label);
    std::exception_ptr error;
    try {
      monitor->ThrowIfCancelled();
      task.work(*monitor);
    } catch (...) {
      error = std::current_exception();
    }
    if (told) on_task_({});
    if (task.done) task.done(error);
    task = {};  // its captures may be large
    lock.lock();
    running_.reset();
  }
}

}  // namespace retint
