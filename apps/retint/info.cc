// SPDX-License-Identifier: BSD-3-Clause
// retint info: what is in a workspace and a splat, and whether the two belong together.
#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "retint/common.h"
#include "splat_io/splat_io.h"

namespace retint::cli {
namespace {

// Below these the renders show something else than the photos: another frame, unit or scene.
constexpr double kMismatchPsnr = 15;       // dB, median over the compared views
constexpr double kMismatchCoverage = 0.5;  // mean alpha, median over the compared views

struct Arguments {
  SceneArguments scene;
  int max_views = 12;
  bool all = false;
};

struct Comparison {
  std::string view;
  double psnr = 0;      // NaN without a photo
  double coverage = 0;  // mean alpha
};

double Median(std::vector<double> values) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  if (values.empty()) return std::nan("");
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double Psnr(const Image& render, const Image& photo) {
  double sum = 0;
  for (size_t i = 0; i < render.data.size(); ++i) {
    const double difference = std::clamp(render.data[i], 0.0F, 1.0F) - photo.data[i];
    sum += difference * difference;
  }
  return -10 * std::log10(std::max(sum / static_cast<double>(render.data.size()), 1e-10));
}

std::vector<const View*> Spread(const std::vector<const View*>& views, int count) {
  if (count >= static_cast<int>(views.size())) return views;
  std::vector<const View*> chosen;
  for (int i = 0; i < count; ++i) {
    chosen.push_back(views[static_cast<size_t>(i) * views.size() / static_cast<size_t>(count)]);
  }
  return chosen;
}

void PrintWorkspace(const Workspace& workspace, Run& run) {
  const Reconstruction& model = workspace.reconstruction;
  std::map<std::string, int> kinds;
  for (const auto& [id, camera] : model.cameras) {
    const CameraModelInfo* info = FindCameraModel(static_cast<int>(camera.model));
    ++kinds[fmt::format("{} {}x{}", info ? info->name : "unknown", camera.width, camera.height)];
  }
  std::string cameras;
  for (const auto& [kind, count] : kinds) {
    cameras += fmt::format("{}{}{}", cameras.empty() ? "" : ", ", kind,
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
  run.Print(fmt::format("workspace    {}", workspace.root.string()));
  run.Print(fmt::format("cameras      {}: {}", model.cameras.size(), cameras));
  run.Print(fmt::format("views        {}, photos of {}", model.views.size(), photos));
  run.Print(fmt::format("points       {}, mean track {:.1f} views, mean error {:.2f} px",
                        model.points.size(), static_cast<double>(observations) / points,
                        error / points));
}

std::vector<Comparison> Compare(EditSession& session, const std::vector<const View*>& views,
                                Run& run) {
  std::vector<Comparison> all;
  for (size_t i = 0; i < views.size(); ++i) {
    const View& view = *views[i];
    run.monitor().Step("compare", static_cast<double>(i), static_cast<double>(views.size()));
    RenderRequest request;
    request.alpha = true;
    request.cache = false;
    const RenderOutput output =
        session.renderer().Render(session.reconstruction().Posed(view), request);
    Comparison one{view.name, std::nan(""), 0};
    for (const float alpha : output.alpha.data) one.coverage += alpha;
    one.coverage /= static_cast<double>(std::max<size_t>(1, output.alpha.data.size()));
    if (session.workspace().HasPhoto(view)) {
      one.psnr = Psnr(output.rgb, session.workspace().ReadPhoto(view));
    }
    all.push_back(one);
  }
  run.monitor().Step("compare", 1, 1);
  return all;
}

void PrintComparison(const std::vector<Comparison>& all, size_t views, Run& run) {
  std::vector<double> psnr, coverage;
  const Comparison* worst = nullptr;
  for (const Comparison& one : all) {
    psnr.push_back(one.psnr);
    coverage.push_back(one.coverage);
    if (std::isfinite(one.psnr) && (!worst || one.psnr < worst->psnr)) worst = &one;
  }
  const double median_psnr = Median(psnr), median_coverage = Median(coverage);
  if (worst) {
    run.Print(
        fmt::format("PSNR         {:.1f} dB median of {} of {} views against their photos, "
                    "worst {:.1f} dB ({})",
                    median_psnr, all.size(), views, worst->psnr, worst->view));
  } else {
    run.Print("PSNR         no photos to compare with");
  }
  run.Print(
      fmt::format("coverage     {:.1f} % of the pixels' opacity, median", 100 * median_coverage));
  if (median_coverage < kMismatchCoverage) {
    run.Warn(
        fmt::format("the splat covers only {:.0f} % of the views: it seems to be in another "
                    "frame than the workspace",
                    100 * median_coverage));
  } else if (worst && median_psnr < kMismatchPsnr) {
    run.Warn(
        fmt::format("renders and photos disagree ({:.1f} dB): the splat seems to be in another "
                    "frame than the workspace, or of another scene",
                    median_psnr));
  }
}

void Info(const Arguments& arguments, Run& run) {
  const Workspace workspace = Workspace::Open(arguments.scene.workspace, arguments.scene.images);
  PrintWorkspace(workspace, run);
  if (arguments.scene.splat.empty()) {
    for (const std::string& warning : workspace.warnings) run.Warn(warning);
    return;
  }
  const auto session = OpenSession(arguments.scene, 0, run);
  const GaussianModel& model = session->original();
  run.FinishProgress();
  run.Print(fmt::format("splat        {}", arguments.scene.splat.string()));
  run.Print(fmt::format("Gaussians    {}, SH degree {}", model.NumGaussians(), model.sh_degree));
  const auto views = session->reconstruction().ViewsByName();
  const auto chosen =
      Spread(views, arguments.all ? static_cast<int>(views.size()) : arguments.max_views);
  const auto comparison = Compare(*session, chosen, run);
  run.FinishProgress();
  PrintComparison(comparison, views.size(), run);
}

}  // namespace

void AddInfo(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = AddVerb(app, globals, "info",
                           "Describe a workspace and a splat and whether they fit each other");
  AddScene(verb, arguments->scene, /*splat_required=*/false);
  verb->add_option("--max-views", arguments->max_views,
                   "Views to render and compare with their photos, evenly spread")
      ->check(CLI::Range(1, 1000000));
  verb->add_flag("--all", arguments->all, "Compare every view");
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { Info(*arguments, run); }; });
}

}  // namespace retint::cli
