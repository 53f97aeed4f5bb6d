// SPDX-License-Identifier: BSD-3-Clause
// Random models and cameras, seeded by the test's name, and the backends that every operation is
// tested on.
#pragma once

#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "kernels/backend.h"

namespace retint {

// A generator that the running test's name seeds.
std::mt19937 TestRng();

float Uniform(std::mt19937& rng, float low, float high);
std::vector<float> UniformVector(std::mt19937& rng, size_t count, float low, float high);

struct TestModel {
  std::vector<float> means, quats, log_scales, logits, sh;
  int sh_degree = 0;
  bool compensate = false;

  int64_t count() const { return int64_t(logits.size()); }
  int num_coeffs() const { return (sh_degree + 1) * (sh_degree + 1); }
  GaussianArrays arrays() const;
};

// A posed camera with its principal point off the centre.
CameraParams TestCamera(int width, int height);

// Gaussians in front of, beside and behind TestCamera: specks, blobs, needles and sheets, from
// transparent to opaque.
TestModel RandomModel(std::mt19937& rng, int64_t count, int sh_degree = 1);

// "cpu", "cpu-scalar" (the oracle of the SIMD loops), and "cuda" if there is a device.
std::vector<std::string> TestedBackends();
// The same, and "cuda" even without a device: its cases are then reported as skipped.
std::vector<std::string> AllBackends();
std::shared_ptr<Backend> MakeBackend(const std::string& name);

// Fixture of tests that hold for every backend.
class BackendTest : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    try {
      backend_ = MakeBackend(GetParam());
    } catch (const std::exception& error) {
      ASSERT_EQ(GetParam(), "cuda") << error.what();
      GTEST_SKIP() << error.what();
    }
  }
  std::shared_ptr<Backend> backend_;
  std::mt19937 rng_ = TestRng();
};

#define RETINT_INSTANTIATE(suite)                                                             \
  INSTANTIATE_TEST_SUITE_P(, suite, testing::ValuesIn(::retint::AllBackends()), [](auto& i) { \
    std::string name = i.param;                                                               \
    for (char& c : name) c = c == '-' ? '_' : c;                                              \
    return name;                                                                              \
  })

// Backend memory with a guard on either side and NaN inside: a write beyond the ends, or a value
// that was never written, is found by Read().
template <typename T>
class Guarded {
 public:
  Guarded(Backend& backend, size_t count)
      : backend_(backend), count_(count), memory_(backend.Allocate<T>(count + 2 * kGuard)) {
    backend.Fill(memory_.data(), 0xFF, memory_.size() * sizeof(T));
  }
  Guarded(Backend& backend, const std::vector<T>& values) : Guarded(backend, values.size()) {
    backend.CopyToDevice(data(), values.data(), count_ * sizeof(T));
  }
  T* data() { return memory_.data() + kGuard; }
  std::vector<T> Read() {
    backend_.Synchronize();
    const std::vector<T> all = backend_.Download(memory_.data(), memory_.size());
    const auto intact = [](const T& value) {
      const auto* bytes = reinterpret_cast<const unsigned char*>(&value);
      for (size_t i = 0; i < sizeof(T); ++i) {
        if (bytes[i] != 0xFF) return false;
      }
      return true;
    };
    for (size_t i = 0; i < kGuard; ++i) {
      EXPECT_TRUE(intact(all[i])) << "written " << kGuard - i << " elements before the buffer";
      EXPECT_TRUE(intact(all[kGuard + count_ + i])) << "written " << i << " elements past the end";
    }
    return {all.begin() + kGuard, all.begin() + int64_t(kGuard + count_)};
  }

 private:
  static constexpr size_t kGuard = 64;
  Backend& backend_;
  size_t count_;
  Buffer<T> memory_;
};

struct Blended {
  std::vector<float> image, alpha;
};
// Blend with everything uploaded, guarded and downloaded.
Blended RunBlend(Backend& backend, const ViewGeometry& view, const std::vector<float>& features,
                 int channels, const std::vector<float>& background = {});
std::vector<float> RunTranspose(Backend& backend, const ViewGeometry& view,
                                const std::vector<float>& residual, int channels);
std::vector<int32_t> RowsOf(Backend& backend, const ViewGeometry& view);

double Dot(const std::vector<float>& a, const std::vector<float>& b);
// |a - b| of the worst element; NaN anywhere gives infinity.
double WorstDifference(const std::vector<float>& a, const std::vector<double>& b);
double WorstDifference(const std::vector<float>& a, const std::vector<float>& b);

}  // namespace retint
