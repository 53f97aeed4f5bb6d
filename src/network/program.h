// SPDX-License-Identifier: BSD-3-Clause
// A network that another program runs, such as one in PyTorch.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "base/process.h"
#include "base/temporary_folder.h"
#include "scene/image.h"

namespace retint {

// The program is started by the first question and lives as long as this, or until a question
// fails or is cancelled; the next question then starts it again. A question is a line on its stdin,
// with tabs between its parts:
//   IMAGE.png ... OUTPUT
// It writes one number a pixel to OUTPUT.npy, OUTPUT.pfm or OUTPUT.png (network/pixel_file.h), then
// the line "ok" on stdout. Any other answer is its own message of a fault.
class NetworkProgram {
 public:
  explicit NetworkProgram(std::string command);

  // Pixels of the first image's size. RunError if the program fails, InputError if its output
  // cannot be read or has another size. Thread-safe.
  ScalarImage Ask(const std::vector<const Image8*>& images, const Monitor& monitor) const;

 private:
  ScalarImage Answer(const std::vector<const Image8*>& images, const Monitor& monitor) const;

  const std::string command_;
  mutable std::mutex mutex_;
  mutable std::unique_ptr<TemporaryFolder> folder_;
  mutable std::unique_ptr<LineProcess> process_;
};

}  // namespace retint
