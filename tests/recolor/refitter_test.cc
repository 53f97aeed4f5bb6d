// SPDX-License-Identifier: BSD-3-Clause
// Properties of both solvers: active and unchanged parts, cancelling, bad input.
#include <algorithm>
#include <cstring>
#include <limits>
#include <span>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/recolor/tiny_scene.h"

namespace retint {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

bool SameBits(std::span<const float> a, std::span<const float> b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

class RefitterTest : public testing::TestWithParam<Solver> {
 protected:
  RefitterTest() {
    options_.solver = GetParam();
    SetIterations(6);
  }
  void SetIterations(int count) { options_.mm.iterations = options_.adam.iterations = count; }
  std::unique_ptr<ShRefitter> Make(const ColorEdit& edit, std::vector<float> shares = {}) {
    return std::make_unique<ShRefitter>(renderer_, scene_.model, scene_.Targets(), edit,
                                        std::move(shares), options_, monitor_);
  }

  TinyScene scene_{41};
  Renderer renderer_ = scene_.MakeRenderer();
  RefitOptions options_;
  Monitor monitor_;
  const ColorEdit edit_ = ColorEdit::Tint({0.2f, 0.7f, 1.4f});
};

INSTANTIATE_TEST_SUITE_P(Solvers, RefitterTest, testing::Values(Solver::kMm, Solver::kAdam),
                         [](auto& param) { return param.param == Solver::kMm ? "mm" : "adam"; });

TEST_P(RefitterTest, InactiveCoefficientsStayBitForBit) {
  auto refitter = Make(edit_, scene_.shares);
  const auto summary = refitter->Run(monitor_);
  const auto sh = refitter->Sh();
  const size_t block = size_t(scene_.model.NumShCoeffs()) * 3;
  const auto active = refitter->active();
  EXPECT_TRUE(std::is_sorted(active.begin(), active.end()));
  EXPECT_EQ(summary.active_gaussians, int64_t(active.size()));
  int64_t changed = 0;
  for (size_t g = 0; g < scene_.shares.size(); ++g) {
    const bool differs =
        std::memcmp(&sh[g * block], &scene_.model.sh[g * block], block * sizeof(float)) != 0;
    changed += differs;
    const bool is_active = std::binary_search(active.begin(), active.end(), int32_t(g));
    if (!is_active) {
      EXPECT_FALSE(differs) << g;
    }
    if (is_active) {
      EXPECT_GT(scene_.shares[g], 0) << g;
    }
  }
  EXPECT_EQ(summary.changed_gaussians, changed);
  EXPECT_GT(changed, int64_t(scene_.shares.size()) / 4);
  EXPECT_THAT(summary.BriefReport(), HasSubstr(std::to_string(changed) + " changed"));
}

TEST_P(RefitterTest, ZeroMaskChangesNothing) {
  scene_.FillMasks(0);
  auto refitter = Make(edit_);
  const auto summary = refitter->Run(monitor_);
  EXPECT_EQ(summary.active_gaussians, 0);
  EXPECT_TRUE(summary.converged);
  EXPECT_TRUE(SameBits(refitter->Sh(), scene_.model.sh));
}

TEST_P(RefitterTest, FullMaskActivatesAllThatIsSeen) {
  scene_.FillMasks(255);
  auto refitter = Make(edit_);
  refitter->Run(monitor_);
  const auto shares = MaskShares(renderer_, scene_.Targets(), monitor_);
  EXPECT_EQ(int64_t(refitter->active().size()),
            std::count_if(shares.begin(), shares.end(),
                          [&](float m) { return m > options_.active_threshold; }));
  EXPECT_GT(refitter->active().size(), 100u);
}

TEST_P(RefitterTest, IdentityTintIsAnUndo) {
  auto refitter = Make(ColorEdit::Tint({1, 1, 1}), scene_.shares);
  const auto summary = refitter->Run(monitor_);
  const auto sh = refitter->Sh();
  if (GetParam() == Solver::kMm) {  // exactly: the loss is 0 at the start
    EXPECT_TRUE(SameBits(sh, scene_.model.sh));
    EXPECT_EQ(summary.changed_gaussians, 0);
    EXPECT_TRUE(summary.converged);
    return;
  }
  // adam rounds its targets to 16 bits. Each of its six steps goes by the sign of the remaining
  // error and is at most the learning rate (2.5e-4). Its first steps may be up to 1 / (1 - beta1)
  // ** 0.5 times longer.
  float largest = 0;
  for (size_t i = 0; i < sh.size(); ++i) {
    largest = std::max(largest, std::abs(sh[i] - scene_.model.sh[i]));
  }
  EXPECT_LE(largest, 6 * 2.5e-4f * 3.2f);
  for (const double loss : summary.losses) EXPECT_LT(loss, 1e-3);
}

TEST_P(RefitterTest, GaussiansOutOfEveryViewStay) {
  SetGaussian(scene_.model, 0, {0, 0, 50}, 0.1, 3);  // behind all the cameras
  scene_.model.means[2] = -50;
  Renderer renderer = scene_.MakeRenderer();
  std::vector<float> shares(scene_.shares.size(), 1.0f);
  ShRefitter refitter(renderer, scene_.model, scene_.Targets(), edit_, shares, options_, monitor_);
  refitter.Run(monitor_);
  EXPECT_NE(refitter.active().front(), 0);
  const auto sh = refitter.Sh();
  EXPECT_EQ(std::memcmp(sh.data(), scene_.model.sh.data(),
                        size_t(scene_.model.NumShCoeffs()) * 3 * sizeof(float)),
            0);
}

TEST_P(RefitterTest, PhotosPullTowardsThemselves) {
  // The scene with its selected half turned grey.
  for (size_t v = 0; v < scene_.cameras.size(); ++v) {
    Image photo = renderer_.Render(scene_.cameras[v]).rgb;
    for (size_t i = 0; i < photo.data.size(); ++i) {
      photo.data[i] += float(scene_.masks[v].data[i / 3]) / 255 * (0.6f - photo.data[i]);
    }
    scene_.photos.push_back(std::move(photo));
  }
  options_.adam.learning_rate = 2e-2;
  options_.adam.closed_form_start = false;
  SetIterations(40);
  auto refitter = Make(ColorEdit(), scene_.shares);
  const auto error = [&](std::span<const float> sh) {
    renderer_.SetSh(sh);
    double sum = 0;
    for (size_t v = 0; v < scene_.cameras.size(); ++v) {
      const Image image = renderer_.Render(scene_.cameras[v]).rgb;
      for (size_t p = 0; p < image.NumPixels(); ++p) {
        if (scene_.masks[v].data[p] < 200) continue;
        for (size_t c = 0; c < 3; ++c) sum += std::pow(double(image.data[3 * p + c]) - 0.6, 2);
      }
    }
    return sum;
  };
  refitter->Run(monitor_);
  EXPECT_LT(error(refitter->Sh()), 0.5 * error(scene_.model.sh));
}

// Gaussians are not fitted to the background between them.
TEST_P(RefitterTest, TheBackgroundOfPhotosIsNotFitted) {
  Renderer renderer = scene_.MakeRenderer({.background = {1, 0.9f, 0.8f}});
  for (const PosedCamera& camera : scene_.cameras) {
    scene_.photos.push_back(renderer.Render(camera).rgb);
  }
  const std::vector<float> all(scene_.model.NumGaussians(), 1.0f);
  const auto change_by = [&](std::vector<RefitTarget> targets) {
    ShRefitter refitter(renderer, scene_.model, std::move(targets), ColorEdit::Tint({1, 1, 1}), all,
                        options_, monitor_);
    refitter.Run(monitor_);
    const FloatArray sh = refitter.Sh();
    float most = 0;
    for (size_t i = 0; i < sh.size(); ++i) {
      most = std::max(most, std::abs(sh[i] - scene_.model.sh[i]));
    }
    return most;
  };
  // Rounding to the step of the targets, and of Adam six steps of its own.
  constexpr float kMost = 5e-3f;
  EXPECT_LT(change_by(scene_.Targets()), kMost);
  std::vector<RefitTarget> made = scene_.Targets();
  for (size_t v = 0; v < made.size(); ++v) {
    made[v].photo = nullptr;
    made[v].edited = [&, v](Renderer&, Mask*) { return scene_.photos[v]; };
  }
  EXPECT_LT(change_by(std::move(made)), kMost);
}

TEST_P(RefitterTest, CancelStopsBetweenViewsAndKeepsTheLastResult) {
  auto refitter = Make(edit_, scene_.shares);
  refitter->Step(monitor_);
  refitter->Step(monitor_);
  const auto before = refitter->Sh();
  Monitor cancelled;
  cancelled.Cancel();
  EXPECT_THROW(refitter->Step(cancelled), Cancelled);
  EXPECT_TRUE(SameBits(refitter->Sh(), before));
  EXPECT_NO_THROW(refitter->Run(monitor_));  // and can go on
  EXPECT_THROW(
      ShRefitter(renderer_, scene_.model, scene_.Targets(), edit_, {}, options_, cancelled),
      Cancelled);
}

TEST_P(RefitterTest, ReportsProgressInOrder) {
  std::vector<double> fractions;
  Monitor monitor([&](const Progress& progress) {
    if (progress.stage == "refit") fractions.push_back(progress.fraction);
  });
  auto refitter = Make(edit_, scene_.shares);
  refitter->Run(monitor);
  EXPECT_GT(fractions.size(), 5u);
  EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
  EXPECT_EQ(fractions.back(), 1.0);
}

TEST_P(RefitterTest, RefusesTargetsThatDoNotFit) {
  auto targets = scene_.Targets();
  const Mask small(10, 10);
  targets[2].mask = &small;
  const auto make = [&] {
    ShRefitter(renderer_, scene_.model, targets, edit_, scene_.shares, options_, monitor_);
  };
  EXPECT_THAT(make, ThrowsMessage<InputError>(HasSubstr("view 'view2': mask is 10x10")));
  targets[2].mask = nullptr;
  EXPECT_THAT(make, ThrowsMessage<InputError>(HasSubstr("view2")));
  targets[2].mask = &scene_.masks[2];
  const Image photo(64, 47);
  targets[2].photo = HeldPhoto(photo);
  EXPECT_THAT(make, ThrowsMessage<InputError>(HasSubstr("photo is 64x47")));
  targets[2].edited = [](Renderer&, Mask*) { return Image(63, 48); };
  EXPECT_THAT(make, ThrowsMessage<InputError>(HasSubstr("edited picture is 63x48")));
  targets.clear();
  EXPECT_THAT(make, ThrowsMessage<OptionError>(HasSubstr("no view")));
}

TEST_P(RefitterTest, RefusesALossThatFloatsCannotHold) {
  const auto most = std::ranges::max_element(scene_.shares);
  const auto selected = size_t(most - scene_.shares.begin());
  const auto block = size_t(scene_.model.NumShCoeffs()) * 3;
  scene_.model.sh[selected * block] = 1e30f;
  Renderer renderer = scene_.MakeRenderer();
  ShRefitter refitter(renderer, scene_.model, scene_.Targets(), edit_, scene_.shares, options_,
                      monitor_);
  EXPECT_THAT(
      [&] { refitter.Run(monitor_); },
      ThrowsMessage<InputError>(AllOf(HasSubstr(": Gaussian " + std::to_string(selected) + " has"),
                                      HasSubstr("SH coefficient 1e+30"))));
}

TEST_P(RefitterTest, RefusesSharesAndEditsThatMakeNoSense) {
  EXPECT_THROW(Make(edit_, std::vector<float>(3, 1.0f)), OptionError);
  auto shares = scene_.shares;
  shares[4] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(Make(edit_, shares), OptionError);
  shares[4] = 1.5f;
  EXPECT_THROW(Make(edit_, shares), OptionError);
  EXPECT_THROW(Make(ColorEdit::Tint({-1, 1, 1}), scene_.shares), OptionError);
}

TEST(RefitOptionsTest, CheckNamesTheOption) {
  EXPECT_NO_THROW(RefitOptions().Check());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refuses = [](auto set, const char* name) {
    RefitOptions options;
    set(options);
    EXPECT_THAT([&] { options.Check(); }, ThrowsMessage<OptionError>(HasSubstr(name)));
  };
  refuses([](auto& o) { o.mm.iterations = -1; }, "iterations");
  refuses([](auto& o) { o.adam.iterations = -1; }, "iterations");
  refuses([](auto& o) { o.adam.learning_rate = 0; }, "learning rate");
  refuses([&](auto& o) { o.adam.learning_rate = nan; }, "learning rate");
  refuses([](auto& o) { o.adam.lambda_dssim = 1.1; }, "lambda dssim");
  refuses([](auto& o) { o.mm.ridge_dc = -1; }, "ridge dc");
  refuses([&](auto& o) { o.mm.ridge_rest = nan; }, "ridge rest");
  refuses([](auto& o) { o.active_threshold = 1; }, "active threshold");
  refuses([](auto& o) { o.mm.tolerance = -1e-3; }, "tolerance");
  refuses([](auto& o) { o.mm.outside_weight = 0; }, "outside weight");
  refuses([](auto& o) { o.mm.min_weight = -1; }, "min weight");
}

}  // namespace
}  // namespace retint
