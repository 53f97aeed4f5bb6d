// SPDX-License-Identifier: BSD-3-Clause
// retint recolor: the whole pipeline, painted views to a recolored splat.
#include <algorithm>

#include <fmt/format.h>

#include "base/error.h"
#include "base/files.h"
#include "base/ranks.h"
#include "base/run_clock.h"
#include "base/staged_output.h"
#include "colmap_io/image_io.h"
#include "editing/compare_pictures.h"
#include "editing/finer_session.h"
#include "reporting/export.h"
#include "retint/common.h"
#include "retint/results.h"
#include "selecting/paint_held.h"
#include "splat_io/splat_io.h"

namespace retint::cli {
namespace {

struct Arguments {
  SceneArguments scene;
  EditArguments edit;
  PaintArguments paint;
  ColorArguments color;
  LargeArguments large;
  bool refine_gaussians = false;
  RefineOptions refine;
  OptionFlags refine_flags;
  std::filesystem::path output, report, page, stages, comparison;
};

void CheckOutputs(const Arguments& arguments) {
  CodecForWriting(arguments.output);
  CheckOutput(arguments.output);
  if (!arguments.report.empty()) CheckOutput(arguments.report);
  if (!arguments.page.empty()) CheckOutput(arguments.page);
  if (!arguments.comparison.empty()) CheckPicture(arguments.comparison);
  if (arguments.stages.empty()) return;
  CheckOutput(arguments.stages, /*as_folder=*/true);
  std::error_code ignored;
  CheckOption(!std::filesystem::equivalent(arguments.stages, arguments.scene.workspace, ignored),
              "--save-stages is the workspace, whose masks it would replace: name another folder");
}

// What the format of the splat adds.
std::optional<FormatError> Save(const Arguments& arguments, const Recolored& result,
                                const LargeScene* large, RunReport report, Run& run) {
  std::optional<FormatError> format;
  EditSession& session = *result.session;
  StagedOutput staged;
  {
    const StageClock::Lap lap(session.scene().clock(), "save");
    staged.Add(arguments.output, [&](const auto& path) {
      WriteEdited(session, large, path, arguments.output, run);
      format = MeasureWritten(session.scene(), result.sh_after, path, run.monitor());
    });
    if (!arguments.comparison.empty()) {
      staged.Add(arguments.comparison,
                 [&](const auto& path) { WritePng(path, ComparisonPicture(result, run)); });
    }
    if (!arguments.stages.empty()) {
      staged.AddFolder(arguments.stages,
                       [&](const auto& folder) { WriteStages(folder, result, run); });
    }
  }
  const RunReport measured = MakeReport(session);
  report.stages_ms = measured.stages_ms;
  report.peak_rss_mb = measured.peak_rss_mb;
  report.peak_device_mb = measured.peak_device_mb;
  if (!arguments.page.empty()) {
    staged.Add(arguments.page, [&](const auto& path) { WritePage(path, session, report, run); });
  }
  if (!arguments.report.empty()) {
    staged.Add(arguments.report,
               [&](const auto& path) { WriteFile(path, WithFormatError(ToJson(report), format)); });
  }
  run.monitor().Step("save", 1, 1);
  run.Commit(staged);
  WarnOfLosses(arguments.output, session.scene().original(), run);
  return format;
}

void PrintResult(const Arguments& arguments, const RunReport& report,
                 const std::optional<FormatError>& format, const Recolored& result,
                 const Run& run) {
  EditSession& session = *result.session;
  for (const PaintedReport& view : report.painted) {
    run.Print(fmt::format("{:<12} {} {:.1f} % measured, {} of {} points kept; {}", view.view,
                          view.depth_method, 100 * view.valid_fraction, view.cloud.kept,
                          view.cloud.sampled, view.registration.BriefReport()));
  }
  const Region& region = session.store().regions().regions.front();
  run.Print(fmt::format("selection    {}, {:.2f} % of their pixels",
                        VerdictOfPaint(session.scene().workspace(),
                                       region.selection->source.painted, region.selection->masks),
                        100 * report.mean_coverage));
  const ColorEdit& edit = region.edit;
  PrintEdit(edit, run);
  if (result.refined) run.Print("refine       " + result.refined->BriefReport());
  run.Print(fmt::format("refit        {}", report.refit.BriefReport()));
  PrintQuality(report.quality, run, &session);
  PrintOutOfGamut(edit, report.quality, run);
  PrintFormatError(format, run);
  PrintParts(report, run);
  run.Print(fmt::format("time         {:.1f} s, peak memory {:.0f} MB",
                        session.scene().clock().Total() / 1000, PeakRssMb()));
  for (const auto& path : {arguments.output, arguments.report, arguments.page, arguments.comparison,
                           arguments.stages}) {
    if (!path.empty()) run.Print(fmt::format("wrote        {}", path.string()));
  }
}

// What was painted: the masks that were given, else what the edit's pictures changed.
std::vector<PaintedView> PaintOf(const Arguments& arguments, ColorEdit& edit,
                                 EditSession& session) {
  std::vector<PaintedView> painted = ReadPaint(arguments.paint, session.scene().pictures());
  const bool none = painted.empty();
  for (ColorOperation& op : edit.operations) {
    if (!op.picture) continue;
    ReadPictures(op, session.scene().workspace());
    if (!none) continue;
    for (auto& [name, mask] : ChangedMasks(op, session.scene(), session.scene().original().sh)) {
      painted.push_back(session.selection().Paint(name, std::move(mask)));
      const Workspace& workspace = session.scene().workspace();
      const View& view = workspace.RequireView(name);
      if (workspace.PhotoOf(view)) painted.back().seen = workspace.photo_pixels->Reach(view.id);
    }
  }
  return painted;
}

std::vector<std::string> PicturesOf(const ColorEdit& edit) {
  std::vector<std::string> names;
  for (const ColorOperation& op : edit.operations) {
    if (!op.picture) continue;
    for (const EditedPicture& picture : op.picture->pictures) names.push_back(picture.view);
  }
  return names;
}

// The scene, or the part of a large one on which is painted; `large` is null of others.
std::unique_ptr<EditSession> OpenPainted(const Arguments& arguments, const ColorEdit& edit,
                                         const RefitOptions& refit,
                                         std::unique_ptr<LargeScene>* large, Run& run) {
  const int holdout = arguments.color.holdout;
  *large = OpenLarge(arguments.scene, arguments.large, holdout, &refit, run);
  if (!*large) return OpenSession(arguments.scene, holdout, run, arguments.large.Limits(run));
  CheckOutputOfParts(arguments.output);
  CheckOption(!arguments.refine_gaussians,
              "--refine-gaussians splits Gaussians of a splat that is opened whole");
  CheckOption(arguments.stages.empty(),
              "--save-stages draws every view of the scene, which is not to be had in parts");
  std::vector<std::string> shown = PicturesOf(edit);
  shown.insert(shown.end(), arguments.paint.views.begin(), arguments.paint.views.end());
  auto session = (*large)->Show(shown, nullptr, run.monitor());
  StartSession(*session, run);
  return session;
}

// The region's scene with its large Gaussians split.
std::unique_ptr<EditSession> RefineRegion(const Arguments& arguments,
                                          std::unique_ptr<EditSession> session, Recolored* result,
                                          Run& run) {
  FinerSession finer =
      MakeFinerSession(*session, result->region, arguments.refine, {}, run.monitor());
  WarnOfRefinement(finer.summary, arguments.refine, run);
  if (!finer.session) return session;
  result->refined = finer.summary;
  result->session = finer.session.get();
  return std::move(finer.session);
}

void WarnOfLargeGaussians(const EditSession& session, RegionId region, Run& run) {
  const double share =
      PaintOnLargeGaussians(*session.store().regions().Find(region), session.scene());
  if (share < kMuchPaint) return;
  run.Warn(
      fmt::format("{:.0f} % of the paint is on Gaussians too large for stripes or letters; "
                  "--refine-gaussians splits them",
                  100 * share));
}

void Recolor(const Arguments& arguments, Run& run) {
  EditOptions options = Resolve(arguments.edit, run.globals());
  RefitOptions& refit = options.refit.options;
  options.select.keep_raw = !arguments.stages.empty();
  const RefitJob& job = options.refit;
  ColorEdit edit = arguments.color.flags.Resolve(run);
  CheckOption(!arguments.paint.views.empty() || !arguments.paint.masks.empty() ||
                  std::any_of(edit.operations.begin(), edit.operations.end(),
                              [](const auto& op) { return op.picture != nullptr; }),
              "--view and --mask are required, or --edited, whose pictures show what is meant");
  if (run.Writes()) CheckOutputs(arguments);
  refit.SetRegionCacheBytes(arguments.large.Limits(run).Cache(refit.RegionCacheBytes()));

  std::unique_ptr<LargeScene> large;
  auto session = OpenPainted(arguments, edit, refit, &large, run);
  Recolored result;
  result.target = job.target;
  result.painted = PaintOf(arguments, edit, *session);
  if (large) {
    std::vector<PosedCamera> cameras;
    for (const PaintedView& view : result.painted) cameras.push_back(view.camera);
    session = large->ForDepth(cameras, options.select, std::move(session), run.monitor());
  }
  if (job.target == TargetKind::kPhoto) WarnOfMissingPhotos(session->scene().workspace(), run);
  result.selection = session->selection().Select(result.painted, options.select, run.monitor());
  std::vector<std::string> shown = arguments.paint.views;
  if (shown.empty()) shown = PicturesOf(edit);
  WarnOfMismatch(shown, *session, run);
  if (large) {
    session = large->ForSelection(result.selection.cloud, result.painted, PicturesOf(edit),
                                  options.projector, std::move(session), run.monitor());
  }
  result.session = session.get();
  ProjectedMasks masks = session->selection().Project(result.selection.cloud, result.painted,
                                                      options.projector, run.monitor());
  WarnOfPaint(result.painted, masks.masks, *session, run);
  Coverage coverage = MeasureCoverage(masks.masks);
  // Views that do not see the selection have no mask in parts, and an empty one else.
  coverage.mean *= static_cast<double>(masks.masks.size()) /
                   static_cast<double>(session->scene().reconstruction().views.size());
  SelectionSource source;  // whose pixels say what the region's main color is
  source.painted = result.painted;
  result.region = session->store().Add("selection", std::move(masks.masks), std::move(masks.shares),
                                       edit, run.monitor(), std::move(source));
  session->store().SetEdit(result.region, session->store().regions().Find(result.region)->edit,
                           arguments.color.flags.strength());
  if (arguments.refine_gaussians) {
    session = RefineRegion(arguments, std::move(session), &result, run);
  } else if (!large) {
    WarnOfLargeGaussians(*session, result.region, run);
  }
  KeepWithin(arguments.large, large.get(), *session, result.region, &refit);
  session->refits().Refit(job, run.monitor());
  result.sh_after = session->refits().CurrentSh();

  RunReport report = MakeReport(*session);
  if (large) report.out_of_core = large->Report();
  report.refine = result.refined;
  report.options = SettingsThatApply(Described(options));
  report.painted = result.selection.painted;
  report.mask_views = coverage.views;
  report.mean_coverage = coverage.mean;
  // The line that is printed is not worth what the figures of a file are.
  constexpr int kRowStepOfLine = 4;
  constexpr size_t kViewsOfLine = 24;
  const bool is_kept = !arguments.report.empty() || !arguments.page.empty();
  report.quality = session->refits().Evaluate(
      result.region, session->scene().original().sh, result.sh_after, job.target, run.monitor(),
      is_kept ? 0 : kViewsOfLine, is_kept ? 1 : kRowStepOfLine);
  if (!run.Writes()) return;
  const ShareAmong alone;
  std::optional<PaintAdvice> advice;
  if (!large && !result.refined) {
    advice = AdviseOn(*session, result.region, result.painted, masks, run.monitor());
  }
  const std::optional<FormatError> format = Save(arguments, result, large.get(), report, run);
  run.FinishProgress();
  PrintResult(arguments, report, format, result, run);
  PrintAdvice(advice, run);
}

void AddRefineOptions(CLI::App* verb, Arguments& arguments) {
  const std::string group = "Refine";
  CLI::Option* const refine =
      verb->add_flag("--refine-gaussians", arguments.refine_gaussians,
                     "Before the fit, split large Gaussians that take paint of --edited, or of "
                     "other edits those inside the masks, as `retint refine` does; the output has "
                     "more Gaussians")
          ->group(group);
  OptionList list;
  arguments.refine.Describe(list);
  arguments.refine_flags.Add(verb, group, list);
  for (const Option& option : list) verb->get_option(option.flag)->needs(refine);
}

}  // namespace

void AddRecolor(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb =
      AddVerb(app, globals, "recolor", "The whole pipeline: painted views to a recolored splat");
  AddScene(verb, arguments->scene);
  AddPaint(verb, arguments->paint, /*required=*/false);
  AddPath(verb, "--output", arguments->output, "Splat to write, in the format of its extension")
      ->required();
  AddPath(verb, "--report", arguments->report, "Report to write (.json)");
  AddPath(verb, "--report-html", arguments->page,
          "Page (.html) to write: every view before, after and masked, plots, options");
  AddPath(verb, "--comparison", arguments->comparison,
          "Picture (.png) to write: before, mask and after of up to four views");
  AddPath(verb, "--save-stages", arguments->stages,
          "Folder for what every stage made: depth, clouds, registration, masks, targets, "
          "result",
          "FOLDER");
  AddPreset(verb, arguments->edit);
  AddRefitOptions(verb, arguments->color, arguments->edit);
  AddDepthOptions(verb, arguments->edit, "--depth");
  AddCloudOptions(verb, arguments->edit);
  AddProjectorOptions(verb, arguments->edit);
  AddLarge(verb, arguments->large, /*selects=*/true);
  AddRefineOptions(verb, *arguments);
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { Recolor(*arguments, run); }; });
}

}  // namespace retint::cli
