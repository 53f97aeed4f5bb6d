// SPDX-License-Identifier: BSD-3-Clause
// retint cameras: the views of a splat alone as a COLMAP workspace.
#include <fmt/format.h>

#include "base/staged_output.h"
#include "reporting/export.h"
#include "retint/common.h"
#include "retint/help.h"

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
  AddPath(verb, "SPLAT", arguments->scene.splat, "Splat to place views around")->required();
  AddPath(verb, "-o,--output", arguments->output,
          "Workspace to write: sparse/0 (cameras, images, points3D) and images, rendered", "FOLDER")
      ->required();
  Everyday(verb, verb->add_option("--views", arguments->scene.views, "Views to place")
                     ->check(CLI::Range(2, 400)));
  Everyday(verb, verb->add_flag("!--no-images", arguments->images,
                                "Write the model only, without pictures"));
  Everyday(verb, verb->add_flag("--overwrite", arguments->overwrite,
                                "Replace what an earlier `retint cameras` wrote there. Other files "
                                "stay")
                     ->default_str(""));
  AddExamples(verb, {"retint cameras sample/splat.ply --views 12 -o views"});
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { Cameras(*arguments, run); }; });
}

}  // namespace retint::cli
