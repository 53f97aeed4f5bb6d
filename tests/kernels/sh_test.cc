// SPDX-License-Identifier: BSD-3-Clause
// The SH basis against closed values and its own orthonormality; EvalSh and its transpose.
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "kernels/common/sh.h"
#include "tests/kernels/reference.h"
#include "tests/kernels/test_scene.h"

namespace retint {
namespace {

std::array<double, 3> RandomDirection(std::mt19937& rng) {
  while (true) {
    std::array<double, 3> d;
    for (double& v : d) v = Uniform(rng, -1, 1);
    const double norm = std::hypot(d[0], d[1], d[2]);
    if (norm > 1 || norm < 0.1) continue;
    for (double& v : d) v /= norm;
    return d;
  }
}

TEST(ShBasis, MatchesAssociatedLegendreFunctions) {
  std::mt19937 rng = TestRng();
  for (int i = 0; i < 100; ++i) {
    const auto d = RandomDirection(rng);
    double basis[kMaxShCoeffs];
    ShBasis(3, d[0], d[1], d[2], basis);
    const auto expected = ReferenceShBasis(3, d[0], d[1], d[2]);
    // The constants are rounded to float.
    for (size_t k = 0; k < 16; ++k) EXPECT_NEAR(basis[k], expected[k], 2e-7) << "k = " << k;
  }
}

TEST(ShBasis, HasTheSignsOf3dgs) {
  float basis[kMaxShCoeffs];
  ShBasis(1, 1.0f, 0.0f, 0.0f, basis);
  EXPECT_FLOAT_EQ(basis[0], 0.2820948f);
  EXPECT_FLOAT_EQ(basis[3], -0.4886025f);  // -x
  ShBasis(1, 0.0f, 1.0f, 0.0f, basis);
  EXPECT_FLOAT_EQ(basis[1], -0.4886025f);  // -y
  ShBasis(3, 0.0f, 0.0f, 1.0f, basis);
  EXPECT_FLOAT_EQ(basis[2], 0.4886025f);   // +z
  EXPECT_FLOAT_EQ(basis[6], 0.6307831f);   // sqrt(5 / 4 pi)
  EXPECT_FLOAT_EQ(basis[12], 0.7463527f);  // sqrt(7 / 4 pi)
}

// Exact quadrature on the sphere: midpoints in phi, Gauss-Legendre (5 nodes, degree 9) in z.
TEST(ShBasis, IsOrthonormal) {
  const double nodes[] = {0, 0.5384693101056831, -0.5384693101056831, 0.9061798459386640,
                          -0.9061798459386640};
  const double node_weights[] = {0.5688888888888889, 0.4786286704993665, 0.4786286704993665,
                                 0.2369268850561891, 0.2369268850561891};
  double gram[16][16] = {};
  constexpr int kSteps = 16;
  for (int n = 0; n < 5; ++n) {
    for (int i = 0; i < kSteps; ++i) {
      const double phi = 2 * M_PI * (i + 0.5) / kSteps, z = nodes[n], r = std::sqrt(1 - z * z);
      double basis[kMaxShCoeffs];
      ShBasis(3, r * std::cos(phi), r * std::sin(phi), z, basis);
      for (int a = 0; a < 16; ++a) {
        for (int b = 0; b < 16; ++b) {
          gram[a][b] += node_weights[n] * 2 * M_PI / kSteps * basis[a] * basis[b];
        }
      }
    }
  }
  for (int a = 0; a < 16; ++a) {
    for (int b = 0; b < 16; ++b) EXPECT_NEAR(gram[a][b], a == b, 1e-6) << a << " " << b;
  }
}

class ShOp : public BackendTest {
 protected:
  void Make(int degree) {
    model_ = RandomModel(rng_, 300, degree);
    uploaded_ = backend_->blend().UploadModel(model_.arrays());
    camera_ = TestCamera(64, 64);
    // Rows: every third Gaussian, back to front; slots: compact, a few without.
    rows_.clear(), slots_.clear();
    for (int g = 297; g >= 0; g -= 3) {
      slots_.push_back(rows_.size() % 7 == 3 ? -1 : 99 - int32_t(rows_.size()));
      rows_.push_back(g);
    }
    k3_ = size_t(model_.num_coeffs()) * 3;
    compact_ = UniformVector(rng_, 100 * k3_, -0.6f, 0.8f);
    device_rows_ = backend_->Upload(std::span<const int32_t>(rows_));
    device_slots_ = backend_->Upload(std::span<const int32_t>(slots_));
  }
  std::vector<double> Expected(const std::vector<float>& sh, size_t slot, int g) {
    const std::vector<double> block(sh.begin() + int64_t(slot * k3_),
                                    sh.begin() + int64_t((slot + 1) * k3_));
    return ReferenceColor(model_, block, g, camera_);
  }
  // Y(d) of Gaussian g seen from the camera.
  std::vector<double> Basis(int g) {
    double d[3], norm = 0;
    for (size_t i = 0; i < 3; ++i) {
      d[i] = double(model_.means[size_t(g) * 3 + i]) - double(camera_.center[i]);
      norm += d[i] * d[i];
    }
    norm = std::sqrt(norm);
    const auto basis = ReferenceShBasis(model_.sh_degree, d[0] / norm, d[1] / norm, d[2] / norm);
    return {basis.begin(), basis.begin() + model_.num_coeffs()};
  }
  template <typename Params>
  Params WithCenter(Params params) {
    for (int i = 0; i < 3; ++i) params.center[i] = camera_.center[i];
    return params;
  }
  TestModel model_;
  std::unique_ptr<Model> uploaded_;
  CameraParams camera_;
  std::vector<int32_t> rows_, slots_;
  std::vector<float> compact_;
  Buffer<int32_t> device_rows_, device_slots_;
  size_t k3_ = 0;
};

TEST_P(ShOp, EvalMatchesReferenceInEveryDegree) {
  for (int degree = 0; degree <= 3; ++degree) {
    Make(degree);
    Guarded<float> whole(*backend_, 900), by_row(*backend_, 300), by_slot(*backend_, 300);
    Guarded<float> compact(*backend_, compact_);
    EvalShParams params = WithCenter(EvalShParams{});
    params.count = 300;
    params.sh = uploaded_->sh();
    params.colors = whole.data();
    backend_->sh().EvalSh(*uploaded_, params);
    params.rows = device_rows_.data();
    params.count = 99 + 1;
    params.colors = by_row.data();
    backend_->sh().EvalSh(*uploaded_, params);
    params.slots = device_slots_.data();
    params.sh = compact.data();
    params.colors = by_slot.data();
    backend_->sh().EvalSh(*uploaded_, params);
    ASSERT_EQ(rows_.size(), 100u);
    const auto a = whole.Read(), b = by_row.Read(), c = by_slot.Read();
    int clamped = 0;
    for (size_t g = 0; g < 300; ++g) {
      const auto expected = Expected(model_.sh, g, int(g));
      for (size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(a[3 * g + i], expected[i], 3e-6);  // 16 products of order 1
        clamped += a[3 * g + i] == 0;
      }
    }
    EXPECT_GT(clamped, degree > 1 ? 0 : -1);
    for (size_t r = 0; r < 100; ++r) {
      for (size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(b[3 * r + i], a[size_t(rows_[r]) * 3 + i]);
        const double expected =
            slots_[r] < 0 ? 0 : Expected(compact_, size_t(slots_[r]), rows_[r])[i];
        EXPECT_NEAR(c[3 * r + i], expected, 3e-6);
      }
    }
  }
}

// <EvalSh'(sh) d, g> = <d, EvalSh^T g>, with the gate of clamped colors; EvalSh' d = sum_k Y_k d_k
// in double precision.
TEST_P(ShOp, TransposeIsAdjoint) {
  for (int degree = 0; degree <= 3; ++degree) {
    Make(degree);
    for (const bool gate : {false, true}) {
      auto colors = UniformVector(rng_, 300, 0, 1);
      for (size_t i = 0; i < colors.size(); i += 5) colors[i] = 0;
      const auto g = UniformVector(rng_, 300, -1, 1);
      const auto start = UniformVector(rng_, 100 * k3_, -1, 1);
      Guarded<float> in_colors(*backend_, colors), in_g(*backend_, g);
      Guarded<float> gradient(*backend_, start);
      EvalShTransposeParams transpose = WithCenter(EvalShTransposeParams{});
      transpose.rows = device_rows_.data();
      transpose.slots = device_slots_.data();
      transpose.count = 100;
      transpose.color_gradients = in_g.data();
      transpose.colors = gate ? in_colors.data() : nullptr;
      transpose.gradient = gradient.data();
      backend_->sh().EvalShTranspose(*uploaded_, transpose);

      const auto out = gradient.Read();
      double left = 0, right = 0, size = 0;
      for (size_t i = 0; i < out.size(); ++i) {
        right += (double(out[i]) - double(start[i])) * double(compact_[i]);
        size += std::fabs((double(out[i]) - double(start[i])) * double(compact_[i]));
      }
      for (size_t r = 0; r < 100; ++r) {
        if (slots_[r] < 0) continue;
        const std::vector<double> basis = Basis(rows_[r]);
        const float* const d = &compact_[size_t(slots_[r]) * k3_];
        for (size_t at = 0; at < k3_; ++at) {
          if (gate && colors[3 * r + at % 3] == 0) continue;
          left += basis[at / 3] * double(d[at]) * double(g[3 * r + at % 3]);
        }
      }
      // Sums of some thousand products, each rounded to single precision.
      EXPECT_NEAR(left, right, 1e-5 * size);
      ASSERT_GT(size, 1);
      // Blocks that no entry names keep their bits.
      for (size_t r = 0; r < 100; ++r) {
        if (slots_[r] >= 0) continue;
        const size_t slot = 99 - r;
        for (size_t i = slot * k3_; i < (slot + 1) * k3_; ++i) EXPECT_EQ(out[i], start[i]);
      }
    }
  }
}

// y y^T in packed form, against the basis itself.
TEST_P(ShOp, AccumulatesBlocks) {
  for (int degree = 0; degree <= 3; ++degree) {
    Make(degree);
    const size_t k = size_t(model_.num_coeffs()), packed = k * (k + 1) / 2;
    const auto weights = UniformVector(rng_, 100, 0, 50);
    const auto start = UniformVector(rng_, 100 * packed, -1, 1);
    Guarded<float> in(*backend_, weights), blocks(*backend_, start);
    AccumulateBlocksParams params = WithCenter(AccumulateBlocksParams{});
    params.rows = device_rows_.data();
    params.slots = device_slots_.data();
    params.count = 100;
    params.weights = in.data();
    params.blocks = blocks.data();
    backend_->sh().AccumulateBlocks(*uploaded_, params);
    const auto out = blocks.Read();
    for (size_t r = 0; r < 100; ++r) {
      const std::vector<double> basis = Basis(rows_[r]);
      const size_t slot = 99 - r;
      size_t at = slot * packed;
      for (size_t a = 0; a < k; ++a) {
        for (size_t b = 0; b <= a; ++b, ++at) {
          const double added = slots_[r] < 0 ? 0 : double(weights[r]) * basis[a] * basis[b];
          EXPECT_NEAR(out[at], double(start[at]) + added, 2e-5);
        }
      }
    }
  }
}

// Shares of five Gaussians, of which two stay as they are.
const std::vector<float> kShares = {1, 0.25f, 0.5f, 0, 0.7f};
constexpr double kThreshold = 0.25;

TEST_P(ShOp, EditsAffinely) {
  for (const int k : {1, 4, 9, 16}) {
    const size_t block = 3 * size_t(k);
    auto sh = UniformVector(rng_, 5 * block, -0.6f, 0.8f);
    Guarded<float> edited(*backend_, sh), shares(*backend_, kShares);
    EditShParams params{edited.data(), shares.data(), kThreshold, 5, k, {}};
    backend_->sh().EditSh(params);  // the identity
    EXPECT_EQ(edited.Read(), sh);
    params.map = {{-0.5f, 0.2f, 0, 0, 0.3f, -0.1f, 0.4f, 0, 0.1f}, {0.1f, -0.2f, 0}};
    backend_->sh().EditSh(params);
    const auto out = edited.Read();
    for (size_t g = 0; g < 5; ++g) {
      // Colors in some direction, before and after.
      const auto d = RandomDirection(rng_);
      const auto basis = ReferenceShBasis(3, d[0], d[1], d[2]);
      double old[3], found[3];
      for (size_t c = 0; c < 3; ++c) {
        old[c] = found[c] = 0.5;
        for (size_t j = 0; j < size_t(k); ++j) {
          old[c] += basis[j] * double(sh[g * block + 3 * j + c]);
          found[c] += basis[j] * double(out[g * block + 3 * j + c]);
        }
      }
      const double share = kShares[g] > kThreshold ? double(kShares[g]) : 0;
      for (size_t c = 0; c < 3; ++c) {
        double change = double(params.map.offset[c]);
        for (size_t e = 0; e < 3; ++e) change += double(params.map.delta[3 * c + e]) * old[e];
        EXPECT_NEAR(found[c], old[c] + share * change, 2e-6) << k << " " << g;
      }
      for (size_t j = 0; share == 0 && j < block; ++j) {
        EXPECT_EQ(out[g * block + j], sh[g * block + j]);
      }
    }
  }
}

TEST_P(ShOp, EditsColorsAround) {
  ColorProgram program{};
  program.count = 1;
  program.strength = 0.9f;
  program.ops[0] = {ColorOpCode::kPower, 1, {0.6f}, 0, 0};
  const auto resident = backend_->Upload(std::span<const ColorProgram>(&program, 1));
  for (const int k : {1, 4, 9, 16}) {
    const size_t block = 3 * size_t(k), directions = k == 1 ? 1 : 4 * size_t(k);
    const auto sh = UniformVector(rng_, 5 * block, -0.6f, 0.8f);
    const auto b = UniformVector(rng_, directions * size_t(k), -0.7f, 0.7f);
    const auto f = UniformVector(rng_, directions * size_t(k), -0.1f, 0.1f);
    Guarded<float> edited(*backend_, sh), shares(*backend_, kShares);
    Guarded<float> basis(*backend_, b), fit(*backend_, f);
    EditShParams params{edited.data(), shares.data(), kThreshold, 5, k, {}};
    params.map.program = resident.data();
    params.basis = basis.data();
    params.fit = fit.data();
    params.directions = int32_t(directions);
    backend_->sh().EditSh(params);
    const auto out = edited.Read();
    int clamped = 0;
    for (size_t g = 0; g < 5; ++g) {
      const double share = kShares[g] > kThreshold ? double(kShares[g]) : 0;
      std::vector<double> expected(block);
      for (size_t j = 0; j < block; ++j) expected[j] = double(sh[g * block + j]);
      for (size_t i = 0; i < 3 * directions; ++i) {
        const size_t d = i / 3, c = i % 3;
        double color = 0.5;
        for (size_t j = 0; j < size_t(k); ++j) {
          color += double(b[d * size_t(k) + j]) * double(sh[g * block + 3 * j + c]);
        }
        const double shown = std::max(color, 0.0);
        double change = share * 0.9 * (std::pow(shown, 0.6) - shown);
        if (change > 0) change += share * (shown - color);
        clamped += color < 0;
        for (size_t j = 0; j < size_t(k); ++j) {
          expected[3 * j + c] += double(f[j * directions + d]) * change;
        }
      }
      for (size_t j = 0; j < block; ++j) {
        if (share > 0) {
          EXPECT_NEAR(out[g * block + j], expected[j], 5e-6) << k << " " << g;
        } else {
          EXPECT_EQ(out[g * block + j], sh[g * block + j]);
        }
      }
    }
    if (k == 16) {
      EXPECT_GT(clamped, 0);
    }
  }
}

TEST_P(ShOp, RefusesEditsThatCannotBe) {
  const ColorProgram program{};
  EditShParams params{nullptr, nullptr, 0, 0, 5, {}};
  EXPECT_THROW(backend_->sh().EditSh(params), std::invalid_argument);
  params.k = 4;
  params.count = -1;
  EXPECT_THROW(backend_->sh().EditSh(params), std::invalid_argument);
  params.count = 0;
  backend_->sh().EditSh(params);
  params.map.program = &program;
  EXPECT_THROW(backend_->sh().EditSh(params), std::invalid_argument);
}

RETINT_INSTANTIATE(ShOp);

}  // namespace
}  // namespace retint
