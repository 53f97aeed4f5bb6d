// SPDX-License-Identifier: BSD-3-Clause
// L1 + D-SSIM against a direct double-precision evaluation, its gradient against central
// differences, and the whole chain from coefficients to loss.
#include <cmath>

#include "tests/kernels/reference.h"
#include "tests/kernels/test_scene.h"

namespace retint {
namespace {

std::vector<double> ToDouble(const std::vector<float>& v) { return {v.begin(), v.end()}; }

class LossOp : public BackendTest {
 protected:
  struct Result {
    ImageLossValue value;
    std::vector<float> gradient;
  };
  Result Run(const std::vector<float>& image, const std::vector<float>& target, int width,
             int height, float lambda, std::array<int, 4> roi = {},
             const std::vector<float>& before = {}) {
    Guarded<float> y(*backend_, image), t(*backend_, target);
    Guarded<float> gradient = before.empty() ? Guarded<float>(*backend_, image.size())
                                             : Guarded<float>(*backend_, before);
    ImageLossParams params{y.data(), t.data(), width, height, lambda, {}, gradient.data()};
    std::copy(roi.begin(), roi.end(), params.roi);
    Result result;
    result.value = backend_->refit().ImageLoss(params);
    result.gradient = gradient.Read();
    return result;
  }
  // Smooth structure with noise, so that SSIM is neither 0 nor 1.
  std::vector<float> Picture(int width, int height) {
    std::vector<float> picture;
    const float phase = Uniform(rng_, 0, 6);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        for (int c = 0; c < 3; ++c) {
          picture.push_back(0.5f + 0.3f * std::sin(0.3f * float(x + c) + 0.2f * float(y) + phase) +
                            Uniform(rng_, -0.1f, 0.1f));
        }
      }
    }
    return picture;
  }
};

constexpr std::pair<int, int> kSizes[] = {{1, 1}, {5, 3}, {33, 47}, {150, 80}};

TEST_P(LossOp, ValueMatchesReference) {
  for (const auto& [width, height] : kSizes) {
    const auto image = Picture(width, height), target = Picture(width, height);
    for (const float lambda : {0.0f, 0.2f, 1.0f}) {
      const auto actual = Run(image, target, width, height, lambda).value;
      const auto expected =
          ReferenceImageLoss(ToDouble(image), ToDouble(target), width, height, double(lambda));
      EXPECT_NEAR(actual.l1, expected.l1, 1e-6);
      EXPECT_NEAR(actual.ssim, expected.ssim, 1e-5);  // variances lose digits to cancellation
      EXPECT_NEAR(actual.loss, expected.loss, 1e-5);
    }
  }
}

TEST_P(LossOp, GradientMatchesCentralDifferences) {
  for (const auto& [width, height] : kSizes) {
    const auto image = Picture(width, height), target = Picture(width, height);
    const auto gradient = Run(image, target, width, height, 0.2f).gradient;
    const double scale = 1.0 / (width * height * 3);
    const int checks = width * height < 2000 ? 12 : 4;  // each evaluates the slow reference twice
    for (int i = 0; i < checks; ++i) {
      // Corners and random pixels.
      const size_t at = i == 0 ? 0 : i == 1 ? image.size() - 1 : rng_() % image.size();
      const double h = 1e-4;
      if (std::fabs(image[at] - target[at]) < 2 * h) continue;  // the kink of |.|
      auto plus = ToDouble(image), minus = plus;
      plus[at] += h, minus[at] -= h;
      const auto t = ToDouble(target);
      const double numeric = (ReferenceImageLoss(plus, t, width, height, 0.2).loss -
                              ReferenceImageLoss(minus, t, width, height, 0.2).loss) /
                             (2 * h);
      // Gradients are of order 1 / N; h^2 and float rounding are below a thousandth of that.
      EXPECT_NEAR(gradient[at], numeric, 1e-3 * scale + 1e-3 * std::fabs(numeric)) << at;
    }
  }
}

TEST_P(LossOp, IsZeroForEqualImages) {
  const auto image = Picture(60, 40);
  const auto result = Run(image, image, 60, 40, 0.2f);
  EXPECT_EQ(result.value.l1, 0);
  EXPECT_NEAR(result.value.ssim, 1, 1e-6);
  // Terms of order 1 / C2 cancel up to rounding; the L1 part's step would be 0.8 / N.
  for (const float g : result.gradient) EXPECT_NEAR(g, 0, 1e-4 / (60 * 40 * 3));
}

// Images that agree outside a box: the region of interest around it plus the window gives the whole
// answer.
TEST_P(LossOp, RegionOfInterestIsExact) {
  const int width = 300, height = 170;
  const auto image = Picture(width, height);
  auto target = image;
  for (int y = 60; y < 90; ++y) {
    for (int x = 120; x < 200; ++x) target[size_t((y * width + x) * 3 + 1)] += 0.2f;
  }
  const auto whole = Run(image, target, width, height, 0.2f);
  const std::array<int, 4> roi = {110, 50, 210, 100};
  const std::vector<float> before(image.size(), 7.0f);
  const auto part = Run(image, target, width, height, 0.2f, roi, before);
  EXPECT_NEAR(part.value.loss, whole.value.loss, 1e-7);
  EXPECT_NEAR(part.value.l1, whole.value.l1, 1e-9);
  EXPECT_NEAR(part.value.ssim, whole.value.ssim, 1e-6);
  const double step = 1e-4 / (width * height * 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const size_t at = size_t((y * width + x) * 3);
      const bool inside = x >= roi[0] && x < roi[2] && y >= roi[1] && y < roi[3];
      for (size_t c = 0; c < 3; ++c) {
        if (inside) {
          EXPECT_NEAR(part.gradient[at + c], whole.gradient[at + c], step);
        } else {
          ASSERT_EQ(part.gradient[at + c], 7.0f);
        }
      }
    }
  }
}

// In an empty region of interest nothing differs, and nothing is written.
TEST_P(LossOp, AnEmptyRegionOfInterestHasNoLoss) {
  const auto image = Picture(40, 30), target = Picture(40, 30);
  const std::vector<float> before(image.size(), 7.0f);
  const auto none = Run(image, target, 40, 30, 0.2f, {5, 5, 5, 20}, before);
  EXPECT_EQ(none.value.loss, 0);
  EXPECT_EQ(none.value.l1, 0);
  EXPECT_EQ(none.value.ssim, 1);
  EXPECT_EQ(none.gradient, before);
}

TEST_P(LossOp, AddsToBackendMemoryOnRequest) {
  const auto image = Picture(40, 30), target = Picture(40, 30);
  Guarded<float> y(*backend_, image), t(*backend_, target), gradient(*backend_, image.size());
  Guarded<double> sum(*backend_, std::vector<double>{1.0});
  ImageLossParams params{y.data(), t.data(), 40, 30, 0.2f, {5, 5, 20, 30}, gradient.data()};
  const double loss = backend_->refit().ImageLoss(params).loss;
  params.loss = sum.data();
  EXPECT_EQ(backend_->refit().ImageLoss(params).loss, 0);
  EXPECT_GT(loss, 0);
  EXPECT_DOUBLE_EQ(sum.Read()[0], 1 + loss);
}

TEST_P(LossOp, RegionOfInterestMayTouchTheBorder) {
  const auto image = Picture(40, 30), target = Picture(40, 30);
  const auto whole = Run(image, target, 40, 30, 0.2f);
  const auto same = Run(image, target, 40, 30, 0.2f, {0, 0, 40, 30});
  EXPECT_EQ(whole.gradient, same.gradient);
  const std::vector<float> zeros(image.size(), 0.0f);
  const auto corner = Run(image, target, 40, 30, 0.2f, {33, 20, 40, 30}, zeros);
  for (int y = 20; y < 30; ++y) {
    for (int x = 33; x < 40; ++x) {
      const size_t at = size_t((y * 40 + x) * 3);
      EXPECT_NEAR(corner.gradient[at], whole.gradient[at], 1e-8);
    }
  }
  EXPECT_THROW(Run(image, target, 40, 30, 0.2f, {0, 0, 41, 30}), std::invalid_argument);
}

// dL/dsh by the kernels (loss, W^T, SH transpose) against central differences of a chain written in
// double precision.
TEST_P(LossOp, WholeChainMatchesCentralDifferences) {
  const int width = 40, height = 28, gaussians = 30;
  const CameraParams camera = TestCamera(width, height);
  TestModel model = RandomModel(rng_, gaussians, 3);
  const auto uploaded = backend_->blend().UploadModel(model.arrays());
  const auto view = backend_->blend().PrepareView(*uploaded, camera);
  const auto rows = RowsOf(*backend_, *view);
  ASSERT_GT(rows.size(), 10u);
  const auto weights = ReferenceWeights(model, camera);
  const auto target = UniformVector(rng_, size_t(width * height * 3), 0, 1);
  const auto loss = [&](const std::vector<double>& sh) {
    std::vector<std::vector<double>> colors;
    for (int g = 0; g < gaussians; ++g) {
      const auto block = sh.begin() + g * 48;
      colors.push_back(ReferenceColor(model, {block, block + 48}, g, camera));
    }
    std::vector<double> image(target.size(), 0.0);
    for (const ReferenceWeight& w : weights) {
      for (size_t c = 0; c < 3; ++c) {
        image[size_t(w.pixel) * 3 + c] += w.weight * colors[size_t(w.gaussian)][c];
      }
    }
    return ReferenceImageLoss(image, ToDouble(target), width, height, 0.2).loss;
  };

  Guarded<float> colors(*backend_, rows.size() * 3);
  EvalShParams eval{view->rows(), nullptr, view->num_rows(), uploaded->sh(), {}, colors.data()};
  std::copy_n(camera.center, 3, eval.center);
  backend_->sh().EvalSh(*uploaded, eval);
  const auto image = RunBlend(*backend_, *view, colors.Read(), 3).image;
  const auto result = Run(image, target, width, height, 0.2f);
  EXPECT_NEAR(result.value.loss, loss(ToDouble(model.sh)), 1e-5);
  Guarded<float> color_gradients(*backend_, RunTranspose(*backend_, *view, result.gradient, 3));
  Guarded<float> gradient(*backend_, std::vector<float>(model.sh.size(), 0.0f));
  EvalShTransposeParams transpose{view->rows(),  nullptr, view->num_rows(), color_gradients.data(),
                                  colors.data(), {},      gradient.data()};
  std::copy_n(camera.center, 3, transpose.center);
  backend_->sh().EvalShTranspose(*uploaded, transpose);
  const auto analytic = gradient.Read();

  double largest = 0;
  for (const float g : analytic) largest = std::max(largest, std::fabs(double(g)));
  ASSERT_GT(largest, 0);
  for (int i = 0; i < 12; ++i) {
    const size_t g = size_t(rows[rng_() % rows.size()]), at = g * 48 + rng_() % 48;
    const double h = 1e-5;
    auto plus = ToDouble(model.sh), minus = plus;
    plus[at] += h, minus[at] -= h;
    const double numeric = (loss(plus) - loss(minus)) / (2 * h);
    // A pixel whose |y - y*| passes its kink within h moves the difference by up to 2 / N of it.
    EXPECT_NEAR(analytic[at], numeric, 2e-3 * largest) << at;
  }
}

RETINT_INSTANTIATE(LossOp);

}  // namespace
}  // namespace retint
