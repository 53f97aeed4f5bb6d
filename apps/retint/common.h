// SPDX-License-Identifier: BSD-3-Clause
// Shared by the verbs: global options, the run's monitor and printer, opening a session. Every
// verb's file adds its options to the command line and hands back its action.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

#include "base/monitor.h"
#include "base/staged_output.h"
#include "editing/edit_options.h"
#include "editing/edit_session.h"
#include "pipeline/edit_recipe.h"
#include "pipeline/scene_source.h"
#include "recolor/finer_gaussians.h"
#include "retint/edit_flags.h"
#include "retint/option_flags.h"
#include "retint/progress.h"

namespace retint::cli {

struct SceneArguments;

// --backend and its like, accepted by every verb.
struct Globals {
  std::string backend = "auto";
  int threads = 0;
  uint64_t seed = 0;
  size_t cache_mb = 640;
  std::string log_level = "warn";
  std::string progress = "auto";
  bool quiet = false, verbose = false;
  std::string command;                                // the typed command, for a shell
  bool runs_job = false;                              // its options are keys of a file, not flags
  bool json_messages = false;                         // warnings and errors: with --progress json
  std::vector<PlannedStage> plan;                     // of the verb's run, for its progress
  std::map<const CLI::App*, SceneArguments*> scenes;  // of the verbs that open one
};

// A message of the library (base/option_name.h) with flags for the names of options.
std::string WithFlags(const std::string& message, const Globals& globals);
// A line on stderr for programs: {"level":"warning","message":"..."}, of an error with its "code".
std::string JsonMessage(const char* level, const std::string& message, int code = 0);

// One run of one verb.
class Run {
 public:
  explicit Run(const Globals& globals);
  ~Run();
  Monitor& monitor() { return monitor_; }
  const Globals& globals() const { return globals_; }
  // Whether this process writes and prints: of several ranks (base/ranks.h) the first.
  static bool Writes();
  // If only the run itself can tell its stages; the first of them is done.
  void SetPlan(std::vector<PlannedStage> plan) { printer_.SetPlan(std::move(plan)); }
  // Closes the last progress line; before results are printed.
  void FinishProgress() { printer_.Finish(); }
  // A line on stderr that does not garble the bar.
  void Warn(const std::string& message);
  const std::vector<std::string>& warnings() const { return warnings_; }  // so far
  void Info(const std::string& message);
  // A line of results on stdout, unless --quiet.
  void Print(const std::string& line) const;
  // Lines of ours, such as a list, as they are.
  void PrintText(const std::string& text) const;
  void Commit(StagedOutput& staged);
  // The results are in files that are in their places.
  void SetWritten() { has_written_ = true; }
  // A file that was not there before and is no result: it is removed where the run fails.
  void Made(const std::filesystem::path& path) { made_.push_back(path); }
  // At the end of a run that did not fail. If stdout cannot be written, the printed lines are
  // missing: a warning beside files, else a RunError.
  void Flush();

 private:
  const Globals& globals_;
  ProgressPrinter printer_;
  std::vector<std::string> warnings_;
  std::vector<std::filesystem::path> made_;
  bool has_written_ = false;
  Monitor monitor_;
};

// Whether all that was printed could be written.
bool FlushOutput();
inline constexpr const char* kNoStandardOutput = "standard output: cannot write";

// Groups of options in help.
inline constexpr const char* kSceneGroup = "Scene";
inline constexpr const char* kOutputGroup = "Output";
inline constexpr const char* kEditGroup = "Edit (in the order given)";

// Results of earlier runs that `run` and `recolor --cache` keep.
inline constexpr uint64_t kKeptStageBytes = uint64_t{2048} << 20;

using Action = std::function<void(Run&)>;

// Verbs whose work the ranks of mpirun or srun share; of the others only the first rank runs.
bool SharesWork(const std::string& verb);

// A subcommand with the global options in a group of their own.
CLI::App* AddVerb(CLI::App& app, Globals& globals, const std::string& name,
                  const std::string& description);

// Which scene to open: SCENE and the flags that say more about it.
struct SceneArguments {
  std::filesystem::path path;                      // as typed
  std::filesystem::path workspace, splat, images;  // found; no workspace: a splat alone
  std::filesystem::path view_folder;               // of a session: views that were placed
  std::string model, world_from_splat, pixels = "photo", render_model;
  OcioSpace space;
  Sim3d place;  // of a session: where its splat lies in the workspace's world
  int views = SessionOptions().views;
  const CLI::Option* views_flag = nullptr;  // --views, of verbs that have it
  bool needs_splat = true;
};
// --render-model, of every verb that opens a splat.
CLI::Option* AddRenderModel(CLI::App* verb, std::string& name);
// SCENE, --splat, --images and --model.
void AddSceneFiles(CLI::App* verb, Globals& globals, SceneArguments& scene, bool needs_splat);
void AddScene(CLI::App* verb, Globals& globals, SceneArguments& scene, bool needs_splat = true);
// The scene of a recipe, where `scene` does not say otherwise.
void TakeScene(const EditRecipe& recipe, SceneArguments& scene);
// Of the splats in a workspace: "no splat", or "2 splats (a.ply, b.ply)".
std::string SplatsText(const std::filesystem::path& workspace);
// After parsing: from the typed arguments to a workspace and a splat. InputError, OptionError.
void FindScene(SceneArguments& scene);
SessionOptions OptionsOf(const SceneArguments& scene, int holdout, const Run& run);
std::unique_ptr<EditSession> OpenSession(const SceneArguments& scene, int holdout, Run& run,
                                         const MemoryLimits& limits = {});
// All ranks (base/ranks.h) must see the same scene and compute alike, or their decisions part:
// InputError where they do not. Links their devices where that can be had, and says so. Collective.
void JoinRanks(EditSession& session, Run& run);
// The backend, and oddities of the workspace.
void DescribeSession(const EditSession& session, const std::string& backend, Run& run);
// Both: the second half of OpenSession(), once the scene is there.
void StartSession(EditSession& session, Run& run);

// --memory-mb and the other flags for a splat larger than memory.
struct LargeArguments {
  size_t memory_mb = 0, device_memory_mb = 0;
  std::string mode = "auto";
  std::filesystem::path index;
  int most_views = 0;
  MemoryLimits Given() const { return {memory_mb << 20, device_memory_mb << 20}; }
  MemoryLimits Limits(const Run& run) const;  // of the backend that was asked for
};
void AddLarge(CLI::App* verb, LargeArguments& large, bool selects);
// Null where the splat is opened whole, as OpenSession() does. `refit` is the fit that follows;
// null: none does.
std::unique_ptr<LargeScene> OpenLarge(const SceneArguments& scene, const LargeArguments& large,
                                      int holdout, const RefitOptions* refit, Run& run);
// The same as the scene of a run's steps.
std::unique_ptr<SceneSource> OpenSource(const SceneArguments& scene, const LargeArguments& large,
                                        int holdout, const RefitOptions* refit, Run& run);

// --view and --mask, repeated in pairs.
struct PaintArguments {
  std::vector<std::string> views;
  std::vector<std::filesystem::path> masks;
  // OptionError when the pairs do not match up.
  std::vector<PaintFile> Files() const;
};
void AddPaint(CLI::App* verb, PaintArguments& paint, bool required);
// Reads the masks and checks them against the pictures that --view names; a picture of several
// views becomes those that it paints. OptionError when the pairs do not match up.
std::vector<PaintedView> ReadPaint(const PaintArguments& paint, const Pictures& pictures);

// Warns of a splat that shows something else in the views of these names than their photos do.
void WarnOfMismatch(const std::vector<std::string>& views, EditSession& session, Run& run);
// As WarningsOfPaint().
void WarnOfPaint(const std::vector<PaintedView>& painted, const std::map<std::string, Mask>& masks,
                 const EditSession& session, Run& run);

// A folder of masks (colmap_io/mask_names.h).
struct MaskArguments {
  std::filesystem::path folder;
  bool invert = false;
};
CLI::Option* AddMasks(CLI::App* verb, MaskArguments& masks);
// --mask-names of what is written, and with --photos beside it.
CLI::Option* AddMaskNames(CLI::App* verb, std::string& names);
void AddPhotos(CLI::App* verb, std::filesystem::path& folder, std::string& names);
// The mask of every picture that has one. Warns of pictures without.
MaskFolder ReadMasksByName(const MaskArguments& masks, const Pictures& pictures, Run& run);
// Warns of an edit whose main color is measured inside masks, which `retint recolor` measures on
// the paint.
void WarnOfMainColor(const ColorEdit& edit, Run& run);
// As WarningOfMissingPhotos().
void WarnOfMissingPhotos(const Workspace& workspace, Run& run);

// All options that --set takes, by stage.
std::vector<StageOption> StagesOf(EditOptions& edit, RefineOptions& refine);
// The verbs whose --set takes options of a stage: "recolor and refit".
std::string VerbsOfStage(const std::string& stage);
// The stage of an option that --set takes, by its name or full name; empty: there is none.
std::string StageOf(std::string_view name);

// The options of an edit as flags, or those that a verb has of them.
struct EditArguments {
  EditOptions options;
  std::string preset = "retint";
  std::string network;  // of --matcher
  OptionFlags flags;
};
void AddPreset(CLI::App* verb, EditArguments& edit);
void AddDepthOptions(CLI::App* verb, EditArguments& edit);
void AddOnnxRuntime(CLI::App* verb, const std::string& group);
void AddCloudOptions(CLI::App* verb, EditArguments& edit);
void AddProjectorOptions(CLI::App* verb, EditArguments& edit);
// The preset's, changed by flags, and the seed. 0 iterations of adam, which nothing but its caller
// ends, are 3000 here. OptionError for values that do not go together.
EditOptions Resolve(const EditArguments& edit, const Globals& globals);

// The edit of the colors, and --holdout.
struct ColorArguments {
  EditFlags flags;
  int holdout = 0;
};
// With the options of the refit.
void AddRefitOptions(CLI::App* verb, ColorArguments& color, EditArguments& edit);

// In lower case, with its dot.
std::string ExtensionOf(const std::filesystem::path& path);
// CheckOutput() of a picture. OptionError unless it is to be a .png: there is no other format.
void CheckPicture(const std::filesystem::path& path);

// An output or input path.
inline CLI::Option* AddPath(CLI::App* verb, const std::string& flag, std::filesystem::path& path,
                            const std::string& description, const char* type = "FILE") {
  return verb->add_option(flag, path, description)->type_name(type)->default_str("");
}

// An option that may be repeated, one value each time.
template <typename T>
CLI::Option* AddRepeated(CLI::App* verb, const std::string& flag, T& values,
                         const std::string& description) {
  return verb->add_option(flag, values, description)->allow_extra_args(false)->default_str("");
}

}  // namespace retint::cli
