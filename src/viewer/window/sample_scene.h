// SPDX-License-Identifier: BSD-3-Clause
// The sample scene for practice, made once by the code of `retint synth`.
#pragma once

#include <filesystem>
#include <mutex>
#include <thread>

#include "base/monitor.h"

namespace retint {

class SampleScene {
 public:
  explicit SampleScene(std::filesystem::path folder) : folder_(std::move(folder)) {}
  ~SampleScene();

  const std::filesystem::path& folder() const { return folder_; }
  // Starts making it on another thread, so that it is ready when needed. Make() reports failures.
  // Call it once.
  void Prepare();
  // Returns when it is ready. InputError and RunError as for any new workspace; Cancelled. On any
  // thread.
  void Make(Monitor& monitor);

 private:
  void MakeAlone(Monitor& monitor);

  const std::filesystem::path folder_;
  std::timed_mutex making_;
  Monitor background_;
  std::thread thread_;
};

}  // namespace retint
