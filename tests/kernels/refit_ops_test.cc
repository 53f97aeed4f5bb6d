// SPDX-License-Identifier: BSD-3-Clause
// The refit's image and region steps against their formulas.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tests/kernels/test_scene.h"

namespace retint {
namespace {

constexpr int kWidth = 75, kHeight = 50;
constexpr size_t kValues = size_t(kWidth * kHeight) * 3;
constexpr float kUnit = 1.0f / 8192;

class RefitOp : public BackendTest {
 protected:
  void SetUp() override {
    BackendTest::SetUp();
    if (IsSkipped()) return;
    const TestModel model = RandomModel(rng_, 60);
    uploaded_ = backend_->blend().UploadModel(model.arrays());
    const auto view = backend_->blend().PrepareView(*uploaded_, TestCamera(kWidth, kHeight));
    std::vector<uint8_t> active(60, 0);
    for (size_t g = 0; g < 60; g += 10) active[g] = 1;
    const auto flags = backend_->Upload(std::span<const uint8_t>(active));
    region_ = backend_->blend().Restrict(*view, flags.data(), 1 << 20);
    thin_ = backend_->blend().Restrict(*view, flags.data(), 1 << 20, 1e-3f);
    for (size_t bytes = thin_->bytes(); bytes > 0 && thin_->num_pixel_rows() == kTileSize;
         bytes = bytes * 3 / 4) {
      thin_ = backend_->blend().Restrict(*view, flags.data(), bytes, 1e-3f);
    }
    lists_ = backend_->blend().Restrict(*view, flags.data(), 0);
    image_ = UniformVector(rng_, kValues, 0, 1.5f);
    other_ = UniformVector(rng_, kValues, 0, 1);
    for (size_t p = 0; p < kValues / 3; ++p) mask_.push_back(p % 4 ? uint8_t(rng_()) : uint8_t{0});
    for (float& d : map_.delta) d = Uniform(rng_, -1, 1);
    for (float& o : map_.offset) o = Uniform(rng_, -0.2f, 0.2f);
  }
  double Edited(const std::vector<float>& image, size_t pixel, size_t c) const {
    double value = double(map_.offset[c]);
    for (size_t j = 0; j < 3; ++j) {
      value += double(map_.delta[3 * c + j]) * double(image[3 * pixel + j]);
    }
    return double(image[3 * pixel + c]) + double(mask_[pixel]) / 255 * value;
  }
  // body(position among the region's pixels, pixel of the image or -1 beyond it).
  template <typename Body>
  void ForTilePixels(const Body& body) const {
    size_t position = 0;
    for (const int32_t tile : region_->tiles()) {
      for (int p = 0; p < kTileSize * kTileSize; ++p) {
        if (!(region_->pixel_rows() >> (p / kTileSize) & 1)) continue;
        const int x = tile % region_->tiles_x() * kTileSize + p % kTileSize;
        const int y = tile / region_->tiles_x() * kTileSize + p / kTileSize;
        body(position++, x < kWidth && y < kHeight ? y * kWidth + x : -1);
      }
    }
  }
  size_t TileValues() const { return NumRegionPixels(*region_) * 3; }

  // The weights that RegionTarget and RegionWeightImage give: m + (1 - m) outside.
  void ExpectWeights(float outside) {
    Guarded<float> render(*backend_, image_), weight_image(*backend_, kValues / 3);
    Guarded<uint8_t> mask(*backend_, mask_), weights(*backend_, TileValues() / 3);
    Guarded<int16_t> target(*backend_, TileValues());
    RegionTargetParams params{render.data(), nullptr, mask.data(), map_, kUnit, target.data()};
    params.weights = weights.data();
    params.outside_weight = outside;
    backend_->refit().RegionTarget(*region_, params);
    backend_->refit().RegionWeightImage(*region_, weights.data(), weight_image.data());
    const auto steps = weights.Read();
    std::vector<double> expected(kValues / 3, 0.0);
    ForTilePixels([&](size_t position, int pixel) {
      if (pixel < 0) {
        EXPECT_EQ(steps[position], 0);
        return;
      }
      const double m = mask_[size_t(pixel)] / 255.0;
      expected[size_t(pixel)] = m + (1 - m) * double(outside);
    });
    EXPECT_LE(WorstDifference(weight_image.Read(), expected), 0.51 / 255);
  }

  void SweepAsInSteps(const StayLoss& stay) {
    Guarded<float> render(*backend_, image_);
    Guarded<uint8_t> mask(*backend_, mask_);
    Guarded<int16_t> target(*backend_, TileValues());
    std::vector<uint8_t> pixel_weights(TileValues() / 3);
    ForTilePixels([&](size_t position, int pixel) {
      pixel_weights[position] = pixel < 0 ? uint8_t{0} : uint8_t(rng_());
    });
    Guarded<uint8_t> weights(*backend_, pixel_weights);
    backend_->refit().RegionTarget(
        *region_, {render.data(), nullptr, mask.data(), map_, kUnit, target.data()});
    const size_t values = size_t(region_->num_rows()) * 3;
    Guarded<float> change(*backend_, UniformVector(rng_, values, -1, 1)),
        result(*backend_, std::vector<float>(values, 7.0f)), image(*backend_, kValues),
        expected(*backend_, values);
    Guarded<double> loss(*backend_, std::vector<double>{5.0}),
        expected_loss(*backend_, std::vector<double>{5.0});
    Guarded<float> scratch(*backend_, kValues);
    RegionSweepParams sweep{.change = change.data(),
                            .target = target.data(),
                            .unit = kUnit,
                            .weights = weights.data(),
                            .loss = loss.data(),
                            .image = scratch.data(),
                            .result = result.data(),
                            .stay = stay};
    backend_->refit().RegionSweep(*region_, sweep);
    BlendParams blend{};
    blend.features = change.data();
    blend.channels = 3;
    blend.image = image.data();
    backend_->blend().Blend(*region_, blend);
    RegionResidualParams residual{target.data(),        kUnit,         image.data(), image.data(),
                                  expected_loss.data(), weights.data()};
    residual.stay = stay;
    backend_->refit().RegionResidual(*region_, residual);
    BlendTransposeParams transpose{};
    transpose.residual = image.data();
    transpose.channels = 3;
    transpose.result = expected.data();
    backend_->blend().BlendTranspose(*region_, transpose);
    const std::vector<float> wanted = expected.Read();
    const double largest = *std::max_element(wanted.begin(), wanted.end());
    ASSERT_GT(largest, 0);
    EXPECT_LE(WorstDifference(result.Read(), std::vector<double>(wanted.begin(), wanted.end())),
              1e-5 * largest);
    EXPECT_NEAR(loss.Read()[0], expected_loss.Read()[0], 1e-5 * expected_loss.Read()[0]);
    sweep.result = nullptr;
    backend_->refit().RegionSweep(*region_, sweep);  // the loss alone, added
    EXPECT_NEAR(loss.Read()[0], 2 * expected_loss.Read()[0] - 5, 2e-5 * expected_loss.Read()[0]);
    sweep.result = change.data();
    const std::vector<float> apart = result.Read();
    backend_->refit().RegionSweep(*region_, sweep);
    EXPECT_EQ(change.Read(), apart);
  }

  std::unique_ptr<Model> uploaded_;
  // With the weights of all rows, with those of some, and without weights.
  std::shared_ptr<const ViewGeometry> region_, thin_, lists_;
  std::vector<float> image_, other_;
  std::vector<uint8_t> mask_;
  ColorMap map_{};
};

TEST_P(RefitOp, TargetsAndResiduals) {
  ASSERT_FALSE(region_->tiles().empty());
  ASSERT_FALSE(thin_->tiles().empty());
  ASSERT_LT(thin_->num_pixel_rows(), region_->num_pixel_rows());
  for (const bool photo : {false, true}) {
    if (photo) region_ = thin_;
    Guarded<float> render(*backend_, image_), source(*backend_, other_);
    Guarded<uint8_t> mask(*backend_, mask_);
    Guarded<int16_t> target(*backend_, TileValues());
    backend_->refit().RegionTarget(*region_, {render.data(), photo ? source.data() : nullptr,
                                              mask.data(), map_, kUnit, target.data()});
    const auto steps = target.Read();
    ExpectWeights(photo ? 0.25f : 1.0f);
    std::vector<uint8_t> weights(TileValues() / 3);
    for (uint8_t& w : weights) w = uint8_t(rng_());
    for (const bool weighted : {false, true}) {
      const StayLoss stay = {weighted ? 0.05f : 0.0f, 0.01f};
      std::vector<double> expected(kValues, 7.0), curvature(kValues / 3, 0.0);
      int staying = 0;
      double loss = 0;
      ForTilePixels([&](size_t position, int pixel) {
        const double weight = weighted ? weights[position] / 255.0 : 1.0;
        const bool stays = pixel >= 0 && steps[3 * position] == 0 && steps[3 * position + 1] == 0 &&
                           steps[3 * position + 2] == 0;
        staying += stays;
        const double slope = stays ? double(stay.slope) : 0.0, bend = double(stay.bend);
        for (size_t c = 0; c < 3; ++c) {
          if (pixel < 0) {
            EXPECT_EQ(steps[3 * position + c], 0);
            continue;
          }
          const size_t at = size_t(pixel) * 3 + c;
          const double wanted =
              Edited(photo ? other_ : image_, size_t(pixel), c) - double(image_[at]);
          EXPECT_NEAR(steps[3 * position + c] * double(kUnit), wanted, 0.51 * double(kUnit));
          const double r = steps[3 * position + c] * double(kUnit) - double(other_[at]);
          const double root = std::sqrt(r * r + bend * bend);
          expected[at] = weight * r * (1 + slope / root);
          curvature[size_t(pixel)] += weight * (1 + slope / root) / 3;
          loss += weight * (r * r + 2 * slope * (root - bend));
        }
      });
      EXPECT_GE(staying, photo ? 0 : 50);
      Guarded<float> image(*backend_, other_), bends(*backend_, kValues / 3),
          residual(*backend_, std::vector<float>(kValues, 7.0f));
      Guarded<uint8_t> device_weights(*backend_, weights);
      Guarded<double> sum(*backend_, std::vector<double>{5.0});
      RegionResidualParams params{target.data(),   kUnit,      image.data(),
                                  residual.data(), sum.data(), nullptr};
      if (weighted) params.weights = device_weights.data();
      params.stay = stay;
      params.curvature = bends.data();
      backend_->refit().RegionResidual(*region_, params);
      EXPECT_NEAR(sum.Read()[0], 5 + loss, 1e-5 * loss);
      const auto apart = residual.Read();
      EXPECT_LE(WorstDifference(apart, expected), 1e-6);
      EXPECT_LE(WorstDifference(bends.Read(), curvature), 1e-5);
      params.residual = image.data();
      backend_->refit().RegionResidual(*region_, params);
      const auto in_place = image.Read();
      for (size_t at = 0; at < kValues; ++at) {
        EXPECT_EQ(in_place[at], expected[at] == 7.0 ? other_[at] : apart[at]);
      }
    }
  }
}

// One pass over a region's weights equals its three steps.
TEST_P(RefitOp, SweepsAsInSteps) {
  const StayLoss kinds[] = {{}, {0.05f, 0.01f}};
  for (const auto& region : {region_, thin_, lists_}) {
    region_ = region;
    for (const StayLoss& stay : kinds) SweepAsInSteps(stay);
  }
}

TEST_P(RefitOp, TargetsSaturate) {
  std::vector<float> extreme(kValues, 100.0f);
  for (size_t i = 1; i < kValues; i += 3) extreme[i] = -100;
  Guarded<float> render(*backend_, image_), source(*backend_, extreme);
  Guarded<uint8_t> mask(*backend_, mask_);
  Guarded<int16_t> target(*backend_, TileValues());
  map_ = {};
  backend_->refit().RegionTarget(
      *region_, {render.data(), source.data(), mask.data(), map_, kUnit, target.data()});
  const auto steps = target.Read();
  ForTilePixels([&](size_t position, int pixel) {
    EXPECT_EQ(steps[3 * position], pixel >= 0 ? 32767 : 0);
    EXPECT_EQ(steps[3 * position + 1], pixel >= 0 ? -32768 : 0);
  });
}

// Of two steps equally near the even one, on every backend.
TEST_P(RefitOp, RoundsHalvesToEven) {
  const std::vector<float> values = {0.5f, 1.5f, 2.5f, 3.49f, 3.51f, 65534.5f};
  Guarded<float> image(*backend_, values);
  Guarded<uint16_t> packed(*backend_, values.size());
  backend_->refit().PackBox({image.data(), 2, 1, {0, 0, 2, 1}, packed.data(), 1});
  EXPECT_EQ(packed.Read(), (std::vector<uint16_t>{0, 2, 2, 3, 4, 65534}));
}

TEST_P(RefitOp, RefusesWhatCannotBe) {
  Guarded<float> image(*backend_, image_);
  Guarded<uint8_t> mask(*backend_, mask_);
  Guarded<int16_t> target(*backend_, TileValues());
  RefitOps& refit = backend_->refit();
  const auto whole = backend_->blend().PrepareView(*uploaded_, TestCamera(kWidth, kHeight));
  RegionTargetParams goal{image.data(), nullptr, mask.data(), map_, kUnit, target.data()};
  EXPECT_THROW(refit.RegionTarget(*whole, goal), std::invalid_argument);
  EXPECT_THROW(refit.RegionAdd(*whole, image.data(), image.data()), std::invalid_argument);
  EXPECT_THROW(refit.RegionWeightImage(*whole, mask.data(), image.data()), std::invalid_argument);
  EXPECT_THROW(refit.RegionResidual(*whole, {}), std::invalid_argument);
  goal.unit = 0;
  EXPECT_THROW(refit.RegionTarget(*region_, goal), std::invalid_argument);
  const int32_t boxes[][4] = {
      {-1, 0, 5, 5}, {0, -1, 5, 5}, {0, 0, kWidth + 1, 5}, {0, 0, 5, kHeight + 1}, {6, 0, 5, 5}};
  for (const auto& box : boxes) {
    PackBoxParams pack{image.data(), kWidth, kHeight, {}, nullptr, kUnit};
    EditImageParams edit{image.data(), mask.data(), map_, kWidth, kHeight, {}, image.data()};
    ImageLossParams loss{image.data(), image.data(), kWidth, kHeight, 0.2f, {}, image.data()};
    for (int32_t* to : {pack.box, edit.box, loss.roi}) std::copy_n(box, 4, to);
    EXPECT_THROW(refit.PackBox(pack), std::invalid_argument);
    EXPECT_THROW(refit.UnpackBox(pack), std::invalid_argument);
    EXPECT_THROW(refit.EditImage(edit), std::invalid_argument);
    EXPECT_THROW(refit.ImageLoss(loss), std::invalid_argument);
  }
  EXPECT_EQ(image.Read(), image_);
}

TEST_P(RefitOp, AddsOnItsTiles) {
  Guarded<float> image(*backend_, image_), delta(*backend_, other_);
  backend_->refit().RegionAdd(*region_, image.data(), delta.data());
  auto expected = image_;
  ForTilePixels([&](size_t, int pixel) {
    for (size_t c = 0; pixel >= 0 && c < 3; ++c) {
      expected[size_t(pixel) * 3 + c] += other_[size_t(pixel) * 3 + c];
    }
  });
  EXPECT_EQ(image.Read(), expected);
}

TEST_P(RefitOp, MarksAndNumbersRows) {
  const size_t rows = size_t(region_->num_rows()), gaussians = size_t(uploaded_->count());
  const std::vector<int32_t> of_rows = backend_->Download(region_->rows(), rows);
  ASSERT_GT(rows, 0u);
  ASSERT_LT(rows, gaussians);
  std::vector<uint8_t> marked(gaussians, 0);
  marked[1] = 7;  // not active, and left alone
  Guarded<uint8_t> seen(*backend_, marked);
  for (const int32_t g : of_rows) marked[size_t(g)] = 1;
  backend_->refit().MarkRows(*region_, seen.data());
  EXPECT_EQ(seen.Read(), marked);

  std::vector<int32_t> number_of, expected;
  for (size_t g = 0; g < gaussians; ++g) number_of.push_back(int32_t(3 * g) - 1);
  for (const int32_t g : of_rows) expected.push_back(number_of[size_t(g)]);
  Guarded<int32_t> by_gaussian(*backend_, number_of), numbers(*backend_, rows);
  backend_->refit().NumberRows(*region_, by_gaussian.data(), numbers.data());
  EXPECT_EQ(numbers.Read(), expected);
}

TEST_P(RefitOp, PacksBoxes) {
  const int32_t box[4] = {5, 7, 60, 41};
  const size_t row = size_t(box[2] - box[0]) * 3, count = row * size_t(box[3] - box[1]);
  image_[size_t((7 * kWidth + 5) * 3)] = -1;
  image_[size_t((7 * kWidth + 5) * 3 + 1)] = 1000;
  Guarded<float> image(*backend_, image_);
  Guarded<uint16_t> packed(*backend_, count);
  PackBoxParams params{image.data(), kWidth, kHeight, {}, packed.data(), kUnit};
  std::copy_n(box, 4, params.box);
  backend_->refit().PackBox(params);
  const auto steps = packed.Read();
  EXPECT_EQ(steps[0], 0);
  EXPECT_EQ(steps[1], 65535);
  Guarded<float> unpacked(*backend_, other_);
  params.image = unpacked.data();
  backend_->refit().UnpackBox(params);
  const auto out = unpacked.Read();
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const size_t at = size_t((y * kWidth + x) * 3 + 2);
      const bool inside = x >= box[0] && x < box[2] && y >= box[1] && y < box[3];
      EXPECT_NEAR(out[at], inside ? image_[at] : other_[at], inside ? 0.51f * kUnit : 0.0f);
    }
  }
}

TEST_P(RefitOp, EditsInsideItsBox) {
  const int32_t box[4] = {0, 10, 75, 30};
  for (const bool in_place : {false, true}) {
    Guarded<float> image(*backend_, image_), out(*backend_, other_);
    Guarded<uint8_t> mask(*backend_, mask_);
    EditImageParams params{image.data(), mask.data(), map_, kWidth, kHeight, {}, out.data()};
    if (in_place) params.out = image.data();
    std::copy_n(box, 4, params.box);
    backend_->refit().EditImage(params);
    const auto edited = in_place ? image.Read() : out.Read();
    for (size_t p = 0; p < kValues / 3; ++p) {
      const bool inside = p >= size_t(10 * kWidth) && p < size_t(30 * kWidth);
      for (size_t c = 0; c < 3; ++c) {
        const size_t at = 3 * p + c;
        const double kept = double(in_place ? image_[at] : other_[at]);
        EXPECT_NEAR(edited[at], inside ? Edited(image_, p, c) : kept, inside ? 1e-6 : 0);
        if (inside && mask_[p] == 0) {
          EXPECT_EQ(edited[at], image_[at]);
        }
      }
    }
  }
}

// Every kind of operation once, on tables of a seed.
ColorProgram EveryOperation(std::mt19937& rng, std::vector<float>* tables) {
  const struct {
    ColorOpCode code;
    std::vector<float> values;
    int size = 0, colors = 0;  // of its table
  } ops[] = {
      {ColorOpCode::kMatrix, {0.9f, 0.1f, 0, 0.02f, 0, 0.8f, 0.1f, 0, 0.1f, 0, 0.9f, 0.01f}},
      {ColorOpCode::kLinearMatrix, {1.2f, 0, 0.1f, 0, 1.1f, 0, 0, 0.1f, 0.9f}},
      {ColorOpCode::kPower, {0.8f}},
      {ColorOpCode::kAdjust, {0.8f, 0.6f, 1.1f, 0.9f, -1, 2, 0.5f, 0, 10, 0, 10, 0.05f}},
      {ColorOpCode::kRecolor,
       {1.6f, 0.88f, 0.43f, 0.1f, 0.2f, 0.7f, -0.545f, 0.459f, 1.086f, 0.8f, 0.4f, 0.22f, 0.2f,
        1.5f, 0.3f, 0.5f, 0.5f}},
      {ColorOpCode::kGradient, {}, 16, 16},
      {ColorOpCode::kTable, {}, 5, 125},
      {ColorOpCode::kPalette, {0.5f}, 6, 14},
      {ColorOpCode::kSoftClip, {0.8f}},
  };
  ColorProgram program{};
  program.strength = 0.9f;
  for (const auto& op : ops) {
    ColorOp& to = program.ops[program.count++];
    to.code = op.code;
    to.strength = op.code == ColorOpCode::kGradient ? 0.3f : 0.7f;
    std::copy(op.values.begin(), op.values.end(), to.values);
    to.table = int32_t(tables->size());
    to.size = op.size;
    for (int i = 0; i < 3 * op.colors; ++i) tables->push_back(Uniform(rng, 0, 1));
  }
  return program;
}

TEST_P(RefitOp, RunsLists) {
  std::vector<float> tables;
  ColorProgram program = EveryOperation(rng_, &tables);
  const auto uploaded_tables = backend_->Upload(std::span<const float>(tables));
  ColorProgram resident = program;
  resident.tables = uploaded_tables.data();
  const auto uploaded = backend_->Upload(std::span<const ColorProgram>(&resident, 1));
  program.tables = tables.data();
  ColorMap map{};
  map.program = uploaded.data();

  Guarded<float> image(*backend_, image_), out(*backend_, other_);
  Guarded<uint8_t> mask(*backend_, mask_);
  EditImageParams params{image.data(), mask.data(), map, kWidth, kHeight, {}, out.data()};
  params.box[2] = kWidth;
  params.box[3] = kHeight;
  backend_->refit().EditImage(params);
  const auto edited = out.Read();
  double changed = 0;
  for (size_t p = 0; p < kValues / 3; ++p) {
    float full[3] = {image_[3 * p], image_[3 * p + 1], image_[3 * p + 2]};
    RunColorProgram(program, full);
    for (size_t c = 0; c < 3; ++c) {
      const float old = image_[3 * p + c];
      // Powers and cube roots of a device are good to a few units of the last place, which cubes
      // and differences of OKLab magnify.
      EXPECT_NEAR(edited[3 * p + c], old + float(mask_[p]) / 255 * (full[c] - old), 2e-4);
      if (mask_[p] == 0) {
        EXPECT_EQ(edited[3 * p + c], old);
      }
      changed += std::abs(double(edited[3 * p + c] - old));
    }
  }
  EXPECT_GT(changed / double(kValues), 0.05);
  params.mask = nullptr;  // the whole image
  params.out = out.data();
  backend_->refit().EditImage(params);
  const auto whole = out.Read();
  for (size_t p = 0; p < kValues / 3; ++p) {
    float full[3] = {image_[3 * p], image_[3 * p + 1], image_[3 * p + 2]};
    RunColorProgram(program, full);
    for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(whole[3 * p + c], full[c], 2e-4);
  }

  Guarded<int16_t> target(*backend_, TileValues());
  backend_->refit().RegionTarget(*region_,
                                 {image.data(), nullptr, mask.data(), map, kUnit, target.data()});
  const auto steps = target.Read();
  ForTilePixels([&](size_t position, int pixel) {
    for (size_t c = 0; c < 3 && pixel >= 0; ++c) {
      const size_t at = 3 * size_t(pixel) + c;
      EXPECT_NEAR(steps[3 * position + c] * double(kUnit), double(edited[at]) - double(image_[at]),
                  0.51 * double(kUnit));
    }
  });
}

RETINT_INSTANTIATE(RefitOp);

}  // namespace
}  // namespace retint
