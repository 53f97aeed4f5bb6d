// SPDX-License-Identifier: BSD-3-Clause
#include "base/overall_progress.h"

#include <algorithm>
#include <utility>

namespace retint {

bool IsNewVisit(const Progress& newest, const Progress& next) {
  constexpr double kBack = 0.5;  // reports of several threads may overtake each other by less
  return next.stage != newest.stage || next.fraction + kBack < newest.fraction;
}

OverallProgress::OverallProgress(std::vector<PlannedStage> plan) : plan_(std::move(plan)) {
  for (const PlannedStage& visit : plan_) total_ += visit.weight;
}

double OverallProgress::Update(const Progress& progress) {
  if (IsNewVisit(newest_, progress)) {
    const auto begin = plan_.begin() + static_cast<ptrdiff_t>(next_);
    const auto found = std::find_if(begin, plan_.end(), [&](const PlannedStage& visit) {
      return visit.name == progress.stage;
    });
    if (found == plan_.end()) return fraction_;
    before_ = 0;
    for (auto visit = plan_.begin(); visit != found; ++visit) before_ += visit->weight;
    next_ = static_cast<size_t>(found - plan_.begin()) + 1;
  } else if (next_ == 0) {
    return fraction_;
  }
  newest_ = progress;
  const double done = before_ + plan_[next_ - 1].weight * progress.fraction;
  fraction_ = std::max(fraction_, std::min(1.0, done / total_));
  return fraction_;
}

}  // namespace retint
