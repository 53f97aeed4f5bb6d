// SPDX-License-Identifier: BSD-3-Clause
// Time since it was made.
#pragma once

#include <chrono>

namespace retint {

class Stopwatch {
 public:
  double Milliseconds() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_)
        .count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace retint
