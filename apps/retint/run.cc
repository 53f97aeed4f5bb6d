// SPDX-License-Identifier: BSD-3-Clause
// retint run: a job file, whose stages are kept and go on from the first that changed.
#include <cstdio>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"
#include "base/ranks.h"
#include "pipeline/edit_checks.h"
#include "pipeline/edit_run.h"
#include "pipeline/job_file.h"
#include "reporting/match_report.h"
#include "retint/common.h"
#include "retint/help.h"
#include "retint/results.h"
#include "retint/stage_plans.h"

namespace retint::cli {
namespace {

struct Arguments {
  std::filesystem::path job, cache;
  bool no_cache = false, dry_run = false, schema = false;
  uint64_t keep_mb = kKeptStageBytes >> 20;
  LargeArguments large;
  const CLI::Option* seed = nullptr;  // of all verbs; a job has its own
};

std::filesystem::path CacheFolder(const Arguments& arguments, const EditRecipe& job) {
  if (arguments.no_cache) return {};
  if (!arguments.cache.empty()) return arguments.cache;
  std::filesystem::path folder = job.file;
  return folder.replace_extension(".cache");
}

void PrintStage(const EditStage& stage, const char* state, const Run& run) {
  run.Print(fmt::format("{:<12} {:<8} {}", stage.name, state, stage.region));
}

void RunJob(const Arguments& arguments, Run& run) {
  if (arguments.schema) {
    std::fputs(JobSchema().c_str(), stdout);
    return;
  }
  CheckOption(!arguments.job.empty(), "a job file is needed, or --schema");
  CheckOption(arguments.cache.empty() || !arguments.no_cache,
              "--cache and --no-cache exclude each other");
  std::optional<uint64_t> seed;
  if (arguments.seed->count() > 0) seed = run.globals().seed;
  const EditRecipe job = ReadJob(arguments.job, seed);
  for (const std::string& warning : job.warnings) run.Warn(warning);
  SceneArguments scene;
  TakeScene(job, scene);
  CheckOutputs(job);
  const auto source =
      OpenSource(scene, arguments.large, job.holdout, &job.options.refit.options, run);
  StageCache cache(CacheFolder(arguments, job));
  std::vector<EditStage> stages;
  EditRun edit(job, *source, cache,
               {.stage = [&](const EditStage& stage) { stages.push_back(stage); },
                .warning = [&](const std::string& text) { run.Warn(text); }});
  if (arguments.dry_run) {
    run.FinishProgress();
    for (const EditStage& stage : edit.Plan()) {
      PrintStage(stage, stage.cached ? "kept" : "to do", run);
    }
    return;
  }
  const bool evaluates = !job.outputs.report.empty() || !job.outputs.page.empty();
  run.SetPlan(PlanOf(job, edit.Plan(), evaluates));
  edit.Run(run.monitor());
  if (evaluates) edit.Evaluate({}, run.monitor());
  if (!run.Writes()) return;
  const ShareAmong alone;
  edit.Write(run.warnings(), run.monitor());
  run.SetWritten();
  for (const auto& splat : job.outputs.splats) {
    WarnOfLosses(splat, edit.session().scene().original(), run);
  }
  cache.Trim(arguments.keep_mb << 20);
  run.FinishProgress();
  for (const EditStage& stage : stages) PrintStage(stage, stage.cached ? "kept" : "done", run);
  for (const RegionOutcome& outcome : edit.outcomes()) {
    if (!outcome.match) continue;
    for (const std::string& line : LinesOf(*outcome.match)) run.Print(line);
  }
  PrintOutputs(job.outputs, run);
}

}  // namespace

void AddRun(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = AddVerb(app, globals, "run",
                           "Run a job file: several edits of one scene, from the first stage that "
                           "changed");
  arguments->seed = verb->get_option("--seed");
  AddPath(verb, "JOB", arguments->job, "Job file (.json)");
  Everyday(verb, verb->add_flag("--dry-run", arguments->dry_run,
                                "Check the job and print the stages that would run"));
  Everyday(verb, AddPath(verb, "--cache", arguments->cache,
                         "Folder of the stages' results. Else the job file's name with .cache",
                         "FOLDER"));
  Everyday(verb, verb->add_flag("--no-cache", arguments->no_cache,
                                "Compute everything and keep nothing"));
  verb->add_option("--keep-mb", arguments->keep_mb,
                   "Results of earlier runs to keep, MiB; the oldest go first")
      ->check(CLI::Range(uint64_t{0}, uint64_t{1} << 40));
  Everyday(verb,
           verb->add_flag("--schema", arguments->schema, "Print the JSON Schema of job files"));
  AddLarge(verb, arguments->large, /*selects=*/true);
  verb->callback([&action, &globals, arguments] {
    globals.runs_job = true;
    action = [arguments](Run& run) { RunJob(*arguments, run); };
  });
}

}  // namespace retint::cli
