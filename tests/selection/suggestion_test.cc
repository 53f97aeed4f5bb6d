// SPDX-License-Identifier: BSD-3-Clause
#include "selection/suggestion.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "scene/gaussian_model.h"
#include "selection/paint_advice.h"

namespace retint {
namespace {

// Three small opaque Gaussians far apart on a line, and a camera right before each; `both` sees the
// first two from further away.
struct Line {
  GaussianModel model;
  Reconstruction reconstruction;
  std::vector<ViewGroup> groups;  // each view by itself

  Line() {
    for (int i = 0; i < 3; ++i) {
      for (const float value : {10.0f * float(i), 0.0f, 0.0f}) model.means.push_back(value);
      for (const float value : {1.0f, 0.0f, 0.0f, 0.0f}) model.quats_wxyz.push_back(value);
      for (int axis = 0; axis < 3; ++axis) model.log_scales.push_back(std::log(0.3f));
      model.opacity_logits.push_back(5);
      for (int c = 0; c < 3; ++c) model.sh.push_back(0);
    }
    reconstruction.cameras[1] = Camera::Pinhole(1, 64, 64, 64, 64, 32, 32);
    Add("a", 0, 4);
    Add("b", 10, 4);
    Add("both", 5, 16);
    Add("c", 20, 4);
    for (const View* view : reconstruction.ViewsByName()) groups.push_back({view->name, {view}});
  }

  const View* Find(const std::string& name) const { return reconstruction.FindView(name); }

  void Add(const std::string& name, double x, double away) {
    View view;
    view.id = ViewId(reconstruction.views.size() + 1);
    view.name = name;
    view.camera_id = 1;
    view.cam_from_world.translation = {-x, 0, away};
    reconstruction.views[view.id] = view;
  }
};

std::vector<std::string> Names(const std::vector<ViewSuggestion>& suggestions) {
  std::vector<std::string> names;
  for (const ViewSuggestion& one : suggestions) names.push_back(one.view);
  return names;
}

TEST(Suggestion, RanksViewsByWhatTheySettle) {
  Line line;
  Renderer renderer(CreateBackend("cpu"), line.model);
  Monitor monitor;
  // The second Gaussian is uncertain altogether, the first by a tenth, the third not at all.
  const std::vector<float> confidence = {0.9f, 0, 1}, visible = {60, 60, 60};
  const auto suggestions =
      SuggestViews(renderer, line.reconstruction, line.groups, {}, confidence, visible, 1, monitor);
  ASSERT_EQ(suggestions.size(), 4u);
  EXPECT_EQ(suggestions[0].view, "b");
  EXPECT_EQ(suggestions[3].view, "c");
  EXPECT_EQ(suggestions[3].settles, 0);
  // b sees all that there is of the second Gaussian: 60 of 66 uncertain pixels.
  EXPECT_NEAR(suggestions[0].fraction, 60.0 / 66, 1e-5);  // floats as they are given
}

TEST(Suggestion, TakesIntoAccountWhatIsSettledBefore) {
  Line line;
  Renderer renderer(CreateBackend("cpu"), line.model);
  Monitor monitor;
  // `both` sees less of either than a and b, and is no use once they are painted.
  const std::vector<float> confidence = {0, 0, 0.5f}, visible = {100, 100, 100};
  const auto suggestions =
      SuggestViews(renderer, line.reconstruction, line.groups, {}, confidence, visible, 3, monitor);
  EXPECT_THAT(Names(suggestions), testing::ElementsAre("a", "b", "c", "both"));
  EXPECT_GT(suggestions[3].settles, 0);  // the part that it would settle by itself
  EXPECT_THAT(Names(SuggestViews(renderer, line.reconstruction, line.groups, {"a", "b"}, confidence,
                                 visible, 3, monitor)),
              testing::UnorderedElementsAre("c", "both"));
}

TEST(Suggestion, TheViewsOfAPhotoAreOne) {
  Line line;
  Renderer renderer(CreateBackend("cpu"), line.model);
  Monitor monitor;
  const std::vector<ViewGroup> groups = {{"both", {line.Find("both")}},
                                         {"photo", {line.Find("a"), line.Find("b")}},
                                         {"c", {line.Find("c")}}};
  const std::vector<float> confidence = {0, 0.5f, 0.25f}, visible = {40, 40, 40};
  const auto suggest = [&](const std::vector<std::string>& painted, int count) {
    return SuggestViews(renderer, line.reconstruction, groups, painted, confidence, visible, count,
                        monitor);
  };
  const auto suggestions = suggest({}, 3);
  ASSERT_THAT(Names(suggestions), testing::ElementsAre("photo", "c", "both"));
  // a and b see all of the first two Gaussians: 40 and 20 of the 90 pixels that are uncertain.
  EXPECT_NEAR(suggestions[0].settles, 60, 1e-4);
  EXPECT_NEAR(suggestions[0].fraction, 60.0 / 90, 1e-5);
  EXPECT_NEAR(suggestions[2].settles, 0, 1e-4);  // nothing is left for it
  // A photo is painted when it or a part of it is.
  EXPECT_THAT(Names(suggest({"photo"}, 3)), testing::UnorderedElementsAre("c", "both"));
  EXPECT_THAT(Names(suggest({"b"}, 3)), testing::UnorderedElementsAre("c", "both"));
}

TEST(PaintAdvice, NamesTheViewThatSettlesMostOfTheSelection) {
  Line line;
  Renderer renderer(CreateBackend("cpu"), line.model);
  Monitor monitor;
  const auto advise = [&](const std::vector<float>& shares, const std::vector<float>& confidence) {
    return AdvisePaint(renderer, line.reconstruction, line.groups, {"a"}, shares, confidence,
                       std::vector<float>{60, 60, 60}, monitor);
  };
  // The first is selected and sure, the second selected and not, the third no part of it.
  const auto advice = advise({1, 1, 0}, {1, 0.75f, 0.6f});
  ASSERT_TRUE(advice);
  EXPECT_EQ(advice->view, "b");
  EXPECT_NEAR(advice->uncertain, 0.25 / 2, 1e-6);
  EXPECT_NEAR(advice->settles, 1, 1e-6);
  // An unselected but undecided Gaussian touches it, too.
  EXPECT_EQ(advise({1, 1, 0}, {1, 0.95f, 0.2f})->view, "c");
  // One pixel of a hundred is not worth another view.
  EXPECT_FALSE(advise({1, 1, 0}, {1, 0.98f, 1}));
}

TEST(Suggestion, OfACertainSceneSettlesNothing) {
  Line line;
  Renderer renderer(CreateBackend("cpu"), line.model);
  Monitor monitor;
  const std::vector<float> confidence(3, 1.0f), visible(3, 100.0f);
  for (const auto& one : SuggestViews(renderer, line.reconstruction, line.groups, {}, confidence,
                                      visible, 2, monitor)) {
    EXPECT_EQ(one.settles, 0);
    EXPECT_EQ(one.fraction, 0);
  }
  EXPECT_FALSE(SettlesAnything(SuggestViews(renderer, line.reconstruction, line.groups, {},
                                            confidence, visible, 2, monitor)));
  EXPECT_TRUE(SettlesAnything(SuggestViews(renderer, line.reconstruction, line.groups, {},
                                           std::vector<float>{0.9f, 0, 1}, visible, 2, monitor)));
  const std::vector<float> few(2, 1.0f);
  EXPECT_THROW(
      SuggestViews(renderer, line.reconstruction, line.groups, {}, few, visible, 2, monitor),
      OptionError);
  monitor.Cancel();
  EXPECT_THROW(
      SuggestViews(renderer, line.reconstruction, line.groups, {}, confidence, visible, 2, monitor),
      Cancelled);
}

}  // namespace
}  // namespace retint
