// SPDX-License-Identifier: BSD-3-Clause
#include "retint/common.h"

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>

#include <spdlog/spdlog.h>

#include "base/error.h"
#include "colmap_io/image_io.h"

namespace retint::cli {
namespace {

std::atomic<Monitor*> g_monitor{nullptr};

// The first Ctrl-C asks the work to stop, which removes what is half written; the second kills.
void OnInterrupt(int signal) {
  if (Monitor* monitor = g_monitor.load()) monitor->Cancel();
  std::signal(signal, SIG_DFL);
}

ProgressStyle StyleOf(const Globals& globals) {
  const ProgressStyle style = ParseProgressStyle(globals.progress);
  return globals.quiet ? ProgressStyle::kNone : style;
}

}  // namespace

Run::Run(const Globals& globals)
    : globals_(globals),
      printer_(StyleOf(globals)),
      monitor_([this](const Progress& progress) { printer_.Report(progress); }) {
  g_monitor.store(&monitor_);
  std::signal(SIGINT, OnInterrupt);
  std::signal(SIGTERM, OnInterrupt);
}

Run::~Run() { g_monitor.store(nullptr); }

void Run::Warn(const std::string& message) {
  printer_.Clear();
  spdlog::warn(message);
}

void Run::Info(const std::string& message) {
  printer_.Clear();
  spdlog::info(message);
}

void Run::Print(const std::string& line) const {
  if (!globals_.quiet) std::printf("%s\n", line.c_str());
}

CLI::App* AddVerb(CLI::App& app, Globals& globals, const std::string& name,
                  const std::string& description) {
  CLI::App* verb = app.add_subcommand(name, description);
  verb->option_defaults()->always_capture_default();
  constexpr const char* kGroup = "Everywhere";
  verb->add_option("--backend", globals.backend, "Where kernels run: auto, cpu or cuda")
      ->check(CLI::IsMember({"auto", "cpu", "cuda"}))
      ->group(kGroup);
  verb->add_option("--threads", globals.threads, "CPU threads; 0 uses every core")
      ->check(CLI::Range(0, 1024))
      ->group(kGroup);
  verb->add_option("--seed", globals.seed, "Seed of everything random")->group(kGroup);
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
  verb->add_flag("--quiet", globals.quiet, "Only errors: no progress, warnings or results")
      ->group(kGroup);
  return verb;
}

void AddScene(CLI::App* verb, SceneArguments& scene, bool splat_required) {
  verb->add_option("--workspace", scene.workspace,
                   "COLMAP workspace: folder with sparse/0, sparse or the model itself, and images")
      ->required()
      ->type_name("FOLDER");
  verb->add_option("--splat", scene.splat, "3D Gaussian Splatting scene in the workspace's frame")
      ->required(splat_required)
      ->type_name("FILE");
  verb->add_option("--images", scene.images, "Folder of the photos, where not WORKSPACE/images")
      ->type_name("FOLDER");
}

std::unique_ptr<EditSession> OpenSession(const SceneArguments& scene, int holdout, Run& run) {
  SessionOptions options;
  options.backend = run.globals().backend;
  options.cache_bytes = run.globals().cache_mb << 20;
  options.image_folder = scene.images;
  options.holdout = holdout;
  auto session = EditSession::Open(scene.workspace, scene.splat, options, run.monitor());
  for (const std::string& warning : session->workspace().warnings) run.Warn(warning);
  const Backend& backend = session->renderer().backend();
  run.Info("backend " + backend.Description());
  const std::string fault = CudaFault();
  if (options.backend == "auto" && !fault.empty() && fault != kCudaNotBuiltIn) {
    run.Warn("no GPU is used (" + fault + "): kernels run on the CPU");
  }
  return session;
}

void AddPaint(CLI::App* verb, PaintArguments& paint, bool required) {
  AddRepeated(verb, "--view", paint.views,
              "Name of the painted view; repeat with --mask for several views of one selection")
      ->required(required)
      ->type_name("NAME");
  AddRepeated(verb, "--mask", paint.masks,
              "Brush mask of that view: any picture of its size, black or transparent outside")
      ->required(required)
      ->type_name("FILE");
}

std::vector<PaintedView> ReadPaint(const PaintArguments& paint, const EditSession& session) {
  if (paint.views.size() != paint.masks.size()) {
    throw OptionError("--view and --mask come in pairs, there are " +
                      std::to_string(paint.views.size()) + " and " +
                      std::to_string(paint.masks.size()));
  }
  std::vector<PaintedView> painted;
  for (size_t i = 0; i < paint.views.size(); ++i) {
    const View& view = session.workspace().RequireView(paint.views[i]);
    for (const PaintedView& other : painted) {
      CheckOption(other.name != view.name, "--view " + view.name + " is given twice");
    }
    const Camera& camera = session.reconstruction().Posed(view).camera;
    painted.push_back(
        session.Paint(view.name, ReadBrushMask(paint.masks[i], camera.width, camera.height)));
  }
  return painted;
}

std::map<std::string, Mask> ReadMasksByName(const std::filesystem::path& folder,
                                            const EditSession& session, Run& run) {
  std::map<std::string, Mask> masks;
  const Reconstruction& model = session.reconstruction();
  for (auto& [id, mask] : ReadMasks(folder, model)) {
    masks.emplace(model.views.at(id).name, std::move(mask));
  }
  if (masks.size() < model.views.size()) {
    run.Warn(folder.string() + ": " + std::to_string(model.views.size() - masks.size()) + " of " +
             std::to_string(model.views.size()) + " views have no mask and take no part");
  }
  const bool any = std::any_of(masks.begin(), masks.end(), [](const auto& entry) {
    return std::any_of(entry.second.data.begin(), entry.second.data.end(),
                       [](uint8_t value) { return value > 0; });
  });
  if (!any) throw InputError(folder, "no mask has a selected pixel");
  return masks;
}

void RequirePhotos(const EditSession& session) {
  for (const auto& [id, view] : session.reconstruction().views) {
    if (!session.workspace().HasPhoto(view)) {
      throw InputError(session.workspace().PhotoPath(view), "--target photo needs it");
    }
  }
}

void AddDepthOptions(CLI::App* verb, SelectArguments& select, const std::string& method_flag) {
  constexpr const char* kGroup = "Depth";
  StereoHvOptions& stereo = select.options.depth.stereo_hv;
  verb->add_option(method_flag, select.method,
                   "gaussian (the splat's own), stereo-hv (rendered pairs) or colmap (dense maps)")
      ->check(CLI::IsMember({"gaussian", "stereo-hv", "colmap"}))
      ->group(kGroup);
  verb->add_option("--aggregate", select.aggregate,
                   "stereo-hv: agree (mean where pairs agree, else nearest) or min (the paper's)")
      ->check(CLI::IsMember({"agree", "min"}))
      ->group(kGroup);
  verb->add_option("--matcher", select.matcher,
                   "stereo-hv: census (the same on every backend) or sgbm (OpenCV's, on the CPU)")
      ->check(CLI::IsMember({"census", "sgbm"}))
      ->group(kGroup);
  verb->add_option("--baseline", stereo.baseline,
                   "stereo-hv: baseline in the workspace's unit; 0 chooses it")
      ->group(kGroup);
  verb->add_option("--disparities", stereo.max_disparities,
                   "stereo-hv: search range in pixels, a multiple of 16")
      ->group(kGroup);
}

void AddCloudOptions(CLI::App* verb, SelectArguments& select) {
  constexpr const char* kGroup = "Cloud and registration";
  CloudOptions& cloud = select.options.cloud;
  RegistrationOptions& registration = select.options.registration;
  verb->add_option("--sample", cloud.sample_fraction, "Share of the mask's pixels made points")
      ->group(kGroup);
  verb->add_option("--outlier-neighbors", cloud.outlier_neighbors,
                   "Neighbours of the outlier filter; 0 keeps all points")
      ->group(kGroup);
  verb->add_option("--outlier-stddev", cloud.outlier_stddev,
                   "Standard deviations above the mean neighbour distance that a point may lie")
      ->group(kGroup);
  verb->add_flag("--no-registration", select.no_registration,
                 "Leave the cloud where its depth put it")
      ->group(kGroup);
  verb->add_option("--margin", registration.margin,
                   "Pixels around the mask in which sparse points count")
      ->group(kGroup);
}

SelectOptions Resolve(const SelectArguments& select, const Globals& globals) {
  SelectOptions options = select.options;
  options.method = select.method;
  options.depth.stereo_hv.aggregate =
      select.aggregate == "min" ? StereoAggregate::kMin : StereoAggregate::kAgree;
  options.depth.stereo_hv.matcher =
      select.matcher == "sgbm" ? StereoMatcherKind::kSgbm : StereoMatcherKind::kCensus;
  options.register_cloud = !select.no_registration;
  options.cloud.seed = globals.seed;
  options.registration.seed = globals.seed;
  options.Check();
  return options;
}

void AddProjectorOptions(CLI::App* verb, ProjectorArguments& projector) {
  constexpr const char* kGroup = "Projection";
  ProjectorOptions& options = projector.options;
  verb->add_option("--projector", projector.projector,
                   "quads (the paper's), surfels, or gaussians (lifted to shares, re-rendered)")
      ->check(CLI::IsMember({"quads", "surfels", "gaussians"}))
      ->group(kGroup);
  verb->add_option("--quad-pixels", options.quad_pixels, "quads: side in pixels")->group(kGroup);
  verb->add_option("--surfel-scale", options.surfel_scale, "surfels: radius in pixel footprints")
      ->group(kGroup);
  verb->add_option("--close-radius", options.close_radius, "Closing of holes, pixels")
      ->group(kGroup);
  verb->add_option("--depth-tolerance", options.depth_tolerance,
                   "Relative depth behind which a point is hidden")
      ->group(kGroup);
  verb->add_option("--share-threshold", options.share_threshold,
                   "gaussians: rendered share above which a pixel is inside")
      ->group(kGroup);
  verb->add_option("--painted-weight", options.painted_weight,
                   "gaussians: weight of a painted view's pixels as evidence")
      ->group(kGroup);
  verb->add_option("--unknown-weight", options.unknown_weight,
                   "gaussians: weight against surfaces that no painted view sees")
      ->group(kGroup);
  verb->add_option("--visible-tolerance", options.visible_tolerance,
                   "gaussians: relative depth within which a painted view sees a surface")
      ->group(kGroup);
}

ProjectorOptions Resolve(const ProjectorArguments& projector) {
  ProjectorOptions options = projector.options;
  options.kind = projector.projector == "quads"     ? ProjectorKind::kQuads
                 : projector.projector == "surfels" ? ProjectorKind::kSurfels
                                                    : ProjectorKind::kGaussians;
  options.Check();
  return options;
}

void AddRefitOptions(CLI::App* verb, RefitArguments& refit) {
  constexpr const char* kGroup = "Edit and refit";
  RefitOptions& options = refit.options;
  verb->add_option("--tint", refit.tint,
                   "Colour filter: R,G,B factors >= 0, or #rrggbb (0-255 become 0-1)")
      ->required()
      ->group(kGroup);
  verb->add_option("--strength", refit.strength, "From 0, nothing, to 1, the whole edit")
      ->check(CLI::Range(0.0, 1.0))
      ->group(kGroup);
  verb->add_option("--target", refit.target,
                   "What is edited to become the targets: render (of the splat) or photo")
      ->check(CLI::IsMember({"render", "photo"}))
      ->group(kGroup);
  verb->add_option("--solver", refit.solver, "mm (block sweeps) or adam (the paper's)")
      ->check(CLI::IsMember({"mm", "adam"}))
      ->group(kGroup);
  verb->add_option("--iterations", refit.iterations,
                   "Sweeps of mm at most (12 where this is not given; 0: until it has converged, "
                   "at most 1000) or steps of adam (3000, also for 0)")
      ->check(CLI::Range(0, 10000000))
      ->group(kGroup);
  verb->add_option("--acceleration", refit.acceleration, "mm: none, nesterov or lbfgs")
      ->check(CLI::IsMember({"none", "nesterov", "lbfgs"}))
      ->group(kGroup);
  verb->add_option("--outside-weight", options.mm.outside_weight,
                   "mm: weight of the error of pixels outside the mask; those inside have 1")
      ->group(kGroup);
  verb->add_option("--learning-rate", options.adam.learning_rate, "adam: step size")->group(kGroup);
  verb->add_option("--lambda-dssim", options.adam.lambda_dssim,
                   "adam: weight of D-SSIM in the loss")
      ->group(kGroup);
  verb->add_option("--tolerance", options.mm.tolerance,
                   "mm: stop when a sweep lowers the loss by less than this share")
      ->group(kGroup);
  verb->add_option("--active-threshold", options.active_threshold,
                   "Share inside the masks above which a Gaussian may change")
      ->group(kGroup);
  verb->add_option_function<size_t>(
          "--region-mb", [&options](size_t mb) { options.region_cache_bytes = mb << 20; },
          "Memory for the fit's weights and targets, MiB")
      ->default_str(std::to_string(options.region_cache_bytes >> 20))
      ->check(CLI::Range(size_t{0}, size_t{1} << 22))
      ->group(kGroup);
  verb->add_option("--holdout", refit.holdout,
                   "Keep every n-th view by name out of the fit and report on it; 0 keeps none")
      ->check(CLI::Range(0, 1000000))
      ->group(kGroup);
}

ColorEdit ResolveEdit(const RefitArguments& refit) {
  const ColorEdit edit = ParseTint(refit.tint);
  edit.Check();
  return edit;
}

RefitJob Resolve(const RefitArguments& refit, const Globals& globals) {
  RefitJob job;
  job.options = refit.options;
  job.options.solver = refit.solver == "adam" ? Solver::kAdam : Solver::kMm;
  job.options.mm.acceleration = refit.acceleration == "none"       ? MmAcceleration::kNone
                                : refit.acceleration == "nesterov" ? MmAcceleration::kNesterov
                                                                   : MmAcceleration::kLbfgs;
  job.options.adam.seed = globals.seed;
  if (refit.iterations) {
    job.options.mm.iterations = *refit.iterations;
    if (*refit.iterations > 0) job.options.adam.iterations = *refit.iterations;
  }
  job.target = refit.target == "photo" ? TargetKind::kPhoto : TargetKind::kRender;
  job.options.Check();
  return job;
}

}  // namespace retint::cli
