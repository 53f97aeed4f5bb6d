// SPDX-License-Identifier: BSD-3-Clause
// How the verbs open a splat that is larger than memory.
#include <filesystem>
#include <system_error>

#include "base/error.h"
#include "base/memory.h"
#include "base/ranks.h"
#include "retint/common.h"
#include "splat_io/splat_io.h"

namespace retint::cli {

MemoryLimits LargeArguments::Limits(const Run& run) const {
  return Given().For(*OpenBackend(run.globals().backend));
}

void AddLarge(CLI::App* verb, LargeArguments& large, bool selects) {
  constexpr const char* kGroup = "Memory";
  verb->add_option("--memory-mb", large.memory_mb,
                   "Memory to keep to, MiB; a splat that does not fit is opened in parts. 0: three "
                   "quarters of the machine's")
      ->check(CLI::Range(size_t{0}, size_t{1} << 24))
      // A fit whose views are made anew in each sweep would leave more and more between blocks.
      ->each([](const std::string&) { GiveLargeBlocksBackAtOnce(); })
      ->group(kGroup);
  verb->add_option("--device-memory-mb", large.device_memory_mb,
                   "The same for a GPU's memory. 0: nine tenths of the free memory")
      ->check(CLI::Range(size_t{0}, size_t{1} << 22))
      ->group(kGroup);
  verb->add_option("--out-of-core", large.mode,
                   "Open the splat in parts: auto (if it does not fit), on or off")
      ->check(CLI::IsMember({"auto", "on", "off"}))
      ->group(kGroup);
  AddPath(verb, "--index", large.index,
          "Index of the splat, built if it is missing. Else <splat>.index")
      ->group(kGroup);
  if (!selects) return;
  verb->add_option("--most-views", large.most_views,
                   "In parts: use only so many views of the selection, those that see it largest. "
                   "0: all")
      ->check(CLI::Range(0, 1'000'000))
      ->group(kGroup);
}

std::unique_ptr<LargeScene> OpenLarge(const SceneArguments& scene, const LargeArguments& large,
                                      int holdout, const RefitOptions* refit, Run& run) {
  LargeSceneOptions options;
  options.limits = large.Limits(run);
  options.index = large.index;
  options.most_views = large.most_views;
  if (refit) options.refit = *refit;
  const size_t caches = options.limits.Cache(run.globals().cache_mb << 20) +
                        (refit ? options.limits.Cache(refit->RegionCacheBytes()) : 0);
  // Ranks that share a GPU may find different amounts of it free, and open the splat alike.
  const bool needed =
      large.mode == "on" || (large.mode == "auto" && !scene.workspace.empty() &&
                             CurrentRanks().Any(IsTooLarge(scene.splat, options.limits, caches)));
  if (!needed) {
    if (large.most_views != 0) {
      run.Warn(
          "--most-views does nothing: the splat fits into memory and is opened whole "
          "(--out-of-core on opens it in parts)");
    }
    return nullptr;
  }
  const SessionOptions session = OptionsOf(scene, holdout, run);
  const std::filesystem::path index =
      large.index.empty() ? SplatIndex::PathFor(scene.splat) : large.index;
  std::error_code ignored;
  const bool is_there = std::filesystem::exists(index, ignored);
  auto opened =
      std::make_unique<LargeScene>(scene.workspace, scene.splat, session, options, run.monitor());
  if (!opened->index_built().empty()) run.Info("built the index: " + opened->index_built());
  if (!is_there) run.Made(index);
  return opened;
}

std::unique_ptr<SceneSource> OpenSource(const SceneArguments& scene, const LargeArguments& large,
                                        int holdout, const RefitOptions* refit, Run& run) {
  if (auto parts = OpenLarge(scene, large, holdout, refit, run)) {
    return std::make_unique<SceneInParts>(
        std::move(parts), large.Given(),
        [&run](EditSession& session) { StartSession(session, run); });
  }
  return std::make_unique<WholeScene>(OpenSession(scene, holdout, run, large.Limits(run)),
                                      large.Given());
}

}  // namespace retint::cli
