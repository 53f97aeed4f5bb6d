// SPDX-License-Identifier: BSD-3-Clause
// retint cameras: the views of a splat alone as a COLMAP workspace.
#include <fmt/format.h>

#include "base/staged_output.h"
#include "reporting/export.h"
#include "retint/common.h"

namespace retint::cli {
namespace {

struct Arguments {
  SceneArguments scene;
  std::filesystem::path output;
  bool images = true, overwrite = false;
};

void Cameras(const Arguments& arguments, Run& run) {
  CheckOutput(arguments.output, /*as_folder=*/true);
  const auto replaced = CheckCamerasFolder(arguments.output, arguments.overwrite);
  const auto session = OpenSession(arguments.scene, 0, run);
  ExportCameras(*session, arguments.images, arguments.output, run.monitor(), replaced);
  run.SetWritten();
  run.FinishProgress();
  const Reconstruction& model = session->scene().reconstruction();
  run.Print(fmt::format("wrote {} views and {} points to {}", model.views.size(),
                        model.points.size(), arguments.output.string()));
}

}  // namespace

void AddCameras(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = AddVerb(app, globals, "cameras",
                           "Place views around a splat and write them as a COLMAP workspace");
  AddPath(verb, "--splat", arguments->scene.splat, "3D Gaussian Splatting scene")->required();
  verb->add_option("--views", arguments->scene.views, "How many views are placed")
      ->check(CLI::Range(2, 400));
  AddPath(verb, "--output", arguments->output,
          "Workspace to write: sparse/0 (cameras, images, points3D) and images, rendered", "FOLDER")
      ->required();
  verb->add_flag("!--no-images", arguments->images, "Write the model only, without pictures");
  verb->add_flag("--overwrite", arguments->overwrite,
                 "Replace the model and pictures that an earlier `retint cameras` wrote there; "
                 "other files stay. Else the folder must hold neither")
      ->default_str("");
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { Cameras(*arguments, run); }; });
}

}  // namespace retint::cli
