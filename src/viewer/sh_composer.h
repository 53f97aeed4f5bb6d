// SPDX-License-Identifier: BSD-3-Clause
// A thread that turns regions into coefficients: what is fitted as fitted, the rest in closed form.
// Only the newest request counts.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "scene/gaussian_model.h"
#include "session/region.h"

namespace retint {

class ShComposer {
 public:
  struct Request {
    std::shared_ptr<const GaussianModel> original;
    RegionSet regions;
    RefitJob job;  // that the fits are of
    uint64_t generation = 0;
  };
  using Sh = std::shared_ptr<const std::vector<float>>;
  // Called on the composer's thread.
  using OnComposed = std::function<void(Sh sh, uint64_t generation)>;

  explicit ShComposer(OnComposed on_composed);
  ~ShComposer();

  void Compose(Request request);
  void Drop();  // the request that waits, and what was kept for the next

 private:
  void Loop();

  const OnComposed on_composed_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Request> pending_;
  bool drop_ = false, quit_ = false;
  std::thread thread_;  // last: starts when everything above exists
};

}  // namespace retint
