// SPDX-License-Identifier: BSD-3-Clause
// Regions against the whole view that they are part of, with and without explicit weights.
#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "tests/kernels/test_scene.h"

namespace retint {
namespace {

constexpr size_t kNoBudget = 0, kAmple = size_t{1} << 30;

class RegionOp : public BackendTest {
 protected:
  void Make(int width, int height, int64_t gaussians, float share) {
    model_ = RandomModel(rng_, gaussians);
    uploaded_ = backend_->blend().UploadModel(model_.arrays());
    view_ = backend_->blend().PrepareView(*uploaded_, TestCamera(width, height));
    active_.resize(size_t(gaussians));
    for (uint8_t& a : active_) a = Uniform(rng_, 0, 1) < share;
    device_active_ = backend_->Upload(std::span<const uint8_t>(active_));
    rows_ = RowsOf(*backend_, *view_);
    pixels_ = size_t(width) * size_t(height);
  }
  std::shared_ptr<const ViewGeometry> Restrict(size_t budget) {
    return backend_->blend().Restrict(*view_, device_active_.data(), budget);
  }
  // Features by Gaussian, [N, channels], zero for inactive ones.
  std::vector<float> MakeFeatures(int channels) {
    std::vector<float> features;
    for (const uint8_t active : active_) {
      for (int c = 0; c < channels; ++c) features.push_back(active ? Uniform(rng_, -1, 1) : 0);
    }
    return features;
  }
  // Those of a geometry's rows.
  std::vector<float> Gather(const std::vector<float>& features, int channels,
                            const ViewGeometry& geometry) {
    std::vector<float> rows;
    for (const int32_t g : RowsOf(*backend_, geometry)) {
      for (int c = 0; c < channels; ++c) {
        rows.push_back(features[size_t(g) * size_t(channels) + size_t(c)]);
      }
    }
    return rows;
  }

  TestModel model_;
  std::unique_ptr<Model> uploaded_;
  std::shared_ptr<const ViewGeometry> view_;
  std::vector<uint8_t> active_;
  Buffer<uint8_t> device_active_;
  std::vector<int32_t> rows_;
  size_t pixels_ = 0;
};

TEST_P(RegionOp, HoldsTheActiveRows) {
  Make(160, 90, 500, 0.2f);
  std::set<int32_t> expected;
  for (const int32_t g : rows_) {
    if (active_[size_t(g)]) expected.insert(g);
  }
  ASSERT_FALSE(expected.empty());
  for (const size_t budget : {kNoBudget, kAmple}) {
    const auto rows = RowsOf(*backend_, *Restrict(budget));
    EXPECT_EQ(rows.size(), expected.size());
    EXPECT_EQ(std::set<int32_t>(rows.begin(), rows.end()), expected);
  }
}

// Recomputed weights are the whole view's, so only the order of additions differs. Explicit ones
// are rounded to 1 / 65535 of their entry's largest. The weights of a pixel sum to at most 1, and
// each of a few dozen entries adds at most half a step: 1e-3 is ample, 2e-4 was measured.
TEST_P(RegionOp, BlendsAsTheWholeView) {
  Make(200, 150, 2000, 0.1f);
  for (const size_t budget : {kNoBudget, kAmple}) {
    SCOPED_TRACE(budget);
    const auto region = Restrict(budget);
    const double tolerance = budget == kNoBudget ? 1e-5 : 2e-4;
    for (const int channels : {1, 3, 8}) {
      const auto features = MakeFeatures(channels);
      const Blended expected =
          RunBlend(*backend_, *view_, Gather(features, channels, *view_), channels);
      const Blended actual =
          RunBlend(*backend_, *region, Gather(features, channels, *region), channels);
      EXPECT_LE(WorstDifference(actual.image, expected.image), tolerance);

      const auto residual = UniformVector(rng_, pixels_ * size_t(channels), -1, 1);
      const auto all = RunTranspose(*backend_, *view_, residual, channels);
      std::vector<float> by_gaussian(active_.size() * size_t(channels));
      for (size_t r = 0; r < rows_.size(); ++r) {
        std::copy_n(&all[r * size_t(channels)], channels,
                    &by_gaussian[size_t(rows_[r]) * size_t(channels)]);
      }
      const auto wanted = Gather(by_gaussian, channels, *region);
      // A row sums over up to thousands of pixels, each off by up to half a step at random.
      EXPECT_LE(WorstDifference(RunTranspose(*backend_, *region, residual, channels), wanted),
                10 * tolerance);
    }
  }
}

TEST_P(RegionOp, IsAdjointOfTranspose) {
  for (const float share : {0.01f, 0.3f, 1.0f}) {
    Make(150, 200, 1500, share);
    for (const size_t budget : {kNoBudget, kAmple}) {
      const auto region = Restrict(budget);
      for (const int channels : {1, 3, 8}) {
        const auto c = UniformVector(rng_, size_t(region->num_rows()) * size_t(channels), 0.1f, 1);
        const auto r = UniformVector(rng_, pixels_ * size_t(channels), 0.1f, 1);
        const double left = Dot(RunBlend(*backend_, *region, c, channels).image, r);
        const double right = Dot(c, RunTranspose(*backend_, *region, r, channels));
        ASSERT_GT(left, 0);
        EXPECT_NEAR(left, right, 1e-5 * left) << share << " " << budget << " " << channels;
      }
    }
  }
}

TEST_P(RegionOp, VisitsOnlyTilesOfActiveGaussians) {
  Make(320, 320, 2000, 0.01f);
  const std::set<int32_t> all(view_->tiles().begin(), view_->tiles().end());
  for (const size_t budget : {kNoBudget, kAmple}) {
    const auto region = Restrict(budget);
    ASSERT_GT(region->num_rows(), 0);
    EXPECT_LT(region->tiles().size(), all.size() / 2);
    EXPECT_TRUE(std::is_sorted(region->tiles().begin(), region->tiles().end()));
    for (const int32_t tile : region->tiles()) EXPECT_TRUE(all.count(tile));
    // Other pixels keep their values.
    const std::vector<float> features(size_t(region->num_rows()), 1.0f), before(pixels_, 7.0f);
    const std::set<int32_t> visited(region->tiles().begin(), region->tiles().end());
    for (const bool keep : {false, true}) {
      Guarded<float> in(*backend_, features), image(*backend_, before);
      backend_->blend().Blend(*region, {in.data(), 1, nullptr, image.data(), nullptr, keep});
      const auto after = image.Read();
      for (int p = 0; p < 320 * 320; ++p) {
        const int tile = p / 320 / kTileSize * region->tiles_x() + p % 320 / kTileSize;
        if (visited.count(tile)) {
          EXPECT_LE(after[size_t(p)], 1.0f);
        } else {
          EXPECT_EQ(after[size_t(p)], keep ? 7.0f : 0.0f);
        }
      }
    }
  }
}

TEST_P(RegionOp, NamesTheTilesThatActiveGaussiansTouch) {
  Make(320, 320, 2000, 0.01f);
  const auto region = Restrict(kNoBudget);
  const auto touched = backend_->blend().TouchedTiles(*view_, device_active_.data());
  ASSERT_FALSE(touched.empty());
  EXPECT_EQ(touched, std::vector<int32_t>(region->tiles().begin(), region->tiles().end()));
  backend_->Fill(device_active_.data(), 0, active_.size());
  EXPECT_TRUE(backend_->blend().TouchedTiles(*view_, device_active_.data()).empty());
}

// Among the wanted tiles are some without a Gaussian, which show the background.
TEST_P(RegionOp, BlendsWantedTilesOfTheWholeViewAlone) {
  Make(333, 222, 40, 0.5f);
  const std::set<int32_t> visited(view_->tiles().begin(), view_->tiles().end());
  std::vector<int32_t> wanted;
  for (int32_t tile = 0; tile < view_->tiles_x() * view_->tiles_y(); tile += 3) {
    wanted.push_back(tile);
  }
  const auto is_visited = [&](int32_t tile) { return visited.count(tile) > 0; };
  ASSERT_TRUE(std::any_of(wanted.begin(), wanted.end(), is_visited));
  ASSERT_FALSE(std::all_of(wanted.begin(), wanted.end(), is_visited));
  const auto features = UniformVector(rng_, rows_.size() * 3, 0, 1);
  const auto background = UniformVector(rng_, 3, 0, 1);
  const std::vector<float> whole = RunBlend(*backend_, *view_, features, 3, background).image;
  Guarded<float> in(*backend_, features), back(*backend_, background);
  Guarded<float> image(*backend_, std::vector<float>(pixels_ * 3, 7.0f));
  BlendParams params{in.data(), 3, back.data(), image.data(), nullptr, false};
  params.tiles = wanted;
  backend_->blend().Blend(*view_, params);
  const auto some = image.Read();
  for (size_t p = 0; p < pixels_; ++p) {
    const size_t x = p % 333 / kTileSize, y = p / 333 / kTileSize;
    const bool is_wanted = (y * size_t(view_->tiles_x()) + x) % 3 == 0;
    for (size_t c = 0; c < 3; ++c) {
      ASSERT_EQ(some[3 * p + c], is_wanted ? whole[3 * p + c] : 7.0f) << p;
    }
  }
  std::swap(wanted[0], wanted[1]);
  EXPECT_THROW(backend_->blend().Blend(*view_, params), std::invalid_argument);
  wanted = {view_->tiles_x() * view_->tiles_y()};
  params.tiles = wanted;
  EXPECT_THROW(backend_->blend().Blend(*view_, params), std::invalid_argument);
}

// The alpha of a region is the active Gaussians' share, W_A 1.
TEST_P(RegionOp, AlphaIsTheActiveShare) {
  Make(100, 80, 300, 0.3f);
  for (const size_t budget : {kNoBudget, kAmple}) {
    const auto region = Restrict(budget);
    const std::vector<float> ones(size_t(region->num_rows()), 1.0f);
    const Blended blended = RunBlend(*backend_, *region, ones, 1);
    EXPECT_LE(WorstDifference(blended.image, blended.alpha), 0.0);
  }
}

TEST_P(RegionOp, KeepsWithinItsBudget) {
  Make(200, 200, 1000, 0.5f);
  const size_t recomputed = Restrict(kNoBudget)->bytes(), stored = Restrict(kAmple)->bytes();
  EXPECT_GT(stored, recomputed);
  EXPECT_EQ(Restrict(stored / 2)->bytes(), recomputed);
  EXPECT_EQ(Restrict(stored)->bytes(), stored);
}

// Compact weights drop values below 1e-3, at most one for each entry and pixel, and round the rest
// to 1 / 255 of their entry's largest.
TEST_P(RegionOp, CompactWeightsAreCloseAndSmall) {
  Make(200, 150, 2000, 0.1f);
  const auto exact = Restrict(kAmple);
  const auto compact = backend_->blend().Restrict(*view_, device_active_.data(), kAmple, 1e-3f);
  EXPECT_EQ(RowsOf(*backend_, *compact), RowsOf(*backend_, *exact));
  EXPECT_LE(compact->bytes(), exact->bytes());
  const auto part = Gather(MakeFeatures(3), 3, *exact);
  const Blended expected = RunBlend(*backend_, *exact, part, 3);
  const Blended actual = RunBlend(*backend_, *compact, part, 3);
  EXPECT_LE(WorstDifference(actual.image, expected.image), 2e-2);
  double difference = 0, sum = 0;
  for (size_t i = 0; i < expected.image.size(); ++i) {
    difference += std::abs(double(actual.image[i]) - double(expected.image[i]));
    sum += std::abs(double(expected.image[i]));
  }
  EXPECT_GT(sum, 0);
  EXPECT_LE(difference, 0.01 * sum);
  // And the transpose is the same matrix's: <W c, r> = <c, W^T r>.
  const auto residual = UniformVector(rng_, pixels_ * 3, -1, 1);
  const auto transposed = RunTranspose(*backend_, *compact, residual, 3);
  double forward = 0, backward = 0;
  for (size_t i = 0; i < residual.size(); ++i) forward += double(actual.image[i]) * residual[i];
  for (size_t i = 0; i < part.size(); ++i) backward += double(part[i]) * transposed[i];
  EXPECT_NEAR(forward, backward, 1e-4 * sum);
}

// The weight that a coarse limit drops goes to the pixel's other Gaussians.
TEST_P(RegionOp, CompactWeightsKeepAPixelsSum) {
  Make(200, 150, 20000, 0.5f);
  const auto exact = Restrict(kAmple);
  const auto compact = backend_->blend().Restrict(*view_, device_active_.data(), kAmple, 0.01f);
  const std::vector<float> ones(size_t(exact->num_rows()), 1.0f);
  const auto expected = RunBlend(*backend_, *exact, ones, 1).image;
  const auto actual = RunBlend(*backend_, *compact, ones, 1).image;
  double difference = 0, sum = 0;
  for (size_t p = 0; p < pixels_; ++p) {
    difference += std::abs(double(actual[p]) - double(expected[p]));
    sum += double(expected[p]);
  }
  ASSERT_GT(sum, 0);
  EXPECT_LE(difference, 0.005 * sum);  // 0.008 when nothing takes over
}

TEST_P(RegionOp, CompactWeightsGiveUpRowsToFit) {
  Make(200, 150, 20000, 0.5f);
  const auto compact = [&](size_t budget) {
    return backend_->blend().Restrict(*view_, device_active_.data(), budget, 1e-3f);
  };
  const auto full = compact(kAmple);
  EXPECT_EQ(full->pixel_rows(), 0xffff);
  const std::vector<float> ones(size_t(full->num_rows()), 1.0f);
  const auto expected = RunBlend(*backend_, *full, ones, 1).image;
  for (const double share : {0.8, 0.4}) {
    const size_t budget = size_t(double(full->bytes()) * share);
    const auto thin = compact(budget);
    const uint16_t rows = thin->pixel_rows();
    EXPECT_LE(thin->bytes(), budget + size_t(thin->num_rows()) * 32);  // beside the weights
    EXPECT_NE(rows, 0xffff);
    const auto actual = RunBlend(*backend_, *thin, ones, 1).image;
    for (size_t p = 0; p < pixels_; ++p) {
      const bool kept = rows >> (p / 200 % kTileSize) & 1;
      ASSERT_NEAR(actual[p], kept ? expected[p] : 0.0f, 1e-2) << p;
    }
  }
}

// Restrict() blends the whole view's picture in the region's tiles and rows.
TEST_P(RegionOp, BlendsOnTheWay) {
  Make(200, 150, 20000, 0.5f);
  const auto colors = UniformVector(rng_, rows_.size() * 3, 0, 1);
  const auto expected = RunBlend(*backend_, *view_, colors, 3).image;
  Guarded<float> device_colors(*backend_, colors);
  const size_t full =
      backend_->blend().Restrict(*view_, device_active_.data(), kAmple, 1e-3f)->bytes();
  const struct {
    size_t budget;
    float min_weight;
  } kinds[] = {{kAmple, 1e-3f}, {full / 2, 1e-3f}, {kNoBudget, 1e-3f}, {kAmple, 0}};
  for (const auto& [budget, min_weight] : kinds) {
    Guarded<float> image(*backend_, std::vector<float>(pixels_ * 3, 7.0f));
    const RegionBlend blend = {device_colors.data(), image.data()};
    const auto region =
        backend_->blend().Restrict(*view_, device_active_.data(), budget, min_weight, &blend);
    const auto plain =
        backend_->blend().Restrict(*view_, device_active_.data(), budget, min_weight);
    EXPECT_EQ(region->bytes(), plain->bytes());
    EXPECT_EQ(region->pixel_rows(), plain->pixel_rows());
    ASSERT_FALSE(region->tiles().empty());
    const auto actual = image.Read();
    for (const int32_t tile : region->tiles()) {
      for (int p = 0; p < kTileSize * kTileSize; ++p) {
        const int x = tile % region->tiles_x() * kTileSize + p % kTileSize;
        const int y = tile / region->tiles_x() * kTileSize + p / kTileSize;
        if (x >= 200 || y >= 150 || !(region->pixel_rows() >> (p / kTileSize) & 1)) continue;
        for (int c = 0; c < 3; ++c) {
          const size_t at = size_t(3 * (y * 200 + x) + c);
          ASSERT_NEAR(actual[at], expected[at], 1e-5) << budget << ' ' << x << ' ' << y;
        }
      }
    }
  }
}

TEST_P(RegionOp, MayBeEmpty) {
  Make(50, 50, 100, 0.0f);
  for (const auto& region :
       {Restrict(kNoBudget), Restrict(kAmple),
        backend_->blend().Restrict(*view_, device_active_.data(), kAmple, 1e-3f)}) {
    EXPECT_EQ(region->num_rows(), 0);
    EXPECT_TRUE(region->tiles().empty());
    const Blended blended = RunBlend(*backend_, *region, {}, 3);
    EXPECT_EQ(blended.image, std::vector<float>(pixels_ * 3, 0.0f));
    EXPECT_TRUE(RunTranspose(*backend_, *region, blended.image, 3).empty());
  }
}

TEST_P(RegionOp, RefusesDepthSharesAndNesting) {
  Make(50, 50, 100, 0.5f);
  const auto region = Restrict(kAmple);
  EXPECT_THROW(Guarded<float> depth(*backend_, pixels_);
               backend_->blend().Depth(*region, {depth.data(), nullptr, nullptr, 0.5f}),
               std::invalid_argument);
  EXPECT_THROW(Guarded<float> image(*backend_, pixels_);
               backend_->blend().BlendShares(*region, {nullptr, image.data(), 0.25f, 0.75f, 0}),
               std::invalid_argument);
  EXPECT_THROW(backend_->blend().Restrict(*region, device_active_.data(), 0),
               std::invalid_argument);
}

RETINT_INSTANTIATE(RegionOp);

}  // namespace
}  // namespace retint
