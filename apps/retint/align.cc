// SPDX-License-Identifier: BSD-3-Clause
// retint align: how a splat lies in a workspace's world.
#include "opening/align.h"
#include "opening/ocio_space.h"
#include "opening/render_model.h"

#include <cmath>

#include <fmt/format.h>

#include "base/error.h"
#include "base/files.h"
#include "base/staged_output.h"
#include "colmap_io/nerfstudio.h"
#include "opening/scene_check.h"
#include "retint/common.h"
#include "retint/help.h"
#include "scene/transform.h"
#include "splat_io/splat_io.h"
#include "splat_io/streamed_sog.h"

namespace retint::cli {
namespace {

struct Arguments {
  SceneArguments scene;
  AlignOptions options;
  std::filesystem::path output, transform;
};

void AlignSplat(const Arguments& arguments, Run& run) {
  const SceneArguments& scene = arguments.scene;
  CheckOption(!scene.workspace.empty(), "a splat is aligned with a workspace: give its folder");
  if (!arguments.output.empty()) {
    CodecForWriting(arguments.output);
    CheckOption(
        !IsStreamedSog(arguments.output),
        arguments.output.string() +
            ": Retint does not move a streamed SOG. Use --transform, or write another format");
    CheckOutput(arguments.output);
  }
  if (!arguments.transform.empty()) CheckOutput(arguments.transform);
  Workspace workspace = Workspace::Open(scene.workspace, scene.images, scene.model);
  workspace.UndistortViews();
  for (const std::string& warning : workspace.warnings) run.Warn(warning);
  GaussianModel model = ReadSplat(scene.splat, run.monitor());
  ChooseRenderModel(ChosenRenderModel(scene.render_model), scene.splat, scene.workspace, model);
  ChooseSpace(scene.space, model);
  const AlignResult result =
      Align(CreateBackend(run.globals().backend), workspace, model,
            FindTransformFiles(scene.workspace, scene.splat), arguments.options, run.monitor());
  const Sim3d& found = result.world_from_splat;
  StagedOutput staged;
  if (!arguments.output.empty()) {
    Transform(found, model);
    staged.Add(arguments.output, [&](const auto& path) { WriteSplat(path, model, run.monitor()); });
  }
  if (!arguments.transform.empty()) {
    staged.Add(arguments.transform,
               [&](const auto& path) { WriteFile(path, WorldFromSplatToJson(found)); });
  }
  run.monitor().ThrowIfCancelled();
  run.Commit(staged);
  run.FinishProgress();
  const Eigen::AngleAxisd turn(found.rotation);
  run.Print(fmt::format("found from   {}", result.source));
  run.Print(fmt::format(
      "similarity   scale {:.6g}, turned by {:.3f} degrees, moved by ({:.6g}, {:.6g}, {:.6g})",
      found.scale, turn.angle() * 180 / 3.14159265358979, found.translation.x(),
      found.translation.y(), found.translation.z()));
  if (std::isfinite(result.psnr_after)) {
    run.Print(fmt::format("PSNR         {:.2f} dB before, {:.2f} dB after, against the photos",
                          result.psnr_before, result.psnr_after));
  } else {
    run.Print("PSNR         no photos to compare with: the sparse points alone decided");
  }
  // Never of a NaN: without photos nothing is known.
  if (result.psnr_after < SceneCheckOptions().min_psnr) {
    run.Warn(fmt::format(
        "renders and photos still disagree ({:.1f} dB): the splat seems to be of another scene",
        result.psnr_after));
  }
  for (const auto& path : {arguments.output, arguments.transform}) {
    if (!path.empty()) run.Print(fmt::format("wrote        {}", path.string()));
  }
}

}  // namespace

void AddAlign(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = AddVerb(app, globals, "align",
                           "Find how a splat from another frame lies in a workspace's world");
  AddSceneFiles(verb, globals, arguments->scene, /*needs_splat=*/true);
  Everyday(verb, verb->get_option("--splat"));
  Everyday(verb, AddPath(verb, "-o,--output", arguments->output,
                         "Splat to write, moved into the workspace's world, in the format of its "
                         "extension"));
  Everyday(verb, AddPath(verb, "--transform", arguments->transform,
                         "Similarity to write (.json), for --world-from-splat"));
  verb->add_option("--compare", arguments->options.views, "Photos to compare renders with")
      ->check(CLI::Range(1, 1000));
  AddExamples(verb, {"retint align sample --splat sample/splat.ply --transform place.json"});
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { AlignSplat(*arguments, run); }; });
}

}  // namespace retint::cli
