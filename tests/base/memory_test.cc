// SPDX-License-Identifier: BSD-3-Clause
#include "base/memory.h"

#include <cstdio>
#include <cstring>
#include <memory>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

namespace retint {
namespace {

TEST(Memory, PopulatingKeepsWhatIsThere) {
  std::vector<char> values(size_t{1} << 20);
  for (size_t i = 0; i < values.size(); ++i) values[i] = char(i % 251);
  const std::vector<char> before = values;
  PopulatePages(values.data() + 1, values.size() - 3);  // no whole pages at either end
  PopulatePages(values.data(), 0);
  PopulatePages(nullptr, 0);
  EXPECT_EQ(values, before);
}

TEST(Memory, ReservingPopulatedKeepsWhatIsThere) {
  for (const size_t count : {size_t{10}, size_t{1} << 20}) {
    std::vector<float> values = {1, 2, 3};
    ReservePopulated(values, count);
    EXPECT_EQ(values, (std::vector<float>{1, 2, 3}));
    values.resize(count);
    std::vector<float> expected(count);
    expected[0] = 1, expected[1] = 2, expected[2] = 3;
    EXPECT_EQ(values, expected);
  }
}

TEST(Memory, AnUnsetVectorIsResizedAsItsAllocatorSays) {
  UnsetVector<float> values(3, 7.0f);
  const float* const data = values.data();
  values.resize(1);
  values.resize(3);
  EXPECT_EQ(values.data(), data);
  EXPECT_EQ(values, (UnsetVector<float>{7, 7, 7}));  // left as it was
  values.resize(1);
  values.resize(3, 0);
  EXPECT_EQ(values, (UnsetVector<float>{7, 0, 0}));
}

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

double ResidentMb() {
  long size = 0, resident = 0;
  FILE* const file = std::fopen("/proc/self/statm", "r");
  if (!file) return 0;
  const int read = std::fscanf(file, "%ld %ld", &size, &resident);
  std::fclose(file);
  return read == 2 ? double(resident) * double(sysconf(_SC_PAGESIZE)) / (1 << 20) : 0;
}

// Small blocks below one that stays: the C library keeps their memory until it is told to free it.
TEST(Memory, FreedBlocksGoBackToTheSystem) {
  constexpr size_t kBlock = 1000, kCount = 64 * 1000;  // 61 MiB
  std::vector<std::unique_ptr<char[]>> blocks(kCount);
  for (auto& block : blocks) {
    block = std::make_unique_for_overwrite<char[]>(kBlock);
    std::memset(block.get(), 1, kBlock);
  }
  const auto last = std::make_unique<char[]>(kBlock);
  blocks.clear();
  const double before = ResidentMb();
  ASSERT_GT(before, 0);
  ReleaseFreedMemory();
  EXPECT_LT(ResidentMb(), before - 30);  // at least half of it, whatever else the process does
}

// Freeing a block of 16 MiB would otherwise let the C library keep all up to that size.
TEST(Memory, LargeBlocksGoBackAtOnce) {
  GiveLargeBlocksBackAtOnce();
  constexpr size_t kLarge = size_t{16} << 20, kBlock = size_t{512} << 10, kCount = 100;
  std::make_unique<char[]>(kLarge).reset();
  std::vector<std::unique_ptr<char[]>> blocks;
  std::vector<std::unique_ptr<char[]>> between;  // keep the end of the heap in use
  for (size_t b = 0; b < kCount; ++b) {
    blocks.push_back(std::make_unique_for_overwrite<char[]>(kBlock));
    std::memset(blocks.back().get(), 1, kBlock);
    between.push_back(std::make_unique<char[]>(1000));
  }
  const double before = ResidentMb();
  ASSERT_GT(before, 50);
  blocks.clear();
  EXPECT_LT(ResidentMb(), before - 40);
}

#endif

}  // namespace
}  // namespace retint
