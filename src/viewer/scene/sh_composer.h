// SPDX-License-Identifier: BSD-3-Clause
// A thread that turns regions into coefficients (editing/color_preview.h). Only the newest
// request counts.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "editing/color_preview.h"

namespace retint {

class ShComposer {
 public:
  struct Request {
    std::shared_ptr<const GaussianModel> original;
    std::shared_ptr<Backend> backend;
    RegionSet regions;
    RefitJob job;  // that the fits are of
    uint64_t generation = 0;
  };
  struct Result {
    ColorPreview::Colors colors;  // of a null `sh`: it failed
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
  void Loop();
  ColorPreview::Colors Work(const Request& request);

  const OnComposed on_composed_;
  std::unique_ptr<ColorPreview> preview_;  // the thread's own
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Request> pending_;
  bool drop_ = false, quit_ = false;
  std::thread thread_;  // last: starts when everything above exists
};

}  // namespace retint
