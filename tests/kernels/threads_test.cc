// SPDX-License-Identifier: BSD-3-Clause
// Every result is bit for bit the same for any number of threads.
#include <thread>

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "tests/kernels/test_scene.h"

namespace retint {
namespace {

// Everything the CPU backend computes, one after the other.
std::vector<float> RunAll(Backend& backend, const TestModel& model, const CameraParams& camera) {
  std::mt19937 rng(1);
  std::vector<float> all;
  const auto append = [&](const std::vector<float>& v) {
    all.insert(all.end(), v.begin(), v.end());
  };
  const auto uploaded = backend.blend().UploadModel(model.arrays());
  const auto view = backend.blend().PrepareView(*uploaded, camera);
  const size_t pixels = size_t(camera.width) * size_t(camera.height);
  const auto residual = UniformVector(rng, pixels * 3, -1, 1);
  const auto features = UniformVector(rng, size_t(view->num_rows()) * 3, 0, 1);
  for (const int32_t row : RowsOf(backend, *view)) all.push_back(float(row));
  const auto blended = RunBlend(backend, *view, features, 3);
  append(blended.image);
  append(RunTranspose(backend, *view, residual, 3));
  std::vector<uint8_t> active(size_t(model.count()));
  for (uint8_t& a : active) a = rng() % 8 == 0;
  for (const size_t budget : {size_t{0}, size_t{1} << 30}) {
    const auto region = backend.blend().Restrict(*view, active.data(), budget);
    all.push_back(float(region->bytes()));
    append(
        RunBlend(backend, *region, UniformVector(rng, size_t(region->num_rows()), 0, 1), 1).image);
    append(RunTranspose(backend, *region, residual, 3));
  }
  Guarded<float> gradient(backend, pixels * 3);
  const auto value = backend.refit().ImageLoss({blended.image.data(),
                                                residual.data(),
                                                camera.width,
                                                camera.height,
                                                0.2f,
                                                {},
                                                gradient.data()});
  append(gradient.Read());
  all.push_back(float(value.loss));
  all.push_back(
      float(backend.solve().Dot(blended.image.data(), residual.data(), int64_t(pixels * 3))));
  return all;
}

TEST(Threads, DoNotChangeResults) {
  std::mt19937 rng = TestRng();
  const TestModel model = RandomModel(rng, 20000);
  const CameraParams camera = TestCamera(301, 203);
  for (const char* name : {"cpu", "cpu-scalar"}) {
    const auto backend = MakeBackend(name);
    std::vector<float> first;
    for (const int threads : {1, 2, 7}) {
      const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                        size_t(threads));
      tbb::task_arena arena(threads);
      const auto all = arena.execute([&] { return RunAll(*backend, model, camera); });
      if (threads == 1) {
        first = all;
        EXPECT_GT(first.size(), 100000u);
      } else {
        EXPECT_TRUE(first == all) << threads << " threads, " << name;
      }
    }
  }
}

TEST(Threads, ABackendMayBeShared) {
  std::mt19937 rng = TestRng();
  const TestModel model = RandomModel(rng, 3000);
  const auto backend = MakeBackend("cpu");
  const CameraParams camera = TestCamera(120, 100);
  const auto expected = RunAll(*backend, model, camera);
  std::vector<std::vector<float>> results(4);
  std::vector<std::thread> threads;
  for (auto& result : results) {
    threads.emplace_back([&] { result = RunAll(*backend, model, camera); });
  }
  for (auto& thread : threads) thread.join();
  for (const auto& result : results) EXPECT_TRUE(result == expected);
}

}  // namespace
}  // namespace retint
