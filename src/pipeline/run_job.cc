// SPDX-License-Identifier: BSD-3-Clause
#include "pipeline/run_job.h"

#include <algorithm>
#include <future>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"
#include "base/files.h"
#include "base/run_clock.h"
#include "base/staged_output.h"
#include "colmap_io/image_io.h"
#include "editing/compare_pictures.h"
#include "editing/finer_session.h"
#include "pipeline/stage_files.h"
#include "recolor/edit_text.h"
#include "reporting/export.h"
#include "reporting/report_html.h"
#include "saving/session_file.h"
#include "scene/image_checks.h"
#include "selecting/paint_held.h"
#include "splat_io/splat_io.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

void AddMasks(StageKey& key, const std::map<std::string, Mask>& masks) {
  for (const auto& [name, mask] : masks) {
    key.Add(name);
    key.AddValue(mask.width);
    key.Add({reinterpret_cast<const char*>(mask.data.data()), mask.data.size()});
  }
}

void AddSum(StageKey& key, const FileChecksum& sum) {
  key.AddValue(sum.bytes);
  key.AddValue(sum.xxh64);
}

void AddFile(StageKey& key, const fs::path& file) { AddSum(key, ChecksumFile(file)); }

// The splat's bytes, cameras, poses and points, and what computes with them.
std::string SceneKey(EditSession& session) {
  StageKey key("scene");
  key.Add(Version());
  key.Add(session.scene().renderer().backend().Name());
  AddSum(key, session.scene().splat_checksum().get());
  const Reconstruction& model = session.scene().reconstruction();
  for (const View* view : model.ViewsByName()) {
    const Camera& camera = model.cameras.at(view->camera_id);
    key.Add(view->name);
    key.AddValue(camera.model);
    key.AddValue(camera.width);
    key.AddValue(camera.height);
    for (const double value : camera.params) key.AddValue(value);
    for (const double value : view->cam_from_world.rotation.coeffs()) key.AddValue(value);
    for (const double value : view->cam_from_world.translation) key.AddValue(value);
    for (const Observation& observation : view->observations) {
      if (observation.point_id == kInvalidPointId) continue;
      key.AddValue(observation.point_id);
      for (const double value : observation.xy) key.AddValue(value);
    }
  }
  for (const auto& [id, point] : model.points) {
    key.AddValue(id);
    for (const double value : point.xyz) key.AddValue(value);
  }
  return key.Hex();
}

void AddPictures(StageKey& key, const ColorEdit& edit, const Workspace& workspace) {
  for (const ColorOperation& op : edit.operations) {
    for (const fs::path& file : FilesCompared(op, workspace)) AddFile(key, file);
  }
}

}  // namespace

JobRunner::JobRunner(const Job& job, std::unique_ptr<EditSession> session, StageCache& cache)
    : job_(job), session_(std::move(session)), cache_(cache) {
  for (const fs::path& splat : job.outputs.splats) {
    CodecForWriting(splat);
    CheckOutput(splat);
  }
  for (const fs::path& file : {job.outputs.report, job.outputs.page, job.outputs.finer_splat}) {
    if (!file.empty()) CheckOutput(file);
  }
  for (const fs::path& folder : {job.outputs.masks, job.outputs.views, job.outputs.session}) {
    if (!folder.empty()) CheckOutput(folder, /*as_folder=*/true);
  }
  if (!job.outputs.session.empty()) SessionWriter(job.outputs.session).CheckFolder();
  if (job.options.refit.target == TargetKind::kPhoto) {
    for (const View* view : session_->scene().train_views()) {
      if (session_->scene().workspace().HasPhoto(*view)) continue;
      throw InputError(session_->scene().workspace().PhotoPath(*view),
                       "the target \"photo\" needs it");
    }
  }
  try {
    PlanOutputs();
    for (const JobRegion& region : job.regions) {
      plans_.push_back(ReadRegion(region));
      refines_ = refines_ || region.refine;
    }
  } catch (const OptionError& error) {
    throw InputError(job.file, error.what());
  }
  AddKeys();
}

// A splat may replace the scene's, and masks those of their own region, which are written as they
// were read. No other output has the place of an input.
void JobRunner::PlanOutputs() {
  const JobOutputs& outputs = job_.outputs;
  const Pictures pictures = session_->scene().pictures();
  inputs_.Add(job_.file);
  for (const fs::path& splat : outputs.splats) {
    inputs_.AllowSplat(splat);
    inputs_.Plan("outputs.splats", splat);
  }
  for (const auto& [name, file] :
       {std::pair("outputs.report", outputs.report), std::pair("outputs.report_html", outputs.page),
        std::pair("outputs.finer_splat", outputs.finer_splat)}) {
    if (!file.empty()) inputs_.Plan(name, file);
  }
  for (const UserPicture& picture : pictures.all()) {
    if (!outputs.views.empty()) {
      inputs_.Plan("outputs.views", ViewFile(outputs.views, picture.name));
    }
    for (const JobRegion& region : job_.regions) {
      if (outputs.masks.empty()) continue;
      const fs::path folder = outputs.masks / region.name, mask = ViewFile(folder, picture.name);
      std::error_code ignored;
      if (fs::equivalent(folder, region.mask_folder, ignored)) inputs_.Allow(mask);
      inputs_.Plan("outputs.masks", mask);
    }
  }
}

JobRunner::RegionPlan JobRunner::ReadRegion(const JobRegion& region) {
  RegionPlan plan;
  plan.region = &region;
  for (const JobPaint& paint : region.paint) {
    for (PaintedView& view : session_->scene().pictures().ReadBrush(paint.view, paint.mask)) {
      plan.painted.push_back(std::move(view));
    }
  }
  const Pictures pictures = session_->scene().pictures();
  Pictures::MasksByName masks;
  if (!region.mask_folder.empty()) masks = pictures.ReadMasks(region.mask_folder);
  for (const auto& [name, path] : region.masks) {
    for (const UserPicture* one : pictures.Require(name)) {
      masks.emplace(one->name, ReadMask(path, one->width, one->height));
    }
  }
  if (region.paint.empty()) {
    const std::string missing = WarningOfMissingMasks(masks.size(), pictures);
    if (!missing.empty()) Warn(plan, missing);
  }
  plan.masks = pictures.ToViews(masks);
  const bool any = std::any_of(plan.masks.begin(), plan.masks.end(),
                               [](const auto& entry) { return AnySet(entry.second); });
  if (plan.painted.empty() && !any) {
    throw InputError("region " + region.name + ": no mask has a selected pixel");
  }
  // The others read depth maps or run a program.
  const std::string& method = region.options.select.method;
  plan.keeps_cloud = method == "stereo-hv" || method == "gaussian";
  return plan;
}

void JobRunner::AddKeys() {
  const std::string scene = SceneKey(*session_);
  StageKey before("refit"), edits("edits"), refine("refine");
  refine.Add(scene);
  refine.AddValue(job_.holdout);
  before.Add(scene);
  before.Add(OptionKey(Described(job_.options.refit)));
  before.AddValue(job_.holdout);
  if (job_.options.refit.target == TargetKind::kPhoto) {
    for (const View* view : session_->scene().train_views()) {
      AddFile(before, session_->scene().workspace().PhotoPath(*view));
    }
  }
  for (RegionPlan& plan : plans_) {
    const ColorEdit& edit = plan.region->edit;
    StageKey select("select"), project("project");
    select.Add(scene);
    select.Add(OptionKey(Described(plan.region->options.select)));
    for (const PaintedView& view : plan.painted) AddMasks(select, {{view.name, view.mask}});
    plan.select_key = select.Hex();
    project.Add(plan.select_key);
    project.Add(OptionKey(Described(plan.region->options.projector)));
    AddMasks(project, plan.masks);
    plan.project_key = project.Hex();
    // A region starts from the colors that the ones before it left.
    edits.Add(plan.project_key);
    edits.Add(EditToJson(edit, /*with_tables=*/true));
    AddPictures(edits, edit, session_->scene().workspace());
    edits.AddValue(plan.region->strength);
    plan.refit_key = edits.Hex();
    if (!plan.region->refine) continue;
    refine.Add(plan.project_key);
    refine.Add(OptionKey(Described(*plan.region->refine)));
    // Paint says which Gaussians are split.
    if (std::ranges::any_of(edit.operations,
                            [](const auto& op) { return op.picture != nullptr; })) {
      refine.Add(edits.Hex());
    }
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

std::vector<JobStage> JobRunner::SelectionStages(const RegionPlan& plan) const {
  if (plan.painted.empty()) return {};
  const bool projected = plan.keeps_cloud && cache_.Has("project", plan.project_key);
  const bool selected = projected || (plan.keeps_cloud && cache_.Has("select", plan.select_key));
  return {{plan.region->name, "select", plan.select_key, selected},
          {plan.region->name, "project", plan.project_key, projected}};
}

JobStage JobRunner::RefineStage(const RegionPlan& plan) const {
  return {plan.region->name, "refine", plan.refine_key,
          plan.keeps_fit && cache_.Has("refine", plan.refine_key)};
}

JobStage JobRunner::RefitStage(const RegionPlan& plan) const {
  return {plan.region->name, "refit", plan.refit_key,
          plan.keeps_fit && cache_.Has("refit", plan.refit_key)};
}

std::vector<JobStage> JobRunner::Plan() const {
  std::vector<JobStage> stages;
  for (const RegionPlan& plan : plans_) {
    for (JobStage& stage : SelectionStages(plan)) stages.push_back(std::move(stage));
    if (!refines_) stages.push_back(RefitStage(plan));
  }
  if (!refines_) return stages;
  for (const RegionPlan& plan : plans_) {
    if (plan.region->refine) stages.push_back(RefineStage(plan));
  }
  for (const RegionPlan& plan : plans_) stages.push_back(RefitStage(plan));
  return stages;
}

RegionSelection JobRunner::Select(const RegionPlan& plan, Kept* kept, Monitor& monitor) {
  RegionSelection selection;
  if (plan.painted.empty()) {
    selection.masks = plan.masks;
    return selection;
  }
  kept->cloud = kept->masks =
      plan.keeps_cloud && cache_.Read("project", plan.project_key, [&](const fs::path& folder) {
        ReadProjected(folder, *session_, &selection);
      });
  selection.source.painted = plan.painted;
  if (kept->masks) return selection;
  SelectionSource& source = selection.source;
  const EditOptions& options = plan.region->options;
  kept->cloud =
      plan.keeps_cloud && cache_.Read("select", plan.select_key, [&](const fs::path& folder) {
        ReadSelected(folder, &source.cloud, &source.reports);
      });
  if (!kept->cloud) {
    SelectionResult result = session_->selection().Select(plan.painted, options.select, monitor);
    source.cloud = std::move(result.cloud);
    source.reports = std::move(result.painted);
    if (plan.keeps_cloud) {
      cache_.Write("select", plan.select_key, [&](const fs::path& folder) {
        WriteSelected(folder, source.cloud, source.reports);
      });
    }
  }
  ProjectedMasks masks =
      session_->selection().Project(source.cloud, plan.painted, options.projector, monitor);
  selection.masks = std::move(masks.masks);
  selection.shares = std::move(masks.shares);
  return selection;
}

// A fit that is there already becomes the newest region's. Its key is made of the session's own
// numbers, which differ from run to run.
bool JobRunner::UseFit(const RegionPlan& plan, RegionId id) {
  RegionFit fit;
  if (!plan.keeps_fit || !cache_.Read("refit", plan.refit_key, [&](const fs::path& folder) {
        fit = ReadFit(folder, session_->scene().original());
      })) {
    return false;
  }
  const RefitJob& job = job_.options.refit;
  RegionSet regions = session_->store().regions();
  Region* region = regions.Find(id);
  fit.key = regions.FitKey(static_cast<size_t>(region - regions.regions.data()), job);
  region->fit = std::make_shared<const RegionFit>(std::move(fit));
  session_->RestoreRegions(std::move(regions), job);
  return true;
}

void JobRunner::KeepFit(const RegionPlan& plan, RegionId id) {
  const auto fit = session_->store().regions().Find(id)->fit;
  if (!fit || !plan.keeps_fit) return;
  cache_.Write("refit", plan.refit_key, [&](const fs::path& folder) { WriteFit(folder, *fit); });
}

void JobRunner::Warn(const RegionPlan& plan, const std::string& warning) {
  warnings_.push_back("region '" + plan.region->name + "': " + warning);
}

RegionId JobRunner::AddRegion(const RegionPlan& plan, const OnStage& on_stage, Monitor& monitor) {
  Kept kept;
  RegionSelection selection = Select(plan, &kept, monitor);
  // As it went: what was kept may have been damaged since.
  for (JobStage& stage : SelectionStages(plan)) {
    stage.cached = stage.name == "select" ? kept.cloud : kept.masks;
    on_stage(stage);
  }
  for (const std::string& warning :
       WarningsOfPaint(session_->scene().workspace(), plan.painted, selection.masks)) {
    Warn(plan, warning);
  }
  const RegionId id = session_->store().Add(plan.region->name, std::move(selection.masks),
                                            std::move(selection.shares), plan.region->edit, monitor,
                                            std::move(selection.source));
  const Region* region = session_->store().regions().Find(id);
  if (!plan.painted.empty() && !kept.masks && plan.keeps_cloud) {
    cache_.Write("project", plan.project_key, [&](const fs::path& folder) {
      WriteProjected(folder, *region->selection, monitor);
    });
  }
  const double on_large =
      plan.region->refine ? 0 : PaintOnLargeGaussians(*region, session_->scene());
  if (on_large >= kMuchPaint) {
    Warn(plan, fmt::format("{:.0f} % of the paint is on Gaussians too large for stripes or "
                           "letters; \"refine\" splits them",
                           100 * on_large));
  }
  session_->store().SetEdit(id, region->edit, plan.region->strength);
  return id;
}

void JobRunner::Refine(const RegionPlan& plan, RegionId id, const OnStage& on_stage,
                       Monitor& monitor) {
  const RefineOptions& options = *plan.region->refine;
  Refinement refined;
  JobStage stage = RefineStage(plan);
  stage.cached =
      plan.keeps_fit && cache_.Read("refine", plan.refine_key, [&](const fs::path& folder) {
        refined = ReadRefined(folder, session_->scene().original());
      });
  on_stage(stage);
  if (!stage.cached) {
    refined = RefineRegion(*session_, id, options, monitor);
    if (plan.keeps_fit) {
      cache_.Write("refine", plan.refine_key,
                   [&](const fs::path& folder) { WriteRefined(folder, refined); });
    }
  }
  const std::string warning = refined.summary.Warning(options);
  if (!warning.empty()) Warn(plan, warning);
  if (refined.summary.split == 0) return;
  refined_.emplace(plan.region->name, refined.summary);
  session_ = WithFinerGaussians(*session_, std::move(refined.finer), {}, monitor);
}

void JobRunner::Fit(const RegionPlan& plan, RegionId id, const OnStage& on_stage,
                    Monitor& monitor) {
  JobStage stage = RefitStage(plan);
  stage.cached = UseFit(plan, id);
  on_stage(stage);
  if (stage.cached) return;
  session_->refits().Refit(job_.options.refit, monitor);
  KeepFit(plan, id);
}

void JobRunner::Run(const OnStage& on_stage, Monitor& monitor) {
  std::vector<RegionId> ids;
  for (const RegionPlan& plan : plans_) {
    ids.push_back(AddRegion(plan, on_stage, monitor));
    if (!refines_) Fit(plan, ids.back(), on_stage, monitor);
  }
  if (!refines_) return;
  for (size_t i = 0; i < plans_.size(); ++i) {
    if (plans_[i].region->refine) Refine(plans_[i], ids[i], on_stage, monitor);
  }
  // Region by region, so that each fit is kept once it is done.
  const RegionSet all = session_->store().regions();
  RegionSet begun;
  for (size_t i = 0; i < plans_.size(); ++i) {
    begun.regions.push_back(all.regions[i]);
    session_->RestoreRegions(begun, job_.options.refit);
    Fit(plans_[i], ids[i], on_stage, monitor);
    begun = session_->store().regions();
  }
}

RunReport JobRunner::Report(Monitor& monitor) {
  RunReport report = FullReport(*session_, job_.options.refit.target, monitor);
  report.options = SettingsThatApply(Described(job_.options));
  for (RegionReport& region : report.regions) {
    const auto found = refined_.find(region.name);
    if (found != refined_.end()) region.refine = found->second;
  }
  if (report.regions.size() == 1) report.refine = report.regions[0].refine;
  return report;
}

void JobRunner::WriteOutputs(const std::vector<std::string>& warnings, Monitor& monitor) {
  const JobOutputs& outputs = job_.outputs;
  StagedOutput staged;
  if (!outputs.report.empty() || !outputs.page.empty()) {
    const RunReport report = Report(monitor);
    if (!outputs.report.empty()) {
      staged.Add(outputs.report, [&](const auto& path) { WriteFile(path, ToJson(report)); });
    }
    if (!outputs.page.empty()) {
      HtmlReportOptions options;
      options.title = job_.file.stem().string();
      options.command = "retint run " + job_.file.string();
      options.warnings = warnings;
      staged.Add(outputs.page, [&](const auto& path) {
        WriteFile(path, HtmlReport(*session_, report, options, monitor));
      });
    }
  }
  for (const fs::path& splat : outputs.splats) {
    staged.Add(splat, [&](const auto& path) { session_->WriteSplat(path, monitor); });
  }
  if (!outputs.masks.empty()) {
    staged.AddFolder(outputs.masks, [&](const fs::path& folder) {
      for (const Region& region : session_->store().regions().regions) {
        session_->WriteMasks(folder / region.name, region.id, monitor);
      }
    });
  }
  if (!outputs.views.empty()) {
    staged.AddFolder(outputs.views, [&](const fs::path& folder) {
      ExportViews(*session_, session_->scene().reconstruction().ViewsByName(),
                  session_->refits().CurrentSh(), folder, monitor);
    });
  }
  if (!outputs.finer_splat.empty()) {
    staged.Add(outputs.finer_splat, [&](const auto& path) {
      WriteSplat(path, session_->scene().original(), monitor);
      std::promise<FileChecksum> checksum;
      checksum.set_value(ChecksumFile(path));
      session_->scene().SetSplat(outputs.finer_splat, checksum.get_future());
    });
  }
  // Writing it may fail, putting what is staged in place hardly does.
  if (!outputs.session.empty()) {
    SessionWriter(outputs.session).Write(TakeSnapshot(*session_), monitor);
  }
  staged.Commit();
  inputs_.ForgetPlanned();  // they are files like any others now
}

}  // namespace retint
