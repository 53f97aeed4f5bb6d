// SPDX-License-Identifier: BSD-3-Clause
// Stereo on every backend: the matcher against plain loops on small images, and the small stages.
#include "kernels/stereo_ops.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <tuple>

#include <hwy/highway.h>
#include <tbb/global_control.h>

#include "tests/kernels/test_scene.h"

namespace retint {
namespace {

class Stereo : public BackendTest {
 protected:
  StereoOps& stereo() { return backend_->stereo(); }
};

struct HostImage {
  int x = 0, y = 0, width = 0, height = 0;  // on the grid
  std::vector<float> gray;
  float At(int px, int py) const {
    px = std::clamp(px, 0, width - 1), py = std::clamp(py, 0, height - 1);
    return gray[size_t(py) * size_t(width) + size_t(px)];
  }
};

// The matcher by its definition, in pixels of the shifted view.
class HostMatcher {
 public:
  HostMatcher(const HostImage& reference, const HostImage& shifted, const StereoMatchParams& params)
      : shifted_(shifted), params_(params), dx_(params.shifted.dx), dy_(params.shifted.dy) {
    HostImage own = shifted;  // the reference's pixels of the same extent
    for (int y = 0; y < own.height; ++y) {
      for (int x = 0; x < own.width; ++x) {
        own.gray[size_t(y) * size_t(own.width) + size_t(x)] =
            reference.At(x + own.x - reference.x, y + own.y - reference.y);
      }
    }
    sums_.assign(size_t(own.width) * size_t(own.height) * size_t(params.count), 0);
    FillCosts(own);
    for (const auto& [u, v] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) AddPath(u, v);
  }

  // On the grid.
  std::vector<float> Disparity() const {
    std::vector<float> out(size_t(params_.width) * size_t(params_.height), -1.0f);
    for (int y = 0; y < params_.height; ++y) {
      for (int x = 0; x < params_.width; ++x) {
        out[size_t(y) * size_t(params_.width) + size_t(x)] = At(x - shifted_.x, y - shifted_.y);
      }
    }
    return out;
  }

 private:
  size_t Index(int x, int y, int d) const {
    return (size_t(y) * size_t(shifted_.width) + size_t(x)) * size_t(params_.count) + size_t(d);
  }
  bool Inside(int x, int y) const {
    return x >= 0 && y >= 0 && x < shifted_.width && y < shifted_.height;
  }
  std::bitset<63> Census(const HostImage& image, int x, int y) const {
    const int rx = dx_ ? 4 : 3, ry = dx_ ? 3 : 4;  // nine pixels along the motion
    std::bitset<63> bits;
    size_t n = 0;
    bits[62] = true;  // unless a pixel differs
    for (int j = -ry; j <= ry; ++j) {
      for (int i = -rx; i <= rx; ++i) {
        if (i || j) bits[n++] = image.At(x + i, y + j) < image.At(x, y);
        if (image.At(x + i, y + j) != image.At(x, y)) bits[62] = false;
      }
    }
    return bits;
  }
  void FillCosts(const HostImage& own) {
    costs_.resize(sums_.size());
    for (int y = 0; y < own.height; ++y) {
      for (int x = 0; x < own.width; ++x) {
        const auto mine = Census(own, x, y);
        for (int d = 0; d < params_.count; ++d) {
          const int s = params_.lowest + d, tx = x + s * dx_, ty = y + s * dy_;
          int& cost = costs_[Index(x, y, d)];
          cost = Inside(tx, ty) ? int((mine ^ Census(shifted_, tx, ty)).count()) : 63;
          if (mine[62]) cost = 0;
        }
      }
    }
  }
  void AddPath(int u, int v) {
    std::vector<int> path(costs_.size());
    const int w = shifted_.width, h = shifted_.height, n = params_.count;
    for (int j = 0; j < h; ++j) {
      for (int i = 0; i < w; ++i) {
        const int x = u < 0 ? w - 1 - i : i, y = v < 0 ? h - 1 - j : j;
        const bool starts = !Inside(x - u, y - v);
        const int* before = starts ? nullptr : &path[Index(x - u, y - v, 0)];
        const int least = starts ? 0 : *std::min_element(before, before + n);
        for (int d = 0; d < n; ++d) {
          int add = 0;
          if (!starts) {
            add = std::min(before[d], least + params_.p2);
            if (d > 0) add = std::min(add, before[d - 1] + params_.p1);
            if (d + 1 < n) add = std::min(add, before[d + 1] + params_.p1);
          }
          path[Index(x, y, d)] = costs_[Index(x, y, d)] + add - least;
          sums_[Index(x, y, d)] += path[Index(x, y, d)];
        }
      }
    }
  }
  float At(int x, int y) const {
    const int n = params_.count;
    const int* sums = &sums_[Index(x, y, 0)];
    const int best = int(std::min_element(sums, sums + n) - sums), least = sums[best];
    int second = INT32_MAX;
    for (int d = 0; d < n; ++d) {
      if (std::abs(d - best) > 1) second = std::min(second, sums[d]);
    }
    if (second <= least || second * (100 - params_.uniqueness_percent) < least * 100) return -1;
    float s = float(params_.lowest + best);
    if (best > 0 && best + 1 < n) {
      const int below = sums[best - 1], above = sums[best + 1];
      const int steeper = std::max(below, above) - least;
      if (steeper > 0) s += 0.5f * float(below - above) / float(steeper);
    }
    // The way back, from the pixel that s leads to.
    const int rounded = int(s + 0.5f), tx = x + rounded * dx_, ty = y + rounded * dy_;
    const int reach = params_.lowest + best;
    if (!Inside(x + reach * dx_, y + reach * dy_) || !Inside(tx, ty)) return -1;
    int back = -1;
    for (int d = 0; d < n; ++d) {
      const int fx = tx - (params_.lowest + d) * dx_, fy = ty - (params_.lowest + d) * dy_;
      if (!Inside(fx, fy)) continue;
      if (back < 0 ||
          sums_[Index(fx, fy, d)] < sums_[Index(tx - (params_.lowest + back) * dx_,
                                                ty - (params_.lowest + back) * dy_, back)]) {
        back = d;
      }
    }
    if (back < 0 || std::fabs(float(params_.lowest + back) - s) > params_.tolerance) return -1;
    return s;
  }

  const HostImage& shifted_;
  const StereoMatchParams& params_;
  int dx_, dy_;
  std::vector<int> costs_, sums_;
};

struct MatchCase {
  int width, height, dx, dy, lowest, count, slope;
};

// A stereo pair in backend memory.
struct MatchPair {
  HostImage reference, shifted;
  std::unique_ptr<Guarded<float>> reference_gray, shifted_gray, disparity;
  StereoMatchParams params{};
};

// By backend: "cpu", "cpu-scalar", "cuda".
class MatcherTest : public testing::Test {
 protected:
  void Open(const std::string& name) {
    name_ = name;
    try {
      backend_ = MakeBackend(name);
    } catch (const std::exception& error) {
      ASSERT_EQ(name, "cuda") << error.what();
      GTEST_SKIP() << error.what();
    }
  }
  void Match(const StereoMatchParams& params) { backend_->stereo().Match(params); }
  MatchPair MakePair(const MatchCase& c);

  std::string name_;
  std::shared_ptr<Backend> backend_;
  std::mt19937 rng_ = TestRng();
};

class StereoMatch : public MatcherTest,
                    public testing::WithParamInterface<std::tuple<MatchCase, std::string>> {
 protected:
  void SetUp() override { Open(std::get<1>(GetParam())); }
};
INSTANTIATE_TEST_SUITE_P(
    , StereoMatch,
    testing::Combine(
        testing::Values(MatchCase{41, 23, -1, 0, 2, 32, 0}, MatchCase{41, 23, 1, 0, 0, 32, 1},
                        MatchCase{19, 37, 0, -1, 1, 64, 0}, MatchCase{33, 17, 0, 1, 3, 32, 1},
                        MatchCase{67, 9, -1, 0, 5, 96, 0}, MatchCase{21, 13, 1, 0, 0, 128, 0},
                        MatchCase{9, 11, -1, 0, 0, 160, 0}, MatchCase{9, 8, 0, 1, 0, 192, 0},
                        MatchCase{9, 8, 0, -1, 0, 224, 0}, MatchCase{9, 8, 1, 0, 0, 256, 0},
                        MatchCase{1, 1, -1, 0, 0, 32, 0}, MatchCase{300, 3, -1, 0, 0, 32, 1},
                        MatchCase{1, 1, 0, 1, 70, 64, 0}, MatchCase{31, 90, 1, 0, 2, 32, 1},
                        MatchCase{70, 40, 0, 1, 0, 32, 0}),
        testing::ValuesIn(AllBackends())));

MatchPair MatcherTest::MakePair(const MatchCase& c) {
  MatchPair pair;
  HostImage &shifted = pair.shifted, &reference = pair.reference;
  // The shifted view is wider on the side from which content enters; the reference wider still.
  const int padding = c.lowest + c.count, margin = 3;
  shifted = {-margin, -margin, c.width + 2 * margin, c.height + 2 * margin, {}};
  (c.dx ? shifted.width : shifted.height) += padding;
  if (c.dx < 0) shifted.x -= padding;
  if (c.dy < 0) shifted.y -= padding;
  reference = {shifted.x - 2, shifted.y - 5, shifted.width + 7, shifted.height + 6, {}};
  // Random texture, seen by the shifted view at a disparity that changes across the motion.
  const auto fill = [&](HostImage& image) {
    image.gray = UniformVector(rng_, size_t(image.width) * size_t(image.height), 0, 1);
  };
  fill(reference);
  fill(shifted);
  for (int y = 0; y < shifted.height; ++y) {
    for (int x = 0; x < shifted.width; ++x) {
      const int gx = x + shifted.x, gy = y + shifted.y;
      const int s = c.lowest + 3 + c.slope * std::max(0, (c.dx ? gy : gx) / 6);
      float& value = shifted.gray[size_t(y) * size_t(shifted.width) + size_t(x)];
      value = 0.1f * value +
              0.9f * reference.At(gx - s * c.dx - reference.x, gy - s * c.dy - reference.y);
    }
  }
  // A flat part, of which nothing is known.
  for (HostImage* image : {&reference, &shifted}) {
    for (int y = image->height * 2 / 3; y < image->height && c.width > 60; ++y) {
      std::fill_n(&image->gray[size_t(y) * size_t(image->width)], image->width / 3, 0.25f);
    }
  }
  pair.reference_gray = std::make_unique<Guarded<float>>(*backend_, reference.gray);
  pair.shifted_gray = std::make_unique<Guarded<float>>(*backend_, shifted.gray);
  pair.disparity = std::make_unique<Guarded<float>>(*backend_, size_t(c.width) * size_t(c.height));
  StereoMatchParams& params = pair.params;
  params.reference = {nullptr,
                      pair.reference_gray->data(),
                      reference.x,
                      reference.y,
                      reference.width,
                      reference.height,
                      0,
                      0};
  params.shifted = {
      nullptr, pair.shifted_gray->data(), shifted.x, shifted.y, shifted.width, shifted.height, c.dx,
      c.dy};
  params.width = c.width;
  params.height = c.height;
  params.lowest = c.lowest;
  params.count = c.count;
  params.tolerance = 1;
  params.disparity = pair.disparity->data();
  return pair;
}

bool SameBits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

TEST_P(StereoMatch, IsItsDefinition) {
  const MatchCase& c = std::get<0>(GetParam());
  MatchPair pair = MakePair(c);
  Match(pair.params);
  const auto found = pair.disparity->Read();
  const auto expected = HostMatcher(pair.reference, pair.shifted, pair.params).Disparity();
  EXPECT_TRUE(name_ == "cuda" || SameBits(found, expected));
  size_t matched = 0, right = 0;
  for (int y = 0; y < c.height; ++y) {
    for (int x = 0; x < c.width; ++x) {
      const size_t i = size_t(y) * size_t(c.width) + size_t(x);
      ASSERT_NEAR(found[i], expected[i], 1e-5) << x << "," << y;
      const float s = float(c.lowest + 3 + c.slope * std::max(0, (c.dx ? y : x) / 6));
      matched += found[i] >= 0;
      right += std::fabs(found[i] - s) < 1;
    }
  }
  if (found.size() > 300) {
    EXPECT_GT(matched, found.size() / 2) << "or nothing was tested";
    EXPECT_GT(right, matched * 8 / 10);
  }
}

class StereoMatchOptions : public StereoMatch {};
INSTANTIATE_TEST_SUITE_P(, StereoMatchOptions,
                         testing::Combine(testing::Values(MatchCase{41, 23, 1, 0, 0, 32, 1},
                                                          MatchCase{19, 37, 0, -1, 1, 64, 0}),
                                          testing::ValuesIn(AllBackends())));

TEST_P(StereoMatchOptions, AreFollowed) {
  const MatchCase& c = std::get<0>(GetParam());
  MatchPair pair = MakePair(c);
  const auto run = [&](auto change) {
    StereoMatchParams params = pair.params;
    change(params);
    Match(params);
    const auto found = pair.disparity->Read();
    const auto expected = HostMatcher(pair.reference, pair.shifted, params).Disparity();
    for (size_t i = 0; i < found.size(); ++i) ASSERT_NEAR(found[i], expected[i], 1e-5) << i;
  };
  run([](auto& p) { p.p1 = 0, p.p2 = 192; });
  run([](auto& p) { p.p1 = p.p2 = 192; });  // sums as large as they get
  run([](auto& p) { p.p1 = p.p2 = 0, p.uniqueness_percent = 0; });
  run([](auto& p) { p.uniqueness_percent = 60, p.tolerance = 0.2f; });
}

class CpuMatch : public MatcherTest {
 protected:
  void SetUp() override { Open("cpu"); }
};

TEST_F(CpuMatch, ThreadsAndInstructionSetsGiveTheSameBits) {
  MatchPair pair = MakePair({150, 110, 0, 1, 3, 64, 1});
  const auto run = [&](const char* name) {  // a backend chooses its kernels when it is made
    MakeBackend(name)->stereo().Match(pair.params);
    return pair.disparity->Read();
  };
  const auto expected = run("cpu-scalar");
  for (const int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    for (const size_t threads : {1, 2, 5}) {
      tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      EXPECT_TRUE(SameBits(run("cpu"), expected)) << hwy::TargetName(target) << ", " << threads;
    }
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

TEST_F(CpuMatch, DisparitiesBeyondTheImageAreNone) {
  MatchPair pair = MakePair({9, 8, -1, 0, 0, 32, 0});
  for (const int lowest : {pair.shifted.width - 1, pair.shifted.width, 1 << 30}) {
    pair.params.lowest = lowest;
    Match(pair.params);
    for (const float s : pair.disparity->Read()) EXPECT_EQ(s, -1) << lowest;
  }
}

class ImpossiblePairs : public MatcherTest, public testing::WithParamInterface<std::string> {
 protected:
  void SetUp() override { Open(GetParam()); }
};
RETINT_INSTANTIATE(ImpossiblePairs);

TEST_P(ImpossiblePairs, AreRefused) {
  Guarded<float> image(*backend_, std::vector<float>(64 * 64, 0.5f)), out(*backend_, 16 * 16);
  StereoMatchParams good{};
  good.reference = {image.data(), image.data(), -40, -2, 64, 20, 0, 0};
  good.shifted = {image.data(), image.data(), -40, -2, 60, 20, -1, 0};
  good.width = good.height = 16;
  good.count = 32;
  good.tolerance = 1;
  good.disparity = out.data();
  EXPECT_NO_THROW(Match(good));
  for (const float s : out.Read()) EXPECT_EQ(s, -1) << "no texture, no match";
  const auto refused = [&](auto change) {
    StereoMatchParams params = good;
    change(params);
    EXPECT_THROW(Match(params), std::invalid_argument);
  };
  refused([](auto& p) { p.count = 48; });
  refused([](auto& p) { p.count = 288; });
  refused([](auto& p) { p.lowest = -1; });
  refused([](auto& p) { p.p2 = 200; });
  refused([](auto& p) { p.p1 = p.p2 + 1; });
  refused([](auto& p) { p.shifted.dy = 1; });
  refused([](auto& p) { p.shifted.x = 1; });
  refused([](auto& p) { p.width = 40; });
  refused([](auto& p) { p.reference.width = 50; });
}

TEST_P(Stereo, RefusesImpossibleStages) {
  Guarded<float> image(*backend_, 9);
  StereoFuseParams fuse{};
  EXPECT_THROW(stereo().Fuse(fuse), std::invalid_argument);
  EXPECT_THROW(stereo().Arbitrate({}), std::invalid_argument);
  EXPECT_THROW(stereo().Refine({}), std::invalid_argument);
  const double bad[] = {1.5};
  EXPECT_THROW(stereo().PositiveQuantiles(image.data(), 9, bad), std::invalid_argument);
}

TEST_P(Stereo, QuantilesAreThoseOfTheSortedPositiveValues) {
  const double fractions[] = {0, 0.005, 0.5, 0.995, 1};
  for (const size_t count : {size_t(1), size_t(2), size_t(1000), size_t(70001)}) {
    auto values = UniformVector(rng_, count, -1, 3);
    values[0] = 2.5f;
    for (size_t i = 3; i < count; i += 7) values[i] = 0;
    std::vector<float> sorted;
    std::copy_if(values.begin(), values.end(), std::back_inserter(sorted),
                 [](float v) { return v > 0; });
    std::sort(sorted.begin(), sorted.end());
    Guarded<float> on_device(*backend_, values);
    const auto found = stereo().PositiveQuantiles(on_device.data(), int64_t(count), fractions);
    ASSERT_EQ(found.size(), 5u);
    for (size_t i = 0; i < 5; ++i) {
      EXPECT_EQ(found[i], sorted[size_t(fractions[i] * double(sorted.size() - 1))]) << count;
    }
  }
  Guarded<float> none(*backend_, {0.0f, -1.0f, -0.0f});
  EXPECT_TRUE(stereo().PositiveQuantiles(none.data(), 3, fractions).empty());
  EXPECT_TRUE(stereo().PositiveQuantiles(none.data(), 0, fractions).empty());
}

TEST_P(Stereo, GrayIsTheLumaOfClampedColor) {
  const auto rgb = UniformVector(rng_, 3 * 501, -0.3f, 1.3f);
  Guarded<float> in(*backend_, rgb), out(*backend_, 501);
  stereo().Gray(in.data(), 501, out.data());
  const auto found = out.Read();
  for (size_t i = 0; i < found.size(); ++i) {
    const auto unit = [&](size_t c) { return std::clamp(double(rgb[3 * i + c]), 0.0, 1.0); };
    EXPECT_NEAR(found[i], 0.299 * unit(0) + 0.587 * unit(1) + 0.114 * unit(2), 1e-6);
  }
}

TEST_P(Stereo, InvertLeavesTheUnknownToTheOther) {
  const std::vector<float> values = {2, 0, -1, 0.5f}, others = {7, 8, 9, 10};
  Guarded<float> in(*backend_, values), other(*backend_, others), out(*backend_, 4);
  stereo().Invert(in.data(), other.data(), 4, 3, out.data());
  EXPECT_EQ(out.Read(), (std::vector<float>{1.5f, 8, 9, 6}));
  stereo().Invert(in.data(), nullptr, 4, 3, in.data());
  EXPECT_EQ(in.Read(), (std::vector<float>{1.5f, -1, -1, 6}));
}

RETINT_INSTANTIATE(Stereo);

}  // namespace
}  // namespace retint
