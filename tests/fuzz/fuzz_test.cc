// SPDX-License-Identifier: BSD-3-Clause
// Every reader on almost valid files: it reads them, or reports the fault in one line.
// RETINT_FUZZ_RUNS in the environment sets more runs than the few of a test.
#include <cstdlib>
#include <random>

#include <gtest/gtest.h>

#include "base/files.h"
#include "tests/fuzz/mutate.h"
#include "tests/fuzz/targets.h"
#include "tests/support/data.h"

namespace retint {
namespace {

std::vector<const FuzzTarget*> AllTargets() {
  std::vector<const FuzzTarget*> targets;
  for (const FuzzTarget& target : RETINT_FUZZ_GROUP()) targets.push_back(&target);
  return targets;
}

int Runs(const FuzzTarget& target) {
  if (const char* runs = std::getenv("RETINT_FUZZ_RUNS")) return std::atoi(runs);
  // Opening a session takes a hundred times as long as reading a file.
  return std::string_view(target.name) == "session" ? 60 : 400;
}

class Fuzz : public testing::TestWithParam<const FuzzTarget*> {};

TEST_P(Fuzz, NothingButOurOwnErrors) {
  const FuzzTarget& target = *GetParam();
  const TempFolder folder;
  if (target.prepare) target.prepare(folder.path());
  std::vector<std::string> seeds = target.seeds();
  for (const char* name : target.data) {
    if (std::filesystem::exists(DataPath(name))) seeds.push_back(ReadFile(DataPath(name)));
  }
  ASSERT_FALSE(seeds.empty());
  for (const std::string& seed : seeds) {
    ASSERT_FALSE(seed.empty());
    RunTarget(target, folder.path(), seed);
  }
  std::mt19937 random(1);
  for (int run = 0; run < Runs(target); ++run) {
    std::string bytes = seeds[random() % seeds.size()];
    const std::string& other = seeds[random() % seeds.size()];
    for (int times = 1 + static_cast<int>(random() % 4); times > 0; --times) {
      MutateOnce(random, other, &bytes);
    }
    try {
      RunTarget(target, folder.path(), bytes);
    } catch (const std::exception& error) {
      const auto kept = std::filesystem::temp_directory_path() /
                        (std::string("retint-fuzz-") + target.name + "-" + std::to_string(run));
      WriteFile(kept, bytes);
      FAIL() << "run " << run << ": " << error.what() << "; the file is kept as " << kept;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Targets, Fuzz, testing::ValuesIn(AllTargets()),
                         [](const auto& one) { return std::string(one.param->name); });

}  // namespace
}  // namespace retint
