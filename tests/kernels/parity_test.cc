// SPDX-License-Identifier: BSD-3-Clause
// Every operation of a device backend against the CPU's, at all sizes: a single Gaussian to a
// million, a single pixel to a photo, every SH degree, 1, 3 and 8 channels, and views that see
// nothing. Skipped without a device.
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <ostream>

#include "tests/kernels/test_scene.h"

namespace retint {
namespace {

struct Shape {
  int64_t gaussians;
  int width, height;
  bool compensate = false;
};
std::ostream& operator<<(std::ostream& out, const Shape& shape) {
  return out << shape.gaussians << "_on_" << shape.width << "x" << shape.height
             << (shape.compensate ? "_mip" : "");
}

// |a - b| / |b| over all values; infinite where a value is not finite or sizes differ.
template <typename A, typename B>
double RelativeError(const std::vector<A>& a, const std::vector<B>& b) {
  if (a.size() != b.size()) return std::numeric_limits<double>::infinity();
  double difference = 0, size = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    difference += std::pow(double(a[i]) - double(b[i]), 2);
    size += std::pow(double(b[i]), 2);
  }
  const double error = size > 0 ? std::sqrt(difference / size) : std::sqrt(difference);
  return std::isfinite(error) ? error : std::numeric_limits<double>::infinity();
}

// One backend's side of a comparison. Values of rows are kept by Gaussian, so that two Gaussians of
// nearly equal depth may trade places.
struct Side {
  std::shared_ptr<Backend> backend;
  std::unique_ptr<Model> model;
  std::shared_ptr<const ViewGeometry> view;
  std::vector<int32_t> rows;

  Side(const std::string& name, const TestModel& host, const CameraParams& camera)
      : backend(MakeBackend(name)),
        model(backend->blend().UploadModel(host.arrays())),
        view(backend->blend().PrepareView(*model, camera)),
        rows(RowsOf(*backend, *view)) {}

  std::vector<float> Gather(const std::vector<float>& by_gaussian, int channels,
                            const ViewGeometry& geometry) const {
    std::vector<float> out;
    for (const int32_t g : RowsOf(*backend, geometry)) {
      const auto from = by_gaussian.begin() + int64_t(g) * channels;
      out.insert(out.end(), from, from + channels);
    }
    return out;
  }
  std::vector<float> Scatter(const std::vector<float>& by_row, int channels,
                             const ViewGeometry& geometry) const {
    std::vector<float> out(size_t(model->count()) * size_t(channels), 0.0f);
    const auto of = RowsOf(*backend, geometry);
    for (size_t r = 0; r < of.size(); ++r) {
      std::copy_n(by_row.begin() + int64_t(r) * channels, channels,
                  out.begin() + int64_t(of[r]) * channels);
    }
    return out;
  }
};

class Parity : public testing::TestWithParam<Shape> {
 protected:
  void SetUp() override {
    try {
      MakeBackend("cuda");
    } catch (const std::exception& error) {
      GTEST_SKIP() << error.what();
    }
  }
  void Make(int degree = 1) {
    const Shape& shape = GetParam();
    model_ = RandomModel(rng_, shape.gaussians, degree);
    model_.compensate = shape.compensate;
    camera_ = TestCamera(shape.width, shape.height);
    pixels_ = size_t(shape.width) * size_t(shape.height);
    cpu_.emplace("cpu", model_, camera_);
    cuda_.emplace("cuda", model_, camera_);
  }
  std::array<Side*, 2> Sides() { return {&*cpu_, &*cuda_}; }
  std::vector<float> ByGaussian(int channels, float low = -1) {
    return UniformVector(rng_, size_t(model_.count()) * size_t(channels), low, 1);
  }
  std::vector<float> ByPixel(int channels, float low = -1) {
    return UniformVector(rng_, pixels_ * size_t(channels), low, 1);
  }
  // Rounding, and decisions at a threshold that fall the other way once in some thousand pixels.
  static constexpr double kRounding = 3e-4;

  std::mt19937 rng_ = TestRng();
  TestModel model_;
  CameraParams camera_;
  size_t pixels_ = 0;
  std::optional<Side> cpu_, cuda_;
};

TEST_P(Parity, SeesTheSameGaussians) {
  Make();
  EXPECT_EQ(std::vector<int32_t>(cuda_->view->tiles().begin(), cuda_->view->tiles().end()),
            std::vector<int32_t>(cpu_->view->tiles().begin(), cpu_->view->tiles().end()));
  // One that only one side sees is hardly there: its rim lies within rounding of a pixel.
  std::vector<float> weights[2];
  for (int i = 0; i < 2; ++i) {
    Side& side = *Sides()[size_t(i)];
    const std::vector<float> ones(pixels_, 1.0f);
    weights[i] = side.Scatter(RunTranspose(*side.backend, *side.view, ones, 1), 1, *side.view);
    std::sort(side.rows.begin(), side.rows.end());
  }
  std::vector<int32_t> alone;
  std::set_symmetric_difference(cpu_->rows.begin(), cpu_->rows.end(), cuda_->rows.begin(),
                                cuda_->rows.end(), std::back_inserter(alone));
  EXPECT_LE(double(alone.size()), 1e-3 * double(cpu_->rows.size()));
  for (const int32_t g : alone) {
    EXPECT_LE(std::max(weights[0][size_t(g)], weights[1][size_t(g)]), 0.01f) << g;
  }
}

TEST_P(Parity, BreaksTiesByIndex) {
  Make();
  // Everything in one place: only the order of the indices gives the CPU's picture.
  for (size_t g = 1; g < size_t(model_.count()); ++g) {
    std::copy_n(model_.means.begin(), 3, model_.means.begin() + int64_t(3 * g));
  }
  const auto features = ByGaussian(3);
  std::vector<float> images[2];
  for (int i = 0; i < 2; ++i) {
    const Side side(i ? "cuda" : "cpu", model_, camera_);
    images[i] =
        RunBlend(*side.backend, *side.view, side.Gather(features, 3, *side.view), 3, {0, 0, 0})
            .image;
  }
  EXPECT_LE(RelativeError(images[1], images[0]), kRounding);
}

TEST_P(Parity, Blends) {
  Make();
  for (const int channels : {1, 3, 8}) {
    const auto features = ByGaussian(channels);
    const auto background = UniformVector(rng_, size_t(channels), 0, 1);
    Blended out[2];
    for (int i = 0; i < 2; ++i) {
      Side& side = *Sides()[size_t(i)];
      out[i] = RunBlend(*side.backend, *side.view, side.Gather(features, channels, *side.view),
                        channels, background);
    }
    EXPECT_LE(RelativeError(out[1].image, out[0].image), kRounding);
    EXPECT_LE(RelativeError(out[1].alpha, out[0].alpha), kRounding);
    // A pair that is skipped on one side only weighs up to twice the least alpha, 1/255.
    EXPECT_LE(WorstDifference(out[1].image, out[0].image), 0.02);
  }
}

TEST_P(Parity, Transposes) {
  Make();
  for (const int channels : {1, 3, 8}) {
    const auto residual = ByPixel(channels);
    std::vector<float> out[2];
    for (int i = 0; i < 2; ++i) {
      Side& side = *Sides()[size_t(i)];
      out[i] = side.Scatter(RunTranspose(*side.backend, *side.view, residual, channels), channels,
                            *side.view);
    }
    EXPECT_LE(RelativeError(out[1], out[0]), 10 * kRounding);  // faint ones sum few pixels
  }
}

// A pixel that is no number reaches the Gaussians that show there, in its own channel, and none
// that ends before its tile. Between the two a backend may multiply it by a weight of zero.
TEST_P(Parity, KeepsWhatIsNoNumberWhereItIs) {
  Make();
  constexpr int kChannels = 3, kBad = 1;
  const size_t width = size_t(camera_.width), height = size_t(camera_.height);
  auto residual = ByPixel(kChannels);
  std::vector<float> pixels(pixels_, 0.0f), without = residual;
  const std::pair<size_t, float> bad[] = {
      {height / 2 * width + width / 2, NAN},
      {height / 4 * width + width / 3, std::numeric_limits<float>::infinity()}};
  for (const auto& [p, value] : bad) {
    residual[kChannels * p + kBad] = value;
    without[kChannels * p + kBad] = 0;
    pixels[p] = 1;
  }
  const auto may_touch_a_bad_tile = [&](size_t g) {
    float at[3];
    for (int j = 0; j < 3; ++j) {
      at[j] = camera_.translation[j];
      for (int k = 0; k < 3; ++k) {
        at[j] += camera_.rotation[3 * j + k] * model_.means[3 * g + size_t(k)];
      }
    }
    if (at[2] <= 0.2f) return false;  // not drawn
    const float x = camera_.fx * at[0] / at[2] + camera_.cx;
    const float y = camera_.fy * at[1] / at[2] + camera_.cy;
    const float* const scale = &model_.log_scales[3 * g];
    // An opaque Gaussian ends after 3.4 standard deviations, which the slant of a ray stretches by
    // at most 2 here.
    const float reach =
        2 * 3.4f * camera_.fx / at[2] * std::exp(*std::max_element(scale, scale + 3)) + 4;
    for (const auto& [p, value] : bad) {
      const auto tile_x = float(p % width / kTileSize * kTileSize);
      const auto tile_y = float(p / width / kTileSize * kTileSize);
      if (x + reach >= tile_x && x - reach <= tile_x + kTileSize && y + reach >= tile_y &&
          y - reach <= tile_y + kTileSize) {
        return true;
      }
    }
    return false;
  };
  const std::vector<uint8_t> active(size_t(model_.count()), 1);
  for (const bool restricted : {false, true}) {
    std::vector<float> out[2], clean, shown;
    for (int i = 0; i < 2; ++i) {
      Side& side = *Sides()[size_t(i)];
      std::shared_ptr<const ViewGeometry> view = side.view;
      if (restricted) {
        Guarded<uint8_t> flags(*side.backend, active);
        view = side.backend->blend().Restrict(*side.view, flags.data(), size_t{1} << 32, 0);
      }
      const auto transposed = [&](const std::vector<float>& of, int channels) {
        return side.Scatter(RunTranspose(*side.backend, *view, of, channels), channels, *view);
      };
      out[i] = transposed(residual, kChannels);
      if (i == 0) shown = transposed(pixels, 1);
      if (i == 1) clean = transposed(without, kChannels);
    }
    for (size_t g = 0; g < size_t(model_.count()); ++g) {
      for (size_t c = 0; c < kChannels; ++c) {
        const size_t at = kChannels * g + c;
        if (c != kBad || !may_touch_a_bad_tile(g)) {
          ASSERT_TRUE(std::isfinite(out[0][at]) && std::isfinite(out[1][at])) << g;
          ASSERT_EQ(out[1][at], clean[at]) << g;
        } else if (shown[g] > 0.01f) {  // a weight at the limit may be skipped on one side
          ASSERT_FALSE(std::isfinite(out[0][at]) || std::isfinite(out[1][at])) << g;
        }
      }
    }
  }
}

TEST_P(Parity, FindsDepth) {
  Make();
  std::vector<float> median[2], expected[2], alpha[2];
  for (int i = 0; i < 2; ++i) {
    Side& side = *Sides()[size_t(i)];
    Guarded<float> m(*side.backend, pixels_), e(*side.backend, pixels_), a(*side.backend, pixels_);
    side.backend->blend().Depth(*side.view, {m.data(), e.data(), a.data(), 0.5f});
    median[i] = m.Read(), expected[i] = e.Read(), alpha[i] = a.Read();
  }
  size_t other = 0;
  for (size_t p = 0; p < pixels_; ++p) {
    if (!(std::fabs(median[1][p] - median[0][p]) < 1e-4f)) ++other;
  }
  // The median jumps to another Gaussian where rounding moves the transmittance across the
  // threshold.
  EXPECT_LE(double(other), 2e-3 * double(pixels_));
  // Pixels at the rim of everything divide by little.
  EXPECT_LE(RelativeError(expected[1], expected[0]), 10 * kRounding);
  EXPECT_LE(RelativeError(alpha[1], alpha[0]), kRounding);
}

TEST_P(Parity, EvaluatesShOfEveryDegree) {
  for (int degree = 0; degree <= 3; ++degree) {
    Make(degree);
    const size_t k = size_t(model_.num_coeffs()), n = size_t(model_.count());
    const auto gradients = ByGaussian(3);
    const auto weights = ByGaussian(1, 0);
    std::vector<float> colors[2], sums[2], blocks[2];
    for (int i = 0; i < 2; ++i) {
      Side& side = *Sides()[size_t(i)];
      Backend& backend = *side.backend;
      Guarded<float> c(backend, 3 * n), g(backend, gradients);
      Guarded<float> s(backend, std::vector<float>(3 * k * n, 0.0f)), w(backend, weights);
      Guarded<float> b(backend, std::vector<float>(k * (k + 1) / 2 * n, 0.0f));
      EvalShParams eval{nullptr, nullptr, int64_t(n), side.model->sh(), {}, c.data()};
      std::copy_n(camera_.center, 3, eval.center);
      backend.sh().EvalSh(*side.model, eval);
      EvalShTransposeParams transpose{nullptr,  nullptr, int64_t(n), g.data(),
                                      c.data(), {},      s.data()};
      std::copy_n(camera_.center, 3, transpose.center);
      backend.sh().EvalShTranspose(*side.model, transpose);
      AccumulateBlocksParams accumulate{nullptr, nullptr, int64_t(n), w.data(), {}, b.data()};
      std::copy_n(camera_.center, 3, accumulate.center);
      backend.sh().AccumulateBlocks(*side.model, accumulate);
      colors[i] = c.Read(), sums[i] = s.Read(), blocks[i] = b.Read();
    }
    EXPECT_LE(RelativeError(colors[1], colors[0]), 1e-5) << degree;  // up to 16 products of order 1
    EXPECT_LE(RelativeError(sums[1], sums[0]), 1e-3) << degree;  // a color at 0 may be shut or not
    EXPECT_LE(RelativeError(blocks[1], blocks[0]), 1e-5) << degree;  // three products
  }
}

TEST_P(Parity, EditsSh) {
  Make();
  const size_t k = size_t(model_.num_coeffs()), n = size_t(model_.count()), directions = 4 * k;
  const auto shares = ByGaussian(1, 0);
  const auto basis = UniformVector(rng_, directions * k, -0.7f, 0.7f);
  const auto fit = UniformVector(rng_, directions * k, -0.05f, 0.05f);
  ColorProgram program{};
  program.count = 2;
  program.strength = 1;
  program.ops[0] = {
      ColorOpCode::kAdjust, 0.8f, {0.8f, 0.6f, 1.1f, 0.9f, -1, 2, 0.5f, 0, 10, 0, 10, 0.05f}, 0, 0};
  program.ops[1] = {ColorOpCode::kPower, 1, {0.8f}, 0, 0};
  for (const bool affine : {true, false}) {
    std::vector<float> edited[2];
    for (int i = 0; i < 2; ++i) {
      Backend& backend = *Sides()[size_t(i)]->backend;
      Guarded<float> sh(backend, model_.sh), s(backend, shares), b(backend, basis), f(backend, fit);
      const auto resident = backend.Upload(std::span<const ColorProgram>(&program, 1));
      EditShParams params{sh.data(), s.data(), 0.3, int64_t(n), int32_t(k), {}};
      params.map = {{0.5f, 0, 0.1f, 0, -0.25f, 0, 0.2f, 0, 1}, {0.1f, 0, -0.1f}};
      if (!affine) params.map.program = resident.data();
      params.basis = b.data();
      params.fit = f.data();
      params.directions = int32_t(directions);
      backend.sh().EditSh(params);
      edited[i] = sh.Read();
    }
    if (std::ranges::any_of(shares, [](float share) { return share > 0.3f; })) {
      EXPECT_NE(edited[0], model_.sh);
    }
    // Cube roots and powers of both, about gray, where a hue is as good as its chroma is large.
    EXPECT_LE(RelativeError(edited[1], edited[0]), affine ? 1e-6 : 1e-3);
  }
}

TEST_P(Parity, RestrictsAndSums) {
  Make();
  std::vector<uint8_t> active(size_t(model_.count())), mask(pixels_);
  for (uint8_t& a : active) a = rng_() % 16 == 0;
  for (uint8_t& m : mask) m = uint8_t(rng_());
  const auto features = ByGaussian(3), residual = ByPixel(3), render = ByPixel(3, 0);
  struct Kind {
    size_t budget;
    float min_weight;
    double tolerance;
  };
  // Lists round as the whole view does. Explicit weights are half floats, or 8 bits of each
  // Gaussian's largest weight in a tile, without the smallest ones.
  for (const Kind& kind : {Kind{0, 0, kRounding}, Kind{size_t{1} << 32, 0, 5e-4},
                           Kind{size_t{1} << 32, 1e-3f, 2e-2}}) {
    SCOPED_TRACE(std::to_string(kind.budget) + " " + std::to_string(kind.min_weight));
    std::vector<float> image[2], sums[2], weight_image[2], residuals[2];
    double loss[2];
    for (int i = 0; i < 2; ++i) {
      Side& side = *Sides()[size_t(i)];
      Backend& backend = *side.backend;
      Guarded<uint8_t> flags(backend, active), device_mask(backend, mask);
      const auto region =
          backend.blend().Restrict(*side.view, flags.data(), kind.budget, kind.min_weight);
      const auto part = side.Gather(features, 3, *region);
      image[i] = RunBlend(backend, *region, part, 3).image;
      sums[i] = side.Scatter(RunTranspose(backend, *region, residual, 3), 3, *region);

      const size_t positions = NumRegionPixels(*region);
      Guarded<float> device_render(backend, render), blended(backend, render);
      Guarded<int16_t> target(backend, 3 * positions);
      Guarded<uint8_t> weights(backend, positions);
      RegionTargetParams params{};
      params.render = device_render.data();
      params.mask = device_mask.data();
      params.map = {{0.5f, 0, 0, 0, -0.25f, 0, 0, 0, 1}, {0.1f, 0, -0.1f}};
      params.unit = 1.0f / 8192;
      params.target = target.data();
      params.weights = weights.data();
      params.outside_weight = 0.8f;
      backend.refit().RegionTarget(*region, params);
      Guarded<double> device_loss(backend, std::vector<double>{0.0});
      RegionResidualParams of_pixels{target.data(),  params.unit,        blended.data(),
                                     blended.data(), device_loss.data(), weights.data()};
      of_pixels.stay.slope = 0.05f;
      backend.refit().RegionResidual(*region, of_pixels);
      Guarded<float> of_weights(backend, pixels_);
      backend.refit().RegionWeightImage(*region, weights.data(), of_weights.data());
      target.Read();
      loss[i] = device_loss.Read()[0];
      residuals[i] = blended.Read(), weight_image[i] = of_weights.Read();
    }
    EXPECT_LE(RelativeError(image[1], image[0]), kind.tolerance);
    EXPECT_LE(RelativeError(sums[1], sums[0]), 10 * kind.tolerance);  // faint ones sum few pixels
    if (kind.min_weight > 0) continue;  // a tile about as faint as the limit falls either way
    EXPECT_LE(RelativeError(weight_image[1], weight_image[0]), 0);
    // Targets in steps of 1/8192 may fall to the next one.
    EXPECT_LE(RelativeError(residuals[1], residuals[0]), 1e-4);
    EXPECT_NEAR(loss[1], loss[0], 1e-4 * loss[0]);
  }
}

TEST_P(Parity, SharesMasks) {
  Make();
  std::vector<uint8_t> mask(pixels_);
  for (uint8_t& m : mask) m = uint8_t(rng_());
  std::vector<double> out[2];
  for (int i = 0; i < 2; ++i) {
    Side& side = *Sides()[size_t(i)];
    Guarded<uint8_t> device_mask(*side.backend, mask);
    Guarded<double> sums(*side.backend, std::vector<double>(2 * size_t(model_.count()), 0.0));
    side.backend->blend().AccumulateShares(*side.view, device_mask.data(), sums.data());
    side.backend->blend().AccumulateShares(*side.view, device_mask.data(), sums.data());
    out[i] = sums.Read();
  }
  EXPECT_LE(RelativeError(out[1], out[0]), kRounding);
}

TEST_P(Parity, MeasuresLoss) {
  Make();
  const auto image = ByPixel(3, 0), target = ByPixel(3, 0);
  std::vector<float> gradient[2];
  double loss[2], added[2];
  for (int i = 0; i < 2; ++i) {
    Backend& backend = *Sides()[size_t(i)]->backend;
    Guarded<float> y(backend, image), t(backend, target), g(backend, image.size());
    Guarded<double> sum(backend, std::vector<double>{2.0});
    ImageLossParams params{y.data(), t.data(), camera_.width, camera_.height, 0.2f, {}, g.data()};
    loss[i] = backend.refit().ImageLoss(params).loss;
    params.loss = sum.data();
    EXPECT_EQ(backend.refit().ImageLoss(params).loss, 0);
    added[i] = sum.Read()[0];
    gradient[i] = g.Read();
  }
  EXPECT_NEAR(loss[1], loss[0], 1e-5);  // variances lose digits to cancellation
  for (int i = 0; i < 2; ++i) EXPECT_NEAR(added[i], 2 + loss[i], 1e-9);  // sums of doubles
  EXPECT_LE(RelativeError(gradient[1], gradient[0]), 1e-4);              // the same cancellation
}

TEST_P(Parity, SolvesBlocks) {
  const size_t n = size_t(std::min<int64_t>(GetParam().gaussians, 5000));
  for (const int k : {1, 4, 9, 16}) {
    const size_t packed = size_t(k * (k + 1) / 2), values = n * size_t(k) * 3;
    // A = L L^T with a diagonal of L between 1 and 2: positive definite, of a modest condition.
    std::vector<float> blocks;
    for (size_t b = 0; b < n; ++b) {
      auto l = UniformVector(rng_, packed, -0.3f, 0.3f);
      for (int i = 0; i < k; ++i) l[size_t(i * (i + 1) / 2 + i)] = Uniform(rng_, 1, 2);
      for (int i = 0; i < k; ++i) {
        for (int j = 0; j <= i; ++j) {
          float sum = 0;
          for (int m = 0; m <= j; ++m) {
            sum += l[size_t(i * (i + 1) / 2 + m)] * l[size_t(j * (j + 1) / 2 + m)];
          }
          blocks.push_back(sum);
        }
      }
    }
    const auto rhs = UniformVector(rng_, values, -1, 1), start = UniformVector(rng_, values, -1, 1);
    std::vector<float> weights[2], solutions[2], descents[2];
    double terms[2];
    for (int i = 0; i < 2; ++i) {
      const auto owner = MakeBackend(i == 0 ? "cpu" : "cuda");
      Backend& backend = *owner;
      Guarded<float> a(backend, blocks), w(backend, n), b(backend, rhs), x(backend, values);
      Guarded<float> out(backend, start), center(backend, start);
      AddRidgeParams add{a.data(), w.data(), int64_t(n), k, {}};
      RidgeTermParams term{w.data(), b.data(), center.data(), out.data(), int64_t(n), k, {}};
      for (int j = 0; j < k; ++j) add.ridge[j] = term.ridge[j] = 0.01f * float(j + 1);
      backend.solve().AddRidge(add);
      backend.solve().FactorBlocks({a.data(), int64_t(n), k});
      backend.solve().SolveBlocks({a.data(), b.data(), x.data(), int64_t(n), k});
      terms[i] = backend.solve().RidgeTerm(term);
      weights[i] = w.Read(), solutions[i] = x.Read(), descents[i] = out.Read();
    }
    EXPECT_LE(RelativeError(weights[1], weights[0]), 1e-6) << k;      // a division
    EXPECT_LE(RelativeError(solutions[1], solutions[0]), 1e-5) << k;  // some hundred operations
    EXPECT_LE(RelativeError(descents[1], descents[0]), 1e-6) << k;    // a product and two sums
    EXPECT_NEAR(terms[1], terms[0], 1e-6 * terms[0]) << k;  // terms in float, a double sum
  }
}

TEST_P(Parity, CombinesVectorsAndTakesAdamsSteps) {
  const size_t n = 3 * size_t(GetParam().gaussians);
  const auto start = UniformVector(rng_, n, -1, 1), other = UniformVector(rng_, n, -1, 1);
  std::vector<float> combined[2], values[2], m[2], v[2];
  double dot[2];
  for (int i = 0; i < 2; ++i) {
    const auto owner = MakeBackend(i == 0 ? "cpu" : "cuda");
    Backend& backend = *owner;
    Guarded<float> x(backend, start), y(backend, other), sum(backend, n);
    Guarded<float> first(backend, std::vector<float>(n, 0.0f));
    Guarded<float> second(backend, std::vector<float>(n, 0.0f));
    backend.solve().LinearCombination({x.data(), y.data(), 0.7f, -1.3f, sum.data(), int64_t(n)});
    dot[i] = backend.solve().Dot(x.data(), y.data(), int64_t(n));
    for (int step = 1; step <= 5; ++step) {
      backend.solve().Adam({x.data(), y.data(), first.data(), second.data(), int64_t(n), step,
                            0.01f, 0.9f, 0.999f, 1e-8f});
    }
    combined[i] = sum.Read(), values[i] = x.Read(), m[i] = first.Read(), v[i] = second.Read();
  }
  EXPECT_LE(RelativeError(combined[1], combined[0]), 1e-6);  // products may be fused with the sum
  // Doubles summed in another order; of n terms of either sign the sum may be near 0.
  EXPECT_NEAR(dot[1], dot[0], 1e-9 * double(n));
  EXPECT_LE(RelativeError(m[1], m[0]), 1e-6);
  EXPECT_LE(RelativeError(v[1], v[0]), 1e-6);
  EXPECT_LE(RelativeError(values[1], values[0]), 1e-6);  // five steps of a root and a division
}

TEST_P(Parity, PacksAndEditsBoxes) {
  const Shape& shape = GetParam();
  const size_t pixels = size_t(shape.width) * size_t(shape.height);
  const auto image = UniformVector(rng_, 3 * pixels, -0.5f, 9);  // some steps saturate
  std::vector<uint8_t> mask(pixels);
  for (uint8_t& byte : mask) byte = uint8_t(rng_());
  const int32_t box[4] = {shape.width / 3, shape.height / 4, shape.width, shape.height};
  const size_t values = size_t(box[2] - box[0]) * size_t(box[3] - box[1]) * 3;
  std::vector<uint16_t> packed[2];
  std::vector<float> unpacked[2], edited[2];
  for (int i = 0; i < 2; ++i) {
    const auto owner = MakeBackend(i == 0 ? "cpu" : "cuda");
    Backend& backend = *owner;
    Guarded<float> from(backend, image), to(backend, std::vector<float>(3 * pixels, 7.0f));
    Guarded<float> out(backend, std::vector<float>(3 * pixels, 5.0f));
    Guarded<uint16_t> steps(backend, values);
    Guarded<uint8_t> shares(backend, mask);
    PackBoxParams pack{from.data(), shape.width, shape.height, {}, steps.data(), 1.0f / 8192};
    EditImageParams edit{
        from.data(), shares.data(), {{0.5f, 0.1f, 0, 0, -0.25f, 0, 0.2f, 0, 1}, {0.1f, 0, -0.1f}},
        shape.width, shape.height,  {},
        out.data()};
    std::copy_n(box, 4, pack.box);
    std::copy_n(box, 4, edit.box);
    backend.refit().PackBox(pack);
    pack.image = to.data();
    backend.refit().UnpackBox(pack);
    backend.refit().EditImage(edit);
    packed[i] = steps.Read(), unpacked[i] = to.Read(), edited[i] = out.Read();
  }
  EXPECT_EQ(packed[1], packed[0]);                       // one product, rounded by the same rule
  EXPECT_EQ(unpacked[1], unpacked[0]);                   // one product
  EXPECT_LE(RelativeError(edited[1], edited[0]), 1e-6);  // products may be fused with sums
}

INSTANTIATE_TEST_SUITE_P(cuda, Parity,
                         testing::Values(Shape{0, 33, 47}, Shape{1, 1, 1}, Shape{1, 33, 47},
                                         Shape{17, 33, 47}, Shape{10000, 1, 1},
                                         Shape{10000, 707, 1261}, Shape{1000000, 33, 47},
                                         Shape{1000000, 707, 1261}, Shape{17, 33, 47, true},
                                         Shape{10000, 707, 1261, true}),
                         testing::PrintToStringParamName());

}  // namespace
}  // namespace retint
