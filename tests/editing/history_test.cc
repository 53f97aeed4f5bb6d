// SPDX-License-Identifier: BSD-3-Clause
#include "editing/history.h"

#include <gtest/gtest.h>

namespace retint {
namespace {

// A state with one region whose selection holds `bytes` of shares.
RegionSet StateOf(const std::string& name, size_t bytes = 0) {
  RegionSet state;
  Region region;
  region.id = 1;
  region.name = name;
  auto selection = std::make_shared<RegionSelection>();
  selection->shares.resize(bytes / sizeof(float));
  region.selection = selection;
  state.regions.push_back(region);
  return state;
}

std::string NameOf(const EditHistory& history) {
  return history.current().regions.empty() ? "" : history.current().regions[0].name;
}

TEST(EditHistory, StartsEmptyAndCannotMove) {
  EditHistory history;
  EXPECT_TRUE(history.current().regions.empty());
  EXPECT_FALSE(history.CanUndo());
  EXPECT_FALSE(history.CanRedo());
  EXPECT_FALSE(history.Undo());
  EXPECT_FALSE(history.Redo());
}

TEST(EditHistory, UndoAndRedoWalkTheStates) {
  EditHistory history;
  history.Push("one", StateOf("a"));
  history.Push("two", StateOf("b"));
  EXPECT_EQ(history.UndoLabel(), "two");
  ASSERT_TRUE(history.Undo());
  EXPECT_EQ(NameOf(history), "a");
  EXPECT_EQ(history.RedoLabel(), "two");
  ASSERT_TRUE(history.Undo());
  EXPECT_EQ(NameOf(history), "");
  ASSERT_TRUE(history.Redo());
  ASSERT_TRUE(history.Redo());
  EXPECT_EQ(NameOf(history), "b");
  EXPECT_FALSE(history.CanRedo());
}

TEST(EditHistory, ANewEditForgetsWhatWasUndone) {
  EditHistory history;
  history.Push("one", StateOf("a"));
  history.Push("two", StateOf("b"));
  history.Undo();
  history.Push("three", StateOf("c"));
  EXPECT_FALSE(history.CanRedo());
  EXPECT_EQ(NameOf(history), "c");
  history.Undo();
  EXPECT_EQ(NameOf(history), "a");
}

TEST(EditHistory, ADragIsOneStep) {
  EditHistory history;
  history.Push("one", StateOf("a"));
  history.Push("drag", StateOf("b"), "slider");
  history.Push("drag", StateOf("c"), "slider");
  history.EndMerge();
  history.Push("drag", StateOf("d"), "slider");
  EXPECT_EQ(NameOf(history), "d");
  history.Undo();
  EXPECT_EQ(NameOf(history), "c");
  history.Undo();
  EXPECT_EQ(NameOf(history), "a");
}

TEST(EditHistory, ADragAfterUndoStartsAStepOfItsOwn) {
  EditHistory history;
  history.Push("drag", StateOf("a"), "slider");
  history.Push("other", StateOf("b"));
  history.Undo();
  history.Push("drag", StateOf("c"), "slider");
  history.Undo();
  EXPECT_EQ(NameOf(history), "a");
}

TEST(EditHistory, DropsTheOldestBeyondItsBudget) {
  EditHistory history(10000);
  for (const char* name : {"a", "b", "c", "d"}) history.Push(name, StateOf(name, 4000));
  EXPECT_LE(history.bytes(), 10000u);
  EXPECT_EQ(NameOf(history), "d");
  ASSERT_TRUE(history.Undo());
  EXPECT_EQ(NameOf(history), "c");
  EXPECT_FALSE(history.CanUndo());
}

TEST(EditHistory, KeepsTheCurrentStateWhateverItsSize) {
  EditHistory history(1000);
  history.Push("big", StateOf("a", 50000));
  EXPECT_EQ(NameOf(history), "a");
  EXPECT_FALSE(history.CanUndo());
}

TEST(EditHistory, SharedPartsAreCountedOnce) {
  EditHistory history;
  const RegionSet state = StateOf("a", 40000);
  history.Push("one", state);
  const size_t one = history.bytes();
  RegionSet renamed = state;
  renamed.regions[0].name = "b";
  history.Push("two", renamed);
  EXPECT_GE(one, 40000u);
  EXPECT_LT(history.bytes(), one + 1000);
}

TEST(EditHistory, AFitBelongsToTheStateItWasMadeFor) {
  EditHistory history;
  history.Push("one", StateOf("a"));
  const auto fit = std::make_shared<RegionFit>();
  history.SetFit(1, fit);
  history.SetFit(99, fit);  // a region that is gone
  RegionSet next = history.current();
  next.regions[0].strength = 0.5F;
  next.regions[0].fit = nullptr;
  history.Push("two", next);
  EXPECT_EQ(history.current().regions[0].fit, nullptr);
  history.Undo();
  EXPECT_EQ(history.current().regions[0].fit, fit);
}

TEST(RegionSet, FitKeyTellsEverythingAFitDependsOn) {
  RegionSet state = StateOf("a");
  Region second = state.regions[0];
  second.id = 2;
  state.regions.push_back(second);
  const RefitJob job;
  const std::string first_key = state.FitKey(0, job), second_key = state.FitKey(1, job);
  EXPECT_NE(first_key, second_key);

  RegionSet renamed = state;
  renamed.regions[0].name = "other";
  EXPECT_EQ(renamed.FitKey(1, job), second_key) << "a name changes no coefficient";

  RegionSet tinted = state;
  tinted.regions[0].edit = ColorEdit::Tint({1, 0, 0});
  EXPECT_NE(tinted.FitKey(0, job), first_key);
  EXPECT_NE(tinted.FitKey(1, job), second_key) << "the second starts from what the first left";

  RegionSet later = state;
  later.regions[1].strength = 0.5F;
  EXPECT_EQ(later.FitKey(0, job), first_key) << "later regions do not matter to earlier ones";

  RegionSet measured = state;
  ColorOperation palette = ColorOperation::Make(ColorOperationKind::kPalette,
                                                {0.5F, 0.5F, 0.5F, kUnset, kUnset, kUnset});
  measured.regions[0].edit.operations.push_back(palette);
  EXPECT_EQ(measured.FitKey(0, job), first_key) << "measuring colors changes none";
  palette.values[3] = palette.values[4] = palette.values[5] = 1;
  measured.regions[0].edit.operations.back() = palette;
  EXPECT_NE(measured.FitKey(0, job), first_key);

  RegionSet hidden = state;
  hidden.regions[0].visible = false;
  EXPECT_NE(hidden.FitKey(1, job), second_key);

  RefitJob other = job;
  other.options.mm.iterations = 7;
  EXPECT_NE(state.FitKey(0, other), first_key);
  other = job;
  other.target = TargetKind::kPhoto;
  EXPECT_NE(state.FitKey(0, other), first_key);
  other = job;
  other.options.region_cache_mb = 0;  // recomputed weights are not rounded
  EXPECT_NE(state.FitKey(0, other), first_key);
  other = job;
  other.options.adam.learning_rate = 1;
  EXPECT_EQ(state.FitKey(0, other), first_key) << "mm is the solver";
}

}  // namespace
}  // namespace retint
