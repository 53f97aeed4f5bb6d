// SPDX-License-Identifier: BSD-3-Clause
#include "base/monitor.h"

#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"

namespace retint {
namespace {

TEST(MonitorTest, ReportsStageAndFractionWithinUnity) {
  std::vector<Progress> seen;
  Monitor monitor([&](const Progress& progress) { seen.push_back(progress); });
  monitor.Step("depth", 0, 4);
  monitor.Step("depth", 1, 4);
  monitor.Step("refit", 9, 4);
  monitor.Step("save", 0, 0);
  ASSERT_EQ(seen.size(), 4u);
  EXPECT_EQ(seen[1].stage, "depth");
  EXPECT_EQ(seen[0].fraction, 0);
  EXPECT_EQ(seen[1].fraction, 0.25);
  EXPECT_EQ(seen[2].fraction, 1) << "more done than there was";
  EXPECT_EQ(seen[3].fraction, 1) << "nothing to do is done";
}

TEST(MonitorTest, SilentWithoutCallback) {
  Monitor monitor;
  EXPECT_NO_THROW(monitor.Step("depth", 1, 2));
}

TEST(MonitorTest, CancelStopsTheNextStepAndReportsNothingMore) {
  int reports = 0;
  Monitor monitor([&](const Progress&) { ++reports; });
  monitor.Step("refit", 1, 3);
  EXPECT_FALSE(monitor.IsCancelled());
  monitor.Cancel();
  EXPECT_TRUE(monitor.IsCancelled());
  EXPECT_THROW(monitor.Step("refit", 2, 3), Cancelled);
  EXPECT_THROW(monitor.ThrowIfCancelled(), Cancelled);
  EXPECT_EQ(reports, 1);
}

TEST(MonitorTest, CallbackMayCancel) {
  Monitor* self = nullptr;
  Monitor monitor([&](const Progress& progress) {
    if (progress.fraction >= 0.5) self->Cancel();
  });
  self = &monitor;
  int steps = 0;
  EXPECT_THROW(
      {
        for (; steps < 10; ++steps) monitor.Step("refit", steps, 10);
      },
      Cancelled);
  EXPECT_EQ(steps, 6) << "the step after the one at 0.5";
}

TEST(MonitorTest, CallbackIsNeverEnteredTwiceAtOnce) {
  int inside = 0, most = 0, calls = 0;  // unguarded on purpose: the monitor's lock guards them
  Monitor monitor([&](const Progress&) {
    most = std::max(most, ++inside);
    ++calls;
    std::this_thread::yield();
    --inside;
  });
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (int i = 0; i < 500; ++i) monitor.Step("cloud", i, 500);
    });
  }
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(most, 1);
  EXPECT_EQ(calls, 2000);
}

}  // namespace
}  // namespace retint
