// SPDX-License-Identifier: BSD-3-Clause
// The stages of Stereo-HV in backend memory against the host's, on a slanted plane with wrong and
// missing patches, and the whole of it against exact depth. Skipped where there is no device.
#include "depth/stereo_device.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "depth/stereo_pairs.h"
#include "kernels/stereo_ops.h"
#include "tests/depth/plane_scene.h"
#include "tests/kernels/test_scene.h"

namespace retint {
namespace {

constexpr int kWidth = 213, kHeight = 131, kPadding = 40;

// A smooth texture in steps of 1/255, each channel its own.
float Texture(double x, double y, int channel) {
  double sum = 0;
  for (int k = 1; k <= 4; ++k) {
    sum += std::sin(0.11 * k * x + 1.7 * k * k + channel) *
           std::cos(0.13 * k * y + 0.9 * k + 2 * channel);
  }
  return float(std::round(255 * (0.5 + 0.12 * sum)) / 255);
}

double Truth(double x, double y) { return 14 + 0.03 * x - 0.02 * y; }

struct Picture {
  Shift shift = Shift::kRight;
  PixelRect rect;
  Image rgb;
  Image8 rgb8;
  ScalarImage gray;
};

// `seen(x, y)` is the reference's point that the picture shows at (x, y).
template <typename Seen>
Picture MakePicture(Shift shift, const PixelRect& rect, const Seen& seen) {
  Picture out{shift, rect, Image(rect.width, rect.height), Image8(rect.width, rect.height),
              ScalarImage(rect.width, rect.height)};
  for (int y = 0; y < rect.height; ++y) {
    for (int x = 0; x < rect.width; ++x) {
      const auto [u, v] = seen(rect.x + x + 0.5, rect.y + y + 0.5);
      for (int c = 0; c < 3; ++c) {
        out.rgb(x, y, c) = Texture(u, v, c);
        out.rgb8(x, y, c) = uint8_t(std::lround(255 * out.rgb(x, y, c)));
      }
      out.gray(x, y) =
          0.299f * out.rgb(x, y, 0) + 0.587f * out.rgb(x, y, 1) + 0.114f * out.rgb(x, y, 2);
    }
  }
  return out;
}

class StereoOnDevice : public testing::Test {
 protected:
  void SetUp() override {
    try {
      backend_ = CreateBackend("cuda");
    } catch (const std::exception& error) {
      GTEST_SKIP() << error.what();
    }
    const Camera camera = Camera::Pinhole(1, kWidth, kHeight, 200, 200, kWidth / 2, kHeight / 2);
    PixelRect all{0, 0, kWidth, kHeight};
    for (const Shift shift : {Shift::kRight, Shift::kDown, Shift::kLeft, Shift::kUp}) {
      const PixelRect rect = PairRect(camera, shift, kPadding);
      all = Union(all, rect);
      pictures_.push_back(MakePicture(shift, rect, [&](double x, double y) {
        // The point whose disparity leads here: a fixed point, which a slant this small has.
        double u = x, v = y;
        for (int i = 0; i < 30; ++i) {
          const double s = Truth(u, v);
          if (shift == Shift::kRight) u = x + s;
          if (shift == Shift::kLeft) u = x - s;
          if (shift == Shift::kDown) v = y + s;
          if (shift == Shift::kUp) v = y - s;
        }
        return std::pair{u, v};
      }));
    }
    reference_ = MakePicture(Shift::kRight, all, [](double x, double y) {
      return std::pair{x, y};
    });
    for (size_t k = 0; k < pictures_.size(); ++k) views_[k] = OnDevice(pictures_[k]);
    for (size_t k = 0; k < pictures_.size(); ++k) {
      const Shift shift = pictures_[k].shift;
      views_[k].dx = shift == Shift::kRight ? -1 : shift == Shift::kLeft ? 1 : 0;
      views_[k].dy = shift == Shift::kDown ? -1 : shift == Shift::kUp ? 1 : 0;
    }
    reference_view_ = OnDevice(reference_);
  }

  StereoView OnDevice(const Picture& picture) {
    held_.push_back(backend_->Upload(std::span<const float>(picture.rgb.data)));
    held_.push_back(backend_->Upload(std::span<const float>(picture.gray.data)));
    return {held_[held_.size() - 2].data(),
            held_.back().data(),
            picture.rect.x,
            picture.rect.y,
            picture.rect.width,
            picture.rect.height,
            0,
            0};
  }

  // The truth and a ripple, with blocks of another disparity and, apart from them, of none.
  ScalarImage Disturbed(float wrong, int x_wrong, int x_missing) const {
    ScalarImage out(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const double ripple = 0.2 * std::sin(0.05 * x) * std::cos(0.07 * y);
        out(x, y) = float(std::round(32 * (Truth(x + 0.5, y + 0.5) + ripple)) / 32);
        const bool block = y % 48 > 12 && y % 48 < 34;
        if (block && std::abs(x - x_wrong) < 11) out(x, y) += wrong;
        if (block && std::abs(x - x_missing) < 9) out(x, y) = -1;
      }
    }
    return out;
  }

  std::shared_ptr<Backend> backend_;
  std::vector<Picture> pictures_;
  Picture reference_;
  std::array<StereoView, 4> views_{};
  StereoView reference_view_{};
  std::vector<Buffer<float>> held_;
};

TEST_F(StereoOnDevice, FusesAsTheHost) {
  std::mt19937 random(1);
  for (const bool nearest : {false, true}) {
    for (int pairs = 1; pairs <= 4; ++pairs) {
      std::vector<ScalarImage> hosts;
      std::vector<Guarded<float>> guarded;
      StereoFuseParams params{};
      for (int k = 0; k < pairs; ++k) {
        hosts.emplace_back(97, 61);
        for (float& s : hosts.back().data) {
          s = random() % 4 == 0 ? -1.0f : 10 + float(random() % 64) / 16;
        }
        guarded.emplace_back(*backend_, hosts.back().data);
        params.pairs[k] = guarded.back().data();
      }
      const auto expected =
          FuseDisparities(hosts, nearest ? StereoAggregate::kMin : StereoAggregate::kAgree, 1);
      Guarded<float> out(*backend_, expected.data.size());
      params.num_pairs = pairs;
      params.pixels = int64_t(expected.data.size());
      params.tolerance = 1;
      params.nearest = nearest;
      params.disparity = out.data();
      backend_->stereo()->Fuse(params);
      EXPECT_THAT(out.Read(), testing::Pointwise(testing::FloatNear(1e-5f), expected.data))
          << pairs << (nearest ? " nearest" : " agree");
    }
  }
}

TEST_F(StereoOnDevice, ArbitratesAsTheHost) {
  const ScalarImage rough = Disturbed(-4, 150, 40);
  ScalarImage expected = Disturbed(5, 70, 110);
  Guarded<float> disparity(*backend_, expected.data), on_device(*backend_, rough.data);
  Guarded<uint8_t> measured(*backend_, expected.data.size());
  StereoArbitrateParams params{};
  params.reference = reference_view_;
  std::copy(views_.begin(), views_.end(), params.shifted);
  params.num_shifted = 4;
  params.width = kWidth;
  params.height = kHeight;
  params.rough = on_device.data();
  params.disparity = disparity.data();
  params.measured = measured.data();
  backend_->stereo()->Arbitrate(params);

  std::vector<RenderedPair> pairs;
  for (const Picture& picture : pictures_) {
    Image8 own(picture.rect.width, picture.rect.height);
    for (int y = 0; y < own.height; ++y) {
      for (int x = 0; x < own.width; ++x) {
        for (int c = 0; c < 3; ++c) {
          own(x, y, c) = reference_.rgb8(x + picture.rect.x - reference_.rect.x,
                                         y + picture.rect.y - reference_.rect.y, c);
        }
      }
    }
    pairs.push_back({picture.shift, picture.rect, own, picture.rgb8});
  }
  const ScalarImage before = expected;
  const Mask expected_measured = ArbitrateDisparity(pairs, rough, expected);
  const auto found = disparity.Read();
  const auto found_measured = measured.Read();
  // The host rounds warped colours to bytes: a verdict near its threshold may fall the other way.
  size_t differ = 0, changed = 0, unmeasured = 0;
  for (size_t i = 0; i < found.size(); ++i) {
    ASSERT_TRUE(std::isfinite(found[i]));
    ASSERT_TRUE(found_measured[i] == 0 || found_measured[i] == 255);
    differ += std::fabs(found[i] - expected.data[i]) > 1e-4f ||
              found_measured[i] != expected_measured.data[i];
    changed += expected.data[i] != before.data[i];
    unmeasured += expected_measured.data[i] == 0;
  }
  EXPECT_LE(double(differ), 0.005 * double(found.size()));
  EXPECT_GT(changed, found.size() / 20);
  EXPECT_GT(unmeasured, found.size() / 50);
}

TEST_F(StereoOnDevice, RefinesAsTheHost) {
  ScalarImage expected = Disturbed(5, 70, 110);
  const ScalarImage before = expected;
  Guarded<float> disparity(*backend_, expected.data);
  StereoRefineParams params{};
  params.reference = reference_view_;
  std::copy(views_.begin(), views_.end(), params.shifted);
  params.num_shifted = 4;
  params.width = kWidth;
  params.height = kHeight;
  params.disparity = disparity.data();
  backend_->stereo()->Refine(params);

  std::vector<ShiftedGray> grays;
  for (const Picture& picture : pictures_) {
    grays.push_back({picture.shift, picture.rect, picture.gray});
  }
  ScalarImage own(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      own(x, y) = reference_.gray(x - reference_.rect.x, y - reference_.rect.y);
    }
  }
  RefineDisparity(own, grays, expected);
  const auto found = disparity.Read();
  double worst = 0, sum_before = 0, sum_after = 0;
  size_t far = 0;
  for (size_t i = 0; i < found.size(); ++i) {
    const double difference = std::fabs(double(found[i]) - double(expected.data[i]));
    worst = std::max(worst, difference);
    far += !(difference < 0.01);  // the host looks positions up in steps of 1/32 pixel
    const double truth = Truth(double(i % kWidth) + 0.5, double(i / kWidth) + 0.5);
    if (std::fabs(before.data[i] - truth) > 1) continue;
    sum_before += std::fabs(before.data[i] - truth);
    sum_after += std::fabs(found[i] - truth);
  }
  EXPECT_LE(worst, 0.2);
  EXPECT_LE(double(far), 0.02 * double(found.size()));
  EXPECT_LT(sum_after, 0.5 * sum_before);
}

TEST_F(StereoOnDevice, FollowsTheOptions) {
  const PosedCamera view{Camera::Pinhole(1, 240, 180, 200, 210, 118.5, 93.25), Rigid3d{}};
  const PlaneScene plane{4, 0.2, 0.1};
  Renderer renderer(backend_, plane.Model(4.5, 0.06, 2));
  const DepthMap truth = plane.ExactDepth(view.camera);
  Monitor monitor;
  const auto median_error = [&](const DepthEstimate& estimate) {
    std::vector<double> errors;
    for (size_t i = 0; i < truth.data.size(); ++i) {
      if (!estimate.valid.data[i]) continue;
      errors.push_back(std::abs(estimate.depth.data[i] / truth.data[i] - 1));
    }
    if (errors.empty()) return 1.0;
    std::nth_element(errors.begin(), errors.begin() + int64_t(errors.size() / 2), errors.end());
    return errors[errors.size() / 2];
  };
  StereoHvOptions options;
  options.both_sides = false;
  options.aggregate = StereoAggregate::kMin;
  options.arbitrate = false;
  options.refine = false;
  const auto papers = EstimateStereoOnDevice(renderer, view, options, monitor);
  ASSERT_TRUE(papers);
  EXPECT_THAT(papers->reason, testing::HasSubstr("2 rendered pairs"));
  EXPECT_GT(papers->valid_fraction, 0.95);
  EXPECT_LT(median_error(*papers), 0.015);

  const auto full = EstimateStereoOnDevice(renderer, view, {}, monitor);
  ASSERT_TRUE(full);
  EXPECT_THAT(full->reason, testing::HasSubstr("4 rendered pairs"));
  EXPECT_LT(median_error(*full), 0.003);
  EXPECT_LT(median_error(*full), median_error(*papers));

  options.baseline = 40;  // disparities beyond the longest search
  options.max_disparities = 1024;
  EXPECT_FALSE(EstimateStereoOnDevice(renderer, view, options, monitor));
}

}  // namespace
}  // namespace retint
