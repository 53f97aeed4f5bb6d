// SPDX-License-Identifier: BSD-3-Clause
// retint_bench_kernels: every operation of a refit on view 0025 of the fox, or on a synthetic
// scene, with known geometry. One JSON line per case. The flags of Google Benchmark work
// (--benchmark_filter=blend).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "colmap_io/workspace.h"
#include "kernels/backend.h"
#include "kernels/cpu/cpu_backend.h"
#include "render/renderer.h"
#include "splat_io/splat_io.h"
#include "tests/benchmarks/main.h"

namespace retint {
namespace {

struct Scene {
  std::string name;
  GaussianModel model;
  CameraParams camera;
};

std::filesystem::path FoxFolder() {
  const char* root = std::getenv("RETINT_DATA");
  const std::filesystem::path base = root ? root : RETINT_SOURCE_DIR "/../shared/data";
  return base / "fox";
}

// A ball of blobs as many and as large on screen as the fox's.
Scene SyntheticScene() {
  Scene scene{"synthetic", {}, {}};
  constexpr size_t kCount = 118000;
  scene.model.Resize(kCount, 3);
  std::mt19937 rng(1);
  const auto uniform = [&](float low, float high) {
    return low + (high - low) * (float(rng() >> 8) * 0x1p-24f);
  };
  for (float& v : scene.model.means) v = uniform(-2, 2);
  for (float& v : scene.model.quats_wxyz) v = uniform(-1, 1);
  for (float& v : scene.model.log_scales) v = uniform(-5.5f, -3);
  for (float& v : scene.model.opacity_logits) v = uniform(-4, 4);
  for (float& v : scene.model.sh) v = uniform(-0.3f, 0.3f);
  scene.camera = {900,       900,       353, 630, 707, 1261, {1, 0, 0, 0, 1, 0, 0, 0, 1},
                  {0, 0, 4}, {0, 0, -4}};
  return scene;
}

Scene LoadScene() {
  if (!std::filesystem::exists(FoxFolder() / "splat.ply")) return SyntheticScene();
  const Workspace workspace = Workspace::Open(FoxFolder());
  const View& view = workspace.RequireView("0025.jpg");
  return {"fox", ReadSplat(FoxFolder() / "splat.ply"),
          ToCameraParams(workspace.reconstruction.Posed(view))};
}

// Everything a case needs, in the memory of one backend.
class Bench {
 public:
  Bench(std::shared_ptr<Backend> shared_backend, const Scene& scene)
      : backend(std::move(shared_backend)), camera(scene.camera) {
    const GaussianModel& m = scene.model;
    model = backend->blend().UploadModel({m.means.data(), m.quats_wxyz.data(), m.log_scales.data(),
                                          m.opacity_logits.data(), m.sh.data(),
                                          int64_t(m.NumGaussians()), m.sh_degree});
    view = backend->blend().PrepareView(*model, camera);
    const size_t values = size_t(camera.width) * size_t(camera.height) * 3;
    image = backend->Allocate<float>(values);
    gradient = backend->Allocate<float>(values);
    const std::vector<float> grey(values, 0.4f);
    target = backend->Upload(std::span<const float>(grey));
    colors = backend->Allocate<float>(size_t(view->num_rows()) * 3);
    sums = backend->Allocate<float>(size_t(view->num_rows()) * 3);
    sh_gradient = backend->Allocate<float>(m.sh.size());
    EvalSh();
    Blend(*view);
  }

  // The Gaussians whose centres lie in the middle of the image, on `share` of its area.
  std::shared_ptr<const ViewGeometry> Region(const Scene& scene, double share, size_t budget) {
    const double half = std::sqrt(share) / 2;
    std::vector<uint8_t> active(scene.model.NumGaussians(), 0);
    for (size_t g = 0; g < active.size(); ++g) {
      double at[3];
      for (size_t i = 0; i < 3; ++i) {
        at[i] = double(camera.translation[i]);
        for (size_t j = 0; j < 3; ++j) {
          at[i] += double(camera.rotation[3 * i + j]) * double(scene.model.means[3 * g + j]);
        }
      }
      const double x = (camera.fx * at[0] / at[2] + camera.cx) / camera.width;
      const double y = (camera.fy * at[1] / at[2] + camera.cy) / camera.height;
      active[g] = at[2] > 0 && std::fabs(x - 0.5) < half && std::fabs(y - 0.5) < half;
    }
    const auto flags = backend->Upload(std::span<const uint8_t>(active));
    return backend->blend().Restrict(*view, flags.data(), budget);
  }

  void EvalSh() {
    EvalShParams params{view->rows(), nullptr, view->num_rows(), model->sh(), {}, colors.data()};
    std::copy_n(camera.center, 3, params.center);
    backend->sh().EvalSh(*model, params);
  }
  void EvalShTranspose() {
    EvalShTransposeParams params{view->rows(),  nullptr, view->num_rows(),  sums.data(),
                                 colors.data(), {},      sh_gradient.data()};
    std::copy_n(camera.center, 3, params.center);
    backend->sh().EvalShTranspose(*model, params);
  }
  void Blend(const ViewGeometry& geometry) {
    backend->blend().Blend(geometry, {colors.data(), 3, nullptr, image.data(), nullptr, true});
  }
  void Transpose(const ViewGeometry& geometry) {
    backend->blend().BlendTranspose(geometry, {target.data(), 3, sums.data()});
  }
  void Loss() {
    backend->refit().ImageLoss(
        {image.data(), target.data(), camera.width, camera.height, 0.2f, {}, gradient.data()});
  }
  void Depth() { backend->blend().Depth(*view, {image.data(), gradient.data(), nullptr, 0.5f}); }

  std::shared_ptr<Backend> backend;
  CameraParams camera;
  std::unique_ptr<Model> model;
  std::shared_ptr<const ViewGeometry> view;
  Buffer<float> image, gradient, target, colors, sums, sh_gradient;
};

// One JSON object per line, the source of performance figures.
class JsonLines : public benchmark::BenchmarkReporter {
 public:
  JsonLines(std::string scene, std::string backend)
      : scene_(std::move(scene)), backend_(std::move(backend)) {}
  bool ReportContext(const Context&) override { return true; }
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      std::printf(
          "{\"benchmark\": \"kernels\", \"case\": \"%s\", \"scene\": \"%s\", \"backend\": \"%s\", "
          "\"wall_ms\": %.3f, \"cpu_ms\": %.3f, \"iterations\": %lld}\n",
          run.run_name.function_name.c_str(), scene_.c_str(), backend_.c_str(),
          run.GetAdjustedRealTime(), run.GetAdjustedCPUTime(),
          static_cast<long long>(run.iterations));
    }
    std::fflush(stdout);
  }

 private:
  std::string scene_, backend_;
};

template <typename Body>
void Register(Bench& bench, const std::string& name, const Body& body) {
  benchmark::RegisterBenchmark(name.c_str(),
                               [&bench, body](benchmark::State& state) {
                                 for (auto _ : state) {
                                   body();
                                   bench.backend->Synchronize();
                                 }
                               })
      ->Unit(benchmark::kMillisecond)
      ->UseRealTime()
      ->MeasureProcessCPUTime()
      ->MinTime(0.3);
}

void RegisterAll(Bench& bench, const Scene& scene) {
  Register(bench, "prepare",
           [&] { bench.backend->blend().PrepareView(*bench.model, bench.camera); });
  Register(bench, "eval_sh", [&] { bench.EvalSh(); });
  Register(bench, "eval_sh_transpose", [&] { bench.EvalShTranspose(); });
  Register(bench, "blend", [&] { bench.Blend(*bench.view); });
  Register(bench, "forward", [&] {
    bench.EvalSh();
    bench.Blend(*bench.view);
  });
  Register(bench, "transpose", [&] { bench.Transpose(*bench.view); });
  Register(bench, "depth", [&] { bench.Depth(); });
  Register(bench, "loss", [&] { bench.Loss(); });
  for (const double share : {0.1, 0.01}) {
    for (const bool stored : {false, true}) {
      const size_t budget = stored ? size_t{1} << 32 : 0;
      std::string suffix = share > 0.05 ? "/10%" : "/1%";
      suffix += stored ? "/stored" : "/recomputed";
      Register(bench, "restrict" + suffix,
               [&bench, &scene, share, budget] { bench.Region(scene, share, budget); });
      const auto region = bench.Region(scene, share, budget);
      Register(bench, "region_blend" + suffix, [&bench, region] { bench.Blend(*region); });
      Register(bench, "region_transpose" + suffix, [&bench, region] { bench.Transpose(*region); });
    }
  }
}

int Main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  const std::string name = argc > 1 ? argv[1] : "auto";
  const auto backend =
      name == "cpu-scalar" ? CreateCpuBackend({.scalar = true}) : CreateBackend(name);
  const Scene scene = LoadScene();
  Bench bench(backend, scene);
  RegisterAll(bench, scene);
  JsonLines reporter(scene.name, backend->Description());
  benchmark::RunSpecifiedBenchmarks(&reporter);
  return 0;
}

}  // namespace
}  // namespace retint

int main(int argc, char** argv) {
  return retint::RunProgram("retint_bench_kernels", retint::Main, argc, argv);
}
