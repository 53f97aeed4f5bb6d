// SPDX-License-Identifier: BSD-3-Clause
// Shared parts of main() in measuring programs.
#pragma once

#include <cstdio>
#include <exception>

namespace retint {

// main_of(argc, argv); after an exception 1, with a line on stderr.
template <typename Main>
int RunProgram(const char* name, const Main& main_of, int argc, char** argv) {
  try {
    return main_of(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", name, error.what());
    return 1;
  }
}

}  // namespace retint
