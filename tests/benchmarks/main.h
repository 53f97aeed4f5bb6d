// SPDX-License-Identifier: BSD-3-Clause
// What the measuring programs' main() have in common.
#pragma once

#include <cstdio>
#include <exception>

namespace retint {

// main_of(argc, argv), or 1 with a line on stderr for what it throws.
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
