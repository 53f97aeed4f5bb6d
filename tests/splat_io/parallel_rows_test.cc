// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/parallel_rows.h"

#include <map>
#include <mutex>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>

#include <gtest/gtest.h>

namespace retint {
namespace {

TEST(ForEachTaskTest, TasksBeginInTheirOrder) {
  // Last number first; how long a task takes does not follow the order.
  std::vector<size_t> order(200);
  std::iota(order.rbegin(), order.rend(), size_t{0});
  std::mutex mutex;
  std::map<std::thread::id, std::vector<size_t>> tasks_of;
  std::vector<double> sums(order.size());
  ForEachTask(order, [&](size_t i) {
    {
      const std::lock_guard lock(mutex);
      tasks_of[std::this_thread::get_id()].push_back(i);
    }
    for (size_t k = 0; k < 1000 * (1 + i * 7 % 50); ++k) sums[i] += 1.0 / double(k + 1);
  });
  size_t tasks = 0;
  for (const auto& [thread, numbers] : tasks_of) {
    EXPECT_TRUE(std::is_sorted(numbers.rbegin(), numbers.rend()));
    tasks += numbers.size();
  }
  EXPECT_EQ(tasks, order.size());
  for (size_t i = 0; i < sums.size(); ++i) EXPECT_GT(sums[i], 0) << i;
}

TEST(ForEachTaskTest, OfSeveralFaultsTheFirstIsThrown) {
  try {
    ForEachTask({3, 2, 1, 0}, [](size_t i) {
      if (i > 0) throw std::runtime_error(std::to_string(i));
    });
    FAIL() << "nothing was thrown";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "1");
  }
}

TEST(ForEachTaskTest, TheLargestComesFirst) {
  const std::vector<std::string> tasks = {"a", "ccc", "bb", "ddd"};
  EXPECT_EQ(LargestFirst(tasks), (std::vector<size_t>{1, 3, 2, 0}));
}

}  // namespace
}  // namespace retint
