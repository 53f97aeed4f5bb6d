// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/quality_report.h"

#include <algorithm>
#include <cmath>
#include <span>

#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/recolor/tiny_scene.h"
#include "tests/support/closed_form.h"

namespace retint {
namespace {

class QualityReportTest : public testing::Test {
 protected:
  QualityReportTest() {
    after_ = ClosedFormSh(renderer_.backend(), scene_.model.sh, scene_.model.NumShCoeffs(),
                          scene_.shares, edit_);
    targets_ = scene_.Targets();
  }
  QualityReport Evaluate(const std::vector<RefitTarget>& train,
                         const std::vector<RefitTarget>& heldout) {
    return EvaluateEdit(renderer_, scene_.model.sh, after_, train, heldout, edit_, monitor_);
  }
  QualityReport EvaluateRows(int step) {
    return EvaluateEdit(renderer_, scene_.model.sh, after_, targets_, {}, edit_, monitor_, step);
  }
  Image RenderWith(std::span<const float> sh, const PosedCamera& camera) {
    renderer_.SetSh(sh);
    Image image = renderer_.Render(camera).rgb;
    renderer_.SetSh(scene_.model.sh);
    return image;
  }

  TinyScene scene_{51};
  Renderer renderer_ = scene_.MakeRenderer();
  Monitor monitor_;
  const ColorEdit edit_ = ColorEdit::Tint({0.3f, 0.9f, 1.5f});
  FloatArray after_;
  std::vector<RefitTarget> targets_;
};

double Clamped(double value) { return std::min(std::max(value, 0.0), 1.0); }

TEST_F(QualityReportTest, MatchesANaiveComputation) {
  const std::vector<RefitTarget> train(targets_.begin() + 2, targets_.end());
  const std::vector<RefitTarget> heldout(targets_.begin(), targets_.begin() + 2);
  const auto report = Evaluate(train, heldout);
  const auto check = [&](size_t first, size_t last, const QualityNumbers& numbers) {
    double before_error = 0, after_error = 0, outside = 0, bleed = 0;
    double inside_values = 0, outside_values = 0;
    for (size_t v = first; v < last; ++v) {
      const Image before = RenderWith(scene_.model.sh, scene_.cameras[v]);
      const Image after = RenderWith(after_, scene_.cameras[v]);
      for (int y = 0; y < 48; ++y) {
        for (int x = 0; x < 64; ++x) {
          const double mask = scene_.masks[v](x, y) / 255.0;
          for (int c = 0; c < 3; ++c) {
            const double tint = edit_.Affine().gain(c, c);
            const double goal = Clamped(before(x, y, c) * (1 + mask * (tint - 1)));
            const double old = Clamped(before(x, y, c)), now = Clamped(after(x, y, c));
            if (mask >= 0.5) {
              before_error += (old - goal) * (old - goal);
              after_error += (now - goal) * (now - goal);
              ++inside_values;
            } else if (mask == 0) {
              outside += (now - goal) * (now - goal);
              bleed += std::abs(now - old);
              ++outside_values;
            }
          }
        }
      }
    }
    const auto psnr = [](double sum, double values) {
      return sum == 0 ? 99 : std::min(99.0, -10 * std::log10(sum / values));
    };
    EXPECT_EQ(numbers.views, int(last - first));
    // Single against double precision of each pixel's target.
    EXPECT_NEAR(numbers.psnr_inside_before, psnr(before_error, inside_values), 1e-3);
    EXPECT_NEAR(numbers.psnr_inside_after, psnr(after_error, inside_values), 1e-3);
    EXPECT_NEAR(numbers.psnr_outside, psnr(outside, outside_values), 1e-3);
    EXPECT_NEAR(numbers.bleed, bleed / outside_values, 1e-7);
    EXPECT_GT(numbers.psnr_inside_after, numbers.psnr_inside_before);
  };
  check(2, targets_.size(), report.train);
  check(0, 2, report.heldout);
}

TEST_F(QualityReportTest, NothingChangedIsPerfectOutside) {
  after_ = scene_.model.sh;
  const auto report = Evaluate(targets_, {});
  EXPECT_EQ(report.train.psnr_outside, 99);
  EXPECT_EQ(report.train.bleed, 0);
  EXPECT_EQ(report.train.psnr_inside_after, report.train.psnr_inside_before);
  EXPECT_EQ(report.heldout.views, 0);
  EXPECT_EQ(report.sh_before.min, report.sh_after.min);
  EXPECT_EQ(report.sh_before.max, report.sh_after.max);
}

// Tiles in which nothing changes and nothing should are not drawn. With the original renders as
// photos all tiles are, and every figure is the same to the last bit.
TEST_F(QualityReportTest, TilesThatAreNotDrawnLoseNothing) {
  after_ = scene_.model.sh;
  const size_t block = size_t(scene_.model.NumShCoeffs()) * 3;
  for (size_t i = 0; i < block; ++i) after_[i] += 0.05f;  // of the first Gaussian alone
  scene_.FillMasks(0);
  for (Mask& mask : scene_.masks) mask(40, 20) = 255, mask(41, 20) = 100;
  targets_ = scene_.Targets();
  const auto drawn_in_part = Evaluate(targets_, {});
  std::vector<Image> photos;
  for (const PosedCamera& camera : scene_.cameras) {
    photos.push_back(RenderWith(scene_.model.sh, camera));
  }
  for (size_t v = 0; v < targets_.size(); ++v) targets_[v].photo = HeldPhoto(photos[v]);
  const auto drawn_whole = Evaluate(targets_, {});
  EXPECT_EQ(drawn_in_part.train.psnr_inside_before, drawn_whole.train.psnr_inside_before);
  EXPECT_EQ(drawn_in_part.train.psnr_inside_after, drawn_whole.train.psnr_inside_after);
  EXPECT_EQ(drawn_in_part.train.psnr_outside, drawn_whole.train.psnr_outside);
  EXPECT_EQ(drawn_in_part.train.bleed, drawn_whole.train.bleed);
  EXPECT_LT(drawn_whole.train.psnr_outside, 99);
}

// Every fourth row of pixels, from another one in every view: with masks on just these rows the
// inside is measured to the last bit, and nothing outside. With masks on the rows below, no inside.
TEST_F(QualityReportTest, MeasuresOtherRowsInEveryView) {
  const auto mask_rows = [&](size_t shift) {
    for (size_t v = 0; v < scene_.masks.size(); ++v) {
      for (int y = 0; y < 48; ++y) {
        const bool is_in = size_t(y) % 4 == (v + shift) % 4;
        for (int x = 0; x < 64; ++x) scene_.masks[v](x, y) = is_in ? 255 : 0;
      }
    }
    targets_ = scene_.Targets();
  };
  mask_rows(0);
  const auto full = Evaluate(targets_, {}), part = EvaluateRows(4);
  EXPECT_EQ(full.row_step, 1);
  EXPECT_EQ(part.row_step, 4);
  EXPECT_EQ(part.train.psnr_inside_before, full.train.psnr_inside_before);
  EXPECT_EQ(part.train.psnr_inside_after, full.train.psnr_inside_after);
  EXPECT_EQ(part.train.psnr_outside, 99);
  EXPECT_LT(full.train.psnr_outside, 99);
  mask_rows(1);
  const auto shifted = EvaluateRows(4);
  EXPECT_EQ(shifted.train.psnr_inside_before, 99);
  EXPECT_LT(shifted.train.psnr_outside, 99);
}

TEST_F(QualityReportTest, ListsTheWorstViewsFirst) {
  const auto report = Evaluate(targets_, {targets_[0]});
  ASSERT_EQ(report.worst.size(), 5u);
  EXPECT_TRUE(std::is_sorted(report.worst.begin(), report.worst.end(),
                             [](auto& a, auto& b) { return a.psnr_inside < b.psnr_inside; }));
  for (const auto& view : report.worst) {
    EXPECT_GT(view.coverage, 0);
    EXPECT_LE(view.coverage, 1);
  }
}

TEST_F(QualityReportTest, ReportsTheRangeOfCoefficients) {
  after_[7] = 123;
  after_[8] = -45;
  const auto report = Evaluate({targets_[0]}, {});
  EXPECT_EQ(report.sh_before.max,
            *std::max_element(scene_.model.sh.begin(), scene_.model.sh.end()));
  EXPECT_EQ(report.sh_after.max, 123);
  EXPECT_EQ(report.sh_after.min, -45);
}

TEST_F(QualityReportTest, PhotosAreTheTargetsWhereGiven) {
  scene_.photos.assign(scene_.cameras.size(), Image(64, 48, 0.25f));
  const auto targets = scene_.Targets();
  const auto report = Evaluate({targets[0]}, {});
  const Image after = RenderWith(after_, scene_.cameras[0]);
  double sum = 0, values = 0;
  for (size_t p = 0; p < after.NumPixels(); ++p) {
    if (scene_.masks[0].data[p] != 0) continue;
    for (size_t c = 0; c < 3; ++c, ++values)
      sum += std::pow(Clamped(after.data[3 * p + c]) - 0.25, 2);
  }
  EXPECT_NEAR(report.train.psnr_outside, -10 * std::log10(sum / values), 1e-3);
}

TEST_F(QualityReportTest, TheBackgroundOfPhotosIsNoError) {
  Renderer renderer = scene_.MakeRenderer({.background = {1, 1, 1}});
  for (const PosedCamera& camera : scene_.cameras) {
    scene_.photos.push_back(renderer.Render(camera).rgb);
  }
  const FloatArray& sh = scene_.model.sh;
  const auto report = EvaluateEdit(renderer, sh, sh, scene_.Targets(), {}, edit_, monitor_);
  EXPECT_GT(report.train.psnr_outside, 90);
}

TEST_F(QualityReportTest, RefusesCoefficientsOfAnotherModel) {
  after_.pop_back();
  EXPECT_THROW(Evaluate(targets_, {}), OptionError);
}

}  // namespace
}  // namespace retint
