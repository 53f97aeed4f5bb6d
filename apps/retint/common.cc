// SPDX-License-Identifier: BSD-3-Clause
#include "retint/common.h"

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <system_error>

#include <spdlog/spdlog.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/option_name.h"
#include "base/printable.h"
#include "base/ranks.h"
#include "base/staged_output.h"
#include "colmap_io/image_io.h"
#include "depth/network_matcher.h"
#include "kernels/cuda/cuda_backend.h"
#include "opening/scene_check.h"
#include "retint/help.h"
#include "retint/version.h"
#include "scene/mask_pixels.h"
#include "selecting/paint_held.h"

namespace retint::cli {
namespace {

std::atomic<Monitor*> g_monitor{nullptr};

// The first Ctrl-C asks the work to stop, which removes half-written files; the second kills.
void OnInterrupt(int signal) {
  if (Monitor* monitor = g_monitor.load()) monitor->Cancel();
  std::signal(signal, SIG_DFL);
}

ProgressStyle StyleOf(const Globals& globals) {
  const ProgressStyle style = ParseProgressStyle(globals.progress);
  return globals.quiet ? ProgressStyle::kNone : style;
}

// As it goes to stderr: control characters in names never reach a terminal.
std::string MessageLine(const Globals& globals, const char* level, const std::string& message) {
  return globals.json_messages ? JsonMessage(level, message) : Printable(message);
}

}  // namespace

std::string JsonMessage(const char* level, const std::string& message, int code) {
  nlohmann::ordered_json json = {{"level", level}, {"message", Printable(message)}};
  if (code != 0) json["code"] = code;
  return json.dump();
}

void JoinRanks(EditSession& session, Run& run) {
  Ranks& ranks = CurrentRanks();
  if (!ranks.AreMany()) return;
  const Backend& backend = session.scene().renderer().backend();
  std::string description = backend.Description();
  description.resize(std::min(description.size(), description.find(',')));  // the processor's kind
  const std::string own = std::to_string(session.scene().original().NumGaussians()) +
                          " Gaussians, " +
                          std::to_string(session.scene().reconstruction().views.size()) +
                          " views, " + std::string(backend.Name()) + " (" + description + ")";
  const std::vector<std::string> all = ranks.AllGather(own);
  for (size_t r = 1; r < all.size(); ++r) {
    if (all[r] == all[0]) continue;
    throw InputError("the ranks differ: rank 0 has " + all[0] + ", rank " + std::to_string(r) +
                     " has " + all[r]);
  }
  ranks.LinkDevices(backend.Identity());
  if (ranks.DevicesAreLinked()) {
    run.Info("arrays go from GPU to GPU by " + ranks.link_text());
  } else if (!backend.IsHost()) {
    run.Warn("arrays go from GPU to GPU through the host's memory, which is slow: " +
             ranks.link_text());
  }
}

Run::Run(const Globals& globals)
    : globals_(globals),
      printer_(StyleOf(globals), globals.plan),
      monitor_([this](const Progress& progress) { printer_.Report(progress); }) {
  g_monitor.store(&monitor_);
  std::signal(SIGINT, OnInterrupt);
  std::signal(SIGTERM, OnInterrupt);
  // The terminal is gone; nohup has it ignored.
  if (std::signal(SIGHUP, OnInterrupt) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);
}

Run::~Run() {
  g_monitor.store(nullptr);
  std::error_code ignored;
  for (const auto& path : made_) std::filesystem::remove(path, ignored);
}

bool Run::Writes() { return CurrentRanks().IsRoot(); }

std::string WithFlags(const std::string& message, const Globals& globals) {
  if (globals.runs_job) return message;
  EditOptions options;
  const OptionList described = Described(options);
  return SpellOptions(message, [&](std::string_view name, std::string_view value) {
    const Option* option = FindOption(described, name);
    if (option && option->Flag().empty()) {
      return "--set " + std::string(name) + (value.empty() ? "" : "=") + std::string(value);
    }
    std::string flag = "--" + std::string(name);
    std::replace(flag.begin(), flag.end(), '_', '-');
    return flag + (value.empty() ? "" : " ") + std::string(value);
  });
}

void Run::Warn(const std::string& message) {
  printer_.Clear();
  warnings_.push_back(WithFlags(message, globals_));
  spdlog::warn(MessageLine(globals_, "warning", warnings_.back()));
}

void Run::Info(const std::string& message) {
  printer_.Clear();
  spdlog::info(MessageLine(globals_, "info", message));
}

void Run::Print(const std::string& line) const {
  if (!globals_.quiet) std::printf("%s\n", Printable(line).c_str());
}

void Run::PrintText(const std::string& text) const {
  if (!globals_.quiet) std::fputs(text.c_str(), stdout);
}

void Run::Commit(StagedOutput& staged) {
  staged.Commit();
  if (!staged.IsEmpty()) SetWritten();
}

void Run::Flush() {
  FinishProgress();
  const bool is_said = FlushOutput();
  if (!is_said && !has_written_) throw RunError(kNoStandardOutput);
  made_.clear();
  if (is_said) return;
  Warn(std::string(kNoStandardOutput) + "; the files are written, the summary is missing");
}

bool FlushOutput() {
  // Text beyond the buffer failed earlier.
  const bool is_written = std::cout.flush() && std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  // The next command may run in the same process (apps/python).
  std::cout.clear();
  std::clearerr(stdout);
  return is_written;
}

bool SharesWork(const std::string& verb) {
  return verb == "recolor" || verb == "run" || verb == "refit" || verb == "project";
}

CLI::App* AddVerb(CLI::App& app, Globals& globals, const std::string& name,
                  const std::string& description) {
  CLI::App* verb = app.add_subcommand(name, description);
  verb->option_defaults()->always_capture_default();
  constexpr const char* kGroup = kEverywhere;
  verb->add_option("--backend", globals.backend, "Where kernels run: auto, cpu or cuda")
      ->check(CLI::IsMember({"auto", "cpu", "cuda"}))
      ->group(kGroup);
  verb->add_option("--threads", globals.threads, "CPU threads; 0 uses every core")
      ->check(CLI::Range(0, 1024))
      ->group(kGroup);
  verb->add_option("--seed", globals.seed, "Seed of everything random")
      ->check(CLI::Validator(
          [](const std::string& text) {
            return text.find('-') == std::string::npos ? "" : text + " is negative";
          },
          ""))
      ->group(kGroup);
  verb->add_option("--cache-mb", globals.cache_mb, "Memory for the views' frozen geometry, MiB")
      ->check(CLI::Range(size_t{0}, size_t{1} << 22))
      ->group(kGroup);
  verb->add_option("--log-level", globals.log_level, "debug, info, warn, error or off, on stderr")
      ->check(CLI::IsMember({"debug", "info", "warn", "error", "off"}))
      ->group(kGroup);
  verb->add_option("--progress", globals.progress,
                   "auto (bars on a terminal, else plain), bar, plain, json or none, on stderr")
      ->check(CLI::IsMember({"auto", "bar", "plain", "json", "none"}))
      ->group(kGroup);
  verb->add_flag("-q,--quiet", globals.quiet, "Only errors: no progress, warnings or results")
      ->group(kGroup);
  verb->add_flag("-v,--verbose", globals.verbose, "All figures of a run, not only its summary")
      ->group(kGroup);
  return verb;
}

std::unique_ptr<EditSession> OpenSession(const SceneArguments& scene, int holdout, Run& run,
                                         const MemoryLimits& limits) {
  SessionOptions options = OptionsOf(scene, holdout, run);
  options.cache_bytes = limits.Cache(options.cache_bytes);
  options.photo_bytes = limits.Cache(MemorySide::kHost, options.photo_bytes);
  auto session = EditSession::Open(scene.workspace, scene.splat, options, run.monitor());
  StartSession(*session, run);
  return session;
}

void StartSession(EditSession& session, Run& run) {
  JoinRanks(session, run);
  DescribeSession(session, run.globals().backend, run);
}

void DescribeSession(const EditSession& session, const std::string& backend, Run& run) {
  run.Info("backend " + BackendText(session.scene().backend(), backend));
  const std::string fault = CudaFault();
  if (backend == "auto" && !fault.empty() && fault != kCudaNotBuiltIn && fault != kCudaNoDevice) {
    run.Warn("the GPU is not used (" + fault + "): kernels run on the CPU");
  }
  for (const std::string& warning : session.warnings()) run.Warn(warning);
}

void AddPaint(CLI::App* verb, PaintArguments& paint, bool required) {
  Everyday(verb, AddRepeated(verb, "--view", paint.views,
                             "Name of the painted view. Repeat with --mask for several views")
                     ->required(required)
                     ->type_name("NAME"));
  Everyday(verb, AddRepeated(verb, "--mask", paint.masks,
                             "Mask of that view, a picture of its size; black or transparent is "
                             "outside")
                     ->required(required)
                     ->type_name("FILE"));
}

std::vector<PaintFile> PaintArguments::Files() const {
  if (views.size() != masks.size()) {
    throw OptionError("--view and --mask come in pairs, there are " + std::to_string(views.size()) +
                      " and " + std::to_string(masks.size()));
  }
  std::vector<PaintFile> files;
  for (size_t i = 0; i < views.size(); ++i) files.push_back({views[i], masks[i]});
  return files;
}

std::vector<PaintedView> ReadPaint(const PaintArguments& paint, const Pictures& pictures) {
  std::vector<PaintedView> painted;
  for (const PaintFile& file : paint.Files()) {
    for (PaintedView& view : pictures.ReadBrush(file.view, file.mask)) {
      for (const PaintedView& other : painted) {
        CheckOption(other.name != view.name, "--view " + file.view + " is given twice");
      }
      painted.push_back(std::move(view));
    }
  }
  return painted;
}

void WarnOfMismatch(const std::vector<std::string>& names, EditSession& session, Run& run) {
  const std::string mismatch = MismatchIn(session.scene(), names);
  if (!mismatch.empty()) run.Warn(mismatch);
}

void WarnOfPaint(const std::vector<PaintedView>& painted, const std::map<std::string, Mask>& masks,
                 const EditSession& session, Run& run) {
  for (const std::string& warning : WarningsOfPaint(session.scene().workspace(), painted, masks)) {
    run.Warn(warning);
  }
}

CLI::Option* AddMasks(CLI::App* verb, MaskArguments& masks) {
  verb->add_flag("--invert-masks", masks.invert, "Black is inside the masks, white outside");
  return AddPath(verb, "--masks", masks.folder,
                 "Folder of masks: <image name>.png, <stem>.png, <stem>.mask.png or "
                 "<stem>_mask.png. Retint ignores views without one",
                 "FOLDER");
}

CLI::Option* AddMaskNames(CLI::App* verb, std::string& names) {
  return verb
      ->add_option("--mask-names", names,
                   "Names of written masks: colmap (0001.jpg.png), stem (0001.png), mask "
                   "(0001.mask.png) or metashape (0001_mask.png)")
      ->check(CLI::IsMember(std::vector<std::string>(kMaskNames.begin(), kMaskNames.end())));
}

void AddPhotos(CLI::App* verb, std::filesystem::path& folder, std::string& names) {
  CLI::Option* photos =
      AddPath(verb, "--photos", folder,
              "Folder for the edited photos: images, with their metadata and JPEG quality, and "
              "masks. Photos without a change are hard links",
              "FOLDER")
          ->group(kOutputGroup);
  AddMaskNames(verb, names)->group(kOutputGroup)->needs(photos);
}

MaskFolder ReadMasksByName(const MaskArguments& arguments, const Pictures& pictures, Run& run) {
  const std::filesystem::path& folder = arguments.folder;
  MaskFolder masks = ReadMaskFolder(folder, arguments.invert, pictures);
  const std::string missing =
      WarningOfMissingMasks(masks.masks.size() + masks.empty.size(), pictures);
  if (!missing.empty()) run.Warn(folder.string() + ": " + missing);
  const bool any =
      std::ranges::any_of(masks.masks, [](const auto& entry) { return AnyInside(entry.second); });
  // A map of labels has small numbers.
  if (!any) throw InputError(folder, "no mask has a selected pixel, 128 or more of 255");
  return masks;
}

void WarnOfMainColor(const ColorEdit& edit, Run& run) {
  const bool measures = std::ranges::any_of(edit.operations, [](const ColorOperation& op) {
    return op.kind != ColorOperationKind::kPicture && op.NeedsMeasuring();
  });
  if (!measures) return;
  run.Warn(
      "the main color, which the edit replaces, is measured inside the masks. If they cover more "
      "than the object, name it, as in --to teal,from=#c8b478, or take a report of `retint "
      "recolor` with --edit");
}

void WarnOfMissingPhotos(const Workspace& workspace, Run& run) {
  const std::string missing = WarningOfMissingPhotos(workspace);
  if (!missing.empty()) run.Warn(missing);
}

void AddPreset(CLI::App* verb, EditArguments& edit) {
  verb->add_option("--preset", edit.preset,
                   "Options to start from: retint (the defaults shown here) or paper (ReCoGS as "
                   "published)")
      ->check(CLI::IsMember(Presets()))
      ->group(kOtherOptions);
}

std::vector<StageOption> StagesOf(EditOptions& edit, RefineOptions& refine) {
  std::vector<StageOption> all;
  const auto add = [&](const char* stage, auto& options) {
    for (const Option& option : Described(options)) all.push_back({stage, option});
  };
  add("select", edit.select);
  add("project", edit.projector);
  add("refine", refine);
  add("refit", edit.refit);
  return all;
}

std::string VerbsOfStage(const std::string& stage) {
  if (stage == "select") return "recolor, select and suggest";
  if (stage == "project") return "recolor, project and suggest";
  return stage == "refit" ? "recolor and refit" : "recolor and refine";
}

std::string StageOf(std::string_view name) {
  EditOptions edit;
  RefineOptions refine;
  for (const StageOption& one : StagesOf(edit, refine)) {
    if (one.IsNamed(name)) return one.stage;
  }
  return {};
}

namespace {

// Beside the option's own values, a network. It belongs to the machine too.
void AddMatcher(CLI::App* verb, EditArguments& edit) {
  verb->add_option_function<std::string>(
          "--matcher",
          [&edit](const std::string& text) {
            const bool is_network = text.starts_with("onnx:") || text.starts_with("exec:");
            if (!is_network && text != "census" && text != "sgbm") {
              throw CLI::ValidationError("--matcher",
                                         "must be census, sgbm, onnx:FILE or "
                                         "exec:COMMAND, not '" +
                                             text + "'");
            }
            edit.network = is_network ? text : "";
            edit.flags.Set("stereo-hv.matcher=" + (is_network ? "network" : text), "--matcher");
          },
          "stereo-hv: census (for up to 256 disparities), sgbm (OpenCV's, on the CPU), "
          "onnx:FILE[,key=value...] (a stereo network) or exec:COMMAND (a program that runs one)")
      ->type_name("NAME")
      ->default_str("census")
      ->group("Selection");
}

}  // namespace

void AddDepthOptions(CLI::App* verb, EditArguments& edit) {
  OptionList list;
  edit.options.select.DescribeDepth(list);
  edit.flags.Add(verb, "select", "Selection", list);
  // The place of a program belongs to the machine: it is no option of the edit.
  verb->add_option("--colmap-program", edit.options.select.depth.colmap_mvs.program,
                   "colmap-mvs: COLMAP's program, built with CUDA. A name is looked up in PATH")
      ->type_name("FILE")
      ->group("Selection");
  AddMatcher(verb, edit);
  AddOnnxRuntime(verb, "Selection");
}

void AddOnnxRuntime(CLI::App* verb, const std::string& group) {
  verb->add_option_function<std::string>(
          "--onnx-runtime",
          [](const std::string& path) { setenv("RETINT_ONNX_RUNTIME", path.c_str(), 1); },
          "onnx: the library libonnxruntime.so, or its folder. Without it, RETINT_ONNX_RUNTIME "
          "names it, else the usual places are searched")
      ->type_name("PATH")
      ->group(group);
}

void AddCloudOptions(CLI::App* verb, EditArguments& edit) {
  OptionList list;
  edit.options.select.DescribeCloud(list);
  edit.flags.Add(verb, "select", "Selection", list);
}

void AddProjectorOptions(CLI::App* verb, EditArguments& edit) {
  OptionList list;
  edit.options.projector.Describe(list);
  edit.flags.Add(verb, "project", "Selection", list);
}

void AddRefitOptions(CLI::App* verb, ColorArguments& color, EditArguments& edit) {
  constexpr const char* kGroup = "Fit";
  color.flags.Add(verb, kEditGroup);
  OptionList list;
  edit.options.refit.Describe(list);
  edit.flags.Add(verb, "refit", kGroup, list);
  Everyday(verb, verb->add_option("--holdout", color.holdout,
                                  "Keep every N-th view by name out of the fit, and report on it")
                     ->check(CLI::Range(0, 1000000))
                     ->group(kGroup));
}

EditOptions Resolve(const EditArguments& edit, const Globals& globals) {
  EditOptions options = edit.options;
  OptionList list;
  options.Describe(list);
  EditOptions preset = PresetOptions(edit.preset);
  preset.SetSeed(globals.seed);
  edit.flags.TakeOver(Described(preset), list);
  if (!edit.network.empty()) {
    options.select.depth.stereo_hv.network = MakeNetworkMatcher(edit.network);
  }
  options.EndByThemselves();
  options.Check();
  return options;
}

std::string ExtensionOf(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

void CheckPicture(const std::filesystem::path& path) {
  CheckOption(ExtensionOf(path) == ".png", path.string() + ": pictures are written as .png");
  CheckOutput(path);
}

}  // namespace retint::cli
