// SPDX-License-Identifier: BSD-3-Clause
// Runs a job: selects, projects and refits its regions in order, then writes its files. Where a
// region is to have its large Gaussians split, all regions are selected and their colors measured
// first, and the finer splat is the job's from then on. Each stage's result is kept by what it was
// computed from, so that a job that was cut off, or whose file or pictures were changed, goes on
// from the first stage that is new.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "base/input_guard.h"
#include "base/stage_cache.h"
#include "base/staged_output.h"
#include "editing/edit_session.h"
#include "pipeline/job_file.h"
#include "reporting/report.h"

namespace retint {

struct JobStage {
  std::string region;
  // "select" (to a cloud), "project" (to masks), "refine" (to smaller Gaussians) or "refit".
  std::string name;
  std::string key;      // of everything that it depends on
  bool cached = false;  // its result is there already
};

class JobRunner {
 public:
  // Reads the job's masks and checks what it names: InputError for masks that are no pictures of
  // their views or select nothing, views that do not exist, missing photos where they are the
  // target, outputs that would replace inputs; RunError for outputs that could not be written;
  // OptionError for formats that cannot.
  JobRunner(const Job& job, std::unique_ptr<EditSession> session, StageCache& cache);

  // What Run() would do, without doing it.
  std::vector<JobStage> Plan() const;
  // `on_stage` is called as each stage of the plan begins. session() holds the regions afterwards,
  // on the finer splat where there is one.
  void Run(const std::function<void(const JobStage&)>& on_stage, Monitor& monitor);
  // All files as StagedOutput does, once the session for the editor is written. After Run().
  // `warnings`: what the page is to tell.
  void WriteOutputs(const std::vector<std::string>& warnings, Monitor& monitor);
  EditSession& session() { return *session_; }
  // What Run() found that people should know, a sentence each.
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  // What a region's job says, read and checked, and the keys of its stages.
  struct RegionPlan {
    const JobRegion* region = nullptr;
    std::vector<PaintedView> painted;
    std::map<std::string, Mask> masks;  // where they come from files
    std::string select_key, project_key, refine_key, refit_key;
    bool keeps_cloud = true;  // the depth method reads nothing that the keys do not name
    // Nor does that of a region before, from whose colors the fit starts, or of any one where
    // Gaussians are split.
    bool keeps_fit = true;
  };
  void PlanOutputs();
  RegionPlan ReadRegion(const JobRegion& region);
  void AddKeys();
  std::vector<JobStage> SelectionStages(const RegionPlan& plan) const;
  JobStage RefineStage(const RegionPlan& plan) const;
  JobStage RefitStage(const RegionPlan& plan) const;
  using OnStage = std::function<void(const JobStage&)>;
  void Warn(const RegionPlan& plan, const std::string& warning);
  RegionId AddRegion(const RegionPlan& plan, const OnStage& on_stage, Monitor& monitor);
  void Refine(const RegionPlan& plan, RegionId id, const OnStage& on_stage, Monitor& monitor);
  void Fit(const RegionPlan& plan, RegionId id, const OnStage& on_stage, Monitor& monitor);
  // What of a selection the cache had.
  struct Kept {
    bool cloud = false, masks = false;
  };
  RegionSelection Select(const RegionPlan& plan, Kept* kept, Monitor& monitor);
  bool UseFit(const RegionPlan& plan, RegionId id);
  void KeepFit(const RegionPlan& plan, RegionId id);
  RunReport Report(Monitor& monitor);

  const Job& job_;
  InputGuard inputs_{InputGuard::Guards::kReads};
  std::unique_ptr<EditSession> session_;
  StageCache& cache_;
  std::vector<RegionPlan> plans_;
  bool refines_ = false;
  std::map<std::string, RefineSummary> refined_;  // by region, where Gaussians were split
  std::vector<std::string> warnings_;
};

}  // namespace retint
