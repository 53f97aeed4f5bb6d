// SPDX-License-Identifier: BSD-3-Clause
// retint refit: masks and an edit to a recolored splat.
#include <fmt/format.h>

#include "base/error.h"
#include "base/files.h"
#include "base/ranks.h"
#include "base/staged_output.h"
#include "pipeline/edit_checks.h"
#include "reporting/export.h"
#include "reporting/export_photos.h"
#include "retint/common.h"
#include "retint/help.h"
#include "retint/results.h"
#include "selecting/selection_files.h"
#include "splat_io/splat_io.h"
#include "splat_io/streamed_sog.h"

namespace retint::cli {
namespace {

struct Arguments {
  SceneArguments scene;
  EditArguments edit;
  ColorArguments color;
  LargeArguments large;
  MaskArguments masks;
  std::filesystem::path output, report, photos;
  std::string mask_names{kMaskNames[0]};
};

// The scene, or the part of a large one that the masks' views see, and the masks with their shares.
struct Masked {
  std::unique_ptr<LargeScene> large;  // null of others
  std::unique_ptr<EditSession> session;
  std::map<std::string, Mask> masks;  // of views
  std::vector<float> shares;          // [N], or empty: to be computed from the masks
};

EditOutputs OutputsOf(const Arguments& arguments) {
  EditOutputs outputs;
  outputs.splats = {arguments.output};
  outputs.report = arguments.report;
  outputs.photos = arguments.photos;
  outputs.mask_names = MaskNamesOf(arguments.mask_names);
  return outputs;
}

Masked Open(const Arguments& arguments, const RefitJob& job, Run& run) {
  Masked opened;
  const int holdout = arguments.color.holdout;
  opened.large = OpenLarge(arguments.scene, arguments.large, holdout, &job.options, run);
  if (!opened.large) {
    opened.session = OpenSession(arguments.scene, holdout, run, arguments.large.Limits(run));
    CheckStreamedSog(arguments.output, opened.session->scene().original());
  }
  LargeScene* const large = opened.large.get();
  if (large) {
    CheckOption(CodecForWriting(arguments.output).Name() == "3DGS .ply",
                "a splat that is opened in parts is written as a patched copy: --output must be a "
                "3DGS .ply");
    CheckOption(arguments.photos.empty(),
                "--photos needs all views of the scene, and it is opened in parts");
  }
  const Workspace& workspace = large ? large->workspace() : opened.session->scene().workspace();
  if (job.target == TargetKind::kPhoto) WarnOfMissingPhotos(workspace, run);
  const Pictures pictures = large ? large->pictures() : opened.session->scene().pictures();
  MaskFolder masks = ReadMasksByName(arguments.masks, pictures, run);
  std::string why_not;
  if (large) {
    const SparseShares shares =
        ReadSparseShares(arguments.masks.folder, masks.checksum, large->NumGaussians());
    why_not = shares.why_not;
    opened.session = large->ForMasks(masks, shares, job.options.active_threshold, run.monitor());
    if (shares.known) opened.shares = shares.Of(opened.session->scene().part()->records);
    StartSession(*opened.session, run);
  } else {
    SharesOfMasks shares = ReadShares(arguments.masks.folder, masks.checksum,
                                      opened.session->scene().original().NumGaussians());
    why_not = shares.why_not;
    opened.shares = std::move(shares.shares);
  }
  if (!why_not.empty()) run.Warn(why_not);
  opened.masks = std::move(masks).OfViews(pictures, opened.session->scene().views());
  return opened;
}

void Refit(const Arguments& arguments, Run& run) {
  const ColorEdit edit = arguments.color.flags.Resolve(run);
  RefitJob job = Resolve(arguments.edit, run.globals()).refit;

  EditRecipe written;
  written.workspace = arguments.scene.workspace;
  written.outputs = OutputsOf(arguments);
  CheckOutputs(written);
  const size_t cache = arguments.large.Limits(run).Cache(job.options.RegionCacheBytes());
  job.options.SetRegionCacheBytes(cache);
  Masked opened = Open(arguments, job, run);
  EditSession* const session = opened.session.get();
  const RegionId region = session->store().Add("selection", std::move(opened.masks),
                                               std::move(opened.shares), edit, run.monitor());
  WarnOfMainColor(edit, run);
  session->store().Do(SetEdit{region, session->store().regions().Find(region)->edit,
                              arguments.color.flags.strength()});
  LimitRegionCache(arguments.large.Given(), opened.large.get(), *session, region, &job.options);
  session->refits().Refit(job, run.monitor());
  const FloatArray after = session->refits().CurrentSh();
  const QualityReport quality = session->refits().Evaluate(region, session->scene().original().sh,
                                                           after, job.target, run.monitor());
  RunReport report = MakeReport(*session);
  if (opened.large) report.out_of_core = opened.large->Report();
  if (!run.Writes()) return;
  const ShareAmong alone;
  std::optional<FormatError> format;
  StagedOutput staged;
  {
    const StageClock::Lap lap(session->scene().clock(), "save");
    staged.Add(arguments.output, [&](const auto& path) {
      const std::string warning =
          WriteEdited(*session, opened.large.get(), path, arguments.output, run.monitor());
      if (!warning.empty()) run.Warn(warning);
      format = MeasureWritten(session->scene(), after, path, run.monitor());
    });
    StagePhotos(
        staged, *session, arguments.photos, written.outputs.mask_names,
        [&](const std::string& warning) { run.Warn(warning); }, run.monitor());
  }
  if (!arguments.report.empty()) {
    const RunReport measured = MakeReport(*session);
    report.stages_ms = measured.stages_ms;
    report.peak_rss_mb = measured.peak_rss_mb;
    report.peak_device_mb = measured.peak_device_mb;
    const Coverage coverage =
        MeasureCoverage(session->store().regions().Find(region)->selection->masks,
                        session->scene().reconstruction().views.size());
    report.mask_views = coverage.views;
    report.mean_coverage = coverage.mean;
    report.options = SettingsThatApply(Described(job));
    report.quality = quality;
    staged.Add(arguments.report,
               [&](const auto& path) { WriteFile(path, WithFormatError(ToJson(report), format)); });
  }
  run.monitor().Step("save", 1, 1);
  run.Commit(staged);
  WarnOfLosses(arguments.output, session->scene().original(), run);
  run.FinishProgress();
  const ColorEdit& applied = session->store().regions().Find(region)->edit;
  report.quality = quality;
  if (run.globals().verbose) {
    PrintEdit(applied, run);
    run.Print(fmt::format("refit        {}", session->refits().Summary().BriefReport()));
    PrintQuality(quality, run);
    PrintFormatError(format, run);
    PrintParts(report, run);
  }
  PrintSummary(applied, report, {}, run);
  PrintOutOfGamut(applied, quality, run);
  PrintOutputs(written.outputs, run);
}

}  // namespace

void AddRefit(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = AddVerb(app, globals, "refit",
                           "Recolor the inside of masks, such as those of another program");
  AddScene(verb, globals, arguments->scene);
  AddMasks(verb, arguments->masks)->required();
  AddPath(verb, "-o,--output", arguments->output, "Splat to write, in the format of its extension")
      ->required();
  Everyday(verb, AddPath(verb, "--report", arguments->report, "Report to write (.json)"));
  AddPhotos(verb, arguments->photos, arguments->mask_names);
  AddPreset(verb, arguments->edit);
  AddRefitOptions(verb, arguments->color, arguments->edit);
  AddLarge(verb, arguments->large, /*selects=*/true);
  AddExamples(verb, {"retint refit sample --masks sample/truth/masks/box --to teal -o teal.ply"});
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { Refit(*arguments, run); }; });
}

}  // namespace retint::cli
