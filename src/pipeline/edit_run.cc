// SPDX-License-Identifier: BSD-3-Clause
#include "pipeline/edit_run.h"

#include <algorithm>
#include <future>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"
#include "base/files.h"
#include "base/option_name.h"
#include "base/ranks.h"
#include "base/run_clock.h"
#include "colmap_io/image_io.h"
#include "editing/compare_pictures.h"
#include "editing/finer_session.h"
#include "opening/scene_check.h"
#include "pipeline/edit_checks.h"
#include "pipeline/edit_outputs.h"
#include "pipeline/stage_files.h"
#include "pipeline/stage_keys.h"
#include "recolor/edit_text.h"
#include "reporting/export.h"
#include "reporting/export_photos.h"
#include "reporting/match_report.h"
#include "reporting/report_html.h"
#include "saving/session_file.h"
#include "scene/mask_pixels.h"
#include "selecting/paint_held.h"
#include "splat_io/splat_io.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> PicturesOf(const ColorEdit& edit) {
  std::vector<std::string> names;
  for (const ColorOperation& op : edit.operations) {
    if (!op.picture) continue;
    for (const EditedPicture& picture : op.picture->pictures) names.push_back(picture.view);
  }
  return names;
}

}  // namespace

EditRun::EditRun(const EditRecipe& recipe, SceneSource& scene, StageCache& cache,
                 EditObserver observer)
    : recipe_(recipe),
      scene_(scene),
      cache_(cache),
      observer_(std::move(observer)),
      keeps_stages_(cache.IsThere() && scene.IsWhole() && !CurrentRanks().AreMany()),
      job_(recipe.options.refit) {
  if (job_.target == TargetKind::kPhoto) {
    const std::string missing = WarningOfMissingPhotos(scene_.workspace());
    if (!missing.empty() && observer_.warning) observer_.warning(missing);
  }
  try {
    CheckSteps(recipe_, scene_);
    // Flags have been checked by their own names.
    if (!recipe_.file.empty()) PlanOutputs(recipe_, scene_, inputs_);
    for (const RegionRecipe& region : recipe.regions) {
      plans_.push_back(ReadRegion(region));
      refines_ = refines_ || region.refine;
    }
  } catch (const OptionError& error) {
    if (recipe_.file.empty()) throw;
    throw InputError(recipe_.file, error.what());
  }
  outcomes_.resize(plans_.size());
  if (keeps_stages_) AddKeys();
}

EditRun::RegionPlan EditRun::ReadRegion(const RegionRecipe& region) {
  RegionPlan plan;
  plan.region = &region;
  plan.edit = region.edit;
  for (ColorOperation& op : plan.edit.operations) {
    if (op.picture) ReadPictures(op, scene_.workspace());
  }
  plan.selection.source.select = region.options.select;
  plan.selection.source.select.keep_raw = !recipe_.outputs.stages.empty();
  plan.selection.source.projector = region.options.projector;
  const Pictures pictures = scene_.pictures();
  for (const PaintFile& paint : region.paint) {
    plan.shown.push_back(paint.view);
    for (PaintedView& view : pictures.ReadBrush(paint.view, paint.mask)) {
      for (const PaintedView& other : plan.selection.source.painted) {
        CheckOption(other.name != view.name, "view " + paint.view + " is painted twice");
      }
      plan.selection.source.painted.push_back(std::move(view));
    }
  }
  // The others read depth maps or run a program.
  const std::string& method = region.options.select.depth_method;
  plan.keeps_cloud = keeps_stages_ && recipe_.outputs.stages.empty() &&
                     (method == "stereo-hv" || method == "gaussian");
  if (region.match) {
    plan.is_painted = plan.keeps_cloud = false;
    return plan;
  }
  if (!region.paint.empty()) return plan;
  if (region.mask_folder.empty() && region.masks.empty()) {
    CheckOption(!PicturesOf(region.edit).empty(),
                "region " + region.name + " has neither paint nor masks");
    plan.shown = PicturesOf(region.edit);
    return plan;
  }
  CheckOption(scene_.IsWhole(),
              "masks that were made elsewhere: `retint refit` takes them for a splat in parts");
  plan.is_painted = false;
  Pictures::MasksByName masks;
  if (!region.mask_folder.empty()) {
    masks = pictures.ReadMasks(region.mask_folder, region.invert_masks);
  }
  for (const auto& [name, path] : region.masks) {
    for (const UserPicture* one : pictures.Require(name)) {
      masks.emplace(one->name, ReadMask(path, one->width, one->height));
    }
  }
  const std::string missing = WarningOfMissingMasks(masks.size(), pictures);
  if (!missing.empty()) Warn(plan, missing);
  plan.selection.masks = pictures.ToViews(masks);
  const bool any = std::ranges::any_of(plan.selection.masks,
                                       [](const auto& entry) { return AnyInside(entry.second); });
  if (!any)
    throw InputError("region " + region.name +
                     ": no mask has a selected pixel, 128 or more of 255");
  return plan;
}

void EditRun::AddKeys() {
  const std::string scene = SceneKey(scene_.session().scene());
  StageKey before("refit"), edits("edits"), refine("refine");
  refine.Add(scene);
  refine.AddValue(recipe_.holdout);
  before.Add(scene);
  before.Add(OptionKey(Described(recipe_.options.refit)));
  before.AddValue(recipe_.holdout);
  if (recipe_.options.refit.target == TargetKind::kPhoto) {
    const Workspace& workspace = scene_.workspace();
    for (const View* view : scene_.session().scene().train_views()) {
      if (!workspace.HasPhoto(*view)) continue;
      before.Add(view->name);
      AddFile(before, workspace.PhotoPath(*view));
    }
  }
  for (RegionPlan& plan : plans_) {
    const ColorEdit& edit = plan.region->edit;
    StageKey select("select"), project("project");
    select.Add(scene);
    select.Add(OptionKey(Described(plan.region->options.select)));
    AddNetwork(select, plan.region->options.select);
    for (const PaintedView& view : plan.selection.source.painted) {
      AddMasks(select, {{view.name, view.mask}});
      select.Add(view.outlined_by);
    }
    if (plan.is_painted && plan.region->paint.empty()) {  // its pictures are its paint
      select.Add(EditToJson(edit, /*with_tables=*/true));
      AddPictures(select, edit, scene_.workspace());
    }
    plan.select_key = select.Hex();
    project.Add(plan.select_key);
    project.Add(OptionKey(Described(plan.region->options.projector)));
    AddMasks(project, plan.selection.masks);
    plan.project_key = project.Hex();
    // A region starts from the colors that the ones before it left.
    edits.Add(plan.project_key);
    edits.Add(EditToJson(edit, /*with_tables=*/true));
    AddPictures(edits, edit, scene_.workspace());
    edits.AddValue(plan.region->strength);
    plan.refit_key = edits.Hex();
    if (!plan.region->refine) continue;
    refine.Add(plan.project_key);
    refine.Add(OptionKey(Described(*plan.region->refine)));
    // Paint says which Gaussians are split.
    if (!PicturesOf(edit).empty()) refine.Add(edits.Hex());
    plan.refine_key = refine.Hex();
  }
  if (refines_) before.Add(refine.Hex());
  bool all_keep = !refines_ || std::ranges::all_of(plans_, &RegionPlan::keeps_cloud);
  for (RegionPlan& plan : plans_) {
    plan.keeps_fit = all_keep = all_keep && plan.keeps_cloud;
    before.Add(plan.refit_key);
    plan.refit_key = before.Hex();
  }
}

std::vector<EditStage> EditRun::SelectionStages(const RegionPlan& plan) const {
  if (plan.region->match) return {{plan.region->name, "match", {}, false}};
  if (!plan.is_painted) return {};
  const bool projected = plan.keeps_cloud && cache_.Has("project", plan.project_key);
  const bool selected = projected || (plan.keeps_cloud && cache_.Has("select", plan.select_key));
  return {{plan.region->name, "select", plan.select_key, selected},
          {plan.region->name, "project", plan.project_key, projected}};
}

EditStage EditRun::RefineStage(const RegionPlan& plan) const {
  return {plan.region->name, "refine", plan.refine_key,
          plan.keeps_fit && cache_.Has("refine", plan.refine_key)};
}

EditStage EditRun::RefitStage(const RegionPlan& plan) const {
  return {plan.region->name, "refit", plan.refit_key,
          plan.keeps_fit && cache_.Has("refit", plan.refit_key)};
}

std::vector<EditStage> EditRun::Plan() const {
  std::vector<EditStage> stages;
  for (const RegionPlan& plan : plans_) {
    for (EditStage& stage : SelectionStages(plan)) stages.push_back(std::move(stage));
  }
  for (const RegionPlan& plan : plans_) {
    if (plan.region->refine) stages.push_back(RefineStage(plan));
  }
  for (const RegionPlan& plan : plans_) stages.push_back(RefitStage(plan));
  return stages;
}

void EditRun::Tell(const EditStage& stage) const {
  if (observer_.stage) observer_.stage(stage);
}

void EditRun::Warn(const RegionPlan& plan, const std::string& warning) const {
  if (!observer_.warning) return;
  const bool is_job = !recipe_.file.empty();
  observer_.warning(!is_job ? warning : "region '" + plan.region->name + "': " + warning);
}

void EditRun::PaintFromPictures(RegionPlan& plan) {
  OpenScene& scene = scene_.session().scene();
  const Workspace& workspace = scene.workspace();
  std::vector<PaintedView>& painted = plan.selection.source.painted;
  for (ColorOperation& op : plan.edit.operations) {
    if (!op.picture) continue;
    for (auto& [name, mask] : ChangedMasks(op, scene, scene.original().sh)) {
      painted.push_back(scene_.session().selection().Paint(name, std::move(mask)));
      const View& view = workspace.RequireView(name);
      if (workspace.PhotoOf(view)) painted.back().seen = workspace.photo_pixels->Reach(view.id);
    }
  }
}

// To a cloud, which masks that are kept make needless.
void EditRun::Select(RegionPlan& plan, RegionOutcome& outcome, Monitor& monitor) {
  if (!plan.is_painted) return;
  scene_.ForPaint(plan.shown, monitor);
  if (plan.selection.source.painted.empty()) PaintFromPictures(plan);
  scene_.ForDepth(plan.selection.source, monitor);
  const bool is_kept = plan.keeps_cloud && cache_.Has("project", plan.project_key);
  if (!is_kept) FindCloud(plan, outcome, monitor);
}

void EditRun::FindCloud(RegionPlan& plan, RegionOutcome& outcome, Monitor& monitor) {
  SelectionSource& source = plan.selection.source;
  plan.has_cloud =
      plan.keeps_cloud && cache_.Read("select", plan.select_key, [&](const fs::path& folder) {
        ReadSelected(folder, &source.cloud, &source.reports);
      });
  if (plan.has_cloud) return;
  SelectionResult result = scene_.session().selection().Select(source, monitor);
  if (source.select.keep_raw) outcome.selected = std::move(result);
  if (!plan.keeps_cloud) return;
  cache_.Write("select", plan.select_key, [&](const fs::path& folder) {
    WriteSelected(folder, source.cloud, source.reports);
  });
}

void EditRun::Project(RegionPlan& plan, RegionOutcome& outcome, Monitor& monitor) {
  if (!plan.is_painted) return;
  EditSession& session = scene_.session();
  RegionSelection& selection = plan.selection;
  RegionSelection kept;
  plan.has_masks =
      plan.keeps_cloud && cache_.Read("project", plan.project_key, [&](const fs::path& folder) {
        ReadProjected(folder, session, &kept);
      });
  if (plan.has_masks) {
    plan.has_cloud = true;
    kept.source.painted = std::move(selection.source.painted);
    kept.source.select = selection.source.select;
    kept.source.projector = selection.source.projector;
    selection = std::move(kept);
  } else {
    if (selection.source.cloud.points.empty()) FindCloud(plan, outcome, monitor);
    ProjectedMasks projected = session.selection().Project(selection.source, monitor);
    selection.masks = std::move(projected.masks);
    selection.shares = std::move(projected.shares);
    if (plans_.size() == 1) {
      outcome.confidence = std::move(projected.confidence);
      outcome.visible = std::move(projected.visible);
    }
    if (plan.keeps_cloud) {
      cache_.Write("project", plan.project_key,
                   [&](const fs::path& folder) { WriteProjected(folder, selection, monitor); });
    }
  }
  // As it went: a kept entry may have been damaged since.
  for (EditStage& stage : SelectionStages(plan)) {
    stage.cached = stage.name == "select" ? plan.has_cloud : plan.has_masks;
    Tell(stage);
  }
  for (const std::string& warning :
       WarningsOfPaint(session.scene().workspace(), selection.source.painted, selection.masks)) {
    Warn(plan, warning);
  }
}

void EditRun::AddRegion(RegionPlan& plan, RegionOutcome& outcome, Monitor& monitor) {
  EditSession& session = scene_.session();
  const RegionRecipe& recipe = *plan.region;
  if (recipe.match) {
    for (const EditStage& stage : SelectionStages(plan)) Tell(stage);
    outcome.match = MatchByRecipe(session, *recipe.match, monitor);
    if (!outcome.match->warning.empty()) Warn(plan, outcome.match->warning);
    outcome.id = ApplyMatch(session, outcome.match->colors, recipe.name, monitor);
  } else {
    outcome.id = session.store().Add(recipe.name, std::move(plan.selection.masks),
                                     std::move(plan.selection.shares), plan.edit, monitor,
                                     std::move(plan.selection.source));
  }
  const Region* region = session.store().regions().Find(outcome.id);
  if (!recipe.refine && scene_.IsWhole()) {
    const PaintDetail detail = DetailOfPaint(*region, session.scene());
    if (detail.IsTorn()) {
      Warn(plan, fmt::format("{}; {} splits them, and {}", detail.Problem(), OptionName("refine"),
                             detail.Gain()));
    }
  }
  session.store().Do(SetEdit{outcome.id, region->edit, recipe.strength});
}

void EditRun::Refine(const RegionPlan& plan, RegionOutcome& outcome, Monitor& monitor) {
  EditSession& session = scene_.session();
  const RefineOptions& options = *plan.region->refine;
  Refinement refined;
  EditStage stage = RefineStage(plan);
  stage.cached =
      plan.keeps_fit && cache_.Read("refine", plan.refine_key, [&](const fs::path& folder) {
        refined = ReadRefined(folder, session.scene().original());
      });
  Tell(stage);
  if (!stage.cached) {
    refined = RefineRegion(session, outcome.id, options, monitor);
    if (plan.keeps_fit) {
      cache_.Write("refine", plan.refine_key,
                   [&](const fs::path& folder) { WriteRefined(folder, refined); });
    }
  }
  const std::string warning = refined.summary.Warning(options);
  if (!warning.empty()) Warn(plan, warning);
  if (refined.summary.split == 0) return;
  outcome.refined = refined.summary;
  scene_.Replace(WithFinerGaussians(session, std::move(refined.finer), {}, monitor));
}

// A fit that is there already becomes the newest region's. Its key is made of the session's own
// numbers, which differ from run to run.
bool EditRun::UseFit(const RegionPlan& plan, RegionId id) {
  EditSession& session = scene_.session();
  RegionFit fit;
  if (!plan.keeps_fit || !cache_.Read("refit", plan.refit_key, [&](const fs::path& folder) {
        fit = ReadFit(folder, session.scene().original());
      })) {
    return false;
  }
  RegionSet regions = session.store().regions();
  Region* region = regions.Find(id);
  fit.key = regions.FitKey(static_cast<size_t>(region - regions.regions.data()), job_);
  region->fit = std::make_shared<const RegionFit>(std::move(fit));
  session.RestoreRegions(std::move(regions), job_);
  return true;
}

void EditRun::Fit(const RegionPlan& plan, RegionId id, Monitor& monitor) {
  // Once: the limit is part of each fit's key, and free memory differs from region to region.
  if (!std::exchange(is_limited_, true)) scene_.LimitRefit(id, &job_.options);
  EditStage stage = RefitStage(plan);
  stage.cached = UseFit(plan, id);
  Tell(stage);
  if (stage.cached) return;
  EditSession& session = scene_.session();
  session.refits().Refit(job_, monitor);
  const auto fit = session.store().regions().Find(id)->fit;
  if (!fit || !plan.keeps_fit) return;
  cache_.Write("refit", plan.refit_key, [&](const fs::path& folder) { WriteFit(folder, *fit); });
}

void EditRun::Run(Monitor& monitor) {
  bool is_checked = false;
  for (size_t i = 0; i < plans_.size(); ++i) {
    Select(plans_[i], outcomes_[i], monitor);
    if (!plans_[i].is_painted || std::exchange(is_checked, true)) continue;
    const std::string mismatch = MismatchIn(scene_.session().scene(), plans_[i].shown);
    if (!mismatch.empty() && observer_.warning) observer_.warning(mismatch);
  }
  std::vector<const SelectionSource*> selections;
  std::vector<std::string> pictures;
  for (const RegionPlan& plan : plans_) {
    selections.push_back(&plan.selection.source);
    for (std::string& name : PicturesOf(plan.region->edit)) pictures.push_back(std::move(name));
  }
  scene_.ForSelections(selections, pictures, monitor);
  for (size_t i = 0; i < plans_.size(); ++i) Project(plans_[i], outcomes_[i], monitor);
  for (size_t i = 0; i < plans_.size(); ++i) {
    AddRegion(plans_[i], outcomes_[i], monitor);
    if (!refines_) Fit(plans_[i], outcomes_[i].id, monitor);
  }
  if (!refines_) return;
  for (size_t i = 0; i < plans_.size(); ++i) {
    if (plans_[i].region->refine) Refine(plans_[i], outcomes_[i], monitor);
  }
  // Region by region, so that each fit is kept once it is done.
  EditSession& session = scene_.session();
  const RegionSet all = session.store().regions();
  RegionSet begun;
  for (size_t i = 0; i < plans_.size(); ++i) {
    begun.regions.push_back(all.regions[i]);
    session.RestoreRegions(begun, job_);
    Fit(plans_[i], outcomes_[i].id, monitor);
    begun = session.store().regions();
  }
}

void EditRun::Evaluate(const EvaluationDetail& detail, Monitor& monitor) {
  report_ = FullReport(scene_.session(), job_.target, monitor, detail.most_views, detail.row_step);
  EditOptions options = recipe_.options;
  options.refit = job_;
  report_.options = SettingsThatApply(Described(options));
  for (size_t i = 0; i < plans_.size(); ++i) {
    for (RegionReport& region : report_.regions) {
      if (region.name == recipe_.regions[i].name) region.refine = outcomes_[i].refined;
    }
  }
  if (report_.regions.size() == 1) report_.refine = report_.regions[0].refine;
  if (scene_.large()) report_.out_of_core = scene_.large()->Report();
}

void EditRun::StageSplats(StagedOutput& staged, Monitor& monitor) {
  EditSession& session = scene_.session();
  const StageClock::Lap lap(session.scene().clock(), "save");
  for (const fs::path& splat : recipe_.outputs.splats) {
    staged.Add(splat, [&](const fs::path& path) {
      const std::string warning = WriteEdited(session, scene_.large(), path, splat, monitor);
      if (!warning.empty() && observer_.warning) observer_.warning(warning);
      const auto error =
          MeasureWritten(session.scene(), session.refits().CurrentSh(), path, monitor);
      if (error) format_error_ = error;
    });
  }
  const fs::path& finer = recipe_.outputs.finer_splat;
  if (finer.empty()) return;
  staged.Add(finer, [&](const fs::path& path) {
    WriteSplat(path, session.scene().original(), monitor);
    std::promise<FileChecksum> checksum;
    checksum.set_value(ChecksumFile(path));
    session.scene().SetSplat(finer, checksum.get_future());
  });
}

void EditRun::StagePictures(StagedOutput& staged, Monitor& monitor) {
  EditSession& session = scene_.session();
  const EditOutputs& outputs = recipe_.outputs;
  const StageClock::Lap lap(session.scene().clock(), "save");
  if (!outputs.comparison.empty()) {
    staged.Add(outputs.comparison,
               [&](const fs::path& path) { WritePng(path, ComparisonPicture(session, monitor)); });
  }
  if (!outputs.stages.empty()) {
    staged.AddFolder(outputs.stages, [&](const fs::path& folder) {
      for (size_t i = 0; i < outcomes_.size(); ++i) {
        const RegionOutcome& one = outcomes_[i];
        WriteStages(outcomes_.size() == 1 ? folder : folder / recipe_.regions[i].name, session,
                    one.id, one.selected, monitor);
      }
      WriteTargets(folder, session, job_.target, monitor);
    });
  }
  if (!outputs.masks.empty()) {
    staged.AddFolder(outputs.masks, [&](const fs::path& folder) {
      for (const Region& region : session.store().regions().regions) {
        session.WriteMasks(folder / region.name, region.id, monitor, outputs.mask_names);
      }
    });
  }
  StagePhotos(staged, session, outputs.photos, outputs.mask_names, observer_.warning, monitor);
  if (!outputs.views.empty()) {
    staged.AddFolder(outputs.views, [&](const fs::path& folder) {
      ExportViews(session, session.scene().reconstruction().ViewsByName(),
                  session.refits().CurrentSh(), folder, monitor);
    });
  }
}

void EditRun::StageReports(StagedOutput& staged, const std::vector<std::string>& warnings,
                           Monitor& monitor) {
  EditSession& session = scene_.session();
  const RunReport now = MakeReport(session);
  report_.stages_ms = now.stages_ms;
  report_.peak_rss_mb = now.peak_rss_mb;
  report_.peak_device_mb = now.peak_device_mb;
  const EditOutputs& outputs = recipe_.outputs;
  if (!outputs.page.empty()) {
    HtmlReportOptions options;
    options.title = recipe_.title;
    options.command = recipe_.command;
    options.warnings = warnings;
    staged.Add(outputs.page, [&](const fs::path& path) {
      WriteFile(path, HtmlReport(session, report_, options, monitor));
    });
  }
  if (!outputs.report.empty()) {
    staged.Add(outputs.report, [&](const fs::path& path) {
      std::string json = WithFormatError(ToJson(report_), format_error_);
      for (size_t i = 0; i < outcomes_.size(); ++i) {
        if (!outcomes_[i].match) continue;
        json = WithMatch(json, recipe_.regions[i].name, *outcomes_[i].match);
      }
      WriteFile(path, json);
    });
  }
}

void EditRun::Write(const std::vector<std::string>& warnings, Monitor& monitor) {
  StagedOutput staged;
  StageSplats(staged, monitor);
  StagePictures(staged, monitor);
  StageReports(staged, warnings, monitor);
  monitor.Step("save", 1, 1);
  // Writing it may fail; moving staged files into place hardly does.
  if (!recipe_.outputs.session.empty()) {
    SessionWriter(recipe_.outputs.session).Write(TakeSnapshot(scene_.session()), monitor);
  }
  staged.Commit();
  inputs_.ForgetPlanned();  // they are files like any others now
}

}  // namespace retint
