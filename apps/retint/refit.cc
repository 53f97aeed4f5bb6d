// SPDX-License-Identifier: BSD-3-Clause
// retint refit: masks and an edit to a recolored splat.
#include <fmt/format.h>

#include "base/error.h"
#include "base/files.h"
#include "base/ranks.h"
#include "retint/common.h"
#include "retint/results.h"
#include "session/selection_files.h"
#include "splat_io/splat_io.h"

namespace retint::cli {
namespace {

struct Arguments {
  SceneArguments scene;
  EditArguments edit;
  ColorArguments color;
  std::filesystem::path masks, output, report;
};

void Refit(const Arguments& arguments, Run& run) {
  const ColorEdit edit = arguments.color.flags.Resolve();
  const RefitJob job = Resolve(arguments.edit, run.globals()).refit;
  CodecForWriting(arguments.output);
  if (run.Writes()) {
    CheckOutput(arguments.output);
    if (!arguments.report.empty()) CheckOutput(arguments.report);
  }
  const auto session = OpenSession(arguments.scene, arguments.color.holdout, run);
  if (job.target == TargetKind::kPhoto) WarnOfMissingPhotos(*session, run);
  auto masks = ReadMasksByName(arguments.masks, *session, run);
  SharesOfMasks shares = ReadShares(arguments.masks, masks, session->original().NumGaussians());
  if (!shares.why_not.empty()) run.Warn(shares.why_not);
  if (const Pictures pictures = session->pictures(); !pictures.AreViews()) {
    masks = pictures.ToViews(masks);
  }
  const RegionId region = session->AddRegion("selection", std::move(masks),
                                             std::move(shares.shares), edit, run.monitor());
  session->SetEdit(region, session->regions().Find(region)->edit, arguments.color.flags.strength());
  session->Refit(job, run.monitor());
  const std::vector<float> after = session->CurrentSh();
  const QualityReport quality =
      session->refits().Evaluate(region, session->original().sh, after, job.target, run.monitor());
  RunReport report = session->MakeReport();
  if (!run.Writes()) return;
  const ShareAmong alone;
  std::optional<FormatError> format;
  StagedOutput staged;
  {
    const StageClock::Lap lap(session->scene().clock(), "save");
    staged.Add(arguments.output, [&](const auto& path) {
      session->WriteSplat(path, run.monitor());
      format = MeasureWritten(session->scene(), after, path, run.monitor());
    });
  }
  if (!arguments.report.empty()) {
    report.stages_ms = session->MakeReport().stages_ms;
    const Coverage coverage = MeasureCoverage(session->regions().Find(region)->selection->masks);
    report.mask_views = coverage.views;
    report.mean_coverage = coverage.mean;
    report.options = SettingsThatApply(Described(job));
    report.quality = quality;
    staged.Add(arguments.report,
               [&](const auto& path) { WriteFile(path, WithFormatError(ToJson(report), format)); });
  }
  run.monitor().Step("save", 1, 1);
  staged.Commit();
  WarnOfLosses(arguments.output, session->original(), run);
  run.FinishProgress();
  PrintPictures(session->regions().Find(region)->edit, run);
  run.Print(fmt::format("refit        {}", session->refits().Summary().BriefReport()));
  PrintQuality(quality, run);
  PrintFormatError(format, run);
  run.Print(fmt::format("wrote        {}", arguments.output.string()));
}

}  // namespace

void AddRefit(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = AddVerb(app, globals, "refit", "Recolor what masks select");
  AddScene(verb, arguments->scene);
  AddPath(verb, "--masks", arguments->masks,
          "Folder of <image name>.png; a view without one takes no part. Shares that `retint "
          "project` wrote there are used as long as the masks are unchanged",
          "FOLDER")
      ->required();
  AddPath(verb, "--output", arguments->output, "Splat to write, in the format of its extension")
      ->required();
  AddPath(verb, "--report", arguments->report, "Report to write (.json)");
  AddPreset(verb, arguments->edit);
  AddRefitOptions(verb, arguments->color, arguments->edit);
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { Refit(*arguments, run); }; });
}

}  // namespace retint::cli
