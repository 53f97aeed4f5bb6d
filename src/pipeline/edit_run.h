// SPDX-License-Identifier: BSD-3-Clause
// Carries out a recipe: selects, projects and refits its regions in order, then writes its files.
// `retint recolor` and `retint run` both go through here.
//
// All regions are selected first and then projected, so that a scene in parts can open the
// Gaussians of all of them together. If Gaussians must be split, that happens once all regions have
// their masks, and the rest of the run uses the finer splat.
//
// Each stage's result may be stored under its inputs. A run that was cut off, or whose recipe or
// pictures were changed, then continues from the first stage that is new. Scenes in parts and runs
// of several processes store nothing.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/input_guard.h"
#include "base/stage_cache.h"
#include "base/staged_output.h"
#include "pipeline/edit_recipe.h"
#include "pipeline/scene_source.h"
#include "reporting/format_error.h"

namespace retint {

struct EditStage {
  std::string region;
  // "select" (to a cloud), "project" (to masks), "match" (to an edit), "refine" (to smaller
  // Gaussians) or "refit".
  std::string name;
  std::string key;      // of everything that it depends on; empty: nothing is kept
  bool cached = false;  // its result is there already
};

// Called on the run's thread. Both may be empty.
struct EditObserver {
  std::function<void(const EditStage&)> stage;           // it begins, or was there already
  std::function<void(const std::string& text)> warning;  // a sentence for people
};

// The findings of a run about a region that the session does not keep.
struct RegionOutcome {
  RegionId id = 0;
  SelectionResult selected;                // filled if outputs.stages are wanted
  std::vector<float> confidence, visible;  // of the only region, if its masks were completed here
  std::optional<RefineSummary> refined;    // if Gaussians were split
  std::optional<SceneMatch> match;         // of a recipe's match
};

// Measures the edit in so many views at most (0: all), in every row_step-th row of pixels.
struct EvaluationDetail {
  size_t most_views = 0;
  int row_step = 1;
};

class EditRun {
 public:
  // Reads and checks the masks and pictures of the recipe. InputError for masks that are no
  // pictures of their views or select nothing, and for views that do not exist. OptionError for
  // outputs that would replace inputs, and for steps that a scene in parts cannot do.
  EditRun(const EditRecipe& recipe, SceneSource& scene, StageCache& cache, EditObserver observer);

  // The stages of Run(), without running them.
  std::vector<EditStage> Plan() const;
  // Afterwards session() holds the regions, on the finer splat if there is one. Collective
  // (base/ranks.h), as Evaluate().
  void Run(Monitor& monitor);
  // After Run().
  void Evaluate(const EvaluationDetail& detail, Monitor& monitor);
  // All files as StagedOutput does, once the session for the editor is written. Report and page
  // need Evaluate(). `warnings`: further lines of the page. By the first rank alone.
  void Write(const std::vector<std::string>& warnings, Monitor& monitor);

  EditSession& session() { return scene_.session(); }
  // In the order of the recipe's regions. After Run().
  const std::vector<RegionOutcome>& outcomes() const { return outcomes_; }
  // After Evaluate(); its times and memory are up to date after Write().
  const RunReport& report() const { return report_; }
  // The rounding of the written splats' format.
  const std::optional<FormatError>& format_error() const { return format_error_; }

 private:
  // A region's recipe, read and checked, and the keys of its stages.
  struct RegionPlan {
    const RegionRecipe* region = nullptr;
    ColorEdit edit;                  // with its pictures read
    RegionSelection selection;       // the paint, then the selection
    std::vector<std::string> shown;  // the pictures that are painted on
    std::string select_key, project_key, refine_key, refit_key;
    // Its depth method reads nothing that the keys do not name.
    bool keeps_cloud = false;
    // Nor does that of a region before it; if Gaussians are split, of any region.
    bool keeps_fit = false;
    bool is_painted = true;                     // its masks do not come from files
    bool has_cloud = false, has_masks = false;  // they were kept
  };
  RegionPlan ReadRegion(const RegionRecipe& region);
  void AddKeys();
  std::vector<EditStage> SelectionStages(const RegionPlan& plan) const;
  EditStage RefineStage(const RegionPlan& plan) const;
  EditStage RefitStage(const RegionPlan& plan) const;
  void Tell(const EditStage& stage) const;
  void Warn(const RegionPlan& plan, const std::string& warning) const;
  void PaintFromPictures(RegionPlan& plan);
  void Select(RegionPlan& plan, RegionOutcome& outcome, Monitor& monitor);
  void FindCloud(RegionPlan& plan, RegionOutcome& outcome, Monitor& monitor);
  void Project(RegionPlan& plan, RegionOutcome& outcome, Monitor& monitor);
  void AddRegion(RegionPlan& plan, RegionOutcome& outcome, Monitor& monitor);
  void Refine(const RegionPlan& plan, RegionOutcome& outcome, Monitor& monitor);
  void Fit(const RegionPlan& plan, RegionId id, Monitor& monitor);
  bool UseFit(const RegionPlan& plan, RegionId id);
  void StageSplats(StagedOutput& staged, Monitor& monitor);
  void StagePictures(StagedOutput& staged, Monitor& monitor);
  void StageReports(StagedOutput& staged, const std::vector<std::string>& warnings,
                    Monitor& monitor);

  const EditRecipe& recipe_;
  SceneSource& scene_;
  StageCache& cache_;
  EditObserver observer_;
  bool keeps_stages_;
  RefitJob job_;             // the recipe's, within the limits of memory
  bool is_limited_ = false;  // so it is
  InputGuard inputs_{InputGuard::Guards::kReads};
  std::vector<RegionPlan> plans_;
  std::vector<RegionOutcome> outcomes_;
  bool refines_ = false;
  RunReport report_;
  std::optional<FormatError> format_error_;
};

}  // namespace retint
