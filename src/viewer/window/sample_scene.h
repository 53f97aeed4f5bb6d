// SPDX-License-Identifier: BSD-3-Clause
// The scene to practice on, made once by the same code as `retint synth`.
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
  // Starts making it on a thread of its own, so that it is there when somebody asks for it. What
  // goes wrong then is told by Make(). Call it once.
  void Prepare();
  // Returns once it is there. InputError and RunError as the making of any workspace; Cancelled. On
  // any thread.
  void Make(Monitor& monitor);

 private:
  void MakeAlone(Monitor& monitor);

  const std::filesystem::path folder_;
  std::timed_mutex making_;
  Monitor background_;
  std::thread thread_;
};

}  // namespace retint
