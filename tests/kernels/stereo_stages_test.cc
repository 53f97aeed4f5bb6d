// SPDX-License-Identifier: BSD-3-Clause
// The stages of stereo after matching, on every backend: against their definitions in double
// precision, and by their purpose.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "kernels/stereo_ops.h"
#include "tests/kernels/stereo_reference.h"
#include "tests/kernels/test_scene.h"

namespace retint {
namespace {

struct Motion {
  int x, y;
};
constexpr Motion kMotions[] = {{-1, 0}, {0, -1}, {1, 0}, {0, 1}};

// The grid's pixels, or more.
struct Rect {
  int x, y, width, height;
};

// An image on the grid's plane.
struct HostImage {
  Rect rect;
  std::vector<float> rgb, gray;
};

// `color(x, y, channel)` at the pixel centers of `rect`.
HostImage Picture(const Rect& rect, const std::function<float(double, double, int)>& color) {
  HostImage out{rect, {}, {}};
  for (int y = 0; y < rect.height; ++y) {
    for (int x = 0; x < rect.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        out.rgb.push_back(color(rect.x + x + 0.5, rect.y + y + 0.5, c));
      }
      const float* rgb = &out.rgb[out.rgb.size() - 3];
      out.gray.push_back(0.299f * rgb[0] + 0.587f * rgb[1] + 0.114f * rgb[2]);
    }
  }
  return out;
}

// The grid with a margin, and with `padding` on the side from which content enters.
Rect RectOf(int width, int height, const Motion& motion, int padding) {
  Rect rect{-8, -8, width + 16, height + 16};
  (motion.x ? rect.width : rect.height) += padding;
  if (motion.x < 0) rect.x -= padding;
  if (motion.y < 0) rect.y -= padding;
  return rect;
}

// Scenes are made by each test.
class StereoStages : public BackendTest {
 protected:
  // The reference shows `own`, and the view shifted by a motion shows `seen`.
  template <typename Own, typename Seen>
  void Render(int width, int height, int padding, const Own& own, const Seen& seen) {
    width_ = width, height_ = height;
    images_.push_back(Picture(
        {-8 - padding, -8 - padding, width + 2 * padding + 16, height + 2 * padding + 16}, own));
    for (const Motion& motion : kMotions) {
      images_.push_back(Picture(RectOf(width, height, motion, padding),
                                [&](double x, double y, int c) { return seen(motion, x, y, c); }));
    }
  }
  // Of image k, the reference's being 0; in backend memory or the host's.
  StereoView ViewOf(size_t k, bool on_host) {
    const HostImage& image = images_[k];
    StereoView view{image.rgb.data(),
                    image.gray.data(),
                    image.rect.x,
                    image.rect.y,
                    image.rect.width,
                    image.rect.height,
                    0,
                    0};
    if (!on_host) {
      held_.push_back(backend_->Upload(std::span<const float>(image.rgb)));
      view.rgb = held_.back().data();
      held_.push_back(backend_->Upload(std::span<const float>(image.gray)));
      view.gray = held_.back().data();
    }
    if (k > 0) view.dx = kMotions[k - 1].x, view.dy = kMotions[k - 1].y;
    return view;
  }
  template <typename Params>
  Params ParamsOf(bool on_host) {
    Params params{};
    params.reference = ViewOf(0, on_host);
    for (size_t k = 1; k < images_.size(); ++k) {
      params.shifted[params.num_shifted++] = ViewOf(k, on_host);
    }
    params.width = width_, params.height = height_;
    return params;
  }
  std::vector<uint8_t> Arbitrate(const std::vector<float>& rough, std::vector<float>& disparity) {
    Guarded<float> in(*backend_, rough), inout(*backend_, disparity);
    Guarded<uint8_t> measured(*backend_, disparity.size());
    auto params = ParamsOf<StereoArbitrateParams>(false);
    params.rough = in.data();
    params.disparity = inout.data();
    params.measured = measured.data();
    backend_->stereo().Arbitrate(params);
    disparity = inout.Read();
    return measured.Read();
  }
  void Refine(std::vector<float>& disparity) {
    Guarded<float> inout(*backend_, disparity);
    auto params = ParamsOf<StereoRefineParams>(false);
    params.disparity = inout.data();
    backend_->stereo().Refine(params);
    disparity = inout.Read();
  }
  size_t At(int x, int y) const { return size_t(y) * size_t(width_) + size_t(x); }

  int width_ = 0, height_ = 0;
  std::vector<HostImage> images_;
  std::vector<Buffer<float>> held_;
};

TEST_P(StereoStages, FuseTheLargestSetThatAgrees) {
  constexpr size_t kCount = 97 * 61;
  for (const bool nearest : {false, true}) {
    for (int pairs = 1; pairs <= kMaxStereoViews; ++pairs) {
      std::vector<std::vector<float>> hosts;
      std::vector<Guarded<float>> guarded;
      StereoFuseParams params{};
      for (int k = 0; k < pairs; ++k) {
        hosts.emplace_back(kCount);
        for (float& s : hosts.back()) {
          s = rng_() % 4 == 0 ? -1.0f : 10 + float(rng_() % 64) / 16;
        }
        guarded.emplace_back(*backend_, hosts.back());
        params.pairs[k] = guarded.back().data();
      }
      Guarded<float> out(*backend_, kCount);
      params.num_pairs = pairs;
      params.pixels = int64_t(kCount);
      params.tolerance = 1;
      params.nearest = nearest;
      params.disparity = out.data();
      backend_->stereo().Fuse(params);
      const auto found = out.Read();
      for (size_t i = 0; i < kCount; ++i) {
        std::vector<double> values;
        for (const auto& host : hosts) values.push_back(double(host[i]));
        // A division of single precision.
        ASSERT_NEAR(found[i], ReferenceFused(values, 1, nearest), 2e-6) << pairs;
      }
    }
  }
}

TEST_P(StereoStages, FuseTakesTheNearestWhereNoneAgree) {
  const auto fuse = [&](const std::vector<float>& values, bool nearest) {
    std::vector<Guarded<float>> guarded;
    StereoFuseParams params{};
    for (const float value : values) {
      guarded.emplace_back(*backend_, std::vector<float>{value});
      params.pairs[params.num_pairs++] = guarded.back().data();
    }
    Guarded<float> out(*backend_, 1);
    params.pixels = 1;
    params.tolerance = 1;
    params.nearest = nearest;
    params.disparity = out.data();
    backend_->stereo().Fuse(params);
    return out.Read()[0];
  };
  EXPECT_FLOAT_EQ(fuse({20, 20.5f}, false), 20.25f);
  EXPECT_FLOAT_EQ(fuse({20, 25}, false), 25);  // the nearer: the larger disparity
  EXPECT_FLOAT_EQ(fuse({20, 25, 20.5f}, false), 20.25f);
  EXPECT_FLOAT_EQ(fuse({30, 20, 20.4f, 30.2f}, false), 30.1f);
  EXPECT_FLOAT_EQ(fuse({-1, 20}, false), 20);
  EXPECT_LT(fuse({-1, -1}, false), 0);
  EXPECT_FLOAT_EQ(fuse({20, 20.5f}, true), 20.5f);
  EXPECT_FLOAT_EQ(fuse({20, 25, 20.5f}, true), 25);
  EXPECT_LT(fuse({-1, -1}, true), 0);
}

// A slanted plane of a smooth texture, with wrong and missing patches in its disparity.
class OnASlant : public StereoStages {
 protected:
  void SetUp() override {
    StereoStages::SetUp();
    if (IsSkipped()) return;
    Render(213, 131, 40, Texture, [](const Motion& motion, double x, double y, int c) {
      // The point whose disparity leads here: a fixed point, which a slant this small has.
      double u = x, v = y;
      for (int i = 0; i < 30; ++i) {
        const double s = Truth(u, v);
        u = x - motion.x * s, v = y - motion.y * s;
      }
      return Texture(u, v, c);
    });
  }
  // In steps of 1/255, each channel its own.
  static float Texture(double x, double y, int channel) {
    double sum = 0;
    for (int k = 1; k <= 4; ++k) {
      sum += std::sin(0.11 * k * x + 1.7 * k * k + channel) *
             std::cos(0.13 * k * y + 0.9 * k + 2 * channel);
    }
    return float(std::round(255 * (0.5 + 0.12 * sum)) / 255);
  }
  static double Truth(double x, double y) { return 14 + 0.03 * x - 0.02 * y; }
  // The truth and a ripple, with blocks of another disparity and, apart from them, of none.
  std::vector<float> Disturbed(float wrong, int x_wrong, int x_missing) const {
    std::vector<float> out;
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        const double ripple = 0.2 * std::sin(0.05 * x) * std::cos(0.07 * y);
        out.push_back(float(std::round(32 * (Truth(x + 0.5, y + 0.5) + ripple)) / 32));
        const bool block = y % 48 > 12 && y % 48 < 34;
        if (block && std::abs(x - x_wrong) < 11) out.back() += wrong;
        if (block && std::abs(x - x_missing) < 9) out.back() = -1;
      }
    }
    return out;
  }
};

TEST_P(OnASlant, ArbitratesByDefinition) {
  const auto rough = Disturbed(-4, 150, 40), start = Disturbed(5, 70, 110);
  auto params = ParamsOf<StereoArbitrateParams>(true);
  auto on_host = start;
  params.rough = rough.data();
  params.disparity = on_host.data();
  const ReferenceArbitration expected = ReferenceArbitrate(params);
  auto found = start;
  const auto measured = Arbitrate(rough, found);
  size_t differ = 0, changed = 0, unmeasured = 0;
  for (size_t i = 0; i < found.size(); ++i) {
    ASSERT_TRUE(std::isfinite(found[i]));
    ASSERT_TRUE(measured[i] == 0 || measured[i] == 255);
    differ +=
        std::fabs(found[i] - expected.disparity[i]) > 1e-4 || measured[i] != expected.measured[i];
    changed += expected.disparity[i] != double(start[i]);
    unmeasured += expected.measured[i] == 0;
  }
  // The CPU rounds warped colors to bytes, so that a verdict near its threshold may fall the other
  // way, and the verdicts that grow from it.
  EXPECT_LE(double(differ), 0.005 * double(found.size()));
  EXPECT_GT(changed, found.size() / 20);
  EXPECT_GT(unmeasured, found.size() / 50);
}

TEST_P(OnASlant, RefinesByDefinition) {
  const auto start = Disturbed(5, 70, 110);
  auto params = ParamsOf<StereoRefineParams>(true);
  auto on_host = start;
  params.disparity = on_host.data();
  const auto expected = ReferenceRefine(params);
  auto found = start;
  Refine(found);
  double worst = 0, sum_before = 0, sum_after = 0;
  size_t far = 0;
  for (size_t i = 0; i < found.size(); ++i) {
    const double difference = std::fabs(double(found[i]) - expected[i]);
    worst = std::max(worst, difference);
    far += !(difference < 0.01);
    const double truth = Truth(double(i % size_t(width_)) + 0.5, double(i / size_t(width_)) + 0.5);
    if (std::fabs(double(start[i]) - truth) > 1) continue;
    sum_before += std::fabs(double(start[i]) - truth);
    sum_after += std::fabs(double(found[i]) - truth);
  }
  // The CPU samples at 32nds of a pixel. With little texture, that moves one more step.
  EXPECT_LE(worst, 0.2);
  EXPECT_LE(double(far), 0.02 * double(found.size()));
  EXPECT_LT(sum_after, 0.5 * sum_before);
}

// Smooth noise in [0, 1], the same at any real position: a texture to look at from two places.
class Noise {
 public:
  explicit Noise(unsigned seed) : values_(64 * 64) {
    std::mt19937 random(seed);
    for (float& value : values_) value = float(random() % 1000) / 999.0f;
  }
  double operator()(double x, double y) const {
    return 0.6 * Octave(x / 5.0, y / 5.0) + 0.4 * Octave(x / 11.0 + 7, y / 11.0 + 3);
  }

 private:
  double At(int x, int y) const { return values_[size_t((y & 63) * 64 + (x & 63))]; }
  double Octave(double x, double y) const {
    const int x0 = int(std::floor(x)), y0 = int(std::floor(y));
    const auto fade = [](double t) { return t * t * (3 - 2 * t); };
    const double u = fade(x - x0), v = fade(y - y0);
    return (At(x0, y0) * (1 - u) + At(x0 + 1, y0) * u) * (1 - v) +
           (At(x0, y0 + 1) * (1 - u) + At(x0 + 1, y0 + 1) * u) * v;
  }
  std::vector<float> values_;
};

// A near square of one texture before a far plane, seen from all four sides.
class BeforeAPlane : public StereoStages {
 protected:
  static constexpr int kLeft = 70, kRight = 130, kTop = 50, kBottom = 110;
  static constexpr float kNear = 24, kFar = 10;
  static bool OnSquare(double x, double y, int grown = 0) {
    return x >= kLeft - grown && x < kRight + grown && y >= kTop - grown && y < kBottom + grown;
  }
  // With `flat`, the far plane has no texture at all.
  void Look(bool flat) {
    const Noise near(11), far(12);
    const auto seen = [&](const Motion& motion, double u, double v, int) {
      const double x = u - motion.x * kNear, y = v - motion.y * kNear;
      if (OnSquare(x, y)) return float(near(x, y));
      return float(flat ? 0.5 : far(u - motion.x * kFar, v - motion.y * kFar));
    };
    Render(
        200, 160, 48,
        [&](double x, double y, int c) {
          return seen({0, 0}, x, y, c);
        },
        seen);
    truth_ = Disparity(0);
  }
  // The truth with the square grown, as a matcher's windows fatten it.
  std::vector<float> Disparity(int grown) const {
    std::vector<float> out;
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) out.push_back(OnSquare(x, y, grown) ? kNear : kFar);
    }
    return out;
  }
  // The share of the pixels within 12 of the square whose disparity is right.
  double ShareRight(const std::vector<float>& disparity) const {
    int right = 0, all = 0;
    for (int y = kTop - 12; y < kBottom + 12; ++y) {
      for (int x = kLeft - 12; x < kRight + 12; ++x, ++all) {
        right += std::abs(disparity[At(x, y)] - truth_[At(x, y)]) < 0.5;
      }
    }
    return double(right) / all;
  }

  std::vector<float> truth_;
};

TEST_P(BeforeAPlane, RoughDepthTrimsFattenedSilhouettesBeforeTexture) {
  Look(false);
  auto disparity = Disparity(8);
  EXPECT_LT(ShareRight(disparity), 0.7);
  const auto measured = Arbitrate(truth_, disparity);
  EXPECT_GT(ShareRight(disparity), 0.97);
  EXPECT_EQ(measured[At(kLeft - 5, 80)], 255) << "color confirms the rough depth there";
}

TEST_P(BeforeAPlane, AndBeforeFlatColorByContinuity) {
  Look(true);
  auto disparity = Disparity(8);
  const auto measured = Arbitrate(truth_, disparity);
  EXPECT_GT(ShareRight(disparity), 0.97);
  EXPECT_EQ(measured[At(kLeft - 5, 80)], 0) << "nothing was measured there";
  EXPECT_EQ(measured[At(100, 80)], 255);
}

TEST_P(BeforeAPlane, WrongRoughDepthDoesNotSpoilStereo) {
  Look(false);
  auto rough = truth_, disparity = truth_;
  for (int y = 60; y < 100; ++y) {
    for (int x = 10; x < 50; ++x) rough[At(x, y)] = 4;    // a blob behind the far plane
    for (int x = 80; x < 120; ++x) rough[At(x, y)] = 10;  // a hole in the square
  }
  const auto measured = Arbitrate(rough, disparity);
  EXPECT_EQ(disparity, truth_);
  EXPECT_EQ(measured[At(30, 80)], 255);
}

TEST_P(BeforeAPlane, AgreeingDepthsAreAveragedAndUnknownOnesStayUnknown) {
  Look(false);
  auto rough = truth_, disparity = truth_;
  rough[At(20, 20)] = kFar + 0.5f;
  rough[At(21, 20)] = -1;
  disparity[At(160, 20)] = rough[At(160, 20)] = -1;
  const auto measured = Arbitrate(rough, disparity);
  EXPECT_FLOAT_EQ(disparity[At(20, 20)], kFar + 0.25f);
  EXPECT_EQ(disparity[At(21, 20)], kFar);
  EXPECT_EQ(measured[At(21, 20)], 255);
  EXPECT_EQ(disparity[At(160, 20)], -1);
  EXPECT_EQ(measured[At(160, 20)], 0);
}

// Refinement from one side at a time.
TEST_P(StereoStages, RefinementRemovesTheSubPixelError) {
  const Noise texture(3);
  const auto plane = [](double x, double y) { return 14.3 + 0.03 * x + 0.04 * y; };
  const auto gray = [&](double x, double y, int) { return float(texture(x, y)); };
  Render(200, 160, 48, gray, [&](const Motion& motion, double x, double y, int) {
    double u = x, v = y;
    for (int i = 0; i < 40; ++i) {
      const double s = plane(u, v);
      u = x - motion.x * s, v = y - motion.y * s;
    }
    return float(texture(u, v));
  });
  std::vector<float> start;
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      start.push_back(float(std::round(2 * plane(x + 0.5, y + 0.5)) / 2));  // locked to halves
    }
  }
  const auto median_error = [&](const std::vector<float>& disparity) {
    std::vector<double> errors;
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        errors.push_back(std::abs(disparity[At(x, y)] - plane(x + 0.5, y + 0.5)));
      }
    }
    const auto middle = errors.begin() + std::ptrdiff_t(errors.size() / 2);
    std::nth_element(errors.begin(), middle, errors.end());
    return *middle;
  };
  EXPECT_GT(median_error(start), 0.1);
  for (size_t k = 1; k < images_.size(); ++k) {
    auto params = ParamsOf<StereoRefineParams>(false);
    params.shifted[0] = params.shifted[k - 1];
    params.num_shifted = 1;
    Guarded<float> disparity(*backend_, start);
    params.disparity = disparity.data();
    backend_->stereo().Refine(params);
    EXPECT_LT(median_error(disparity.Read()), 0.04) << k;  // the damping leaves a share of the step
  }
}

TEST_P(StereoStages, RefinementLeavesHolesAndEdgesAlone) {
  const Noise texture(4);
  Render(
      200, 160, 48, [&](double x, double y, int) { return float(texture(x, y)); },
      [&](const Motion& motion, double x, double y, int) {
        return float(texture(x - 20 * motion.x, y - 20 * motion.y));
      });
  std::vector<float> disparity(size_t(width_ * height_), 20.2f);
  for (int y = 0; y < height_; ++y) {
    for (int x = 100; x < width_; ++x) disparity[At(x, y)] = 9.9f;
  }
  disparity[At(40, 40)] = -1;
  Refine(disparity);
  EXPECT_EQ(disparity[At(40, 40)], -1);
  EXPECT_EQ(disparity[At(41, 41)], 20.2f);
  EXPECT_EQ(disparity[At(99, 80)], 20.2f);
  EXPECT_EQ(disparity[At(100, 80)], 9.9f);
  EXPECT_NEAR(disparity[At(60, 80)], 20, 0.05);
}

RETINT_INSTANTIATE(StereoStages);
RETINT_INSTANTIATE(OnASlant);
RETINT_INSTANTIATE(BeforeAPlane);

}  // namespace
}  // namespace retint
