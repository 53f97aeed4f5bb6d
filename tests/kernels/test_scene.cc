// SPDX-License-Identifier: BSD-3-Clause
#include "tests/kernels/test_scene.h"

#include <cmath>
#include <functional>
#include <limits>

#include "kernels/cpu/cpu_backend.h"

namespace retint {

std::mt19937 TestRng() {
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  // The backend's name must not matter: parameterised names are "Case/backend".
  std::string name = test ? test->name() : "";
  name = name.substr(0, name.find('/'));
  uint32_t seed = 2166136261u;  // FNV-1a, the same everywhere
  for (const char c : name) seed = (seed ^ uint32_t(uint8_t(c))) * 16777619u;
  return std::mt19937(seed);
}

float Uniform(std::mt19937& rng, float low, float high) {
  return low + (high - low) * (float(rng() >> 8) * 0x1p-24f);
}

std::vector<float> UniformVector(std::mt19937& rng, size_t count, float low, float high) {
  std::vector<float> values(count);
  for (float& value : values) value = Uniform(rng, low, high);
  return values;
}

GaussianArrays TestModel::arrays() const {
  return {means.data(), quats.data(), log_scales.data(), logits.data(),
          sh.data(),    count(),      sh_degree,         compensate};
}

CameraParams TestCamera(int width, int height) {
  CameraParams camera{};
  camera.width = width;
  camera.height = height;
  camera.fx = 0.9f * float(std::max(width, height));
  camera.fy = 0.95f * float(std::max(width, height));
  camera.cx = 0.53f * float(width);
  camera.cy = 0.46f * float(height);
  // A rotation by 0.3 about (1, 2, 2) / 3.
  const double angle = 0.3, c = std::cos(angle), s = std::sin(angle);
  const double axis[3] = {1.0 / 3, 2.0 / 3, 2.0 / 3};
  const double cross[9] = {0, -axis[2], axis[1], axis[2], 0, -axis[0], -axis[1], axis[0], 0};
  const double shift[3] = {0.1, -0.2, 0.3};
  for (int i = 0; i < 9; ++i) {
    camera.rotation[i] =
        float((i % 4 == 0 ? c : 0) + (1 - c) * axis[i / 3] * axis[i % 3] + s * cross[i]);
  }
  for (int i = 0; i < 3; ++i) camera.translation[i] = float(shift[i]);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j)
      camera.center[i] -= camera.rotation[3 * j + i] * camera.translation[j];
  }
  return camera;
}

TestModel RandomModel(std::mt19937& rng, int64_t count, int sh_degree) {
  const CameraParams camera = TestCamera(64, 64);
  TestModel model;
  model.sh_degree = sh_degree;
  // The more Gaussians, the smaller, so that pixels blend dozens and not thousands of them.
  const float size = -1.5f - 0.4f * std::log(float(count + 1));
  for (int64_t i = 0; i < count; ++i) {
    const bool behind = i % 16 == 15;
    const float z = behind ? Uniform(rng, -2, 0.25f) : Uniform(rng, 1, 6);
    const float at[3] = {Uniform(rng, -0.75f, 0.75f) * z, Uniform(rng, -0.75f, 0.75f) * z, z};
    for (int j = 0; j < 3; ++j) {
      float world = 0;
      for (int k = 0; k < 3; ++k) {
        world += camera.rotation[3 * k + j] * (at[k] - camera.translation[k]);
      }
      model.means.push_back(world);
    }
    for (int j = 0; j < 4; ++j) model.quats.push_back(Uniform(rng, -2, 2));
    const float spread = i % 4 == 0 ? 2.5f : 0.7f;
    for (int j = 0; j < 3; ++j) model.log_scales.push_back(size + Uniform(rng, -spread, spread));
    model.logits.push_back(Uniform(rng, -6, 6));
  }
  model.sh = UniformVector(rng, size_t(count) * size_t(model.num_coeffs()) * 3, -0.6f, 0.8f);
  return model;
}

std::vector<std::string> TestedBackends() {
  auto names = AvailableBackends();
  names.insert(names.begin() + 1, "cpu-scalar");
  return names;
}

std::vector<std::string> AllBackends() {
  auto names = TestedBackends();
  if (names.back() != "cuda") names.push_back("cuda");
  return names;
}

std::shared_ptr<Backend> MakeBackend(const std::string& name) {
  return name == "cpu-scalar" ? CreateCpuBackend({.scalar = true}) : CreateBackend(name);
}

Blended RunBlend(Backend& backend, const ViewGeometry& view, const std::vector<float>& features,
                 int channels, const std::vector<float>& background) {
  const size_t pixels = size_t(view.camera().width) * size_t(view.camera().height);
  Guarded<float> in(backend, features), back(backend, background);
  Guarded<float> image(backend, pixels * size_t(channels)), alpha(backend, pixels);
  backend.blend().Blend(view, {in.data(), channels, background.empty() ? nullptr : back.data(),
                               image.data(), alpha.data(), false});
  return {image.Read(), alpha.Read()};
}

std::vector<float> RunTranspose(Backend& backend, const ViewGeometry& view,
                                const std::vector<float>& residual, int channels) {
  Guarded<float> in(backend, residual);
  Guarded<float> out(backend, size_t(view.num_rows()) * size_t(channels));
  backend.blend().BlendTranspose(view, {in.data(), channels, out.data()});
  return out.Read();
}

std::vector<int32_t> RowsOf(Backend& backend, const ViewGeometry& view) {
  return backend.Download(view.rows(), size_t(view.num_rows()));
}

double Dot(const std::vector<float>& a, const std::vector<float>& b) {
  EXPECT_EQ(a.size(), b.size());
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += double(a[i]) * double(b[i]);
  return sum;
}

namespace {

template <typename A, typename B>
double Worst(const std::vector<A>& a, const std::vector<B>& b) {
  EXPECT_EQ(a.size(), b.size());
  double worst = 0;
  for (size_t i = 0; i < a.size() && i < b.size(); ++i) {
    const double difference = std::fabs(double(a[i]) - double(b[i]));
    if (!(difference <= worst)) worst = difference;
    if (std::isnan(difference)) return std::numeric_limits<double>::infinity();
  }
  return worst;
}

}  // namespace

double WorstDifference(const std::vector<float>& a, const std::vector<double>& b) {
  return Worst(a, b);
}
double WorstDifference(const std::vector<float>& a, const std::vector<float>& b) {
  return Worst(a, b);
}

}  // namespace retint
