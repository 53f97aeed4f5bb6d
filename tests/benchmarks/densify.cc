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

namespace retint {
namespace {

// A standard normal value; std::normal_distribution differs between standard libraries.
float Normal(std::mt19937& rng) {
  const auto uniform = [&] { return (double(rng() >> 8) + 0.5) * 0x1p-24; };
  return float(std::sqrt(-2 * std::log(uniform())) * std::cos(2 * M_PI * uniform()));
}

GaussianModel Densify(const GaussianModel& model, int children, uint32_t seed) {
  std::mt19937 rng(seed);
  GaussianModel dense;
  const size_t count = model.NumGaussians(), block = size_t(model.NumShCoeffs()) * 3;
  dense.Resize(count * size_t(children), model.sh_degree);
  // The children cover about their parent's area between them.
  const float shrink = -0.5f * std::log(float(children));
  for (size_t g = 0; g < count; ++g) {
    const float* q = &model.quats_wxyz[4 * g];
    const Eigen::Matrix3f axes =
        Eigen::Quaternionf(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
    for (size_t child = 0; child < size_t(children); ++child) {
      const size_t to = g * size_t(children) + child;
      Eigen::Vector3f offset;
      for (int i = 0; i < 3; ++i) {
        offset[i] = 0.8f * Normal(rng) * std::exp(model.log_scales[3 * g + size_t(i)]);
        dense.log_scales[3 * to + size_t(i)] = model.log_scales[3 * g + size_t(i)] + shrink;
      }
      const Eigen::Vector3f moved = axes * offset;
      for (size_t i = 0; i < 3; ++i) dense.means[3 * to + i] = model.means[3 * g + i] + moved[i];
      std::copy_n(q, 4, &dense.quats_wxyz[4 * to]);
      dense.opacity_logits[to] = model.opacity_logits[g];
      std::copy_n(&model.sh[g * block], block, &dense.sh[to * block]);
    }
  }
  return dense;
}

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
  try {
    return retint::Main(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "retint_densify: %s\n", error.what());
    return 1;
  }
}
