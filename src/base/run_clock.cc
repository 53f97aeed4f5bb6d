// SPDX-License-Identifier: BSD-3-Clause
#include "base/run_clock.h"

#include <sys/resource.h>

namespace retint {

std::string_view Version() { return RETINT_VERSION; }

double PeakRssMb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;  // Linux counts KiB
}

double StageClock::Get(const std::string& stage) const {
  const auto found = stages_.find(stage);
  return found == stages_.end() ? 0 : found->second;
}

double StageClock::MillisecondsSince(std::chrono::steady_clock::time_point start) const {
  return std::chrono::duration<double, std::milli>(now_() - start).count();
}

}  // namespace retint
