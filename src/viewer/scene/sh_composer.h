// SPDX-License-Identifier: BSD-3-Clause
// A thread that computes coefficients of regions (editing/color_preview.h). Only the newest request
// counts.
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
    RefitJob job;  // for the fits
    uint64_t generation = 0;
  };
  struct Result {
    ColorPreview::Colors colors;  // a null `sh`: failed
    uint64_t generation = 0;
    std::string failure = {};  // for the user
  };
  // Is called on the composer's thread.
  using OnComposed = std::function<void(const Result& result)>;

  explicit ShComposer(OnComposed on_composed);
  ~ShComposer();

  void Compose(Request request);
  void Drop();  // the waiting request, and prepared data

 private:
  void Loop();
  ColorPreview::Colors Work(const Request& request);

  const OnComposed on_composed_;
  std::unique_ptr<ColorPreview> preview_;  // used only on the thread
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Request> pending_;
  bool drop_ = false, quit_ = false;
  std::thread thread_;  // last: it starts when all members above exist
};

}  // namespace retint
