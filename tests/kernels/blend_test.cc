// SPDX-License-Identifier: BSD-3-Clause
// Blend, its transpose and depth of whole views against the double-precision reference, and the
// adjoint identity <W c, r> = <c, W^T r>.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "tests/kernels/reference.h"
#include "tests/kernels/test_scene.h"

namespace retint {
namespace {

struct Shape {
  int width, height;
  int64_t gaussians;
  bool compensate = false;
};
constexpr Shape kShapes[] = {{1, 1, 17},     {33, 47, 0},          {33, 47, 1},       {33, 47, 17},
                             {160, 90, 400}, {160, 90, 400, true}, {707, 1261, 10000}};

std::string NameOf(const Shape& shape) {
  return std::to_string(shape.gaussians) + " Gaussians on " + std::to_string(shape.width) + "x" +
         std::to_string(shape.height) + (shape.compensate ? ", antialiased" : "");
}

// Float against double. If no decision (alpha < 1/255, T < 1e-4, order) differs, only rounding is
// left. A center near x = 1000 is known to 6e-5 px, and alpha changes by up to 0.6 a pixel. A
// different decision moves a pixel by a faint splat's weight. At most 0.1 % of the values may be
// off by more than 1e-4, none by `flip`.
void ExpectClose(const std::vector<float>& actual, const std::vector<double>& expected,
                 double scale, double flip) {
  ASSERT_EQ(actual.size(), expected.size());
  size_t loose = 0;
  for (size_t i = 0; i < actual.size(); ++i) {
    const double difference = std::fabs(double(actual[i]) - expected[i]);
    ASSERT_LE(difference, flip * scale) << "at " << i;  // false for NaN too
    if (difference > 1e-4 * scale) ++loose;
  }
  EXPECT_LE(double(loose), 1e-3 * double(actual.size()) + 1);
}

class BlendOp : public BackendTest {
 protected:
  struct Scene {
    TestModel model;
    std::unique_ptr<Model> uploaded;
    std::shared_ptr<const ViewGeometry> view;
    std::vector<int32_t> rows;
    size_t pixels;
  };
  Scene MakeScene(const Shape& shape) {
    Scene scene;
    scene.model = RandomModel(rng_, shape.gaussians);
    scene.model.compensate = shape.compensate;
    scene.uploaded = backend_->blend().UploadModel(scene.model.arrays());
    scene.view =
        backend_->blend().PrepareView(*scene.uploaded, TestCamera(shape.width, shape.height));
    scene.rows = RowsOf(*backend_, *scene.view);
    scene.pixels = size_t(shape.width) * size_t(shape.height);
    return scene;
  }
};

TEST_P(BlendOp, MatchesReference) {
  for (const Shape& shape : kShapes) {
    SCOPED_TRACE(NameOf(shape));
    const Scene scene = MakeScene(shape);
    const auto weights = ReferenceWeights(scene.model, scene.view->camera());
    for (const int channels : {1, 3, 8}) {
      const auto per_gaussian =
          UniformVector(rng_, size_t(shape.gaussians) * size_t(channels), -1, 1);
      const auto background = UniformVector(rng_, size_t(channels), 0, 1);
      std::vector<float> features;
      for (const int32_t g : scene.rows) {
        const auto from = per_gaussian.begin() + g * channels;
        features.insert(features.end(), from, from + channels);
      }
      std::vector<double> image(scene.pixels * size_t(channels), 0.0), alpha(scene.pixels, 0.0);
      for (const ReferenceWeight& w : weights) {
        alpha[size_t(w.pixel)] += w.weight;
        for (int c = 0; c < channels; ++c) {
          image[size_t(w.pixel * channels + c)] +=
              w.weight * double(per_gaussian[size_t(w.gaussian * channels + c)]);
        }
      }
      for (size_t i = 0; i < image.size(); ++i) {
        image[i] += (1 - alpha[i / size_t(channels)]) * double(background[i % size_t(channels)]);
      }
      const Blended blended = RunBlend(*backend_, *scene.view, features, channels, background);
      ExpectClose(blended.image, image, 1, 0.012);
      ExpectClose(blended.alpha, alpha, 1, 0.006);
    }
  }
}

TEST_P(BlendOp, TransposeMatchesReference) {
  for (const Shape& shape : kShapes) {
    SCOPED_TRACE(NameOf(shape));
    const Scene scene = MakeScene(shape);
    const auto weights = ReferenceWeights(scene.model, scene.view->camera());
    std::vector<double> magnitude(size_t(shape.gaussians), 0.0);
    for (const ReferenceWeight& w : weights) magnitude[size_t(w.gaussian)] += w.weight;
    // Every Gaussian with weight is a row.
    std::vector<bool> listed(size_t(shape.gaussians), false);
    for (const int32_t g : scene.rows) listed[size_t(g)] = true;
    for (size_t g = 0; g < listed.size(); ++g) EXPECT_TRUE(listed[g] || magnitude[g] < 0.005) << g;
    for (const int channels : {1, 3, 8}) {
      const auto residual = UniformVector(rng_, scene.pixels * size_t(channels), -1, 1);
      std::vector<double> sums(size_t(shape.gaussians) * size_t(channels), 0.0);
      for (const ReferenceWeight& w : weights) {
        for (int c = 0; c < channels; ++c) {
          sums[size_t(w.gaussian * channels + c)] +=
              w.weight * double(residual[size_t(w.pixel * channels + c)]);
        }
      }
      const auto result = RunTranspose(*backend_, *scene.view, residual, channels);
      for (size_t row = 0; row < scene.rows.size(); ++row) {
        const size_t g = size_t(scene.rows[row]);
        std::vector<float> actual;
        std::vector<double> expected;
        for (int c = 0; c < channels; ++c) {
          actual.push_back(result[row * size_t(channels) + size_t(c)]);
          expected.push_back(sums[g * size_t(channels) + size_t(c)]);
        }
        // Rounding grows with the weights summed; some pixels at the rim may flip.
        ASSERT_LE(WorstDifference(actual, expected), 1e-4 * magnitude[g] + 0.02)
            << "Gaussian " << g;
      }
    }
  }
}

// Both operators use the same weights, so the identity holds to the rounding of the sums: 1e-5
// relative to sum |W| |c| |r|.
TEST_P(BlendOp, IsAdjointOfTranspose) {
  for (const Shape& shape : kShapes) {
    SCOPED_TRACE(NameOf(shape));
    const Scene scene = MakeScene(shape);
    for (const int channels : {1, 2, 3, 4, 5, 6, 7, 8}) {
      const auto c = UniformVector(rng_, scene.rows.size() * size_t(channels), 0.1f, 1);
      const auto r = UniformVector(rng_, scene.pixels * size_t(channels), 0.1f, 1);
      const double left = Dot(RunBlend(*backend_, *scene.view, c, channels).image, r);
      const double right = Dot(c, RunTranspose(*backend_, *scene.view, r, channels));
      EXPECT_NEAR(left, right, 1e-5 * std::fabs(left)) << channels << " channels";
      EXPECT_GT(left, shape.gaussians > 100 ? 1 : -1);
    }
  }
}

TEST_P(BlendOp, DepthMatchesReference) {
  for (const Shape& shape : kShapes) {
    SCOPED_TRACE(NameOf(shape));
    const Scene scene = MakeScene(shape);
    std::vector<double> median(scene.pixels, 0.0), moment(scene.pixels, 0.0), alpha = moment;
    for (const ReferenceWeight& w : ReferenceWeights(scene.model, scene.view->camera())) {
      const size_t p = size_t(w.pixel);
      moment[p] += w.weight * w.depth;
      alpha[p] += w.weight;
      if (w.transmittance_before >= 0.5 && w.transmittance_before - w.weight < 0.5) {
        median[p] = w.depth;
      }
    }
    Guarded<float> out_median(*backend_, scene.pixels), out_expected(*backend_, scene.pixels);
    Guarded<float> out_alpha(*backend_, scene.pixels);
    backend_->blend().Depth(*scene.view,
                            {out_median.data(), out_expected.data(), out_alpha.data(), 0.5f});
    const auto actual = out_median.Read(), expected = out_expected.Read();
    ExpectClose(out_alpha.Read(), alpha, 1, 0.006);
    size_t flips = 0, faint = 0;
    for (size_t p = 0; p < scene.pixels; ++p) {
      // Depths are of order 1 to 6. The median is a choice: equal to rounding, or another splat.
      if (!(std::fabs(double(actual[p]) - median[p]) < 1e-5)) ++flips;
      const double mean = alpha[p] > 0 ? moment[p] / alpha[p] : 0;
      if (!(std::fabs(double(expected[p]) - mean) < 2e-4)) ++faint;
    }
    EXPECT_LE(double(flips), 1e-3 * double(scene.pixels));
    // Includes pixels where a lone splat at 1 / 255 is there or not.
    EXPECT_LE(double(faint), 1e-3 * double(scene.pixels));
    Guarded<float> only(*backend_, scene.pixels);
    backend_->blend().Depth(*scene.view, {nullptr, only.data(), nullptr, 0.5f});
    EXPECT_EQ(only.Read(), expected);
  }
}

TEST_P(BlendOp, DepthAlongRaysMatchesReference) {
  for (const Shape& shape : kShapes) {
    SCOPED_TRACE(NameOf(shape));
    const Scene scene = MakeScene(shape);
    std::vector<double> median(scene.pixels, 0.0);
    for (const ReferenceWeight& w : ReferenceWeights(scene.model, scene.view->camera())) {
      if (w.transmittance_before >= 0.5 && w.transmittance_before - w.weight < 0.5) {
        median[size_t(w.pixel)] = w.depth_along_ray;
      }
    }
    const auto find = [&](uint16_t pixel_rows, const uint8_t* flags = nullptr) {
      Guarded<float> found(*backend_, std::vector<float>(scene.pixels, -7.0f));
      DepthParams depth{};
      depth.median = found.data();
      depth.threshold = 0.5f;
      depth.pixel_rows = pixel_rows;
      depth.left_out = flags;
      depth.along_rays = scene.uploaded.get();
      backend_->blend().Depth(*scene.view, depth);
      return found.Read();
    };
    // As the kernels leave Gaussians out, and as a model that does not show them.
    std::vector<uint8_t> left_out(size_t(shape.gaussians), 0);
    for (size_t g = 0; g < left_out.size(); g += 3) left_out[g] = 1;
    Guarded<uint8_t> flags(*backend_, left_out);
    const auto without = find(kAllPixelRows, flags.data());
    TestModel faint = scene.model;
    for (size_t g = 0; g < left_out.size(); g += 3) faint.logits[g] = -50;
    const auto fewer = backend_->blend().UploadModel(faint.arrays());
    const auto view = backend_->blend().PrepareView(*fewer, scene.view->camera());
    Guarded<float> expected(*backend_, scene.pixels);
    DepthParams depth{};
    depth.median = expected.data();
    depth.threshold = 0.5f;
    depth.along_rays = fewer.get();
    backend_->blend().Depth(*view, depth);
    EXPECT_EQ(without, expected.Read());
    const auto all = find(kAllPixelRows), some = find(0x0421);
    size_t flips = 0;
    for (size_t p = 0; p < scene.pixels; ++p) {
      if (!(std::fabs(double(all[p]) - median[p]) < 1e-4)) ++flips;
      const size_t row = p / size_t(scene.view->camera().width) % kTileSize;
      if (0x0421 >> row & 1) {
        EXPECT_EQ(some[p], all[p]);
      }
    }
    EXPECT_LE(double(flips), 1e-3 * double(scene.pixels));
  }
}

// Depth without some Gaussians is that of a model that does not have them.
TEST_P(BlendOp, DepthLeavesGaussiansOut) {
  const Scene scene = MakeScene({160, 90, 400});
  const size_t count = size_t(scene.uploaded->count());
  std::vector<uint8_t> left_out(count), none(count, 0);
  for (size_t g = 0; g < count; ++g) left_out[g] = g % 3 == 0;
  const auto depths = [&](const ViewGeometry& view, const uint8_t* flags) {
    Guarded<float> median(*backend_, scene.pixels), expected(*backend_, scene.pixels);
    DepthParams depth{};
    depth.median = median.data();
    depth.expected = expected.data();
    depth.threshold = 0.5f;
    depth.min_alpha = 0.2f;
    depth.left_out = flags;
    backend_->blend().Depth(view, depth);
    return std::pair(median.Read(), expected.Read());
  };
  Guarded<uint8_t> some(*backend_, left_out), all(*backend_, none);
  const auto whole = depths(*scene.view, nullptr);
  EXPECT_EQ(depths(*scene.view, all.data()), whole);
  const auto without = depths(*scene.view, some.data());
  EXPECT_NE(without, whole);
  TestModel faint = scene.model;
  for (size_t g = 0; g < count; g += 3) faint.logits[g] = -50;
  const auto model = backend_->blend().UploadModel(faint.arrays());
  const auto view = backend_->blend().PrepareView(*model, scene.view->camera());
  EXPECT_EQ(depths(*view, nullptr), without);
}

// Any rows, every second, which backends may have loops for, and an odd number of them.
TEST_P(BlendOp, PixelRowsWantedAreTheSameAlone) {
  for (const uint16_t kept : {0x9305, 0x5555, 0x0421}) {
    const Scene scene = MakeScene({160, 96, 400});
    constexpr size_t kWidth = 160;
    const auto wanted = [&](size_t p) { return (kept >> (p / kWidth % kTileSize) & 1) != 0; };
    const auto features = UniformVector(rng_, scene.rows.size() * 3, 0, 1);
    auto residual = UniformVector(rng_, scene.pixels * 3, 0, 1);
    for (size_t i = 0; i < residual.size(); ++i) {
      if (!wanted(i / 3)) residual[i] = 0;
    }
    Guarded<float> in(*backend_, features), out_residual(*backend_, residual);
    std::vector<std::vector<float>> images[2];
    std::vector<float> sums[2];
    for (const uint16_t rows : {kAllPixelRows, kept}) {
      Guarded<float> image(*backend_, scene.pixels * 3), median(*backend_, scene.pixels);
      Guarded<float> expected(*backend_, scene.pixels), sum(*backend_, scene.rows.size() * 3);
      BlendParams blend{};
      blend.features = in.data();
      blend.channels = 3;
      blend.image = image.data();
      blend.pixel_rows = rows;
      backend_->blend().Blend(*scene.view, blend);
      DepthParams depth{};
      depth.median = median.data();
      depth.expected = expected.data();
      depth.threshold = 0.5f;
      depth.pixel_rows = rows;
      backend_->blend().Depth(*scene.view, depth);
      BlendTransposeParams transpose{};
      transpose.residual = out_residual.data();
      transpose.channels = 3;
      transpose.result = sum.data();
      // Earlier contents of the memory must not enter the sums, even if they are NaN.
      Guarded<float> no_numbers(*backend_, std::vector<float>(scene.pixels * 3, NAN));
      transpose.residual = no_numbers.data();
      backend_->blend().BlendTranspose(*scene.view, transpose);
      transpose.residual = out_residual.data();
      transpose.pixel_rows = rows;
      backend_->blend().BlendTranspose(*scene.view, transpose);
      images[rows == kept] = {image.Read(), median.Read(), expected.Read()};
      sums[rows == kept] = sum.Read();
    }
    for (size_t i = 0; i < images[0].size(); ++i) {
      const size_t channels = images[0][i].size() / scene.pixels;
      for (size_t at = 0; at < images[0][i].size(); ++at) {
        if (!wanted(at / channels)) continue;
        // A device's loop over some rows may round in another way.
        const float value = images[0][i][at], slack = GetParam() == "cuda" ? 1e-4f * value : 0;
        ASSERT_NEAR(value, images[1][i][at], slack) << i << " " << at;
      }
    }
    for (const float sum : sums[1]) ASSERT_TRUE(std::isfinite(sum));
    EXPECT_LE(WorstDifference(sums[1], sums[0]), 1e-4);  // a device adds in any order
  }
}

// `limited` is `exact` between the limits, or on the same side, or of a tile whose rows 0, 5, 10
// and 15 are.
void ExpectSame(const ViewGeometry& view, const std::vector<float>& exact,
                const std::vector<float>& limited, float low, float high) {
  const int width = view.camera().width, height = view.camera().height;
  const auto is_side = [&](int tile, float side) {
    const int x0 = tile % view.tiles_x() * kTileSize;
    const int y0 = tile / view.tiles_x() * kTileSize;
    for (int y = y0; y < std::min(height, y0 + kTileSize); y += 5) {
      for (int x = x0; x < std::min(width, x0 + kTileSize); ++x) {
        if (std::clamp(exact[size_t(y * width + x)], low, high) != side) return false;
      }
    }
    return true;
  };
  for (size_t p = 0; p < exact.size(); ++p) {
    const int x = int(p) % width, y = int(p) / width;
    const int tile = y / kTileSize * view.tiles_x() + x / kTileSize;
    const float found = std::clamp(limited[p], low, high);
    if ((found == low || found == high) && is_side(tile, found)) continue;
    ASSERT_NEAR(found, std::clamp(exact[p], low, high), 1e-6) << p;
  }
}

// A limit ends a pixel only if nothing behind can bring its value back. Between limits, values
// equal those without limits; beyond them, they stay beyond. A tile may be judged by its rows 0, 5,
// 10 and 15.
TEST_P(BlendOp, LimitsChangeNoValueBetweenThem) {
  constexpr float kLow = 0.25f, kHigh = 0.75f;
  for (const Shape& shape : kShapes) {
    SCOPED_TRACE(NameOf(shape));
    const Scene scene = MakeScene(shape);
    auto features = UniformVector(rng_, scene.rows.size(), 0, 1);
    for (size_t i = 0; i < features.size(); ++i) {
      if (i % 3 != 0) features[i] = i % 3 == 1 ? 0.0f : 1.0f;
    }
    Guarded<float> in(*backend_, features), image(*backend_, scene.pixels);
    Guarded<float> alpha(*backend_, scene.pixels);
    BlendParams blend{};
    blend.features = in.data();
    blend.channels = 1;
    blend.image = image.data();
    blend.alpha = alpha.data();
    backend_->blend().Blend(*scene.view, blend);
    const std::vector<float> sums = image.Read(), opacity = alpha.Read();
    BlendSharesParams shares{
        .shares = in.data(), .image = image.data(), .low = kLow, .high = kHigh, .behind = 0};
    for (const float behind : {0.0f, kLow}) {
      std::vector<float> exact = sums;
      for (size_t p = 0; p < scene.pixels; ++p) exact[p] += behind * (1 - opacity[p]);
      shares.behind = behind;
      backend_->blend().BlendShares(*scene.view, shares);
      ExpectSame(*scene.view, exact, image.Read(), kLow, kHigh);
    }
    shares.behind = 2 * kLow;
    EXPECT_THROW(backend_->blend().BlendShares(*scene.view, shares), std::invalid_argument);
  }
}

// Gaussians that all cover one pixel, in the order in which it meets them: each then weighs less
// than the one before.
std::vector<int32_t> OrderOf(Backend& backend, const std::vector<float>& depths, float opacity) {
  CameraParams camera = TestCamera(32, 32);
  const float identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  std::copy_n(identity, 9, camera.rotation);
  std::fill_n(camera.translation, 3, 0.0f);
  TestModel model;
  for (const float depth : depths) {
    model.means.insert(model.means.end(), {0, 0, depth});
    model.quats.insert(model.quats.end(), {1, 0, 0, 0});
    model.log_scales.insert(model.log_scales.end(), 3, std::log(5.0f));
    model.logits.push_back(std::log(opacity / (1 - opacity)));
    model.sh.insert(model.sh.end(), 3, 0.0f);
  }
  const auto uploaded = backend.blend().UploadModel(model.arrays());
  const auto view = backend.blend().PrepareView(*uploaded, camera);
  const auto rows = RowsOf(backend, *view);
  std::vector<float> residual(32 * 32, 0.0f);
  residual[size_t(32 * int(camera.cy) + int(camera.cx))] = 1;
  const auto weights = RunTranspose(backend, *view, residual, 1);
  std::vector<size_t> order(rows.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::sort(order.begin(), order.end(),
            [&](size_t a, size_t b) { return weights[a] > weights[b]; });
  std::vector<int32_t> gaussians;
  for (const size_t r : order) gaussians.push_back(rows[r]);
  return gaussians;
}

// Equal depths in the order of the indices.
std::vector<int32_t> ByDepth(const std::vector<float>& depths) {
  std::vector<int32_t> order(depths.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int32_t a, int32_t b) { return depths[size_t(a)] < depths[size_t(b)]; });
  return order;
}

TEST_P(BlendOp, BlendsByDepthAndIndex) {
  // Twins: the same place, so the index decides.
  auto depths = UniformVector(rng_, 250, 3, 6);
  depths.insert(depths.end(), depths.begin(), depths.begin() + 250);
  EXPECT_EQ(OrderOf(*backend_, depths, 0.015f), ByDepth(depths));
}

TEST_P(BlendOp, BlendsByTheLastBitsOfDepth) {
  std::vector<float> depths;
  for (int g = 0; g < 1500; ++g) {
    // Five hundred at one depth, the others within 400 of a float's steps.
    const auto steps = g % 3 ? rng_() % 400 : 200;
    depths.push_back(5 + float(steps) * 0x1p-21f);
  }
  EXPECT_EQ(OrderOf(*backend_, depths, 0.0045f), ByDepth(depths));
}

// Lists may be cut behind the last feature, but not if coverage is requested too.
TEST_P(BlendOp, SkipsWhatHasNoFeature) {
  const Scene scene = MakeScene({160, 90, 400});
  auto features = UniformVector(rng_, scene.rows.size(), 0, 1);
  for (size_t row = 0; row < features.size(); ++row) {
    if (row % 7 != 0) features[row] = 0;
  }
  const Blended with_alpha = RunBlend(*backend_, *scene.view, features, 1);
  Guarded<float> in(*backend_, features), image(*backend_, scene.pixels);
  backend_->blend().Blend(*scene.view, {in.data(), 1, nullptr, image.data(), nullptr, false});
  EXPECT_EQ(image.Read(), with_alpha.image);
  Guarded<float> none(*backend_, std::vector<float>(features.size(), 0.0f));
  Guarded<float> black(*backend_, scene.pixels);
  backend_->blend().Blend(*scene.view, {none.data(), 1, nullptr, black.data(), nullptr, false});
  EXPECT_EQ(black.Read(), std::vector<float>(scene.pixels, 0.0f));
}

TEST_P(BlendOp, KeepsPixelsOutsideOnRequest) {
  const TestModel model = RandomModel(rng_, 1);
  const auto uploaded = backend_->blend().UploadModel(model.arrays());
  const auto view = backend_->blend().PrepareView(*uploaded, TestCamera(200, 200));
  const int total = view->tiles_x() * view->tiles_y();
  ASSERT_LT(int(view->tiles().size()), total);
  std::vector<bool> visited(size_t(total), false);
  for (const int32_t tile : view->tiles()) visited[size_t(tile)] = true;
  const std::vector<float> features(size_t(view->num_rows()), 0.0f), before(200 * 200, 7.0f);
  const std::vector<float> background = {0.25f};
  for (const bool keep : {false, true}) {
    Guarded<float> in(*backend_, features), back(*backend_, background), image(*backend_, before);
    backend_->blend().Blend(*view, {in.data(), 1, back.data(), image.data(), nullptr, keep});
    const auto after = image.Read();
    for (int p = 0; p < 200 * 200; ++p) {
      const int tile = p / 200 / kTileSize * view->tiles_x() + p % 200 / kTileSize;
      if (visited[size_t(tile)]) {
        EXPECT_LE(after[size_t(p)], 0.25f);
      } else {
        EXPECT_EQ(after[size_t(p)], keep ? 7.0f : 0.25f);
      }
    }
  }
}

// A wall of opaque splats ends every pixel; nothing behind it may show.
TEST_P(BlendOp, StopsAtOpaqueSplats) {
  TestModel model = RandomModel(rng_, 64);
  const CameraParams camera = TestCamera(64, 64);
  for (int g = 0; g < 64; ++g) {
    const float at[3] = {0, 0, 1 + 0.05f * float(g)};
    for (int j = 0; j < 3; ++j) {
      float world = 0;
      for (int k = 0; k < 3; ++k) {
        world += camera.rotation[3 * k + j] * (at[k] - camera.translation[k]);
      }
      model.means[size_t(3 * g + j)] = world;
      model.log_scales[size_t(3 * g + j)] = 3;
    }
    model.logits[size_t(g)] = 2.2f;  // alpha 0.9: T is 1e-4 after four
  }
  const auto uploaded = backend_->blend().UploadModel(model.arrays());
  const auto view = backend_->blend().PrepareView(*uploaded, camera);
  ASSERT_EQ(view->num_rows(), 64);
  std::vector<float> features(64, 0.0f);
  for (size_t row = 5; row < 64; ++row) features[row] = 1000;
  const Blended blended = RunBlend(*backend_, *view, features, 1);
  for (const float value : blended.image) EXPECT_EQ(value, 0.0f);
  for (const float alpha : blended.alpha) EXPECT_NEAR(alpha, 0.999f, 0.001f);
}

RETINT_INSTANTIATE(BlendOp);

}  // namespace
}  // namespace retint
