// SPDX-License-Identifier: BSD-3-Clause
// Truth by damage: a splat whose colors were changed gets them back.
#include "editing/match_scene.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/color_difference.h"
#include "base/error.h"
#include "kernels/common/color_spaces.h"
#include "synthetic/synthetic_workspace.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using Eigen::Vector3d;
using Kind = ColorOperationKind;
using testing::HasSubstr;

// 0.3 stops more light, and a cast of 3 %.
ColorEdit Damage() {
  return {{ColorOperation::Make(Kind::kExposure, {0.3F}),
           ColorOperation::Make(Kind::kTint, {1.03F, 1, 0.97F})}};
}

GaussianModel Damaged(GaussianModel model, const ColorEdit& damage) {
  const auto backend = CreateBackend("cpu");
  const std::vector<float> ones(model.NumGaussians(), 1);
  ApplyClosedForm(*backend, model.sh, model.NumShCoeffs(), ones, damage, 0);
  return model;
}

std::unique_ptr<EditSession> Open(Workspace workspace, GaussianModel model) {
  SessionOptions options;
  options.backend = "cpu";
  options.holdout = 4;
  return std::make_unique<EditSession>(std::move(workspace), std::move(model), options);
}

// Mean DeltaE00 of the pixels of the worst held-out view, of coefficients to others.
double WorstHeldout(EditSession& session, const FloatArray& sh, const FloatArray& truth) {
  double worst = 0;
  for (const View* view : session.scene().heldout_views()) {
    const Image a = session.scene().Render(*view, sh), b = session.scene().Render(*view, truth);
    double sum = 0;
    const auto lab = [](const float* rgb) {
      const Eigen::Vector3f shown = Eigen::Vector3f(rgb[0], rgb[1], rgb[2]).cwiseMax(0).cwiseMin(1);
      return CieLabFromSrgb(shown.data());
    };
    for (size_t i = 0; i < a.data.size(); i += 3) {
      sum += ColorDifference(lab(&a.data[i]), lab(&b.data[i]));
    }
    worst = std::max(worst, sum / double(a.NumPixels()));
  }
  return worst;
}

void InLight(Image& image, const Eigen::Matrix3d& map) {
  for (size_t i = 0; i < image.data.size(); i += 3) {
    Vector3d light;
    for (size_t c = 0; c < 3; ++c) {
      light[Eigen::Index(c)] = double(LinearFromSrgb(image.data[i + c]));
    }
    light = map * light;
    for (size_t c = 0; c < 3; ++c) {
      image.data[i + c] = std::clamp(SrgbFromLinear(float(light[Eigen::Index(c)])), 0.0F, 1.0F);
    }
  }
}

void Paint(Image& image, int left, int top, int width, int height, const float* rgb) {
  for (int y = top; y < top + height; ++y) {
    for (int x = left; x < left + width; ++x) std::copy_n(rgb, 3, &image.data[image.Index(x, y)]);
  }
}

class MatchSceneTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    SyntheticOptions options;
    options.width = 240, options.height = 180, options.views = 12;
    Monitor monitor;
    made_ = new SyntheticScene(MakeSyntheticScene(options, monitor));
    // Nobody trained that splat on its photos. Renders of it as photos make its colors the truth.
    Renderer renderer(CreateBackend("cpu"), made_->model);
    for (const View* view : made_->reconstruction.ViewsByName()) {
      const auto found = std::ranges::find(made_->views, view->name, &SyntheticView::name);
      found->photo = renderer.Render(made_->reconstruction.Posed(*view)).rgb;
    }
  }
  static void TearDownTestSuite() { delete made_; }

  // A session of the scene with a damaged splat, and with photos after `change`.
  std::unique_ptr<EditSession> Session(const ColorEdit& damage,
                                       const std::function<void(size_t, Image&)>& change = {}) {
    SyntheticScene scene = *made_;
    for (size_t v = 0; v < scene.views.size() && change; ++v) change(v, scene.views[v].photo);
    WriteSyntheticWorkspace(temp_.path(), scene, monitor_);
    return Open(Workspace::Open(temp_.path()), Damaged(made_->model, damage));
  }
  SceneMatch Match(EditSession& session, const SceneMatchRequest& request = {}) {
    SceneMatch match = MatchScene(session, request, monitor_);
    RefitJob job;
    job.options.mm.iterations = 3;
    ApplyMatch(session, match.colors, "match", monitor_);
    session.refits().Refit(job, monitor_);
    return match;
  }
  static double ErrorOf(EditSession& session) {
    return WorstHeldout(session, session.refits().CurrentSh(), made_->model.sh);
  }
  std::string ErrorFor(EditSession& session, const SceneMatchRequest& request) {
    try {
      MatchScene(session, request, monitor_);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  }

  static SyntheticScene* made_;
  TempFolder temp_;
  Monitor monitor_;
};
SyntheticScene* MatchSceneTest::made_ = nullptr;

TEST_F(MatchSceneTest, ADriftComesBack) {
  const auto session = Session(Damage());
  EXPECT_GT(ErrorOf(*session), 2.5);
  const SceneMatch match = Match(*session);
  EXPECT_LT(ErrorOf(*session), 0.5);
  EXPECT_NEAR(match.colors.gray_stops.mean(), -0.3, 0.05);
  EXPECT_FALSE(match.colors.exposures_differ);
  EXPECT_EQ(match.colors.heldout, 3);
}

TEST_F(MatchSceneTest, PhotosOfDifferentExposureAreToldFromADrift) {
  // Of the fitted views 1, 2, 3, 5, ... the middle is 0.
  const double stops[] = {-0.3, 0.2, -0.4, 0.3, 0.4, -0.2, 0, 0.35, -0.25, 0.1, 0, -0.1};
  const auto session = Session(Damage(), [&](size_t v, Image& photo) {
    InLight(photo, std::exp2(stops[v]) * Eigen::Matrix3d::Identity());
  });
  const SceneMatch match = Match(*session);
  EXPECT_LT(ErrorOf(*session), 0.6);  // the median of nine exposures has an error of its own
  EXPECT_TRUE(match.colors.exposures_differ);
  for (size_t v = 0; v < 12; ++v) {
    EXPECT_NEAR(match.colors.views[v].stops.mean(), stops[v], 0.06) << v;
  }
  EXPECT_THAT(match.sentences.back(), HasSubstr("different exposure each"));
}

TEST_F(MatchSceneTest, AGrayCardSaysWhatIsNeutral) {
  const Eigen::Matrix3d cast = Vector3d(1.12, 1, 0.85).asDiagonal();
  const auto session = Session({}, [&](size_t v, Image& photo) {
    const float gray[] = {0.5F, 0.5F, 0.5F};
    if (v == 5) Paint(photo, 20, 30, 40, 30, gray);
    InLight(photo, cast);
  });
  SceneMatchRequest request;
  request.gray = ParseCard("gray", made_->views[5].name + ":20,30,40,30");
  Match(*session, request);
  EXPECT_LT(ErrorOf(*session), 0.6);  // the card keeps its luminance, not that of no cast
  // Without it the splat takes over the cast of the photos.
  session->store().Do(RemoveRegion{session->store().regions().regions.front().id});
  Match(*session);
  EXPECT_GT(ErrorOf(*session), 2);
}

TEST_F(MatchSceneTest, AColorCheckerIsReadInAnyTurn) {
  Eigen::Matrix3d mix;
  mix << 0.75, 0.12, 0, 0.06, 0.8, 0.05, 0, 0.1, 0.7;
  const auto session = Session({}, [&](size_t v, Image& photo) {
    // Turned by a quarter: four patches across, six down.
    for (int i = 0; v == 5 && i < 24; ++i) {
      const int row = i / 6, column = i % 6;
      Paint(photo, 20 + 16 * (3 - row), 30 + 16 * column, 16, 16, &CheckerColors()[size_t(3 * i)]);
    }
    InLight(photo, mix);
  });
  SceneMatchRequest request;
  request.checker = ParseCard("checker", made_->views[5].name + ":20,30,64,96");
  const SceneMatch match = Match(*session, request);
  ASSERT_TRUE(match.checker);
  EXPECT_GT(match.checker->before, 3);
  EXPECT_LT(match.checker->after, 0.5);  // eight bits
  EXPECT_LT(ErrorOf(*session), 0.5);
  // The same as corners.
  request.checker = ParseCard("checker", made_->views[5].name + ":84,30,84,126,20,126,20,30");
  EXPECT_NEAR(MatchScene(*session, request, monitor_).checker->after, match.checker->after, 1e-6);
}

TEST_F(MatchSceneTest, OneSplatLooksLikeAnother) {
  const auto session = Session(Damage());
  SceneMatchRequest request;
  request.like = &made_->model;
  Match(*session, request);
  EXPECT_LT(ErrorOf(*session), 0.1);
}

TEST_F(MatchSceneTest, ATableUndoesACurve) {
  const auto session = Session({{ColorOperation::Make(Kind::kGamma, {1.35F})}});
  const double before = ErrorOf(*session);
  const SceneMatch match = Match(*session);
  EXPECT_EQ(match.colors.map, MatchMap::kTable);
  EXPECT_GT(before, 5);
  EXPECT_LT(ErrorOf(*session), 0.7);
}

// Also of Gaussians that no view sees, and after a fit of all regions.
TEST_F(MatchSceneTest, AnAffineMapIsExact) {
  const auto session = Session(Damage());
  SceneMatchRequest request;
  request.map = MatchMap::kMatrix;
  const SceneMatch match = Match(*session, request);
  const auto map = match.colors.edit.Affine();
  const FloatArray after = session->refits().CurrentSh();
  const FloatArray& before = session->scene().original().sh;
  constexpr float kY0 = 0.28209479F;
  for (size_t i = 0; i < before.size(); i += 3) {
    const Eigen::Vector3f from(before[i], before[i + 1], before[i + 2]);
    Eigen::Vector3f to = map.gain * from;
    if (i % 48 == 0) {  // the first of 16: 0.5 + Y c
      to = (map.gain * (kY0 * from + Eigen::Vector3f::Constant(0.5F)) + map.offset -
            Eigen::Vector3f::Constant(0.5F)) /
           kY0;
    }
    for (size_t c = 0; c < 3; ++c) ASSERT_NEAR(after[i + c], to[Eigen::Index(c)], 1e-4) << i;
  }
}

TEST_F(MatchSceneTest, CardsThatSayNothingAreRefused) {
  for (const char* text : {"", "a.jpg", ":1,2,3,4", "a.jpg:1,2,3", "a.jpg:1,2,3,x", "a.jpg:1,2,0,4",
                           "a.jpg:1,2,3,4,", "a.jpg:1,2,3,4,5,6,7", "a.jpg:nan,2,3,4"}) {
    EXPECT_THROW(ParseCard("gray", text), OptionError) << text;
  }
  EXPECT_EQ(ParseCard("gray", "a:b,1.jpg:1,2.5,3,4").view, "a:b,1.jpg");
  const auto session = Session({});
  const std::string name = made_->views[0].name;
  SceneMatchRequest request;
  request.gray = CardInPhoto{name, {200, 10, 60, 20}};
  EXPECT_THAT(ErrorFor(*session, request), HasSubstr("outside the photo, which has 240x180"));
  request.gray = CardInPhoto{name, {0, 0, 240, 180}};
  EXPECT_THAT(ErrorFor(*session, request), HasSubstr("several colors"));
  request.gray.reset();
  request.checker = CardInPhoto{name, {0, 0, 240, 180}};
  EXPECT_THAT(ErrorFor(*session, request), HasSubstr("no ColorChecker of 24 patches"));
  EXPECT_THROW((MatchRecipe{.map = "auto", .like = "b.ply", .checker = "a.jpg:1,2,3,4"}.Check()),
               OptionError);
}

// A third of the views of real captures. Smaller pictures would not do: the original rasterizer
// draws every Gaussian wider there, which changes the colors.
class MatchCapture : public testing::TestWithParam<const char*> {};

TEST_P(MatchCapture, ComesBack) {
  RETINT_REQUIRE_DATA(GetParam());
  Monitor monitor;
  SessionOptions options;
  options.backend = "cpu";
  Workspace workspace = OpenWorkspace(DataPath(GetParam()), options);
  std::erase_if(workspace.reconstruction.views, [](const auto& one) { return one.first % 3 != 0; });
  const GaussianModel truth =
      EditSession::Open(DataPath(GetParam()), DataPath(GetParam()) / "splat.ply", options, monitor)
          ->scene()
          .original();
  const auto intact = Open(workspace, truth), damaged = Open(workspace, Damaged(truth, Damage()));
  // The photos' own result for the splat that was trained from them.
  const ColorMatch of_truth = MatchScene(*intact, {}, monitor).colors;
  const SceneMatch match = MatchScene(*damaged, {}, monitor);
  ApplyMatch(*damaged, match.colors, "match", monitor);
  EXPECT_GT(WorstHeldout(*damaged, damaged->scene().original().sh, truth.sh), 2.5);
  EXPECT_LT(WorstHeldout(*damaged, damaged->refits().CurrentSh(), truth.sh), 0.5);
  EXPECT_LT(std::abs(of_truth.gray_stops.mean()), 0.05);
}
INSTANTIATE_TEST_SUITE_P(Captures, MatchCapture, testing::Values("fox", "flower"));

}  // namespace
}  // namespace retint
