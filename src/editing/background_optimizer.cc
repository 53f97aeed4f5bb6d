// SPDX-License-Identifier: BSD-3-Clause
#include "editing/background_optimizer.h"

#include <exception>
#include <utility>

#include "base/error.h"
#include "base/memory.h"
#include "base/parallel.h"

namespace retint {

BackgroundOptimizer::BackgroundOptimizer(std::function<void()> on_publish)
    : on_publish_(std::move(on_publish)),
      thread_([this] { RunInBackground([this] { Loop(); }); }) {}

BackgroundOptimizer::~BackgroundOptimizer() {
  {
    std::lock_guard lock(mutex_);
    quit_ = true;
    pending_ = nullptr;
    if (monitor_) monitor_->Cancel();
  }
  changed_.notify_all();
  thread_.join();
}

uint64_t BackgroundOptimizer::Start(Factory factory) {
  uint64_t number = 0;
  {
    std::lock_guard lock(mutex_);
    if (monitor_) monitor_->Cancel();
    pending_ = std::move(factory);
    number = ++number_;
    paused_ = false;
    state_ = State::kRunning;
    error_.clear();
  }
  changed_.notify_all();
  return number;
}

void BackgroundOptimizer::Pause() {
  std::lock_guard lock(mutex_);
  if (state_ != State::kRunning) return;
  paused_ = true;
  state_ = State::kPaused;
}

void BackgroundOptimizer::Resume() {
  {
    std::lock_guard lock(mutex_);
    if (state_ != State::kPaused) return;
    paused_ = false;
    state_ = State::kRunning;
  }
  changed_.notify_all();
}

void BackgroundOptimizer::Cancel() {
  {
    std::lock_guard lock(mutex_);
    pending_ = nullptr;
    paused_ = false;
    if (monitor_) monitor_->Cancel();
    if (state_ == State::kRunning || state_ == State::kPaused) state_ = State::kCancelled;
  }
  changed_.notify_all();
}

void BackgroundOptimizer::Wait() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !busy_ && !pending_; });
}

void BackgroundOptimizer::Forget() {
  std::lock_guard lock(mutex_);
  if (!busy_ && !pending_) newest_ = nullptr;
}

BackgroundOptimizer::State BackgroundOptimizer::state() const {
  std::lock_guard lock(mutex_);
  return state_;
}

std::shared_ptr<const ShSnapshot> BackgroundOptimizer::Newest() const {
  std::lock_guard lock(mutex_);
  wanted_ = true;
  return newest_;
}

std::string BackgroundOptimizer::error() const {
  std::lock_guard lock(mutex_);
  return error_;
}

void BackgroundOptimizer::Notify() const {
  if (on_publish_) on_publish_();
}

void BackgroundOptimizer::Loop() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return quit_ || pending_; });
    if (quit_) return;
    const Factory factory = std::exchange(pending_, nullptr);
    const uint64_t number = number_;
    const auto monitor = std::make_shared<Monitor>();
    monitor_ = monitor;
    busy_ = true;
    lock.unlock();
    RunJob(number, factory, *monitor);
    ReleaseFreedMemory();  // a fit's weights are the most that a session ever holds
    lock.lock();
    busy_ = false;
    monitor_.reset();
    changed_.notify_all();
  }
}

void BackgroundOptimizer::RunJob(uint64_t number, const Factory& factory, Monitor& monitor) {
  try {
    const std::unique_ptr<OptimizerJob> job = factory(monitor);
    int steps = 0;
    Publish(number, *job, steps, false);
    do {
      BetweenSteps(number, *job, steps, monitor);
      ++steps;
    } while (job->Step(monitor));
    Publish(number, *job, steps, true);
    SetState(number, State::kFinished);
  } catch (const Cancelled&) {
    SetState(number, State::kCancelled);
  } catch (const std::exception& error) {
    SetState(number, State::kFailed, error.what());
  }
  Notify();
}

void BackgroundOptimizer::Publish(uint64_t number, const OptimizerJob& job, int steps,
                                  bool finished) {
  auto snapshot = std::make_shared<ShSnapshot>(job.Snapshot());
  snapshot->job = number;
  snapshot->steps = steps;
  snapshot->finished = finished;
  {
    std::lock_guard lock(mutex_);
    // A job that was cancelled or overtaken during its step has nothing to say any more.
    if (number != number_ || state_ == State::kCancelled) throw Cancelled();
    newest_ = std::move(snapshot);
    wanted_ = false;
  }
  Notify();
}

void BackgroundOptimizer::BetweenSteps(uint64_t number, const OptimizerJob& job, int steps,
                                       Monitor& monitor) {
  bool published = steps == 0;
  std::unique_lock lock(mutex_);
  while (true) {
    if (!published && (wanted_ || paused_)) {
      lock.unlock();
      Publish(number, job, steps, false);
      published = true;
      lock.lock();
    }
    if (!paused_ || monitor.IsCancelled()) break;
    changed_.wait(lock);
  }
  lock.unlock();
  monitor.ThrowIfCancelled();
}

void BackgroundOptimizer::SetState(uint64_t number, State state, std::string error) {
  std::lock_guard lock(mutex_);
  if (number != number_ || state_ == State::kCancelled) return;
  state_ = state;
  error_ = std::move(error);
}

}  // namespace retint
