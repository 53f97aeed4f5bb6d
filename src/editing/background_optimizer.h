// SPDX-License-Identifier: BSD-3-Clause
// A thread that runs one optimization at a time, step by step, and publishes whole snapshots of the
// coefficients. A lock is held only to swap a pointer, never while a step runs.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "base/monitor.h"
#include "editing/region.h"
#include "scene/gaussian_model.h"

namespace retint {

// A state of the coefficients between two steps. Immutable once published.
struct ShSnapshot {
  uint64_t job = 0;                      // which Start() it belongs to
  int steps = 0;                         // taken so far
  bool finished = false;                 // nothing better will come from this job
  RegionId region = 0;                   // being fitted, 0: none
  std::vector<double> losses;            // of that region so far, RefitSummary::losses
  std::shared_ptr<const FloatArray> sh;  // [N, K, 3]
  // Of the regions whose fit is complete, by region.
  std::map<RegionId, std::shared_ptr<const RegionFit>> fits;
};

// Work that the optimizer drives. All calls come from the optimizer's thread.
class OptimizerJob {
 public:
  virtual ~OptimizerJob() = default;
  virtual bool Step(Monitor& monitor) = 0;  // false: nothing left to do
  virtual ShSnapshot Snapshot() const = 0;  // `sh` and `fits`; the rest is filled in
};

class BackgroundOptimizer {
 public:
  enum class State { kIdle, kRunning, kPaused, kFinished, kCancelled, kFailed };
  // Makes the job, on the optimizer's thread; may be long and may throw.
  using Factory = std::function<std::unique_ptr<OptimizerJob>(Monitor& monitor)>;

  // A job's first and last states are published, and the one at which it pauses. In between a step
  // is published only when somebody called Newest() since the snapshot before: a state that nobody
  // asks for is not copied.
  // `on_publish` (may be empty) is called from the optimizer's thread after each snapshot and
  // change of state, without a lock held: a viewer asks for a repaint there.
  explicit BackgroundOptimizer(std::function<void()> on_publish = {});
  ~BackgroundOptimizer();  // cancels and joins

  // Starts a job and returns its number. The job before it is cancelled at its next check.
  uint64_t Start(Factory factory);
  void Pause();  // after the step in progress
  void Resume();
  void Cancel();  // the running or waiting job; returns at once
  void Wait();    // until nothing runs or waits to run; do not call while paused

  void Forget();  // the newest snapshot, if nothing runs or waits

  State state() const;
  // The newest snapshot, null before the first. Only of the newest job once it has published.
  std::shared_ptr<const ShSnapshot> Newest() const;
  std::string error() const;  // why the last job failed, else empty

 private:
  void Loop();
  void RunJob(uint64_t number, const Factory& factory, Monitor& monitor);
  // Throws Cancelled when the job was cancelled or overtaken.
  void Publish(uint64_t number, const OptimizerJob& job, int steps, bool finished);
  // Before each step: publishes the state where it is wanted, and stays while paused.
  void BetweenSteps(uint64_t number, const OptimizerJob& job, int steps, Monitor& monitor);
  void SetState(uint64_t number, State state, std::string error = {});
  void Notify() const;

  const std::function<void()> on_publish_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  // Guarded by mutex_.
  Factory pending_;
  std::shared_ptr<Monitor> monitor_;
  std::shared_ptr<const ShSnapshot> newest_;
  State state_ = State::kIdle;
  std::string error_;
  uint64_t number_ = 0;
  bool paused_ = false, quit_ = false, busy_ = false;
  mutable bool wanted_ = false;  // Newest() was called since the last snapshot
  std::thread thread_;           // last: starts when everything above exists
};

}  // namespace retint
