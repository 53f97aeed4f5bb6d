// SPDX-License-Identifier: BSD-3-Clause
// retint project: a point cloud to a mask on every view.
#include <fmt/format.h>

#include "base/error.h"
#include "base/ranks.h"
#include "base/staged_output.h"
#include "reporting/export.h"
#include "retint/common.h"
#include "retint/help.h"
#include "retint/results.h"
#include "selecting/paint_held.h"
#include "selecting/selection_files.h"

namespace retint::cli {
namespace {

struct Arguments {
  SceneArguments scene;
  EditArguments edit;
  PaintArguments paint;
  LargeArguments large;
  std::filesystem::path cloud, output;
  std::string mask_names{kMaskNames[0]};
};

void Project(const Arguments& arguments, Run& run) {
  const ProjectorOptions options = Resolve(arguments.edit, run.globals()).projector;
  if (run.Writes()) CheckOutput(arguments.output, /*as_folder=*/true);
  SelectionSource source;
  source.projector = options;
  source.cloud = ReadCloud(arguments.cloud);
  if (source.cloud.points.empty()) throw InputError(arguments.cloud, "holds no points");
  const auto large = OpenLarge(arguments.scene, arguments.large, 0, /*refit=*/nullptr, run);
  auto session =
      large ? nullptr : OpenSession(arguments.scene, 0, run, arguments.large.Limits(run));
  const Pictures pictures = large ? large->pictures() : session->scene().pictures();
  source.painted = ReadPaint(arguments.paint, pictures);
  if (source.painted.empty() && !source.cloud.sources.empty() &&
      options.kind == ProjectorKind::kGaussians) {
    run.Warn("without --view and --mask nothing is known of what was painted: masks are rougher");
  }
  if (large) {
    session = large->ForSelections({&source}, {}, nullptr, run.monitor());
    StartSession(*session, run);
  }
  ProjectedMasks masks = session->selection().Project(source, run.monitor());
  WarnOfPaint(source.painted, masks.masks, *session, run);
  const std::string verdict = source.painted.empty() ? std::string()
                                                     : VerdictOfPaint(session->scene().workspace(),
                                                                      source.painted, masks.masks);
  if (!run.Writes()) return;
  const ShareAmong alone;
  if (!pictures.AreViews()) masks.masks = pictures.FromViews(masks.masks);
  StagedOutput staged;
  staged.AddFolder(arguments.output, [&](const std::filesystem::path& folder) {
    WriteMasks(folder, masks.masks, run.monitor(), MaskNamesOf(arguments.mask_names));
    if (!masks.shares.empty()) {
      const auto& part = session->scene().part();
      WriteShares(folder, masks.masks, masks.shares, masks.confidence, part ? &*part : nullptr);
    }
  });
  run.Commit(staged);
  run.FinishProgress();
  const Coverage coverage = MeasureCoverage(masks.masks, masks.masks.size());
  run.Print(fmt::format(
      "wrote {} masks to {}: {} hold a selected pixel, {:.2f} % covered on average",
      masks.masks.size(), arguments.output.string(), coverage.views, 100 * coverage.mean));
  if (!verdict.empty()) run.Print("selection: " + verdict);
  RunReport report = MakeReport(*session);
  if (large) report.out_of_core = large->Report();
  PrintParts(report, run);
}

}  // namespace

void AddProject(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = AddVerb(app, globals, "project", "Project a selection to masks on every view");
  AddScene(verb, globals, arguments->scene);
  AddPath(verb, "--cloud", arguments->cloud,
          "Point cloud (.ply) of `retint select`, or any with x y z in the workspace's frame")
      ->required();
  AddPath(verb, "-o,--output", arguments->output,
          "Folder to write: masks, coverage of the Gaussians (shares.bin) and "
          "its confidence (confidence.bin)",
          "FOLDER")
      ->required();
  AddMaskNames(verb, arguments->mask_names);
  AddPaint(verb, arguments->paint, /*required=*/false);
  AddPreset(verb, arguments->edit);
  AddProjectorOptions(verb, arguments->edit);
  AddLarge(verb, arguments->large, /*selects=*/true);
  AddExamples(verb, {"retint project sample --cloud cloud.ply --view 023.png "
                     "--mask sample/masks/023.png.png -o masks"});
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { Project(*arguments, run); }; });
}

}  // namespace retint::cli
