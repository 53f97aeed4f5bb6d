// SPDX-License-Identifier: BSD-3-Clause
// A thread that turns regions into coefficients: what is fitted as fitted, the rest in closed form.
// Only the newest request counts. Only the Gaussians that some region touches are computed and
// written, into buffers that are used again, so that a change of color costs next to nothing.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
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
  struct Result {
    std::shared_ptr<const FloatArray> sh;                // [N, K, 3]; null: it failed
    std::shared_ptr<const std::vector<int32_t>> active;  // where it may differ from the original
    uint64_t generation = 0;
    std::string failure = {};  // why there is no `sh`, for people
  };
  // Called on the composer's thread.
  using OnComposed = std::function<void(const Result& result)>;

  explicit ShComposer(OnComposed on_composed);
  ~ShComposer();

  void Compose(Request request);
  void Drop();  // the request that waits, and what was kept for the next

 private:
  class Touched;
  class Buffers;
  void Loop();
  Result Work(const Request& request);

  const OnComposed on_composed_;
  // The thread's own.
  std::unique_ptr<Touched> touched_;
  std::shared_ptr<Buffers> buffers_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Request> pending_;
  bool drop_ = false, quit_ = false;
  std::thread thread_;  // last: starts when everything above exists
};

}  // namespace retint
