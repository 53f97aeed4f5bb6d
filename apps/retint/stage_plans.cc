// SPDX-License-Identifier: BSD-3-Clause
#include "retint/stage_plans.h"

#include <algorithm>
#include <map>
#include <string>
#include <string_view>

namespace retint::cli {
namespace {

using Plan = std::vector<PlannedStage>;

// Weights are estimates of how long the stages take beside each other. They were not measured.
constexpr double kBrief = 0.1;
const PlannedStage kLoad{"load", 1}, kCheck{"check", 0.5}, kShares{"shares", 3}, kRefit{"refit", 6},
    kEvaluate{"evaluate", 2}, kPictures{"pictures", 8}, kRender{"render", 2}, kSave{"save", 0.5};

void Add(Plan* plan, const Plan& more) { plan->insert(plan->end(), more.begin(), more.end()); }

void AddSelecting(Plan* plan, size_t painted) {
  for (size_t i = 0; i < std::max<size_t>(1, painted); ++i) {
    Add(plan, {{"depth", 2}, {"cloud", 0.3}, {"registration", kBrief}});
  }
}

// Floaters and the graph are looked for, then the views' evidence; it is completed, and masks are
// drawn.
void AddProjecting(Plan* plan, bool completes) {
  plan->push_back({"projection", kBrief});
  if (completes) Add(plan, {{"completion", 1}, {"completion", 1}});
  plan->push_back({"projection", 3});
  if (completes) Add(plan, {{"completion", 1}, {"projection", 1}});
}

// The typed options of a verb.
class Typed {
 public:
  explicit Typed(const CLI::App& verb) : verb_(verb) {}
  size_t Count(const char* flag) const {
    const CLI::Option* option = verb_.get_option_no_throw(flag);
    return option ? option->count() : 0;
  }
  bool Has(const char* flag) const { return Count(flag) > 0; }
  bool Completes() const {
    const CLI::Option* complete = verb_.get_option_no_throw("--completion");
    return !complete || complete->count() == 0 || complete->results().front() != "off";
  }
  size_t Painted() const { return Count("--view"); }

 private:
  const CLI::App& verb_;
};

Plan PlanOfSuggest(const Typed& typed) {
  Plan plan = {kLoad};
  AddSelecting(&plan, typed.Painted());
  AddProjecting(&plan, typed.Completes());
  plan.push_back({"suggestion", 3});
  return plan;
}

Plan PlanOfSelect(const Typed& typed) {
  Plan plan = {kLoad};
  AddSelecting(&plan, typed.Painted());
  plan.push_back(kCheck);
  return plan;
}

Plan PlanOfProject(const Typed& typed) {
  Plan plan = {kLoad};
  AddProjecting(&plan, typed.Has("--view") && typed.Completes());
  plan.push_back({"save", 1});
  return plan;
}

// Strokes are decided by a look at the selection that they would make.
Plan PlanOfMask(const Typed& typed) {
  Plan plan = {kLoad};
  if (typed.Has("--scribble")) {
    plan.push_back({"outline", 3});
    if (!typed.Has("--this-view-alone")) {
      AddSelecting(&plan, 1);
      AddProjecting(&plan, true);
    }
  }
  plan.push_back(kCheck);
  return plan;
}

// Without paint, the changes in the pictures of the edit are selected.
size_t NumPainted(const RegionRecipe& region) {
  size_t count = region.paint.size();
  if (count > 0) return count;
  for (const ColorOperation& op : region.edit.operations) {
    if (op.picture) count += op.picture->pictures.size();
  }
  return count;
}

// Of verbs that always do the same.
const std::map<std::string_view, Plan>& FixedPlans() {
  static const std::map<std::string_view, Plan> plans = {
      {"refit", {kLoad, kShares, kRefit, kEvaluate, kSave}},
      {"refine", {kLoad, kShares, {"refine", 20}, kSave}},
      {"evaluate", {kLoad, kShares, kEvaluate}},
      {"depth", {kLoad, {"depth", 3}}},
      {"info", {kLoad, kCheck}},
      {"render", {kLoad, {"views", 1}, kRender, {"video", 1}}},
      {"palette", {kLoad}},
      {"score", {{"score", 1}}},
      {"align", {kLoad, {"points", 1}, {"align", 5}, kSave}},
      {"match", {kLoad, {"match", 3}, kPictures, kSave}},
      {"cameras", {kLoad, {"views", 1}, kRender}},
      {"convert", {kLoad, kSave, kLoad, {"color error", 3}}},
      {"index", {{"index", 1}}},
      {"synth", {{"photos", 4}, {"points", kBrief}, {"light", 1}, {"gaussians", 1}, {"save", 1}}}};
  return plans;
}

}  // namespace

std::vector<PlannedStage> PlanOf(const CLI::App& verb) {
  const std::string name = verb.get_name();
  const Typed typed(verb);
  if (name == "select") return PlanOfSelect(typed);
  if (name == "suggest") return PlanOfSuggest(typed);
  if (name == "project") return PlanOfProject(typed);
  if (name == "mask") return PlanOfMask(typed);
  const auto found = FixedPlans().find(name);
  return found == FixedPlans().end() ? Plan() : found->second;
}

std::vector<PlannedStage> PlanOf(const EditRecipe& recipe, const std::vector<EditStage>& stages,
                                 bool evaluates) {
  Plan plan = {kLoad, kCheck};
  for (const EditStage& stage : stages) {
    if (stage.cached) continue;
    const RegionRecipe& region =
        *std::ranges::find(recipe.regions, stage.region, &RegionRecipe::name);
    if (stage.name == "select") AddSelecting(&plan, NumPainted(region));
    if (stage.name == "project") AddProjecting(&plan, region.options.projector.Completes());
    if (stage.name == "match") plan.push_back({"match", 3});
    if (stage.name == "refine") plan.push_back({"refine", 20});
    if (stage.name == "refit") plan.push_back(kRefit);
  }
  const EditOutputs& outputs = recipe.outputs;
  if (evaluates) plan.insert(plan.end(), recipe.regions.size(), kEvaluate);
  if (!outputs.stages.empty()) plan.push_back({"save", 4});
  if (!outputs.page.empty()) plan.push_back(kPictures);
  plan.push_back(kSave);
  return plan;
}

}  // namespace retint::cli
