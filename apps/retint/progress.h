// SPDX-License-Identifier: BSD-3-Clause
// Progress on stderr: one bar for the whole run on a terminal, plain lines or JSON lines elsewhere.
#pragma once

#include <chrono>
#include <mutex>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "base/overall_progress.h"

namespace retint::cli {

enum class ProgressStyle { kNone, kBar, kPlain, kJson };

// Prints the reports of a Monitor. Calls may come from any thread.
class ProgressPrinter {
 public:
  ProgressPrinter(ProgressStyle style, std::vector<PlannedStage> plan)
      : style_(style), whole_(std::move(plan)) {}
  ~ProgressPrinter() { EndStage(/*done=*/false); }
  ProgressPrinter(const ProgressPrinter&) = delete;
  ProgressPrinter& operator=(const ProgressPrinter&) = delete;

  // If the visits are known only during the run; the first one is under way or done.
  void SetPlan(std::vector<PlannedStage> plan);
  void Report(const Progress& progress);
  void Finish();  // the run is complete
  // Takes an unfinished bar off the screen, so that a message gets a line of its own.
  void Clear();

 private:
  using Clock = std::chrono::steady_clock;
  void EndStage(bool done);
  void Draw(double fraction);
  double SecondsLeft() const;  // below 0: not known yet

  const ProgressStyle style_;
  std::mutex mutex_;
  Progress newest_;  // no stage: none is under way
  OverallProgress whole_;
  const Clock::time_point begin_ = Clock::now();
  Clock::time_point start_, last_drawn_;  // of the stage
  bool finished_ = false, drawn_ = false;
};

// "auto", "bar", "plain", "json", "none"; auto: bars where stderr is a terminal, else plain lines.
ProgressStyle ParseProgressStyle(const std::string& name);

}  // namespace retint::cli
