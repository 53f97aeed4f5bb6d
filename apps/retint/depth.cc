// SPDX-License-Identifier: BSD-3-Clause
// retint depth: the depth map of one view.
#include <fmt/format.h>

#include "retint/common.h"
#include "retint/results.h"

namespace retint::cli {
namespace {

struct Arguments {
  SceneArguments scene;
  EditArguments edit;
  std::string view;
  std::filesystem::path output, png;
};

void Depth(const Arguments& arguments, Run& run) {
  const SelectOptions options = Resolve(arguments.edit, run.globals()).select;
  CheckOutput(arguments.output);
  if (!arguments.png.empty()) CheckOutput(arguments.png);
  const auto session = OpenSession(arguments.scene, 0, run);
  const View& view = session->workspace().RequireView(arguments.view);
  const DepthEstimate depth =
      session->EstimateDepth(session->reconstruction().Posed(view), options, run.monitor());
  StagedOutput staged;
  staged.Add(arguments.output, [&](const auto& path) { WriteDepth(path, {}, depth); });
  if (!arguments.png.empty()) {
    staged.Add(arguments.png, [&](const auto& path) { WriteDepth({}, path, depth); });
  }
  run.monitor().ThrowIfCancelled();
  staged.Commit();
  run.FinishProgress();
  if (!depth.warning.empty()) run.Warn(depth.warning);
  run.Print(fmt::format("{}: {:.1f} % of the pixels measured ({})", depth.method,
                        100 * depth.valid_fraction, depth.reason));
}

}  // namespace

void AddDepth(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = AddVerb(app, globals, "depth", "Estimate the depth of one view");
  AddScene(verb, arguments->scene);
  verb->add_option("--view", arguments->view, "Name of the view")->required();
  AddPath(verb, "--output", arguments->output,
          "COLMAP depth map (.bin), z in the workspace's unit, 0 unknown")
      ->required();
  AddPath(verb, "--png", arguments->png, "Also a picture: near warm, far cold");
  AddPreset(verb, arguments->edit);
  AddDepthOptions(verb, arguments->edit, "--method");
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { Depth(*arguments, run); }; });
}

}  // namespace retint::cli
