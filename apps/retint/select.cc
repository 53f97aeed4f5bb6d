// SPDX-License-Identifier: BSD-3-Clause
// retint select: painted views to a registered point cloud.
#include <fmt/format.h>

#include "base/error.h"
#include "base/files.h"
#include "base/staged_output.h"
#include "colmap_io/image_io.h"
#include "reporting/export.h"
#include "retint/common.h"
#include "retint/help.h"
#include "retint/results.h"

namespace retint::cli {
namespace {

struct Arguments {
  SceneArguments scene;
  EditArguments edit;
  PaintArguments paint;
  LargeArguments large;
  std::vector<std::filesystem::path> erase;
  std::filesystem::path output, append, report;
};

// The i-th erase mask belongs to the i-th view; further views erase nothing.
int64_t EraseAll(const Arguments& arguments, const SelectOptions& options, EditSession& session,
                 SelectionCloud& cloud, Run& run) {
  int64_t erased = 0;
  for (size_t i = 0; i < arguments.erase.size(); ++i) {
    for (const auto& view :
         session.scene().pictures().ReadBrush(arguments.paint.views[i], arguments.erase[i])) {
      const DepthEstimate depth =
          session.selection().EstimateDepth(view.camera, options, run.monitor());
      erased += Erase(cloud, view.camera, view.mask, depth.depth);
    }
  }
  return erased;
}

void CheckArguments(const Arguments& arguments) {
  CheckOption(
      !arguments.paint.masks.empty() || (!arguments.append.empty() && !arguments.erase.empty()),
      "--mask is required (without it, --append and --erase are)");
  CheckOption(arguments.erase.size() <= arguments.paint.views.size(),
              "--erase belongs to the --view in the same place, there are more of it than views");
  CheckOutput(arguments.output);
  if (!arguments.report.empty()) CheckOutput(arguments.report);
}

// The scene, or the part of a large one for the depth of the painted views.
std::unique_ptr<EditSession> OpenPainted(const Arguments& arguments, const SelectOptions& options,
                                         Run& run) {
  const auto large = OpenLarge(arguments.scene, arguments.large, 0, /*refit=*/nullptr, run);
  if (!large) return OpenSession(arguments.scene, 0, run, arguments.large.Limits(run));
  auto session = large->Show(arguments.paint.views, nullptr, run.monitor());
  DescribeSession(*session, run.globals().backend, run);
  std::vector<PosedCamera> cameras;
  for (const View* view : session->scene().views()) {
    cameras.push_back(session->scene().reconstruction().Posed(*view));
  }
  return large->ForDepth(cameras, options, std::move(session), run.monitor());
}

void Select(const Arguments& arguments, Run& run) {
  const SelectOptions options = Resolve(arguments.edit, run.globals()).select;
  CheckArguments(arguments);
  const auto session = OpenPainted(arguments, options, run);
  SelectionCloud cloud;
  if (!arguments.append.empty()) cloud = ReadCloud(arguments.append);
  SelectionResult added;
  if (!arguments.paint.masks.empty()) {
    added = session->selection().Select(ReadPaint(arguments.paint, session->scene().pictures()),
                                        options, run.monitor());
    Append(cloud, added.cloud);
  }
  const int64_t erased = EraseAll(arguments, options, *session, cloud, run);
  if (cloud.points.empty()) throw InputError("the selection is empty");
  WarnOfMismatch(arguments.paint.views, *session, run);
  StagedOutput staged;
  staged.Add(arguments.output, [&](const auto& path) { WriteCloud(path, cloud); });
  if (!arguments.report.empty()) {
    RunReport report = MakeReport(*session);
    report.options = SettingsThatApply(Described(options));
    report.painted = added.painted;
    staged.Add(arguments.report, [&](const auto& path) { WriteFile(path, ToJson(report)); });
  }
  run.monitor().ThrowIfCancelled();
  run.Commit(staged);
  run.FinishProgress();
  for (const PaintedReport& view : added.painted) {
    run.Print(fmt::format("{}: {} mask pixels, {} sampled, {} kept; depth {} {:.1f} % measured; {}",
                          view.view, view.cloud.mask_pixels, view.cloud.sampled, view.cloud.kept,
                          view.depth_method, 100 * view.valid_fraction,
                          view.registration.BriefReport()));
  }
  if (erased > 0) run.Print(fmt::format("erased {} points", erased));
  run.Print(fmt::format("wrote {} points to {}", cloud.points.size(), arguments.output.string()));
}

}  // namespace

void AddSelect(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb =
      AddVerb(app, globals, "select", "Turn painted views into a registered 3D selection");
  AddScene(verb, globals, arguments->scene);
  AddRepeated(verb, "--view", arguments->paint.views,
              "Name of the painted view; repeat with --mask for several views of one selection")
      ->required()
      ->type_name("NAME");
  Everyday(verb, AddRepeated(verb, "--mask", arguments->paint.masks,
                             "Mask of that view: any picture of its size, black or transparent "
                             "outside")
                     ->type_name("FILE"));
  AddPath(verb, "-o,--output", arguments->output, "Point cloud to write (.ply)")->required();
  Everyday(verb, AddPath(verb, "--append", arguments->append, "Point cloud (.ply) to add to"));
  AddRepeated(verb, "--erase", arguments->erase,
              "Mask of pixels to take away, of the --view in the same place")
      ->type_name("FILE");
  AddPath(verb, "--report", arguments->report, "Report to write (.json)");
  AddPreset(verb, arguments->edit);
  AddDepthOptions(verb, arguments->edit);
  AddCloudOptions(verb, arguments->edit);
  AddLarge(verb, arguments->large, /*selects=*/false);
  AddExamples(verb,
              {"retint select sample --view 023.png --mask sample/masks/023.png.png -o cloud.ply"});
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { Select(*arguments, run); }; });
}

}  // namespace retint::cli
