// SPDX-License-Identifier: BSD-3-Clause
// retint evaluate: how well a recolored splat shows an edit, whoever made it.
#include <cstring>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "base/error.h"
#include "base/files.h"
#include "base/staged_output.h"
#include "pipeline/large_evaluation.h"
#include "reporting/export.h"
#include "retint/common.h"
#include "retint/help.h"
#include "retint/results.h"
#include "selection/mask_score.h"
#include "splat_io/splat_io.h"

namespace retint::cli {
namespace {

struct Arguments {
  SceneArguments scene;
  LargeArguments large;
  MaskArguments masks;
  std::filesystem::path after, true_masks, report;
  EditFlags edit;
  std::string target = "render";
  int holdout = 0;
};

GaussianModel ReadAfter(const Arguments& arguments, const GaussianModel& before) {
  GaussianModel after = ReadSplat(arguments.after);
  CheckSameShape({arguments.scene.splat, before.NumGaussians(), before.sh_degree},
                 {arguments.after, after.NumGaussians(), after.sh_degree});
  if (after.means != before.means) FailOfOtherMeans(arguments.scene.splat, arguments.after);
  return after;
}

int64_t CountChanged(const GaussianModel& before, const GaussianModel& after) {
  const size_t block = static_cast<size_t>(before.NumShCoeffs()) * 3;
  int64_t changed = 0;
  for (size_t i = 0; i < before.NumGaussians(); ++i) {
    changed += std::memcmp(&before.sh[i * block], &after.sh[i * block], block * sizeof(float)) != 0;
  }
  return changed;
}

// Mean over the views that either mask shows in, of those that have both.
double MeanIou(const std::map<std::string, Mask>& masks, const std::map<std::string, Mask>& truth) {
  double sum = 0;
  int views = 0;
  for (const auto& [name, mask] : masks) {
    const auto found = truth.find(name);
    if (found == truth.end()) continue;
    const std::optional<double> iou = Iou(mask, found->second);
    if (!iou) continue;
    sum += *iou;
    ++views;
  }
  return views > 0 ? sum / views : 0;
}

std::map<std::string, Mask> ReadViewMasks(const MaskArguments& masks, const EditSession& session,
                                          Run& run) {
  const Pictures pictures = session.scene().pictures();
  return ReadMasksByName(masks, pictures, run).OfViews(pictures, session.scene().views());
}

// The true masks as another region of the session, with the same edit.
TrueMaskReport EvaluateTrueMasks(const Arguments& arguments, const Region& region,
                                 TargetKind target, const GaussianModel& after,
                                 EditSession& session, Run& run) {
  const std::shared_ptr<const RegionSelection> selection = region.selection;
  const ColorEdit edit = region.edit;
  const float strength = region.strength;
  const RegionId id =
      session.store().Add("truth", ReadViewMasks({arguments.true_masks}, session, run),
                          std::vector<float>(after.NumGaussians(), 0.0F), edit, run.monitor());
  session.store().Do(SetEdit{id, edit, strength});
  TrueMaskReport report;
  report.mask_iou = MeanIou(selection->masks, session.store().regions().Find(id)->selection->masks);
  report.quality =
      session.refits().Evaluate(id, session.scene().original().sh, after.sh, target, run.monitor());
  return report;
}

RunReport EvaluateWhole(const Arguments& arguments, const ColorEdit& edit, TargetKind target,
                        Run& run) {
  const auto session =
      OpenSession(arguments.scene, arguments.holdout, run, arguments.large.Limits(run));
  if (target == TargetKind::kPhoto) WarnOfMissingPhotos(session->scene().workspace(), run);
  const GaussianModel after = ReadAfter(arguments, session->scene().original());
  const RegionId region = session->store().Add(
      "selection", ReadViewMasks(arguments.masks, *session, run), {}, edit, run.monitor());
  WarnOfMainColor(edit, run);
  session->store().Do(
      SetEdit{region, session->store().regions().Find(region)->edit, arguments.edit.strength()});
  RunReport report = MakeReport(*session);
  report.quality = session->refits().Evaluate(region, session->scene().original().sh, after.sh,
                                              target, run.monitor());
  if (!arguments.true_masks.empty()) {
    report.true_masks = EvaluateTrueMasks(arguments, *session->store().regions().Find(region),
                                          target, after, *session, run);
  }
  const RegionSelection& selection = *session->store().regions().Find(region)->selection;
  const Coverage coverage = MeasureCoverage(selection.masks, selection.masks.size());
  report.mask_views = coverage.views;
  report.mean_coverage = coverage.mean;
  report.refit.solver = "external";
  report.refit.changed_gaussians = CountChanged(session->scene().original(), after);
  for (const float share : selection.shares) {
    report.refit.active_gaussians += share > RefitOptions{}.active_threshold ? 1 : 0;
  }
  const RunReport measured = MakeReport(*session);
  report.stages_ms = measured.stages_ms;
  report.peak_rss_mb = measured.peak_rss_mb;
  report.peak_device_mb = measured.peak_device_mb;
  return report;
}

// Null: the splat is opened whole.
std::unique_ptr<LargeScene> OpenParts(const Arguments& arguments, Run& run) {
  RefitOptions none;  // two sets of coefficients are held, as by the report on a fit
  none.region_cache_mb = 0;
  return OpenLarge(arguments.scene, arguments.large, arguments.holdout, &none, run);
}

RunReport EvaluateParts(const Arguments& arguments, const ColorEdit& edit, TargetKind target,
                        LargeScene& large, Run& run) {
  if (target == TargetKind::kPhoto) WarnOfMissingPhotos(large.workspace(), run);
  const Pictures pictures = large.pictures();
  LargeEvaluation evaluation;
  evaluation.after = arguments.after;
  evaluation.masks = ReadMasksByName(arguments.masks, pictures, run);
  if (!arguments.true_masks.empty()) {
    evaluation.true_masks = ReadMasksByName({arguments.true_masks}, pictures, run);
  }
  evaluation.edit = edit;
  evaluation.strength = arguments.edit.strength();
  evaluation.target = target;
  evaluation.opened = [&](EditSession& session) { StartSession(session, run); };
  const RunReport report = EvaluateInParts(large, std::move(evaluation), run.monitor());
  WarnOfMainColor(edit, run);
  return report;
}

void Evaluate(const Arguments& arguments, Run& run) {
  const ColorEdit edit = arguments.edit.Resolve(run);
  const TargetKind target = arguments.target == "photo" ? TargetKind::kPhoto : TargetKind::kRender;
  if (!arguments.report.empty()) CheckOutput(arguments.report);
  const auto large = OpenParts(arguments, run);
  const RunReport report = large ? EvaluateParts(arguments, edit, target, *large, run)
                                 : EvaluateWhole(arguments, edit, target, run);
  StagedOutput staged;
  if (!arguments.report.empty()) {
    staged.Add(arguments.report, [&](const auto& path) { WriteFile(path, ToJson(report)); });
  }
  run.monitor().ThrowIfCancelled();
  run.Commit(staged);
  run.FinishProgress();
  run.Print(fmt::format("changed      {} of {} Gaussians, {} inside the masks",
                        report.refit.changed_gaussians, report.gaussians,
                        report.refit.active_gaussians));
  PrintQuality(report.quality, run);
  if (report.true_masks) {
    run.Print(fmt::format("by the true masks, with which the masks have a mean IoU of {:.3f}:",
                          report.true_masks->mask_iou));
    PrintQuality(report.true_masks->quality, run);
  }
  PrintParts(report, run);
}

}  // namespace

void AddEvaluate(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb =
      AddVerb(app, globals, "evaluate", "Measure a recolored splat against the edited targets");
  AddScene(verb, globals, arguments->scene);
  AddPath(verb, "--after", arguments->after, "The scene's splat recolored, by any program")
      ->required();
  AddMasks(verb, arguments->masks)->required();
  AddPath(verb, "--true-masks", arguments->true_masks,
          "Folder of the object's true masks. Retint compares the masks with "
          "them, and gives all figures by them, too",
          "FOLDER");
  arguments->edit.Add(verb, kEditGroup);
  verb->add_option("--target", arguments->target,
                   "Pictures that are edited to become the targets: render or photo")
      ->check(CLI::IsMember({"render", "photo"}));
  Everyday(verb, verb->add_option("--holdout", arguments->holdout,
                                  "Report every N-th view by name on its own")
                     ->check(CLI::Range(0, 1000000)));
  Everyday(verb, AddPath(verb, "--report", arguments->report, "Report to write (.json)"));
  AddLarge(verb, arguments->large, /*selects=*/false);
  AddExamples(verb,
              {"retint evaluate sample --after out.ply --masks sample/truth/masks/box --to teal"});
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { Evaluate(*arguments, run); }; });
}

}  // namespace retint::cli
