// SPDX-License-Identifier: BSD-3-Clause
// Every instruction set that this machine can run agrees with the scalar loops, not only the best.
#include <set>

#include <hwy/highway.h>

#include "tests/kernels/test_scene.h"

namespace retint {
namespace {

// Lets run-time dispatch choose among `targets` (0: all that there are).
void AllowTargets(int64_t targets) {
  hwy::SetSupportedTargetsForTest(targets);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

struct Results {
  std::vector<float> rounded;  // compared within 1e-4
  std::vector<float> weights;  // explicit ones: within their step
};

Results RunAll(Backend& backend, const TestModel& model) {
  std::mt19937 rng(7);
  const CameraParams camera = TestCamera(133, 71);
  const size_t values = size_t(camera.width) * size_t(camera.height) * 3;
  const auto uploaded = backend.blend().UploadModel(model.arrays());
  const auto view = backend.blend().PrepareView(*uploaded, camera);
  Results results;
  const auto append = [](const std::vector<float>& v, std::vector<float>* all) {
    all->insert(all->end(), v.begin(), v.end());
  };
  const auto residual = UniformVector(rng, values, 0, 0.1f);
  const auto features = UniformVector(rng, size_t(view->num_rows()) * 3, 0, 1);
  const Blended blended = RunBlend(backend, *view, features, 3);
  append(blended.image, &results.rounded);
  append(blended.alpha, &results.rounded);
  append(RunTranspose(backend, *view, residual, 3), &results.rounded);
  Guarded<float> expected(backend, values / 3), gradient(backend, values);
  backend.blend().Depth(*view, {nullptr, expected.data(), nullptr, 0.5f});
  append(expected.Read(), &results.rounded);
  const auto loss = backend.refit().ImageLoss({blended.image.data(),
                                               residual.data(),
                                               camera.width,
                                               camera.height,
                                               0.2f,
                                               {},
                                               gradient.data()});
  for (const float g : gradient.Read()) results.rounded.push_back(g * float(values));
  results.rounded.push_back(float(loss.loss));
  std::vector<uint8_t> active(size_t(model.count()));
  for (uint8_t& a : active) a = rng() % 4 == 0;
  const auto region = backend.blend().Restrict(*view, active.data(), size_t{1} << 30);
  const auto part = UniformVector(rng, size_t(region->num_rows()) * 3, 0, 1);
  append(RunBlend(backend, *region, part, 3).image, &results.weights);
  append(RunTranspose(backend, *region, residual, 3), &results.weights);
  return results;
}

TEST(Dispatch, EveryTargetAgreesWithScalar) {
  std::mt19937 rng = TestRng();
  const TestModel model = RandomModel(rng, 1500);
  const Results expected = RunAll(*MakeBackend("cpu-scalar"), model);
  std::set<std::string> seen;
  for (const int64_t target : hwy::SupportedAndGeneratedTargets()) {
    AllowTargets(target);
    const auto backend = MakeBackend("cpu");
    SCOPED_TRACE(backend->Description());
    seen.insert(backend->Description());
    const Results actual = RunAll(*backend, model);
    // A pair at the threshold 1/255 may fall either way: few values, by a faint splat's weight.
    size_t flips = 0;
    ASSERT_EQ(actual.rounded.size(), expected.rounded.size());
    for (size_t i = 0; i < expected.rounded.size(); ++i) {
      const float difference = std::abs(actual.rounded[i] - expected.rounded[i]);
      if (!(difference < 2e-4f)) ++flips;
    }
    EXPECT_LE(double(flips), 2e-3 * double(expected.rounded.size()));
    EXPECT_LE(WorstDifference(actual.weights, expected.weights), 0.012);
  }
  AllowTargets(0);
  EXPECT_FALSE(seen.empty());
#if HWY_ARCH_X86_64
  EXPECT_GE(seen.size(), 2u) << "SSE4 at least should differ from SSE2";
#endif
}

}  // namespace
}  // namespace retint
