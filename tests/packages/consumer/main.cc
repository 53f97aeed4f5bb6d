// SPDX-License-Identifier: BSD-3-Clause
// A program of somebody else's: says how many Gaussians a splat has.
#include <iostream>

#include "base/error.h"
#include "base/run_clock.h"
#include "splat_io/splat_io.h"

int main(int argc, char** argv) try {
  std::cout << "Retint " << retint::Version() << "\n";
  if (argc > 1) std::cout << retint::ReadSplat(argv[1]).NumGaussians() << " Gaussians\n";
} catch (const retint::Error& error) {
  std::cout << error.what() << "\n";
  return 3;
}
