// SPDX-License-Identifier: BSD-3-Clause
// The mask projection's steps against their formulas.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <Eigen/Core>

#include "tests/kernels/test_scene.h"

namespace retint {
namespace {

constexpr int kWidth = 75, kHeight = 50;
constexpr size_t kPixels = size_t(kWidth) * size_t(kHeight);
constexpr uint16_t kSomeRows = 0b1001'0101'0110'0001;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

bool IsWanted(uint16_t rows, int y) { return rows >> (y % kTileSize) & 1; }

// Rows that are not wanted as the wanted one above.
std::vector<float> Repeated(std::vector<float> image, uint16_t rows) {
  for (int y = 0; y < kHeight; ++y) {
    if (IsWanted(rows, y)) continue;
    std::copy_n(image.begin() + (y - 1) * kWidth, kWidth, image.begin() + y * kWidth);
  }
  return image;
}

// Garbage that a backend may leave in unwanted rows.
std::vector<float> Spoiled(std::vector<float> image, uint16_t rows) {
  for (int y = 0; y < kHeight; ++y) {
    if (!IsWanted(rows, y)) std::fill_n(image.begin() + y * kWidth, kWidth, kNan);
  }
  return image;
}

Eigen::Vector3d Vector(const float* xyz) {
  return Eigen::Map<const Eigen::Vector3f>(xyz).cast<double>();
}

Eigen::Vector3d InCamera(const CameraParams& camera, const Eigen::Vector3d& point) {
  const Eigen::Matrix3d rotation =
      Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(camera.rotation).cast<double>();
  return rotation * point + Vector(camera.translation);
}

Eigen::Vector2d InImage(const CameraParams& camera, const Eigen::Vector3d& x) {
  return {double(camera.fx) * x.x() / x.z() + double(camera.cx),
          double(camera.fy) * x.y() / x.z() + double(camera.cy)};
}

Eigen::Vector3d Ray(const CameraParams& camera, int x, int y) {
  return {(x + 0.5 - double(camera.cx)) / double(camera.fx),
          (y + 0.5 - double(camera.cy)) / double(camera.fy), 1};
}

class MaskProjectionOp : public BackendTest {
 protected:
  // A slanted plane, exact for interpolation in 1/z.
  static double Plane(double x, double y) { return 1 / (0.2 + 0.001 * x - 0.0007 * y); }
  static std::vector<float> PlaneDepth() {
    std::vector<float> depth;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) depth.push_back(float(Plane(x + 0.5, y + 0.5)));
    }
    return depth;
  }
  std::vector<double> Sample(const std::vector<float>& depth, const std::vector<double>& pixels,
                             uint16_t rows = kAllPixelRows) {
    Guarded<float> map(*backend_, depth);
    Guarded<double> at(*backend_, pixels), samples(*backend_, pixels.size() / 2);
    backend_->mask().SampleDepth({map.data(), kWidth, kHeight, at.data(),
                                  int64_t(pixels.size() / 2), 0.03, samples.data(), rows});
    return samples.Read();
  }
  // Points in front of, beside and behind TestCamera; some far larger than a pixel.
  std::vector<CloudPoint> RandomCloud(size_t count) {
    std::vector<CloudPoint> points(count);
    for (CloudPoint& point : points) {
      point = {};
      for (int i = 0; i < 3; ++i) {
        point.position[i] = Uniform(rng_, -3, 3);
        point.normal[i] = Uniform(rng_, -1, 1);
      }
      point.position[2] += 4;
      Eigen::Map<Eigen::Vector3f>(point.normal).normalize();
      if (rng_() % 8 == 0) std::fill_n(point.normal, 3, 0.0f);
      point.footprint = std::exp(Uniform(rng_, -5, -1.5f));
      point.coverage = Uniform(rng_, 0.1f, 1);
    }
    return points;
  }
  std::vector<float> Draw(const CameraParams& camera, const std::vector<CloudPoint>& points,
                          const std::vector<float>& depth, float square, float scale,
                          uint16_t rows = kAllPixelRows) {
    Guarded<CloudPoint> cloud(*backend_, points);
    Guarded<float> front(*backend_, depth), coverage(*backend_, kPixels);
    backend_->mask().DrawCloud({camera, cloud.data(), int64_t(points.size()), square, scale,
                                front.data(), 0.02f, coverage.data(), rows});
    return coverage.Read();
  }
  std::vector<uint8_t> MakeMask(const std::vector<float>& image, int width, int height,
                                double scale, double offset, int radius) {
    Guarded<float> from(*backend_, image);
    Guarded<uint8_t> mask(*backend_, image.size());
    backend_->mask().MakeMask({from.data(), width, height, scale, offset, radius, mask.data()});
    return mask.Read();
  }
};

// A point's coverage of a pixel, as in mask_ops.h; `hidden_by` is the depth there.
double CoverageOf(const CameraParams& camera, const CloudPoint& point, float square, float scale,
                  int x, int y, double hidden_by) {
  const double limit = hidden_by > 0 ? hidden_by * (1 + double(0.02f)) : INFINITY;
  const Eigen::Vector3d center = InCamera(camera, Vector(point.position));
  if (center.z() <= 0) return 0;
  if (square > 0) {
    const Eigen::Vector2d away = InImage(camera, center) - Eigen::Vector2d(x + 0.5, y + 0.5);
    const bool covers = away.cwiseAbs().maxCoeff() <= double(square) / 2;
    return covers && center.z() <= limit ? double(point.coverage) : 0;
  }
  const double footprint = double(point.footprint), radius = double(scale) * footprint;
  if (center.z() <= radius + footprint / 2) return 0;
  Eigen::Vector3d normal = -center;
  if (!Vector(point.normal).isZero()) {
    CameraParams turn = camera;
    std::fill_n(turn.translation, 3, 0.0f);
    normal = InCamera(turn, Vector(point.normal));
  }
  const Eigen::Vector3d ray = Ray(camera, x, y);
  const double z = normal.dot(center) / normal.dot(ray);
  const double fade = (radius - (z * ray - center).norm()) / footprint + 0.5;
  return fade > 0 && z <= limit ? double(point.coverage) * std::min(1.0, fade) : 0;
}

TEST_P(MaskProjectionOp, SamplesDepthBetweenPixels) {
  std::vector<double> pixels;
  for (int i = 0; i < 500; ++i) {
    pixels.push_back(double(Uniform(rng_, 0.5f, kWidth - 0.5f)));
    pixels.push_back(double(Uniform(rng_, 0.5f, kHeight - 0.5f)));
  }
  const auto samples = Sample(PlaneDepth(), pixels);
  for (size_t i = 0; i < samples.size(); ++i) {
    EXPECT_NEAR(samples[i], Plane(pixels[2 * i], pixels[2 * i + 1]), 1e-6 * samples[i]);
  }
}

TEST_P(MaskProjectionOp, SamplesNothingWhereDepthIsNotKnown) {
  auto depth = PlaneDepth();
  depth[10 * kWidth + 20] = 0;
  depth[10 * kWidth + 30] = INFINITY;
  depth[10 * kWidth + 40] *= 1.05f;  // an edge
  depth[10 * kWidth + 50] *= 1.02f;  // none
  const auto samples = Sample(depth, {-0.1, 5,    5,    -0.1, kWidth, 5,    5,    kHeight, NAN, 5,
                                      20.9, 10.6, 30.2, 10.1, 40.5,   10.9, 50.5, 10.9,    0,   0});
  for (size_t i = 0; i < 8; ++i) EXPECT_EQ(samples[i], 0) << i;
  EXPECT_GT(samples[8], 0);
  EXPECT_NEAR(samples[9], Plane(0.5, 0.5), 1e-6);  // the border's pixels reach to the edge
}

TEST_P(MaskProjectionOp, DepthOfUnwantedRowsIsThatOfTheRowAbove) {
  const auto depth = Spoiled(PlaneDepth(), kSomeRows), repeated = Repeated(depth, kSomeRows);
  std::vector<double> pixels;
  for (int i = 0; i < 500; ++i) {
    pixels.push_back(double(Uniform(rng_, 0, kWidth)));
    pixels.push_back(double(Uniform(rng_, 0, kHeight)));
  }
  const auto expected = Sample(repeated, pixels);
  EXPECT_EQ(Sample(depth, pixels, kSomeRows), expected);
  EXPECT_EQ(std::count(expected.begin(), expected.end(), 0.0), 0);

  const float a = 0.9f, b = 0.01f;
  Guarded<float> corrected(*backend_, depth);
  backend_->mask().CorrectDepth({corrected.data(), kWidth, kHeight, a, b, kSomeRows});
  std::vector<double> wanted;
  for (const float z : repeated) wanted.push_back(1 / (double(a) / double(z) + double(b)));
  EXPECT_LE(WorstDifference(Repeated(corrected.Read(), kSomeRows), wanted), 1e-5);

  EXPECT_THROW(Sample(depth, pixels, 0xfffe), std::invalid_argument);
  EXPECT_THROW(backend_->mask().CorrectDepth({corrected.data(), kWidth, kHeight, a, b, 0xfffe}),
               std::invalid_argument);
}

TEST_P(MaskProjectionOp, CorrectionsDropWhatTheyPushToInfinity) {
  auto depth = PlaneDepth();
  depth[7] = 0;
  depth[8] = 100;
  Guarded<float> corrected(*backend_, depth);
  backend_->mask().CorrectDepth({corrected.data(), kWidth, kHeight, 1, -0.01f});
  const auto out = corrected.Read();
  for (size_t p = 0; p < kPixels; ++p) {
    const double z = double(depth[p]), expected = p == 7 || p == 8 ? 0 : z / (1 - 0.01 * z);
    EXPECT_NEAR(out[p], expected, 1e-5 * expected);
  }
}

TEST_P(MaskProjectionOp, DepthIsGatedByOpacity) {
  const auto model = backend_->blend().UploadModel(RandomModel(rng_, 300).arrays());
  const auto view = backend_->blend().PrepareView(*model, TestCamera(kWidth, kHeight));
  Guarded<float> plain(*backend_, kPixels), gated(*backend_, kPixels), alpha(*backend_, kPixels);
  DepthParams depth{};
  depth.expected = plain.data();
  depth.alpha = alpha.data();
  backend_->blend().Depth(*view, depth);
  depth.expected = gated.data();
  depth.min_alpha = 0.5f;
  backend_->blend().Depth(*view, depth);
  const auto all = plain.Read(), some = gated.Read(), opaque = alpha.Read();
  int dropped = 0, kept = 0;
  for (size_t p = 0; p < kPixels; ++p) {
    EXPECT_EQ(some[p], opaque[p] >= 0.5f ? all[p] : 0);
    ++(opaque[p] >= 0.5f ? kept : dropped);
  }
  EXPECT_GT(dropped, 10);
  EXPECT_GT(kept, 10);
}

TEST_P(MaskProjectionOp, DrawsDiscsAndSquares) {
  const CameraParams camera = TestCamera(kWidth, kHeight);
  const auto points = RandomCloud(400);
  auto depth = UniformVector(rng_, kPixels, 1, 8);
  for (size_t p = 0; p < kPixels; p += 3) depth[p] = 0;
  const auto expect = [&](float square, float scale) {
    std::vector<double> expected(kPixels, 0.0);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const size_t p = size_t(y) * kWidth + size_t(x);
        for (const auto& point : points) {
          expected[p] = std::max(expected[p],
                                 CoverageOf(camera, point, square, scale, x, y, double(depth[p])));
        }
      }
    }
    EXPECT_GT(std::count_if(expected.begin(), expected.end(), [](double c) { return c > 0; }), 500);
    EXPECT_LE(WorstDifference(Draw(camera, points, depth, square, scale), expected), 2e-3);
  };
  expect(0, 1.5f);
  expect(3, 0);
  expect(4.3f, 1);
}

TEST_P(MaskProjectionOp, DrawsInWantedRowsAlone) {
  const CameraParams camera = TestCamera(kWidth, kHeight);
  const auto points = RandomCloud(400);
  const auto depth = PlaneDepth();
  const auto some = Draw(camera, points, Spoiled(depth, kSomeRows), 0, 1.5f, kSomeRows);
  auto expected = Draw(camera, points, depth, 0, 1.5f);
  for (size_t p = 0; p < kPixels; ++p) {
    if (!(kSomeRows >> (p / kWidth % 16) & 1)) expected[p] = 0;
  }
  EXPECT_EQ(some, expected);
  EXPECT_THROW(Draw(camera, points, depth, 0, 1.5f, 0xfffe), std::invalid_argument);
}

TEST_P(MaskProjectionOp, DrawsNothingOfAnEmptyCloud) {
  EXPECT_EQ(Draw(TestCamera(kWidth, kHeight), {}, PlaneDepth(), 0, 1.5f),
            std::vector<float>(kPixels, 0.0f));
}

TEST_P(MaskProjectionOp, MakesMasks) {
  const auto image = UniformVector(rng_, kPixels, -0.2f, 1.2f);
  const auto mask = MakeMask(image, kWidth, kHeight, 2, -0.5, 0);
  for (size_t p = 0; p < kPixels; ++p) {
    EXPECT_EQ(mask[p], std::lround(std::clamp(2 * double(image[p]) - 0.5, 0.0, 1.0) * 255));
  }
}

TEST_P(MaskProjectionOp, ClosesMasksWithADisc) {
  // The largest (or smallest) value over the disc, pixel by pixel.
  const auto over_disc = [](const std::vector<uint8_t>& in, int width, int height, int radius,
                            bool largest) {
    std::vector<uint8_t> out;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        int value = largest ? 0 : 255;
        for (int v = std::max(0, y - radius); v <= std::min(height - 1, y + radius); ++v) {
          const long reach = std::lround(std::sqrt(radius * radius - (v - y) * (v - y)));
          for (int u = 0; u < width; ++u) {
            if (std::abs(u - x) > reach) continue;
            const int pixel = in[size_t(v * width + u)];
            value = largest ? std::max(value, pixel) : std::min(value, pixel);
          }
        }
        out.push_back(uint8_t(value));
      }
    }
    return out;
  };
  for (const auto& [width, height] : {std::pair(1, 1), {33, 47}, {3, 80}}) {
    std::vector<float> image(size_t(width * height), 0.0f);
    for (float& value : image) {
      if (rng_() % 10 == 0) value = Uniform(rng_, 0, 1);
    }
    for (auto row = image.begin(); image.end() - row > 20 * width; row += 25 * width) {
      std::fill_n(row, 12 * width, 0.0f);  // rows without any
    }
    const auto mask = MakeMask(image, width, height, 1, 0, 0);
    for (const int radius : {1, 2, 5, 60}) {
      const auto closed =
          over_disc(over_disc(mask, width, height, radius, true), width, height, radius, false);
      EXPECT_EQ(MakeMask(image, width, height, 1, 0, radius), closed) << radius;
    }
  }
}

TEST_P(MaskProjectionOp, DropsWhatIsFaintFarFromWhatIsFirm) {
  for (const auto& [width, height] : {std::pair(1, 1), {33, 47}, {3, 80}, {150, 40}}) {
    std::vector<uint8_t> mask(size_t(width * height), 0);
    for (uint8_t& value : mask) {
      const auto draw = rng_() % 100;
      if (draw < 2) value = uint8_t(128 + rng_() % 128);
      if (draw >= 90) value = uint8_t(rng_() % 128);
    }
    for (const int reach : {0, 1, 4, 200}) {
      std::vector<uint8_t> expected = mask;
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          bool near = false;
          for (int v = std::max(0, y - reach); v <= std::min(height - 1, y + reach); ++v) {
            for (int u = std::max(0, x - reach); u <= std::min(width - 1, x + reach); ++u) {
              near = near || mask[size_t(v * width + u)] >= 128;
            }
          }
          if (!near) expected[size_t(y * width + x)] = 0;
        }
      }
      Guarded<uint8_t> dropped(*backend_, mask);
      backend_->mask().DropFaint({dropped.data(), width, height, reach});
      EXPECT_EQ(dropped.Read(), expected) << width << " " << reach;
    }
  }
  Guarded<uint8_t> one(*backend_, 1);
  EXPECT_THROW(backend_->mask().DropFaint({one.data(), 1, 1, -1}), std::invalid_argument);
}

TEST_P(MaskProjectionOp, LooksPaintUp) {
  // Two painted views, beside the one looked up from, that see the same plane and a step on it.
  CameraParams camera = TestCamera(kWidth, kHeight), posed[2];
  const auto depth = UniformVector(rng_, kPixels, 3.9f, 4.1f);
  std::vector<std::vector<float>> seen;
  std::vector<std::vector<uint8_t>> paint(2);
  for (int i = 0; i < 2; ++i) {
    posed[i] = camera;
    const float turn = 0.02f * float(i + 1);
    const float rotation[9] = {std::cos(turn),  0, std::sin(turn), 0, 1, 0,
                               -std::sin(turn), 0, std::cos(turn)};
    std::copy_n(rotation, 9, posed[i].rotation);
    posed[i].translation[0] = i ? 0.3f : -0.2f;
    posed[i].translation[1] = 0.1f;
    posed[i].translation[2] = 0.05f;
    seen.push_back(UniformVector(rng_, kPixels, 3.8f, 4.2f));
    for (size_t p = 0; p < kPixels; p += 7) seen.back()[p] = 0;
    for (size_t p = 0; p < kPixels; ++p) paint[size_t(i)].push_back(uint8_t(rng_()));
  }
  auto holes = depth;
  for (size_t p = 0; p < kPixels; p += 11) holes[p] = p % 2 ? 0 : INFINITY;
  std::vector<uint8_t> coverage(kPixels, 0);
  for (size_t p = 0; p < kPixels; p += 5) coverage[p] = uint8_t(rng_());

  const float tolerance = 0.03f, unknown = 0.2f, scale = 1.5f;
  std::array<int, 3> counts{};
  const auto expect = [&](bool with_depth, bool with_coverage, uint16_t rows) {
    std::vector<double> expected;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const size_t p = size_t(y) * kWidth + size_t(x);
        double sum = 0, inside = 0, weight = double(unknown);
        int count = 0;
        const double z = with_depth ? double(holes[p]) : 0;
        for (size_t i = 0; z > 0 && z < INFINITY && i < 2; ++i) {
          const Eigen::Vector3d moved = InCamera(posed[i], z * Ray(camera, x, y));
          const Eigen::Vector2d at = InImage(posed[i], moved);
          if (at.minCoeff() < 0 || at.x() >= kWidth || at.y() >= kHeight) continue;
          const size_t there = size_t(at.y()) * kWidth + size_t(at.x());
          const double front = double(seen[i][there]);
          if (front == 0 || std::abs(moved.z() - front) > double(tolerance) * front) continue;
          sum += paint[i][there];
          ++count;
        }
        ++counts[size_t(count)];
        if (count > 0) {
          inside = sum / (255.0 * count), weight = 1;
        } else if (with_coverage) {
          inside = coverage[p] / 255.0;
          weight = std::max(weight, coverage[p] / 255.0);
        }
        if (!IsWanted(rows, y)) weight = 0;
        expected.push_back(double(scale) * weight * inside);
        expected.push_back(double(scale) * weight);
      }
    }
    Guarded<float> surface(*backend_, Spoiled(holes, rows)), residual(*backend_, 2 * kPixels);
    Guarded<float> seen0(*backend_, seen[0]), seen1(*backend_, seen[1]);
    Guarded<uint8_t> paint0(*backend_, paint[0]), paint1(*backend_, paint[1]);
    Guarded<uint8_t> covered(*backend_, coverage);
    const PaintedImage painted[] = {{posed[0], seen0.data(), paint0.data()},
                                    {posed[1], seen1.data(), paint1.data()}};
    backend_->mask().Evidence({camera, with_depth ? surface.data() : nullptr, painted, tolerance,
                               unknown, with_coverage ? covered.data() : nullptr, scale,
                               residual.data(), rows});
    const auto found = residual.Read();
    // Rounding may take a pixel over an edge or the tolerance.
    int wrong = 0;
    for (size_t i = 0; i < found.size(); ++i) {
      wrong += !(std::abs(double(found[i]) - expected[i]) <= 1e-5);
    }
    EXPECT_LE(wrong, 4);
    // Visibility, known and whole, leaves the first two channels as they are.
    const float visible = 2.5f;
    Guarded<float> with_visible(*backend_, 4 * kPixels);
    backend_->mask().Evidence({camera, with_depth ? surface.data() : nullptr, painted, tolerance,
                               unknown, with_coverage ? covered.data() : nullptr, scale,
                               with_visible.data(), rows, visible});
    const auto four = with_visible.Read();
    for (size_t p = 0; p < kPixels; ++p) {
      EXPECT_EQ(four[4 * p], found[2 * p]);
      EXPECT_EQ(four[4 * p + 1], found[2 * p + 1]);
      EXPECT_NEAR(four[4 * p + 2], visible / scale * found[2 * p + 1], 1e-5f);
      EXPECT_EQ(four[4 * p + 3], IsWanted(rows, int(p / kWidth)) ? visible : 0);
    }
  };
  expect(true, true, kAllPixelRows);
  for (const int count : counts) EXPECT_GT(count, 100);  // seen by none, one, both
  expect(true, false, kSomeRows);
  expect(false, true, kAllPixelRows);
  expect(false, false, kSomeRows);
}

TEST_P(MaskProjectionOp, MarksTheOutsideOfSilhouettes) {
  // A disc at depth 2 before a wall at 4 that bends to 2.005 at the right, with holes.
  std::vector<uint8_t> mask(kPixels, 0);
  std::vector<float> depth(kPixels, 4);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const size_t p = size_t(y) * kWidth + size_t(x);
      if (x > kWidth / 2) depth[p] = 2.005f;
      if (std::hypot(x - kWidth / 2, y - kHeight / 2) < kHeight / 3.0) {
        mask[p] = 128;
        depth[p] = 2;
      }
      if (p % 13 == 0) depth[p] = 0;
    }
  }
  mask[0] = 255;  // in the corner, with no depth
  std::vector<float> expected = depth;
  int marked = 0, plain = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const size_t p = size_t(y) * kWidth + size_t(x);
      bool beside = false, touches = false;
      for (int k = 0; k < 9; ++k) {
        const int i = x + k % 3 - 1, j = y + k / 3 - 1;
        if (mask[p] >= 128 || i < 0 || j < 0 || i >= kWidth || j >= kHeight) continue;
        const size_t q = size_t(j) * kWidth + size_t(i);
        if (mask[q] < 128 || depth[q] == 0) continue;
        touches = true;
        beside |= depth[p] == 0 || depth[p] > depth[q] * 1.005f;
      }
      if (beside) expected[p] = kNoEvidence;
      marked += beside;
      plain += touches && !beside;
    }
  }
  EXPECT_GT(marked, 10);
  EXPECT_GT(plain, 10);
  Guarded<uint8_t> paint(*backend_, mask);
  Guarded<float> surface(*backend_, depth);
  backend_->mask().MarkSilhouette({paint.data(), kWidth, kHeight, 0.005f, surface.data()});
  EXPECT_EQ(surface.Read(), expected);

  // A marked pixel says nothing, covered or not.
  Guarded<float> residual(*backend_, 2 * kPixels);
  EvidenceParams evidence{};
  evidence.camera = TestCamera(kWidth, kHeight);
  evidence.depth = surface.data();
  evidence.unknown_weight = 1;
  evidence.coverage = paint.data();
  evidence.scale = 8;
  evidence.residual = residual.data();
  backend_->mask().Evidence(evidence);
  const auto found = residual.Read();
  for (size_t p = 0; p < kPixels; ++p) {
    EXPECT_EQ(found[2 * p + 1], expected[p] == kNoEvidence ? 0 : 8) << p;
  }
}

TEST_P(MaskProjectionOp, MovesValuesBetweenGaussiansAndRows) {
  const auto model = backend_->blend().UploadModel(RandomModel(rng_, 500).arrays());
  const auto view = backend_->blend().PrepareView(*model, TestCamera(kWidth, kHeight));
  const auto gaussians = RowsOf(*backend_, *view);
  ASSERT_GT(gaussians.size(), 50u);
  ASSERT_LT(gaussians.size(), 500u);
  for (const size_t channels : {size_t{1}, size_t{2}, size_t{3}}) {
    const auto of = UniformVector(rng_, 500 * channels, -1, 1);
    const auto added = UniformVector(rng_, gaussians.size() * channels, -1, 1);
    Guarded<float> from(*backend_, of), values(*backend_, gaussians.size() * channels);
    backend_->blend().GatherRows(*view, from.data(), int32_t(channels), values.data());
    const auto gathered = values.Read();
    Guarded<float> more(*backend_, added), sums(*backend_, of);
    backend_->blend().AddRows(*view, more.data(), int32_t(channels), sums.data());
    auto expected = of;
    for (size_t r = 0; r < gaussians.size(); ++r) {
      for (size_t c = 0; c < channels; ++c) {
        const size_t at = size_t(gaussians[r]) * channels + c;
        EXPECT_EQ(gathered[r * channels + c], of[at]);
        expected[at] += added[r * channels + c];
      }
    }
    EXPECT_EQ(sums.Read(), expected);
  }
}

TEST_P(MaskProjectionOp, AddsTheSquareOfTheLastChannel) {
  const auto model = backend_->blend().UploadModel(RandomModel(rng_, 500).arrays());
  const auto view = backend_->blend().PrepareView(*model, TestCamera(kWidth, kHeight));
  const auto gaussians = RowsOf(*backend_, *view);
  ASSERT_GT(gaussians.size(), 50u);
  const auto before = UniformVector(rng_, 500 * 3, -1, 1);
  const auto added = UniformVector(rng_, gaussians.size() * 2, -1, 1);
  Guarded<float> values(*backend_, added), sums(*backend_, before);
  backend_->blend().AddRows(*view, values.data(), 2, sums.data(), /*and_square=*/true);
  auto expected = before;
  for (size_t r = 0; r < gaussians.size(); ++r) {
    float* const sum = &expected[3 * size_t(gaussians[r])];
    const float first = added[2 * r], last = added[2 * r + 1];
    sum[0] += first, sum[1] += last, sum[2] += last * last;
  }
  const auto found = sums.Read();
  for (size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-6f) << i;
}

RETINT_INSTANTIATE(MaskProjectionOp);

}  // namespace
}  // namespace retint
