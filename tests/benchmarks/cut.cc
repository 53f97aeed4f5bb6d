// SPDX-License-Identifier: BSD-3-Clause
// retint_cut: writes a part of a scene as its own scene, for benchmarks. It is the part that the
// fit of some masks opens. OUTPUT/splat.ply, OUTPUT/sparse/0 with the views that take part, and in
// OUTPUT/masks their masks with the Gaussians' shares.
#include <cstdio>
#include <filesystem>
#include <string>

#include <CLI/CLI.hpp>

#include "colmap_io/sparse.h"
#include "pipeline/large_scene.h"
#include "selecting/selection_files.h"
#include "splat_io/splat_io.h"
#include "tests/benchmarks/main.h"

namespace retint {
namespace {

int Main(int argc, char** argv) {
  std::filesystem::path workspace, splat, masks, output;
  CLI::App app("what the fit of some masks opens of a large scene, for benchmarks");
  app.add_option("--workspace", workspace)->required();
  app.add_option("--splat", splat)->required();
  app.add_option("--masks", masks, "of `retint project`")->required();
  app.add_option("--output", output)->required();
  CLI11_PARSE(app, argc, argv);
  Monitor monitor;
  SessionOptions options;
  options.backend = "cpu";
  LargeScene large(workspace, splat, options, {}, monitor);
  MaskFolder folder = ReadMaskFolder(masks, /*invert=*/false, large.pictures());
  const SparseShares shares = ReadSparseShares(masks, folder.checksum, large.NumGaussians());
  const auto session = large.ForMasks(folder, shares, RefitOptions().active_threshold, monitor);
  const std::vector<const View*>& views = session->scene().views();
  Reconstruction cut = large.workspace().reconstruction;
  cut.points.clear();
  cut.views.clear();
  for (const View* view : views) cut.views.emplace(view->id, *view);
  for (auto& [id, view] : cut.views) view.observations.clear();
  std::filesystem::create_directories(output / "sparse" / "0");
  WriteReconstructionBinary(output / "sparse" / "0", cut);
  WriteSplat(output / "splat.ply", session->scene().original());
  const auto of_views = std::move(folder).OfViews(large.pictures(), views);
  WriteMasks(output / "masks", of_views, monitor);
  WriteShares(output / "masks", of_views, shares.Of(session->scene().part()->records));
  std::printf("%zu of %zu Gaussians, %zu views\n", session->scene().original().NumGaussians(),
              large.NumGaussians(), views.size());
  return 0;
}

}  // namespace
}  // namespace retint

int main(int argc, char** argv) {
  return retint::RunProgram("retint_cut", retint::Main, argc, argv);
}
