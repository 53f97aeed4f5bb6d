// SPDX-License-Identifier: BSD-3-Clause
// retint_bench_refit: mm against adam, and the cost of a sweep against the masked area, on the real
// captures. One JSON line a case.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <sys/resource.h>

#include <CLI/CLI.hpp>

#include "base/error.h"
#include "colmap_io/image_io.h"
#include "colmap_io/workspace.h"
#include "recolor/quality_report.h"
#include "recolor/sh_refitter.h"
#include "splat_io/splat_io.h"
#include "tests/benchmarks/main.h"
#include "tests/support/blend.h"
#include "tests/support/closed_form.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

double Now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// CPU seconds of this process over both cores: comparable even on a busy machine.
double CpuNow() { return double(std::clock()) / CLOCKS_PER_SEC; }

struct Flags {
  std::string data, output, fox_masks, backend = "cpu", tint = "#3060ff";
  std::vector<std::string> scenes = {"fox", "flower"};
  std::vector<std::string> solvers = {"mm"};
  std::vector<double> learning_rates = {2.5e-4};
  int sweeps = MmOptions().iterations, steps = AdamOptions().iterations, holdout = 8;
  double ridge_dc = MmOptions().ridge_dc, ridge_rest = MmOptions().ridge_rest;
  double tolerance = MmOptions().tolerance;
  double active_threshold = RefitOptions().active_threshold;
  double region_mb = RefitOptions().region_cache_mb;
  size_t cache_mb = RendererOptions().cache_bytes >> 20;
  double min_weight = MmOptions().min_weight;
  double outside_weight = MmOptions().outside_weight;
  double scale = 1, ball = 0;
  bool cold_start = false, no_quality = false, area = false;
};

struct Scene {
  std::string name;
  Workspace workspace;
  GaussianModel model;
  std::map<std::string, Mask> masks;
  std::vector<float> shares;
  std::vector<RefitTarget> train, heldout;
  double coverage = 0;  // mean masked fraction of the training views
};

Mask Threshold(const std::vector<float>& soft, int width, int height, float threshold) {
  Mask mask(width, height);
  for (size_t p = 0; p < soft.size(); ++p) mask.data[p] = soft[p] > threshold ? 255 : 0;
  return mask;
}

// The masks of all views from per-Gaussian shares: W m above 0.3.
void MasksFromShares(Scene& scene, Renderer& renderer, const std::vector<float>& shares) {
  scene.masks.clear();
  for (const View* view : scene.workspace.reconstruction.ViewsByName()) {
    const PosedCamera camera = scene.workspace.reconstruction.Posed(*view);
    scene.masks[view->name] = Threshold(BlendFeatures(renderer, camera, shares),
                                        camera.camera.width, camera.camera.height, 0.3f);
  }
}

void SplitTargets(Scene& scene, int holdout) {
  scene.train.clear();
  scene.heldout.clear();
  int index = 0;
  double covered = 0;
  for (const View* view : scene.workspace.reconstruction.ViewsByName()) {
    const auto mask = scene.masks.find(view->name);
    if (mask == scene.masks.end()) continue;
    const RefitTarget target{view->name, scene.workspace.reconstruction.Posed(*view), &mask->second,
                             nullptr};
    const bool held = holdout > 0 && index++ % holdout == 0;
    (held ? scene.heldout : scene.train).push_back(target);
    if (held) continue;
    double sum = 0;
    for (const uint8_t value : mask->second.data) sum += value;
    covered += sum / 255 / double(mask->second.data.size());
  }
  scene.coverage = covered / double(std::max<size_t>(scene.train.size(), 1));
}

// Smaller cameras and masks: the same solver behaviour in a fraction of the time.
void Shrink(Scene& scene, double scale) {
  if (scale == 1) return;
  for (auto& [id, camera] : scene.workspace.reconstruction.cameras) {
    for (double& param : camera.params) param *= scale;
    camera.width = int(std::lround(camera.width * scale));
    camera.height = int(std::lround(camera.height * scale));
  }
}

Mask Resized(const Mask& mask, double scale) {
  if (scale == 1) return mask;
  Mask small(int(std::lround(mask.width * scale)), int(std::lround(mask.height * scale)));
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      small(x, y) = mask(std::min(int((x + 0.5) / scale), mask.width - 1),
                         std::min(int((y + 0.5) / scale), mask.height - 1));
    }
  }
  return small;
}

// A selection for scenes without masks: 1 for Gaussians in a ball around the middle of the first
// view. Its radius is `radius` of the depth there.
std::vector<float> BallShares(const GaussianModel& model, const PosedCamera& view, double radius) {
  const auto mean = [&](size_t g) {
    return Eigen::Vector3d(Eigen::Map<const Eigen::Vector3f>(&model.means[3 * g]).cast<double>());
  };
  std::vector<double> depths;
  for (size_t g = 0; g < model.NumGaussians(); ++g) {
    const auto pixel = view.Project(mean(g));
    if (!pixel || model.opacity_logits[g] < 0) continue;
    if (std::abs((*pixel)[0] / view.camera.width - 0.5) > 0.05) continue;
    if (std::abs((*pixel)[1] / view.camera.height - 0.5) > 0.05) continue;
    depths.push_back((*pixel)[2]);
  }
  std::nth_element(depths.begin(), depths.begin() + int64_t(depths.size() / 3), depths.end());
  const double depth = depths[depths.size() / 3];
  const Eigen::Vector3d middle =
      view.Unproject({0.5 * view.camera.width, 0.5 * view.camera.height}, depth);
  std::vector<float> shares(model.NumGaussians());
  for (size_t g = 0; g < shares.size(); ++g) {
    shares[g] = (mean(g) - middle).norm() < radius * depth ? 1.0f : 0.0f;
  }
  return shares;
}

Scene LoadScene(const std::string& name, const Flags& flags) {
  Scene scene;
  scene.name = name;
  const fs::path root = fs::path(flags.data) / name;
  scene.workspace = Workspace::Open(root);
  scene.model = ReadSplat(root / "splat.ply");
  Shrink(scene, flags.scale);
  Renderer renderer(CreateBackend(flags.backend), scene.model, {flags.cache_mb << 20, {}});
  Monitor monitor;
  if (flags.ball > 0) {
    const View& view = *scene.workspace.reconstruction.ViewsByName()[0];
    MasksFromShares(
        scene, renderer,
        BallShares(scene.model, scene.workspace.reconstruction.Posed(view), flags.ball));
  } else if (name != "fox" || !flags.fox_masks.empty()) {
    const fs::path folder = name == "fox" ? fs::path(flags.fox_masks) : root / "truth";
    for (const View* view : scene.workspace.reconstruction.ViewsByName()) {
      scene.masks[view->name] = Resized(ReadMask(ViewFile(folder, view->name)), flags.scale);
    }
  } else {  // lift the one brush mask to the Gaussians and render it everywhere
    const View& view = scene.workspace.RequireView("0025.jpg");
    const Mask brush = Resized(ReadMask(ViewFile(root / "masks", view.name)), flags.scale);
    const auto shares = MaskShares(
        renderer, {{view.name, scene.workspace.reconstruction.Posed(view), &brush, nullptr}},
        monitor);
    MasksFromShares(scene, renderer, shares);
  }
  SplitTargets(scene, flags.holdout);
  const double start = Now(), cpu_start = CpuNow();
  scene.shares = MaskShares(renderer, scene.train, monitor);
  const auto above = [&](float threshold) {
    return static_cast<long long>(std::count_if(scene.shares.begin(), scene.shares.end(),
                                                [=](float share) { return share > threshold; }));
  };
  std::printf(
      "{\"scene\":\"%s\",\"case\":\"shares\",\"above_1e-3_1e-2_1e-1\":[%lld,%lld,%lld],\"views\":%"
      "zu,\"coverage\":%.4f,\"s\":%.4f,\"cpu_s\":%"
      ".2f}\n",
      name.c_str(), above(1e-3f), above(1e-2f), above(0.1f), scene.train.size(), scene.coverage,
      Now() - start, CpuNow() - cpu_start);
  std::fflush(stdout);
  return scene;
}

void WritePictures(Scene& scene, Renderer& renderer, std::span<const float> sh,
                   const std::string& label, const Flags& flags) {
  if (flags.output.empty()) return;
  for (const size_t v : {size_t{0}, scene.train.size() / 2, scene.train.size() - 1}) {
    const RefitTarget& target = scene.train[v];
    const auto path = [&](const std::string& what) {
      return fs::path(flags.output) / scene.name / (target.name + "." + what + ".png");
    };
    renderer.SetSh(scene.model.sh);
    WritePng(path("before"), renderer.Render(target.camera).rgb);
    WritePng(path("mask"), *target.mask);
    renderer.SetSh(sh);
    WritePng(path(label), renderer.Render(target.camera).rgb);
  }
}

void Fit(Scene& scene, const std::string& solver, double learning_rate, const Flags& flags,
         const std::string& label) {
  Renderer renderer(CreateBackend(flags.backend), scene.model, {flags.cache_mb << 20, {}});
  Monitor monitor;
  const ColorEdit edit = ParseTint(flags.tint);
  RefitOptions options;
  options.solver = solver == "adam" ? Solver::kAdam : Solver::kMm;
  options.mm.iterations = flags.sweeps;
  options.adam.iterations = flags.steps;
  options.adam.learning_rate = learning_rate;
  options.mm.ridge_dc = flags.ridge_dc;
  options.mm.ridge_rest = flags.ridge_rest;
  options.mm.tolerance = flags.tolerance;
  options.active_threshold = flags.active_threshold;
  options.region_cache_mb = flags.region_mb;
  options.mm.min_weight = flags.min_weight;
  options.mm.outside_weight = flags.outside_weight;
  options.adam.closed_form_start = !flags.cold_start;
  const double start = Now(), cpu_start = CpuNow();
  ShRefitter refitter(renderer, scene.model, scene.train, edit, scene.shares, options, monitor);
  const double ready = Now(), cpu_ready = CpuNow();
  const RefitSummary summary = refitter.Run(monitor);
  const double done = Now(), cpu_done = CpuNow();
  const auto sh = solver == "closed-form"
                      ? ClosedFormSh(renderer.backend(), scene.model.sh, scene.model.NumShCoeffs(),
                                     scene.shares, edit)
                      : refitter.Sh();
  std::printf(
      "{\"scene\":\"%s\",\"case\":\"%s\",\"solver\":\"%s\",\"lr\":%g,\"cold\":%d,\"iterations\":%d,"
      "\"converged\":%d,\"coverage\":%.4f,\"active\":%lld,\"views\":%d,\"views_kept\":%d,\"region_"
      "mb\":%.0f,\"region_fraction\":%.3f,\"setup_s\":%.4f,\"run_s\":%.4f,"
      "\"total_s\":%.4f,\"ms_per_iteration\":%.3f,\"setup_cpu_s\":%.2f,\"run_cpu_s\":%.2f,\"loss\":"
      "[",
      scene.name.c_str(), label.c_str(), solver.c_str(), learning_rate, flags.cold_start,
      summary.iterations, summary.converged, scene.coverage,
      static_cast<long long>(summary.active_gaussians), summary.views, summary.views_kept,
      double(summary.region_bytes) / 1e6, summary.region_fraction, ready - start, done - ready,
      done - start, 1000 * (done - ready) / std::max(summary.iterations, 1), cpu_ready - cpu_start,
      cpu_done - cpu_ready);
  for (size_t i = 0; i < summary.losses.size() && i < 40; ++i) {
    std::printf("%s%.4g", i ? "," : "", summary.losses[i]);
  }
  std::printf("]");
  if (!flags.no_quality) {
    const auto report =
        EvaluateEdit(renderer, scene.model.sh, sh, scene.train, scene.heldout, edit, monitor);
    std::printf(
        ",\"evaluate_s\":%.2f,\"inside_before\":%.2f,\"inside\":%.3f,\"outside\":%.3f,"
        "\"bleed\":%.2e,\"heldout_inside\":%.3f,\"heldout_outside\":%.3f,\"sh\":[%.2f,%.2f,%.2f,"
        "%.2f]",
        Now() - done, report.train.psnr_inside_before, report.train.psnr_inside_after,
        report.train.psnr_outside, report.train.bleed, report.heldout.psnr_inside_after,
        report.heldout.psnr_outside, double(report.sh_before.min), double(report.sh_before.max),
        double(report.sh_after.min), double(report.sh_after.max));
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  std::printf(",\"peak_rss_mb\":%ld,\"peak_device_mb\":%.0f}\n", usage.ru_maxrss / 1024,
              double(renderer.backend().PeakDeviceBytes()) / 1e6);
  std::fflush(stdout);
  WritePictures(scene, renderer, sh, label, flags);
}

// Masks given, to the first recolored frame: shares, closed form, upload, render; with the views'
// geometry still to be prepared, and with it in the cache as after a selection.
void Preview(Scene& scene, const Flags& flags) {
  Renderer renderer(CreateBackend(flags.backend), scene.model, {flags.cache_mb << 20, {}});
  Monitor monitor;
  const ColorEdit edit = ParseTint(flags.tint);
  renderer.Render(scene.train[0].camera);  // wakes the device
  std::vector<double> ms;
  for (int round = 0; round < 4; ++round) {
    renderer.SetSh(scene.model.sh);
    renderer.backend().Synchronize();
    const double start = Now();
    const auto shares = MaskShares(renderer, scene.train, monitor);
    const double shared = Now();
    renderer.SetSh(
        ClosedFormSh(renderer.backend(), scene.model.sh, scene.model.NumShCoeffs(), shares, edit));
    renderer.Render(scene.train[0].camera);
    ms.insert(ms.end(), {1000 * (Now() - start), 1000 * (shared - start)});
  }
  std::printf(
      "{\"scene\":\"%s\",\"case\":\"preview\",\"views\":%zu,\"cold_ms\":%.2f,\"warm_ms\":%.2f,"
      "\"warm_shares_ms\":%.2f}\n",
      scene.name.c_str(), scene.train.size(), ms[0], std::min(ms[4], ms[6]),
      std::min(ms[5], ms[7]));
  std::fflush(stdout);
}

// A selection of a tenth of the area: the Gaussians of the selection nearest to its middle.
void ShrinkToTenth(Scene& scene, const Flags& flags) {
  Renderer renderer(CreateBackend(flags.backend), scene.model, {flags.cache_mb << 20, {}});
  const double wanted = scene.coverage / 10;
  const auto full = scene.shares;
  std::vector<std::pair<float, size_t>> by_distance;
  Eigen::Vector3f middle = Eigen::Vector3f::Zero();
  double weight = 0;
  const auto mean = [&](size_t g) {
    return Eigen::Map<const Eigen::Vector3f>(&scene.model.means[3 * g]);
  };
  for (size_t g = 0; g < full.size(); ++g) {
    if (full[g] < 0.5f) continue;
    middle += mean(g);
    weight += 1;
  }
  middle /= float(weight);
  for (size_t g = 0; g < full.size(); ++g) {
    if (full[g] >= 0.5f) by_distance.emplace_back((mean(g) - middle).norm(), g);
  }
  std::sort(by_distance.begin(), by_distance.end());
  double low = 0, high = 1;
  for (int round = 0; round < 7; ++round) {
    const double fraction = (low + high) / 2;
    std::vector<float> shares(full.size(), 0.0f);
    const size_t kept = size_t(fraction * double(by_distance.size()));
    for (size_t i = 0; i < kept; ++i) shares[by_distance[i].second] = 1;
    MasksFromShares(scene, renderer, shares);
    SplitTargets(scene, flags.holdout);
    (scene.coverage > wanted ? high : low) = fraction;
    if (std::abs(scene.coverage / wanted - 1) < 0.05) break;
  }
  Monitor monitor;
  scene.shares = MaskShares(renderer, scene.train, monitor);
}

int Main(int argc, char** argv) {
  Flags flags;
  const char* data = std::getenv("RETINT_DATA");
  flags.data = data ? data : RETINT_SOURCE_DIR "/../shared/data";
  CLI::App app("mm against adam on real captures; one JSON line a case");
  app.add_option("--data", flags.data, "folder with fox/ and flower/");
  app.add_option("--fox-masks", flags.fox_masks, "folder of `retint project`; else lifted here");
  app.add_option("--backend", flags.backend, "auto, cpu or cuda");
  app.add_option("--output", flags.output, "folder for before and after pictures");
  app.add_option("--tint", flags.tint);
  app.add_option("--scenes", flags.scenes)->delimiter(',');
  app.add_option("--solvers", flags.solvers, "mm, adam, closed-form")->delimiter(',');
  app.add_option("--lr", flags.learning_rates, "learning rates of adam")->delimiter(',');
  app.add_option("--sweeps", flags.sweeps, "of mm at most; 0: until it has converged");
  app.add_option("--steps", flags.steps, "of adam");
  app.add_option("--holdout", flags.holdout);
  app.add_option("--ridge-dc", flags.ridge_dc);
  app.add_option("--ridge-rest", flags.ridge_rest);
  app.add_option("--tolerance", flags.tolerance);
  app.add_option("--active-threshold", flags.active_threshold);
  app.add_option("--region-mb", flags.region_mb);
  app.add_option("--cache-mb", flags.cache_mb, "of view geometry");
  app.add_option("--min-weight", flags.min_weight);
  app.add_option("--outside-weight", flags.outside_weight);
  app.add_option("--scale", flags.scale, "of the cameras");
  app.add_option("--ball", flags.ball,
                 "select a ball, of this share of its depth, instead of masks");
  app.add_flag("--cold-start", flags.cold_start, "adam starts from the original coefficients");
  app.add_flag("--no-quality", flags.no_quality);
  app.add_flag("--area", flags.area, "also fit a selection of a tenth of the area");
  CLI11_PARSE(app, argc, argv);
  for (const std::string& name : flags.scenes) {
    Scene scene = LoadScene(name, flags);
    Preview(scene, flags);
    for (const std::string& solver : flags.solvers) {
      if (solver == "adam") {
        for (const double rate : flags.learning_rates) {
          char label[32];
          std::snprintf(label, sizeof(label), "adam-%g", rate);
          Fit(scene, solver, rate, flags, label);
        }
      } else {
        Fit(scene, solver, 0.1, flags, solver);
      }
    }
    if (!flags.area) continue;
    ShrinkToTenth(scene, flags);
    for (const std::string& solver : flags.solvers) {
      if (solver != "adam") Fit(scene, solver, 0.1, flags, solver + "-tenth");
    }
  }
  return 0;
}

}  // namespace
}  // namespace retint

int main(int argc, char** argv) {
  return retint::RunProgram("retint_bench_refit", retint::Main, argc, argv);
}
