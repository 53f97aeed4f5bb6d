// SPDX-License-Identifier: BSD-3-Clause
// run_job(): a job file, carried out as `retint run` does.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "arrays.h"
#include "calls.h"
#include "colmap_io/nerfstudio.h"
#include "pipeline/edit_checks.h"
#include "pipeline/edit_run.h"
#include "pipeline/job_file.h"
#include "results.h"
#include "types.h"

namespace retint::python {
namespace {

namespace fs = std::filesystem;

struct Limits {
  std::string backend;
  size_t memory_mb;
  std::string in_parts;  // auto, on or off
};

SessionOptions OptionsOf(const EditRecipe& job, const std::string& backend) {
  SessionOptions options;
  options.backend = backend;
  options.image_folder = job.images;
  options.model = job.model;
  options.render_model = job.render_model;
  options.space = job.space;
  options.holdout = job.holdout;
  if (job.views > 0) options.views = job.views;
  if (!job.world_from_splat.empty()) {
    options.world_from_splat = WorldFromSplatOf(job.world_from_splat);
  }
  return options;
}

std::unique_ptr<SceneSource> OpenSource(const EditRecipe& job, const Limits& given,
                                        std::vector<std::string>* warnings, Monitor& monitor) {
  SessionOptions options = OptionsOf(job, given.backend);
  const MemoryLimits typed{given.memory_mb << 20, 0};
  const MemoryLimits limits = typed.For(*retint::OpenBackend(given.backend));
  options.cache_bytes = limits.Cache(options.cache_bytes);
  const RefitOptions& refit = job.options.refit.options;
  const size_t caches = options.cache_bytes + limits.Cache(refit.RegionCacheBytes());
  const auto warn = [warnings](EditSession& session) {
    warnings->insert(warnings->end(), session.warnings().begin(), session.warnings().end());
  };
  if (given.in_parts == "on" || (given.in_parts == "auto" && !job.workspace.empty() &&
                                 IsTooLarge(job.splat, limits, caches))) {
    LargeSceneOptions large;
    large.limits = limits;
    large.refit = refit;
    return std::make_unique<SceneInParts>(
        std::make_unique<LargeScene>(job.workspace, job.splat, options, large, monitor), typed,
        warn);
  }
  auto session = EditSession::Open(job.workspace, job.splat, options, monitor);
  warn(*session);
  return std::make_unique<WholeScene>(std::move(session), typed);
}

struct Outcome {
  std::vector<EditStage> stages;
  std::vector<std::string> warnings;
  std::string report;  // JSON; empty: the job wants none
};

Outcome Run(const EditRecipe& job, const fs::path& cache_folder, const Limits& limits,
            Monitor& monitor) {
  Outcome outcome;
  outcome.warnings = job.warnings;
  CheckOutputs(job);
  const auto source = OpenSource(job, limits, &outcome.warnings, monitor);
  StageCache cache(cache_folder);
  EditRun run(job, *source, cache,
              {.stage = [&](const EditStage& stage) { outcome.stages.push_back(stage); },
               .warning = [&](const std::string& text) { outcome.warnings.push_back(text); }});
  run.Run(monitor);
  const bool evaluates = !job.outputs.report.empty() || !job.outputs.page.empty();
  if (evaluates) run.Evaluate({}, monitor);
  run.Write(outcome.warnings, monitor);
  if (evaluates) outcome.report = ToJson(run.report());
  return outcome;
}

py::dict RunJob(const py::object& file, const py::object& cache, const std::string& backend,
                size_t memory_mb, const std::string& in_parts, py::object progress) {
  CheckOption(in_parts == "auto" || in_parts == "on" || in_parts == "off",
              "in_parts is \"auto\", \"on\" or \"off\"");
  CheckOption(memory_mb <= size_t{1} << 24, "memory_mb is at most 16777216");
  const fs::path path = ToPath(file);
  const fs::path folder = cache.is_none() ? fs::path() : ToPath(cache);
  Call call(std::move(progress));
  const Outcome outcome = call.Run([&](Monitor& monitor) {
    return Run(ReadJob(path), folder, {backend, memory_mb, in_parts}, monitor);
  });
  py::list stages;
  for (const EditStage& stage : outcome.stages) {
    py::dict one;
    one["region"] = stage.region;
    one["stage"] = stage.name;
    one["kept"] = stage.cached;
    stages.append(one);
  }
  py::dict result;
  result["stages"] = stages;
  result["warnings"] = outcome.warnings;
  result["report"] = outcome.report.empty() ? py::object(py::none()) : FromJson(outcome.report);
  return result;
}

}  // namespace

void BindJobs(py::module_& module) {
  module.def(
      "run_job", &RunJob, py::arg("job"), py::kw_only(), py::arg("cache") = py::none(),
      py::arg("backend") = "auto", py::arg("memory_mb") = 0, py::arg("in_parts") = "auto",
      py::arg("progress") = py::none(),
      "Carries out a job file as `retint run` does, and writes its outputs. Returns a dict: "
      "'stages' (each a dict of 'region', 'stage' and 'kept'), 'warnings' (sentences) and 'report' "
      "(a dict with the keys of the job's report; None if the job has neither report nor page). "
      "`cache`: a folder that keeps the stages' results, so that the next run goes on from the "
      "first stage that changed. `memory_mb`: memory to keep to, MiB; 0 is three quarters of the "
      "machine's. `in_parts`: whether to open the splat in parts: 'auto' (if it does not fit), "
      "'on' or 'off'.");
}

}  // namespace retint::python
