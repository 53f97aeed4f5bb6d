// SPDX-License-Identifier: BSD-3-Clause
// Progress on stderr: a bar a stage on a terminal, plain lines or JSON lines elsewhere.
#pragma once

#include <chrono>
#include <mutex>
#include <string>

#include "base/monitor.h"

namespace retint::cli {

enum class ProgressStyle { kNone, kBar, kPlain, kJson };

// Prints what a Monitor reports. Calls may come from any thread.
class ProgressPrinter {
 public:
  explicit ProgressPrinter(ProgressStyle style) : style_(style) {}
  ~ProgressPrinter() { EndStage(/*done=*/false); }
  ProgressPrinter(const ProgressPrinter&) = delete;
  ProgressPrinter& operator=(const ProgressPrinter&) = delete;

  void Report(const Progress& progress);
  void Finish();  // the last stage is complete
  // Takes an unfinished bar off the screen, so that a message gets a line of its own.
  void Clear();

 private:
  using Clock = std::chrono::steady_clock;
  void EndStage(bool done);
  void Draw(double fraction);
  double Seconds() const;

  const ProgressStyle style_;
  std::mutex mutex_;
  std::string stage_;
  double fraction_ = 0;
  Clock::time_point start_, last_drawn_;
  bool drawn_ = false;
};

// "auto", "bar", "plain", "json", "none"; auto: bars where stderr is a terminal, else plain lines.
ProgressStyle ParseProgressStyle(const std::string& name);

}  // namespace retint::cli
