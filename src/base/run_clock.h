// SPDX-License-Identifier: BSD-3-Clause
// The figures of a run: the program's version, its memory, and its time by stage.
#pragma once

#include <chrono>
#include <map>
#include <string>
#include <string_view>
#include <utility>

namespace retint {

// The version of the program, "0.1.0".
std::string_view Version();

// Highest resident set size of this process so far, MiB.
double PeakRssMb();

// Wall-clock time per stage, summed over visits.
class StageClock {
 public:
  using Now = std::chrono::steady_clock::time_point (*)();
  explicit StageClock(Now now = std::chrono::steady_clock::now) : now_(now) {}

  // Runs until destroyed.
  class Lap {
   public:
    Lap(StageClock& clock, std::string stage) : clock_(clock), stage_(std::move(stage)) {}
    ~Lap() { clock_.Add(stage_, clock_.MillisecondsSince(start_)); }
    Lap(const Lap&) = delete;
    Lap& operator=(const Lap&) = delete;

   private:
    StageClock& clock_;
    std::string stage_;
    std::chrono::steady_clock::time_point start_ = clock_.now_();
  };

  void Add(const std::string& stage, double milliseconds) { stages_[stage] += milliseconds; }
  double Get(const std::string& stage) const;                 // 0 when it never ran
  double Total() const { return MillisecondsSince(start_); }  // since the clock was made

 private:
  double MillisecondsSince(std::chrono::steady_clock::time_point start) const;
  Now now_;
  std::map<std::string, double> stages_;
  std::chrono::steady_clock::time_point start_ = now_();
};

}  // namespace retint
