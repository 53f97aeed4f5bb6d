// SPDX-License-Identifier: BSD-3-Clause
// retint_densify: a larger scene from a real one, for benchmarks. Every Gaussian becomes `children`
// smaller ones drawn from itself; the cameras keep their poses and take another size, the middle of
// the old view. Writes OUTPUT/splat.ply and OUTPUT/sparse/0, the same bytes for the same seed.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>

#include "colmap_io/sparse.h"
#include "colmap_io/workspace.h"
#include "splat_io/splat_io.h"
#include "tests/benchmarks/densify.h"
#include "tests/benchmarks/main.h"

namespace retint {
namespace {

// Up to `count` views: copies of the given ones, each moved a little.
void AddViews(Reconstruction* model, size_t count, uint32_t seed) {
  std::mt19937 rng(seed + 1);
  const std::vector<View> given = [&] {
    std::vector<View> views;
    for (const auto& [id, view] : model->views) views.push_back(view);
    return views;
  }();
  for (size_t i = 0; model->views.size() < count; ++i) {
    View view = given[i % given.size()];
    view.id = model->views.rbegin()->first + 1;
    view.name = std::to_string(i / given.size() + 1) + "_" + view.name;
    for (int j = 0; j < 3; ++j) {
      view.cam_from_world.translation[j] += 0.05 * double(Normal(rng));
    }
    model->views.emplace(view.id, std::move(view));
  }
}

int Main(int argc, char** argv) {
  std::filesystem::path workspace, output;
  int children = 9, width = 1600, height = 1066;
  size_t views = 0;
  uint32_t seed = 0;
  CLI::App app("a larger scene from a real one, for benchmarks");
  app.add_option("--workspace", workspace, "with splat.ply in it")->required();
  app.add_option("--output", output)->required();
  app.add_option("--children", children, "Gaussians from each one")->check(CLI::Range(1, 1000));
  app.add_option("--width", width, "of the cameras, pixels")->check(CLI::Range(1, 16384));
  app.add_option("--height", height, "of the cameras, pixels")->check(CLI::Range(1, 16384));
  app.add_option("--views", views, "at least so many, copies moved a little");
  app.add_option("--seed", seed);
  CLI11_PARSE(app, argc, argv);
  Reconstruction model = Workspace::Open(workspace).reconstruction;
  for (auto& [id, camera] : model.cameras) {
    const double scale = double(width) / camera.width;
    for (double& param : camera.params) param *= scale;
    camera.params[camera.params.size() - 1] += 0.5 * (height - scale * camera.height);  // cy
    camera.width = width;
    camera.height = height;
  }
  for (auto& [id, view] : model.views) view.observations.clear();
  model.points.clear();
  AddViews(&model, views, seed);
  std::filesystem::create_directories(output / "sparse" / "0");
  WriteReconstructionBinary(output / "sparse" / "0", model);
  const GaussianModel dense = Densify(ReadSplat(workspace / "splat.ply"), children, seed);
  WriteSplat(output / "splat.ply", dense);
  std::printf("%zu Gaussians, %zu views of %d x %d\n", dense.NumGaussians(), model.views.size(),
              width, height);
  return 0;
}

}  // namespace
}  // namespace retint

int main(int argc, char** argv) {
  return retint::RunProgram("retint_densify", retint::Main, argc, argv);
}
