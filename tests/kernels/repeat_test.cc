// SPDX-License-Identifier: BSD-3-Clause
// The same input gives the same bytes under any schedule of threads and blocks. Every operation
// with sums of many terms runs three times, each time on its own backend. Also the range of values
// for which the sums of a device are exact.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <optional>

#include "tests/kernels/test_scene.h"

namespace retint {
namespace {

constexpr int kRuns = 3;
constexpr float kUnit = 1.0f / 8192;

class Repeat : public BackendTest {
 protected:
  struct Scene {
    std::unique_ptr<Model> model;
    std::shared_ptr<const ViewGeometry> view;
  };
  // How a region holds its weights: tile lists, explicit ones, approximate ones.
  struct Kind {
    size_t budget;
    float min_weight;
  };
  static constexpr Kind kKinds[] = {{0, 0}, {size_t{1} << 32, 0}, {size_t{1} << 32, 1e-3f}};

  // Many Gaussians a pixel and many pixels a Gaussian, so that sums have terms from
  // everywhere.
  Repeat() : host_(RandomModel(rng_, 20000)), camera_(TestCamera(203, 157)) {
    for (size_t g = 0; g < active_.size(); ++g) active_[g] = g % 4 == 0;
  }
  Scene MakeScene(Backend& backend) const {
    Scene scene{backend.blend().UploadModel(host_.arrays()), nullptr};
    scene.view = backend.blend().PrepareView(*scene.model, camera_);
    return scene;
  }
  std::shared_ptr<const ViewGeometry> Region(Backend& backend, const Scene& scene,
                                             const Kind& kind) const {
    const auto flags = backend.Upload(std::span<const uint8_t>(active_));
    return backend.blend().Restrict(*scene.view, flags.data(), kind.budget, kind.min_weight);
  }
  size_t Pixels() const { return size_t(camera_.width) * size_t(camera_.height); }

  // `run` returns the result on a backend.
  template <typename Run>
  void ExpectSameBytes(const Run& run) const {
    const auto first = run(*backend_);
    ASSERT_FALSE(first.empty());
    for (int i = 1; i < kRuns; ++i) {
      const auto again = run(*MakeBackend(GetParam()));
      ASSERT_EQ(again.size(), first.size());
      EXPECT_EQ(std::memcmp(again.data(), first.data(), first.size() * sizeof(first[0])), 0) << i;
    }
  }

  TestModel host_;
  CameraParams camera_;
  std::vector<uint8_t> active_ = std::vector<uint8_t>(20000);
};
RETINT_INSTANTIATE(Repeat);

TEST_P(Repeat, Transposes) {
  for (const int channels : {1, 3, 8}) {
    const auto residual = UniformVector(rng_, Pixels() * size_t(channels), -1, 1);
    ExpectSameBytes([&](Backend& backend) {
      const Scene scene = MakeScene(backend);
      return RunTranspose(backend, *scene.view, residual, channels);
    });
  }
}

TEST_P(Repeat, TransposesRegions) {
  const auto residual = UniformVector(rng_, Pixels() * 3, -1, 1);
  for (const Kind& kind : kKinds) {
    ExpectSameBytes([&](Backend& backend) {
      const Scene scene = MakeScene(backend);
      return RunTranspose(backend, *Region(backend, scene, kind), residual, 3);
    });
  }
}

TEST_P(Repeat, SumsShares) {
  std::vector<uint8_t> mask(Pixels());
  for (uint8_t& byte : mask) byte = uint8_t(rng_());
  ExpectSameBytes([&](Backend& backend) {
    const Scene scene = MakeScene(backend);
    Guarded<uint8_t> on_device(backend, mask);
    Guarded<double> sums(backend, std::vector<double>(2 * size_t(host_.count()), 0.0));
    backend.blend().AccumulateShares(*scene.view, on_device.data(), sums.data());
    return sums.Read();
  });
}

TEST_P(Repeat, SumsResiduals) {
  const auto image = UniformVector(rng_, Pixels() * 3, -1, 1);
  for (const Kind& kind : kKinds) {
    ExpectSameBytes([&](Backend& backend) {
      const Scene scene = MakeScene(backend);
      const auto region = Region(backend, scene, kind);
      const size_t values = NumRegionPixels(*region) * 3;
      Guarded<int16_t> target(backend, std::vector<int16_t>(values, int16_t(1234)));
      Guarded<float> rendered(backend, image);
      Guarded<double> loss(backend, std::vector<double>{0.5});
      backend.refit().RegionResidual(
          *region, {target.data(), kUnit, rendered.data(), rendered.data(), loss.data(), nullptr});
      return loss.Read();
    });
  }
}

TEST_P(Repeat, MeasuresLoss) {
  const auto image = UniformVector(rng_, Pixels() * 3, 0, 1);
  const auto target = UniformVector(rng_, Pixels() * 3, 0, 1);
  ExpectSameBytes([&](Backend& backend) {
    Guarded<float> y(backend, image), t(backend, target), gradient(backend, image.size());
    Guarded<double> sum(backend, std::vector<double>{2.0});
    ImageLossParams params{y.data(), t.data(), camera_.width,  camera_.height,
                           0.2f,     {},       gradient.data()};
    const ImageLossValue value = backend.refit().ImageLoss(params);
    params.loss = sum.data();
    backend.refit().ImageLoss(params);
    std::vector<double> out = {value.loss, value.l1, value.ssim, sum.Read()[0]};
    for (const float one : gradient.Read()) out.push_back(double(one));
    return out;
  });
}

TEST_P(Repeat, Multiplies) {
  const auto x = UniformVector(rng_, 300001, -1, 1), y = UniformVector(rng_, 300001, -1, 1);
  ExpectSameBytes([&](Backend& backend) {
    Guarded<float> a(backend, x), b(backend, y);
    std::vector<double> products;
    for (const int64_t count : {1, 255, 300001}) {
      products.push_back(backend.solve().Dot(a.data(), b.data(), count));
    }
    return products;
  });
}

// The transpose is linear over the whole range of values that a float can hold.
TEST_P(Repeat, ScalesWithTheResidual) {
  const Scene scene = MakeScene(*backend_);
  const auto residual = UniformVector(rng_, Pixels() * 3, -1, 1);
  for (const Kind& kind : kKinds) {
    const auto region = Region(*backend_, scene, kind);
    const auto sums = RunTranspose(*backend_, *region, residual, 3);
    for (const float scale : {0.0f, 1e-30f, 1e-6f, 1e6f, 1e30f}) {
      std::vector<float> scaled = residual;
      for (float& value : scaled) value *= scale;
      const auto of_scaled = RunTranspose(*backend_, *region, scaled, 3);
      ASSERT_EQ(of_scaled.size(), sums.size());
      double worst = 0, largest = 0;
      for (size_t i = 0; i < sums.size(); ++i) {
        worst = std::max(worst, std::abs(double(of_scaled[i]) - double(scale) * double(sums[i])));
        largest = std::max(largest, std::abs(double(scale) * double(sums[i])));
      }
      EXPECT_LE(worst, 1e-5 * largest) << scale;  // sums of some thousand floats
    }
  }
}

TEST_P(Repeat, KeepsWhatIsNoNumber) {
  const Scene scene = MakeScene(*backend_);
  auto residual = UniformVector(rng_, Pixels(), -1, 1);
  residual[Pixels() / 2 + size_t(camera_.width) / 2] = NAN;
  const auto sums = RunTranspose(*backend_, *scene.view, residual, 1);
  const auto is_nan = [](float sum) { return std::isnan(sum); };
  EXPECT_TRUE(std::any_of(sums.begin(), sums.end(), is_nan));
  EXPECT_FALSE(std::all_of(sums.begin(), sums.end(), is_nan));
}

// A sweep follows from its input alone, also after one whose residuals are a million times larger.
TEST_P(Repeat, Sweeps) {
  constexpr float kLarger = 1e6f;
  for (const Kind& kind : kKinds) {
    ExpectSameBytes([&](Backend& backend) {
      const Scene scene = MakeScene(backend);
      const auto region = Region(backend, scene, kind);
      const size_t pixels = NumRegionPixels(*region), values = size_t(region->num_rows()) * 3;
      Guarded<int16_t> target(backend, std::vector<int16_t>(3 * pixels, int16_t(-4321)));
      Guarded<uint8_t> weights(backend, std::vector<uint8_t>(pixels, uint8_t{200}));
      Guarded<float> change(backend, std::vector<float>(values, 0.25f)),
          image(backend, 3 * Pixels());
      std::vector<float> out;
      for (const float unit : {kUnit, kLarger * kUnit, kUnit}) {
        Guarded<double> loss(backend, std::vector<double>{0.5});
        Guarded<float> result(backend, values);
        backend.refit().RegionSweep(*region, {.change = change.data(),
                                              .target = target.data(),
                                              .unit = unit,
                                              .weights = weights.data(),
                                              .loss = loss.data(),
                                              .image = image.data(),
                                              .result = result.data()});
        const std::vector<float> sums = result.Read();
        if (out.empty()) {
          out = sums;
        } else if (unit == kUnit) {
          EXPECT_EQ(sums, out);
        }
      }
      return out;
    });
  }
}

}  // namespace
}  // namespace retint
