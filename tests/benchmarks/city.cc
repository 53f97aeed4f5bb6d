// SPDX-License-Identifier: BSD-3-Clause
// retint_city: a city, for benchmarks: one block of houses many times over, written a block at a
// time, so that the splat may be larger than memory. The block is the middle of a splat, such as
// that of `retint synth --around`, whose world has y down; its Gaussians become smaller ones as in
// retint_densify, others in every block. Views look down at each block's middle from a circle above
// it. Writes OUTPUT/splat.ply, OUTPUT/sparse/0 and OUTPUT/mask.png, a disc in the middle of
// VIEW, which is named at the end. The same bytes for the same seed.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "colmap_io/sparse.h"
#include "splat_io/splat_io.h"
#include "tests/benchmarks/densify.h"
#include "tests/benchmarks/main.h"

namespace retint {
namespace {

struct Arguments {
  std::filesystem::path splat, output;
  int tiles_x = 4, tiles_z = 4, children = 1, views = 8, width = 800, height = 600;
  double extent = 0.9, radius = 0.5, above = 0.9, spacing = 1;
  uint32_t seed = 0;
};

// Of the Gaussians' means along an axis.
float Quantile(const GaussianModel& model, size_t axis, double q) {
  std::vector<float> values;
  for (size_t g = 0; g < model.NumGaussians(); ++g) values.push_back(model.means[3 * g + axis]);
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// The Gaussians that lie in a box in x and z, moved so that its middle is the origin.
struct Block {
  GaussianModel model;
  float size_x, size_z;
};

Block CutBlock(const GaussianModel& model, double extent) {
  std::array<float, 3> low, high;
  for (size_t axis = 0; axis < 3; ++axis) {
    low[axis] = Quantile(model, axis, 0.5 - extent / 2);
    high[axis] = Quantile(model, axis, 0.5 + extent / 2);
  }
  Block block{{}, high[0] - low[0], high[2] - low[2]};
  const float largest = 0.05F * std::max(block.size_x, block.size_z);
  GaussianModel& cut = block.model;
  cut.sh_degree = model.sh_degree;
  const size_t width = size_t(model.NumShCoeffs()) * 3;
  for (size_t g = 0; g < model.NumGaussians(); ++g) {
    const float* const mean = &model.means[3 * g];
    const float* const s = &model.log_scales[3 * g];
    const bool inside = mean[0] >= low[0] && mean[0] < high[0] && mean[2] >= low[2] &&
                        mean[2] < high[2] && std::exp(std::max({s[0], s[1], s[2]})) < largest;
    if (!inside) continue;
    for (size_t axis = 0; axis < 3; ++axis) {
      cut.means.push_back(mean[axis] - (axis == 1 ? high[1] : (low[axis] + high[axis]) / 2));
    }
    cut.log_scales.insert(cut.log_scales.end(), s, s + 3);
    cut.quats_wxyz.insert(cut.quats_wxyz.end(), &model.quats_wxyz[4 * g],
                          &model.quats_wxyz[4 * g] + 4);
    cut.opacity_logits.push_back(model.opacity_logits[g]);
    cut.sh.insert(cut.sh.end(), &model.sh[g * width], &model.sh[g * width] + width);
  }
  return block;
}

// The records of a .ply as the 3DGS training code orders its columns.
void WriteRecords(const GaussianModel& model, float dx, float dz, AtomicFile* file) {
  const size_t coeffs = size_t(model.NumShCoeffs());
  std::vector<float> record(6 + 3 * coeffs + 8);
  for (size_t g = 0; g < model.NumGaussians(); ++g) {
    size_t at = 0;
    const float* const mean = &model.means[3 * g];
    for (const float value : {mean[0] + dx, mean[1], mean[2] + dz, 0.0F, 0.0F, 0.0F}) {
      record[at++] = value;
    }
    const float* const sh = &model.sh[g * coeffs * 3];
    for (size_t c = 0; c < 3; ++c) record[at++] = sh[c];
    for (size_t c = 0; c < 3; ++c) {
      for (size_t k = 1; k < coeffs; ++k) record[at++] = sh[3 * k + c];
    }
    record[at++] = model.opacity_logits[g];
    for (size_t i = 0; i < 3; ++i) record[at++] = model.log_scales[3 * g + i];
    for (size_t i = 0; i < 4; ++i) record[at++] = model.quats_wxyz[4 * g + i];
    file->Write(record.data(), record.size() * sizeof(float));
  }
}

std::string Header(uint64_t count, size_t coeffs) {
  std::string text =
      "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(count) + "\n";
  const auto add = [&](const std::string& name) { text += "property float " + name + "\n"; };
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"})
    add(name);
  for (size_t i = 0; i < 3 * (coeffs - 1); ++i) add("f_rest_" + std::to_string(i));
  add("opacity");
  for (int i = 0; i < 3; ++i) add("scale_" + std::to_string(i));
  for (int i = 0; i < 4; ++i) add("rot_" + std::to_string(i));
  return text + "end_header\n";
}

// Looks from `eye` at `target`, the world's y down.
Rigid3d LookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  const Eigen::Vector3d forward = (target - eye).normalized();
  const Eigen::Vector3d right = Eigen::Vector3d(0, 1, 0).cross(forward).normalized();
  Eigen::Matrix3d rotation;
  rotation << right.transpose(), forward.cross(right).transpose(), forward.transpose();
  Rigid3d pose;
  pose.rotation = Eigen::Quaterniond(rotation);
  pose.translation = -(rotation * eye);
  return pose;
}

std::string ViewNameOf(int x, int z, int v) {
  char name[64];
  std::snprintf(name, sizeof(name), "block_%02d_%02d_%02d.png", x, z, v);
  return name;
}

Reconstruction PlaceCameras(const Arguments& arguments, double pitch_x, double pitch_z) {
  Reconstruction model;
  const double focal = 0.9 * arguments.width;
  model.cameras[1] = Camera::Pinhole(1, arguments.width, arguments.height, focal, focal,
                                     arguments.width / 2.0, arguments.height / 2.0);
  const double size = std::max(pitch_x, pitch_z);
  for (int x = 0; x < arguments.tiles_x; ++x) {
    for (int z = 0; z < arguments.tiles_z; ++z) {
      for (int v = 0; v < arguments.views; ++v) {
        const double angle = 2 * M_PI * v / arguments.views;
        const Eigen::Vector3d middle(x * pitch_x, 0, z * pitch_z);
        const Eigen::Vector3d eye =
            middle + size * Eigen::Vector3d(arguments.radius * std::sin(angle), -arguments.above,
                                            -arguments.radius * std::cos(angle));
        View view;
        view.id = static_cast<ViewId>(model.views.size() + 1);
        view.name = ViewNameOf(x, z, v);
        view.camera_id = 1;
        view.cam_from_world = LookAt(eye, middle);
        model.views.emplace(view.id, std::move(view));
      }
    }
  }
  return model;
}

Mask Disc(int width, int height) {
  Mask mask(width, height);
  const double radius = 0.12 * height;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double dx = x + 0.5 - width / 2.0, dy = y + 0.5 - height / 2.0;
      mask.data[size_t(y) * size_t(width) + size_t(x)] =
          dx * dx + dy * dy < radius * radius ? 255 : 0;
    }
  }
  return mask;
}

int Main(int argc, char** argv) {
  Arguments arguments;
  std::string tiles = "4x4";
  CLI::App app("a city of one block many times over, for benchmarks");
  app.add_option("--splat", arguments.splat, "whose middle is the block; y is down")->required();
  app.add_option("--output", arguments.output)->required();
  app.add_option("--tiles", tiles, "blocks along x and z, such as 4x4");
  app.add_option("--children", arguments.children, "Gaussians from each one")
      ->check(CLI::Range(1, 1000));
  app.add_option("--extent", arguments.extent, "share of the splat that is the block");
  app.add_option("--spacing", arguments.spacing, "of the blocks, in their size");
  app.add_option("--views", arguments.views, "of each block")->check(CLI::Range(1, 100));
  app.add_option("--radius", arguments.radius, "of the views' circle, in sizes of a block");
  app.add_option("--above", arguments.above, "the ground are the views, in sizes of a block");
  app.add_option("--width", arguments.width)->check(CLI::Range(16, 16384));
  app.add_option("--height", arguments.height)->check(CLI::Range(16, 16384));
  app.add_option("--seed", arguments.seed);
  CLI11_PARSE(app, argc, argv);
  if (std::sscanf(tiles.c_str(), "%dx%d", &arguments.tiles_x, &arguments.tiles_z) != 2 ||
      arguments.tiles_x < 1 || arguments.tiles_z < 1) {
    std::fprintf(stderr, "retint_city: --tiles is not like 4x4\n");
    return 2;
  }
  const Block block = CutBlock(ReadSplat(arguments.splat), arguments.extent);
  const double pitch_x = arguments.spacing * double(block.size_x);
  const double pitch_z = arguments.spacing * double(block.size_z);
  const uint64_t a_tile = block.model.NumGaussians() * uint64_t(arguments.children);
  const uint64_t count = a_tile * uint64_t(arguments.tiles_x) * uint64_t(arguments.tiles_z);
  std::filesystem::create_directories(arguments.output / "sparse" / "0");
  const Reconstruction model = PlaceCameras(arguments, pitch_x, pitch_z);
  WriteReconstructionBinary(arguments.output / "sparse" / "0", model);
  WritePng(arguments.output / "mask.png", Disc(arguments.width, arguments.height));
  AtomicFile file(arguments.output / "splat.ply");
  file.Write(Header(count, size_t(block.model.NumShCoeffs())));
  uint32_t seed = arguments.seed;
  for (int x = 0; x < arguments.tiles_x; ++x) {
    for (int z = 0; z < arguments.tiles_z; ++z) {
      WriteRecords(Densify(block.model, arguments.children, seed++), float(x * pitch_x),
                   float(z * pitch_z), &file);
    }
  }
  file.Commit();
  std::printf("%llu Gaussians, %llu a block, %zu views of %d x %d, the middle one %s\n",
              static_cast<unsigned long long>(count), static_cast<unsigned long long>(a_tile),
              model.views.size(), arguments.width, arguments.height,
              ViewNameOf(arguments.tiles_x / 2, arguments.tiles_z / 2, 0).c_str());
  return 0;
}

}  // namespace
}  // namespace retint

int main(int argc, char** argv) {
  return retint::RunProgram("retint_city", retint::Main, argc, argv);
}
