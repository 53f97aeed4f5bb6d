// SPDX-License-Identifier: BSD-3-Clause
// Progress and cancellation of long work, passed down by reference. Thread-safe.
#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>

namespace retint {

struct Progress {
  std::string
      stage;  // "load", "depth", "cloud", "registration", "projection", "refit", "save", ...
  double fraction = 0;  // of this stage, in [0, 1]
};

class Monitor {
 public:
  using Callback = std::function<void(const Progress&)>;

  Monitor() = default;
  explicit Monitor(Callback callback) : callback_(std::move(callback)) {}

  // Reports `done` of `total` steps of `stage` and throws Cancelled when the work was cancelled.
  // Called between views.
  void Step(std::string_view stage, double done, double total);
  void ThrowIfCancelled() const;
  void Cancel() { cancelled_.store(true, std::memory_order_relaxed); }  // async-signal-safe
  bool IsCancelled() const { return cancelled_.load(std::memory_order_relaxed); }

 private:
  Callback callback_;
  std::mutex mutex_;
  std::atomic<bool> cancelled_{false};
};

}  // namespace retint
