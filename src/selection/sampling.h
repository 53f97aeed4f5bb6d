// SPDX-License-Identifier: BSD-3-Clause
// Seeded sampling with the same result on every machine.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

namespace retint {

// `wanted` of the indices 0 .. count-1, ascending, each subset equally likely (Knuth, TAOCP 3.4.2,
// algorithm S). Uses the engine's bits directly: standard distributions differ between libraries.
inline std::vector<size_t> SampleIndices(size_t count, size_t wanted, uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::vector<size_t> sampled(wanted);
  size_t taken = 0;
  for (size_t i = 0; i < count && taken < wanted; ++i) {
    const double uniform = static_cast<double>(engine() >> 11) * 0x1p-53;
    sampled[taken] = i;  // branchless: a branch would be mispredicted every second time
    taken += uniform * double(count - i) < double(wanted - taken);
  }
  sampled.resize(taken);
  return sampled;
}

}  // namespace retint
