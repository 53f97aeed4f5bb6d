// SPDX-License-Identifier: BSD-3-Clause
// One figure for a whole run out of its stages' reports to a Monitor.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/monitor.h"

namespace retint {

// A visit to a stage. A stage that comes three times is planned three times.
struct PlannedStage {
  std::string name;
  double weight = 0;  // above 0: about how long it takes, in any unit
};

// Not thread-safe; a Monitor's callback is never called twice at once.
class OverallProgress {
 public:
  // Visits in the order in which they come. Empty: the whole is known at the end only.
  explicit OverallProgress(std::vector<PlannedStage> plan = {});

  // Takes over a stage's report and returns fraction(). A stage that is not among the visits to
  // come changes nothing, and planned visits that are left out count as done.
  double Update(const Progress& progress);
  double fraction() const { return fraction_; }  // of the whole, in [0, 1]; never falls

 private:
  std::vector<PlannedStage> plan_;
  double total_ = 0, before_ = 0;  // of all weights; of the visits before the one under way
  size_t next_ = 0;                // in the plan, after the one under way
  Progress newest_;                // of the visit under way
  double fraction_ = 0;
};

// Whether `next` begins another visit to a stage whose newest report is `newest`.
bool IsNewVisit(const Progress& newest, const Progress& next);

}  // namespace retint
