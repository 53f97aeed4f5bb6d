// SPDX-License-Identifier: BSD-3-Clause
#include "base/monitor.h"

#include <algorithm>

#include "base/error.h"

namespace retint {

void Monitor::Step(std::string_view stage, double done, double total) {
  ThrowIfCancelled();
  if (!callback_) return;
  const double fraction = total > 0 ? std::clamp(done / total, 0.0, 1.0) : 1.0;
  std::lock_guard lock(mutex_);
  callback_({std::string(stage), fraction});
}

void Monitor::ThrowIfCancelled() const {
  if (IsCancelled()) throw Cancelled();
}

}  // namespace retint
