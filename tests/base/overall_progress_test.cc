// SPDX-License-Identifier: BSD-3-Clause
#include "base/overall_progress.h"

#include <gtest/gtest.h>

namespace retint {
namespace {

TEST(OverallProgress, IsTheShareOfTheWeights) {
  OverallProgress whole({{"load", 1}, {"depth", 3}, {"refit", 6}});
  EXPECT_EQ(whole.fraction(), 0);
  EXPECT_DOUBLE_EQ(whole.Update({"load", 0.5}), 0.05);
  EXPECT_DOUBLE_EQ(whole.Update({"depth", 0}), 0.1);
  EXPECT_DOUBLE_EQ(whole.Update({"depth", 1}), 0.4);
  EXPECT_DOUBLE_EQ(whole.Update({"refit", 0.5}), 0.7);
  EXPECT_DOUBLE_EQ(whole.Update({"refit", 1}), 1);
}

TEST(OverallProgress, VisitsOfOneNameFollowEachOther) {
  OverallProgress whole({{"depth", 1}, {"cloud", 1}, {"depth", 1}, {"cloud", 1}});
  whole.Update({"depth", 1});
  whole.Update({"cloud", 1});
  EXPECT_DOUBLE_EQ(whole.fraction(), 0.5);
  EXPECT_DOUBLE_EQ(whole.Update({"depth", 0.5}), 0.625);

  OverallProgress twice({{"completion", 1}, {"completion", 1}});
  EXPECT_DOUBLE_EQ(twice.Update({"completion", 1}), 0.5);
  EXPECT_DOUBLE_EQ(twice.Update({"completion", 0}), 0.5);
  EXPECT_DOUBLE_EQ(twice.Update({"completion", 1}), 1);
}

TEST(OverallProgress, NeverFallsWhateverComes) {
  OverallProgress whole({{"load", 1}, {"depth", 1}, {"refit", 1}});
  double last = 0;
  const Progress reports[] = {{"load", 1},    {"check", 0.3}, {"depth", 0.8}, {"depth", 0.7},
                              {"load", 0},    {"load", 1},    {"depth", 0},   {"depth", 1},
                              {"refit", 0.2}, {"depth", 1},   {"refit", 0.6}, {"refit", 0}};
  for (const Progress& report : reports) {
    const double now = whole.Update(report);
    EXPECT_GE(now, last) << report.stage << ' ' << report.fraction;
    EXPECT_LE(now, 1);
    last = now;
  }
}

TEST(OverallProgress, WhatIsLeftOutCountsAsDone) {
  OverallProgress whole({{"load", 1}, {"depth", 1}, {"refit", 2}});
  EXPECT_DOUBLE_EQ(whole.Update({"refit", 0}), 0.5);
  EXPECT_DOUBLE_EQ(whole.Update({"depth", 1}), 0.5);
}

TEST(OverallProgress, WithoutAPlanIsNotKnown) {
  EXPECT_EQ(OverallProgress().Update({"load", 1}), 0);
}

}  // namespace
}  // namespace retint
