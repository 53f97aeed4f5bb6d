// SPDX-License-Identifier: BSD-3-Clause
// retint index: the places of Gaussians in a splat larger than memory.
#include <fmt/format.h>

#include "base/error.h"
#include "base/run_clock.h"
#include "base/staged_output.h"
#include "out_of_core/splat_index.h"
#include "pipeline/large_scene.h"
#include "retint/common.h"
#include "retint/help.h"

namespace retint::cli {
namespace {

struct Arguments {
  std::filesystem::path splat, output;
  SplatIndexOptions options;
  size_t memory_mb = SplatIndexOptions().memory_bytes >> 20;
  bool force = false;
};

void Index(const Arguments& arguments, Run& run) {
  const PlyFile splat(arguments.splat);
  const std::filesystem::path path =
      arguments.output.empty() ? SplatIndex::PathFor(arguments.splat) : arguments.output;
  CheckOutput(path);
  MemoryLimits limits;
  limits.host_bytes = arguments.memory_mb << 20;
  const StageClock clock;
  std::string built;
  const SplatIndex index =
      OpenIndex(splat, path, limits, arguments.options, arguments.force, run.monitor(), &built);
  run.SetWritten();
  const std::string why = arguments.force ? "it was asked for" : built;
  run.FinishProgress();
  run.Print(fmt::format("{} Gaussians of {} bytes in {} blocks", index.count(),
                        splat.record_bytes(), index.blocks().size()));
  if (why.empty()) {
    run.Print(fmt::format("{} fits the file", path.string()));
  } else {
    run.Print(fmt::format("wrote {} in {:.1f} s, peak memory {:.0f} MB ({})", path.string(),
                          clock.Total() / 1000, PeakRssMb(), why));
  }
}

}  // namespace

void AddIndex(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = AddVerb(app, globals, "index",
                           "Index a splat (.ply), so that one larger than memory can be edited");
  AddPath(verb, "SPLAT", arguments->splat, "Splat to index, a binary .ply")->required();
  Everyday(verb,
           AddPath(verb, "-o,--output", arguments->output, "Index to write. Else <splat>.index"));
  verb->add_option("--block", arguments->options.block, "Most Gaussians of a block")
      ->check(CLI::Range(16U, 65536U));
  verb->add_option("--memory-mb", arguments->memory_mb,
                   "Memory to keep to, MiB. Retint sorts the rest on disk")
      ->check(CLI::Range(size_t{1}, size_t{1} << 20));
  verb->add_flag("--force", arguments->force, "Build it even if there is one that fits the file");
  AddExamples(verb, {"retint index sample/splat.ply"});
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { Index(*arguments, run); }; });
}

}  // namespace retint::cli
