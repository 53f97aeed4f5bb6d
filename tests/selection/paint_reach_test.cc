// SPDX-License-Identifier: BSD-3-Clause
#include "selection/paint_reach.h"

#include <gtest/gtest.h>

namespace retint {
namespace {

TEST(PaintReach, EachChoiceIsRecognizedAgain) {
  EXPECT_EQ(ReachOf(ProjectorOptions()), PaintReach::kObject);
  ProjectorOptions options;
  for (const PaintReach reach : {PaintReach::kExact, PaintReach::kSurface, PaintReach::kObject}) {
    SetReach(reach, &options);
    EXPECT_EQ(ReachOf(options), reach);
    options.Check();
  }
  // Back at the default, nothing of the other choices is left.
  EXPECT_EQ(options.unknown_weight, ProjectorOptions().unknown_weight);
}

TEST(PaintReach, ChoicesKeepTheSlack) {
  ProjectorOptions options;
  options.paint_slack = 0.01;
  for (const PaintReach reach : {PaintReach::kSurface, PaintReach::kExact, PaintReach::kObject}) {
    SetReach(reach, &options);
    EXPECT_EQ(options.paint_slack, 0.01);
  }
}

TEST(PaintReach, OtherOptionsStandForNoChoice) {
  ProjectorOptions options;
  options.completion = Completion::kAll;
  EXPECT_EQ(ReachOf(options), std::nullopt);
  options = {};
  options.kind = ProjectorKind::kQuads;
  EXPECT_EQ(ReachOf(options), std::nullopt);
  SetReach(PaintReach::kSurface, &options);
  EXPECT_EQ(options.kind, ProjectorKind::kGaussians);
}

}  // namespace
}  // namespace retint
