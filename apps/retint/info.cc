// SPDX-License-Identifier: BSD-3-Clause
// retint info: the contents of a workspace and a splat, and whether the two belong together.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <fmt/format.h>

#include "base/error.h"
#include "opening/scene_check.h"
#include "retint/common.h"
#include "retint/help.h"
#include "scene/sh_band4.h"

namespace retint::cli {
namespace {

struct Arguments {
  SceneArguments scene;
  LargeArguments large;
  int max_views = 12;
  bool all = false;
};

void PrintWorkspace(const Workspace& workspace, Run& run) {
  const Reconstruction& model = workspace.reconstruction;
  std::map<CameraId, const Camera*> photo_cameras;
  for (const auto& [id, camera] : model.cameras) {
    if (!workspace.photo_pixels) photo_cameras[id] = &camera;
  }
  for (const auto& [id, view] : model.views) {
    const Camera& camera = workspace.PhotoCamera(view);
    photo_cameras[camera.id] = &camera;
  }
  std::map<std::string, int> kinds;
  for (const auto& [id, camera] : photo_cameras) ++kinds[DescribeCamera(*camera)];
  std::string cameras;
  for (const auto& [kind, count] : kinds) {
    cameras += fmt::format("{}{}{}", cameras.empty() ? "" : "; ", kind,
                           count > 1 ? fmt::format(" (x{})", count) : "");
  }
  size_t photos = 0, observations = 0;
  double error = 0;
  for (const auto& [id, view] : model.views) photos += workspace.HasPhoto(view) ? 1 : 0;
  for (const auto& [id, point] : model.points) {
    observations += point.track.size();
    error += point.error > 0 ? point.error : 0;
  }
  const double points = std::max<double>(1, static_cast<double>(model.points.size()));
  if (workspace.has_virtual_views) {
    run.Print("workspace    none: views were placed around the splat");
  } else {
    run.Print(fmt::format("workspace    {}", workspace.root.string()));
    run.Print(fmt::format("model        {}", workspace.sparse_folder.string()));
  }
  run.Print(fmt::format("cameras      {}: {}", photo_cameras.size(), cameras));
  run.Print(workspace.has_virtual_views
                ? fmt::format("views        {}, renders serve as their photos", model.views.size())
                : fmt::format("views        {}, photos of {}", model.views.size(), photos));
  run.Print(fmt::format("points       {}, mean track {:.1f} views, mean error {:.2f} px",
                        model.points.size(), static_cast<double>(observations) / points,
                        error / points));
}

void PrintCheck(const SceneCheck& check, Run& run) {
  const ViewComparison* worst = nullptr;
  int with_photo = 0;
  for (const ViewComparison& one : check.comparisons) {
    if (!std::isfinite(one.psnr)) continue;
    ++with_photo;
    if (!worst || one.psnr < worst->psnr) worst = &one;
  }
  if (worst) {
    run.Print(
        fmt::format("PSNR         {:.1f} dB median of {} of {} views against their photos, "
                    "worst {:.1f} dB ({})",
                    check.median_psnr, with_photo, check.views, worst->psnr, worst->view));
  } else {
    run.Print("PSNR         no photos to compare with");
  }
  run.Print(fmt::format("coverage     {:.1f} % of the pixels' opacity, median",
                        100 * check.median_coverage));
  if (!check.mismatch.empty()) run.Warn(check.mismatch);
}

void PrintSplat(const std::filesystem::path& splat, size_t count, int sh_degree, bool has_band4,
                Run& run) {
  run.Print(fmt::format("splat        {}", splat.string()));
  run.Print(fmt::format("Gaussians    {}, SH degree {}{}", count, sh_degree,
                        has_band4 ? "; degree 4 is kept and not shown" : ""));
}

void PrintSplat(const PlyFile& splat, Run& run) {
  PrintSplat(splat.path(), splat.count(), splat.sh_degree(), splat.has_sh_band4(), run);
}

SceneCheckOptions CheckOf(const Arguments& arguments) {
  SceneCheckOptions options;
  options.max_views = arguments.all ? std::numeric_limits<int>::max() : arguments.max_views;
  options.longest_side = 0;
  options.strict = true;
  return options;
}

void PrintTraits(const SplatTraits& traits, Run& run) {
  const std::string& reason = traits.render_model_reason;
  run.Print(fmt::format("render model {} ({})", NameOf(traits.render_model),
                        reason.empty() ? "its files do not say" : reason));
  run.Print(fmt::format("color space  {}", traits.chosen_space
                                               ? traits.chosen_space->name + " (chosen)"
                                               : std::string(NameOf(traits.color_space))));
}

// A scene, compared with its photos.
struct Found {
  SceneCheck check;
  SplatTraits traits;
};

// One view's Gaussians after the other's. `prints`: describes them, too.
Found CheckParts(const Arguments& arguments, LargeScene& large, bool prints, Run& run) {
  run.FinishProgress();
  if (prints) PrintWorkspace(large.workspace(), run);
  if (prints) PrintSplat(large.file(), run);
  Found found;
  std::unique_ptr<EditSession> session;
  const auto show = [&](const View& view) -> OpenScene& {
    const bool is_first = !session;
    session = large.Show(std::vector<const View*>{&view}, std::move(session), run.monitor());
    if (is_first) found.traits = session->scene().original().traits;
    if (is_first && prints) {
      DescribeSession(*session, run.globals().backend, run);
      run.FinishProgress();
      PrintTraits(found.traits, run);
    }
    return session->scene();
  };
  found.check = CheckScene(large.workspace(), show, run.monitor(), CheckOf(arguments));
  return found;
}

Found CheckWhole(const Arguments& arguments, const SceneArguments& scene, bool prints, Run& run) {
  const MemoryLimits limits = arguments.large.Limits(run);
  if (!prints) {
    SessionOptions options = OptionsOf(scene, 0, run);
    options.cache_bytes = limits.Cache(options.cache_bytes);
    const auto opened = OpenScene::Open(scene.workspace, scene.splat, options, run.monitor());
    return {CheckScene(*opened, run.monitor(), CheckOf(arguments)), opened->original().traits};
  }
  const auto session = OpenSession(scene, 0, run, limits);
  const GaussianModel& model = session->scene().original();
  run.FinishProgress();
  PrintWorkspace(session->scene().workspace(), run);
  PrintSplat(scene.splat, model.NumGaussians(), model.sh_degree, HasShBand4(model), run);
  PrintTraits(model.traits, run);
  return {CheckScene(session->scene(), run.monitor(), CheckOf(arguments)), model.traits};
}

Found CheckIt(const Arguments& arguments, const SceneArguments& scene, bool prints, Run& run) {
  const auto large = OpenLarge(scene, arguments.large, 0, /*refit=*/nullptr, run);
  Found found = large ? CheckParts(arguments, *large, prints, run)
                      : CheckWhole(arguments, scene, prints, run);
  run.FinishProgress();
  return found;
}

// If no file says how the splat was trained: the photos show which of the two models fits.
void RecommendRenderModel(const Arguments& arguments, const Found& found, Run& run) {
  constexpr double kClear = 0.1;  // dB
  const double as_default = found.check.median_psnr;
  if (!found.traits.render_model_reason.empty() || !std::isfinite(as_default)) return;
  SceneArguments tried = arguments.scene;
  tried.render_model = NameOf(RenderModel::kMip);
  const double as_mip = CheckIt(arguments, tried, /*prints=*/false, run).check.median_psnr;
  run.Print(fmt::format("compared     {:.2f} dB as default, {:.2f} dB as mip: {}", as_default,
                        as_mip,
                        as_mip > as_default + kClear   ? "--render-model mip fits the photos better"
                        : as_mip < as_default - kClear ? "default fits the photos better"
                                                       : "the photos do not tell them apart"));
}

// Views are placed around a whole splat: of one that is opened in parts and has no workspace, only
// the header is described. Whether it is one.
bool DescribedAlone(const Arguments& arguments, Run& run) {
  const SceneArguments& scene = arguments.scene;
  const MemoryLimits limits = arguments.large.Limits(run);
  const size_t caches = limits.Cache(run.globals().cache_mb << 20);
  const bool in_parts = arguments.large.mode == "on" ||
                        (arguments.large.mode == "auto" && IsTooLarge(scene.splat, limits, caches));
  if (!scene.workspace.empty() || !in_parts) return false;
  run.Print("workspace    none: views are placed only around a splat that is opened whole");
  PrintSplat(PlyFile(scene.splat), run);
  return true;
}

void Info(const Arguments& arguments, Run& run) {
  const SceneArguments& scene = arguments.scene;
  CheckOption(scene.world_from_splat.empty() || !scene.splat.empty(),
              "--world-from-splat needs a splat");
  if (scene.splat.empty()) {
    const Workspace workspace = Workspace::Open(scene.workspace, scene.images, scene.model);
    PrintWorkspace(workspace, run);
    run.Print("splat        none opened: the workspace holds " + SplatsText(scene.workspace));
    for (const std::string& warning : workspace.warnings) run.Warn(warning);
    return;
  }
  if (DescribedAlone(arguments, run)) return;
  const Found found = CheckIt(arguments, scene, /*prints=*/true, run);
  PrintCheck(found.check, run);
  RecommendRenderModel(arguments, found, run);
}

}  // namespace

void AddInfo(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = AddVerb(app, globals, "info",
                           "Describe a workspace and a splat and whether they fit each other");
  AddScene(verb, globals, arguments->scene, /*needs_splat=*/false);
  Everyday(verb, verb->get_option("--splat"));
  Everyday(verb, verb->add_option("--compare", arguments->max_views,
                                  "Views to render and compare with their photos, evenly spread")
                     ->check(CLI::Range(1, 1000000)));
  Everyday(verb, verb->add_flag("--all", arguments->all, "Compare every view"));
  AddLarge(verb, arguments->large, /*selects=*/false);
  AddExamples(verb, {"retint info sample", "retint info sample/splat.ply"});
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { Info(*arguments, run); }; });
}

}  // namespace retint::cli
