// SPDX-License-Identifier: BSD-3-Clause
// retint_bench_device: renders, refit iterations and stereo depth on views of real scenes, for
// comparison with other rasterizers on the same views. One JSON line a case: `ms` an iteration when
// many are queued, `synced_ms` when each is waited for.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "base/error.h"
#include "colmap_io/workspace.h"
#include "depth/stereo_hv.h"
#include "kernels/backend.h"
#include "render/renderer.h"
#include "splat_io/splat_io.h"
#include "tests/benchmarks/main.h"

namespace retint {
namespace {

double Now() {
  return std::chrono::duration<double, std::milli>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

double Quantile(std::vector<double> values, double share) {
  const auto at = int64_t(double(values.size()) * share);
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[size_t(at)];
}

class Bench {
 public:
  Bench(std::shared_ptr<Backend> backend, std::string name, const GaussianModel& host,
        const CameraParams& camera)
      : backend_(std::move(backend)), name_(std::move(name)), host_(host), camera_(camera) {
    model_ = backend_->blend().UploadModel(
        {host.means.data(), host.quats_wxyz.data(), host.log_scales.data(),
         host.opacity_logits.data(), host.sh.data(), int64_t(host.NumGaussians()), host.sh_degree});
    view_ = backend_->blend().PrepareView(*model_, camera);
    const size_t values = size_t(camera.width) * size_t(camera.height) * 3;
    image_ = backend_->Allocate<float>(values);
    other_ = backend_->Allocate<float>(values);
    gradient_ = backend_->Allocate<float>(values);
    colors_ = backend_->Allocate<float>(host.NumGaussians() * 3);
    sums_ = backend_->Allocate<float>(host.NumGaussians() * 3);
    Forward(*view_);
    backend_->CopyToDevice(other_.data(), backend_->Download(image_.data(), values).data(),
                           values * sizeof(float));
  }

  // The render alone. Its picture goes to `file`, as floats of 32 bits, to be compared.
  void Renders(const std::filesystem::path& file) {
    Report("forward_cold", [&] { Forward(*backend_->blend().PrepareView(*model_, camera_)); });
    Report("forward", [&] { Forward(*view_); });
    const auto pixels = backend_->Download(image_.data(), image_.size());
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(pixels.data()),
               std::streamsize(pixels.size() * sizeof(float)));
  }

  void WholeView() {
    Report("prepare", [&] { backend_->blend().PrepareView(*model_, camera_); });
    Report("forward_cold", [&] { Forward(*backend_->blend().PrepareView(*model_, camera_)); });
    Report("forward", [&] { Forward(*view_); });
    Report("eval_sh", [&] { EvalSh(*view_); });
    Report("blend", [&] { Blend(*view_, colors_, image_); });
    Report("transpose", [&] { Transpose(*view_, other_); });
    Report("depth", [&] {
      backend_->blend().Depth(*view_, {image_.data(), gradient_.data(), nullptr, 0.5f});
    });
    Report("loss", [&] { Loss({}); });
    Report("shares", [&] {
      if (mask_.empty()) MakeMask();
      backend_->blend().AccumulateShares(*view_, mask_.data(), share_sums_.data());
    });
  }

  // Iterations on the Gaussians that project into the middle `share` of the image.
  void Region(double share, const std::string& label) {
    const auto flags = ActiveFlags(share);
    MakeMask();
    Report("restrict" + label, [&] { Restrict(flags); });
    region_ = Restrict(flags);
    const size_t active = size_t(region_->num_rows());
    const size_t k3 = size_t(model_->num_sh_coeffs()) * 3;
    // Compact coefficients of the active Gaussians, as the refit keeps them.
    const auto rows = backend_->Download(region_->rows(), active);
    std::vector<float> compact;
    std::vector<int32_t> slots;
    for (const int32_t g : rows) {
      slots.push_back(int32_t(slots.size()));
      const auto from = host_.sh.begin() + int64_t(size_t(g) * k3);
      compact.insert(compact.end(), from, from + int64_t(k3));
    }
    slots_ = backend_->Upload(std::span<const int32_t>(slots));
    sh_ = backend_->Upload(std::span<const float>(compact));
    for (auto* buffer : {&sh_gradient_, &m_, &v_})
      *buffer = backend_->Allocate<float>(compact.size());
    base_colors_ = backend_->Allocate<float>(active * 3);
    change_ = backend_->Allocate<float>(active * 3);
    EvalActive(base_colors_);
    const size_t positions = NumRegionPixels(*region_);
    target_ = backend_->Allocate<int16_t>(positions * 3);
    weights_ = backend_->Allocate<uint8_t>(positions);
    loss_ = backend_->Allocate<double>(1);
    MakeTarget();
    char extra[160];
    std::snprintf(
        extra, sizeof(extra),
        ", \"active\": %zu, \"tiles\": %zu, \"pixel_fraction\": %.4f, \"region_mb\": %.2f", active,
        region_->tiles().size(), double(positions) / (double(camera_.width) * camera_.height),
        double(region_->bytes()) / 1e6);
    Report(
        "region_blend" + label, [&] { Blend(*region_, change_, image_); }, extra);
    Report(
        "region_transpose" + label, [&] { Transpose(*region_, other_); }, extra);
    Report(
        "mm_iteration" + label, [&] { MmIteration(); }, extra);
    Report(
        "adam_iteration" + label, [&] { AdamIteration(); }, extra);
  }

  void Memory() {
    std::printf(
        "{\"benchmark\": \"device\", \"scene\": \"%s\", \"backend\": \"%s\", \"case\": \"memory\", "
        "\"peak_device_mb\": %.1f, \"view_mb\": %.2f}\n",
        name_.c_str(), backend_->Description().c_str(), double(backend_->PeakDeviceBytes()) / 1e6,
        double(view_->bytes()) / 1e6);
    std::fflush(stdout);
  }

 private:
  void Report(const std::string& label, const std::function<void()>& body,
              const std::string& extra = "") {
    for (int i = 0; i < 5; ++i) body();
    backend_->Synchronize();
    std::vector<double> single, batches;
    for (int i = 0; i < 60; ++i) {
      const double start = Now();
      body();
      backend_->Synchronize();
      single.push_back(Now() - start);
      if (i > 4 && single.back() > 100) break;  // a slow backend
    }
    const int count = std::clamp(int(20 / Quantile(single, 0.5)), 1, 200);
    for (int batch = 0; batch < 7; ++batch) {
      const double start = Now();
      for (int i = 0; i < count; ++i) body();
      backend_->Synchronize();
      batches.push_back((Now() - start) / count);
    }
    std::printf(
        "{\"benchmark\": \"device\", \"scene\": \"%s\", \"backend\": \"%s\", \"gaussians\": %zu, "
        "\"width\": %d, \"height\": %d, \"case\": \"%s\", \"ms\": %.4f, \"synced_ms\": %.4f, "
        "\"synced_quartiles_ms\": [%.4f, %.4f]%s}\n",
        name_.c_str(), backend_->Description().c_str(), host_.NumGaussians(), camera_.width,
        camera_.height, label.c_str(), Quantile(batches, 0.5), Quantile(single, 0.5),
        Quantile(single, 0.25), Quantile(single, 0.75), extra.c_str());
    std::fflush(stdout);
  }

  template <typename Params>
  Params WithCenter(Params params) const {
    std::copy_n(camera_.center, 3, params.center);
    return params;
  }
  void EvalSh(const ViewGeometry& view) {
    backend_->sh().EvalSh(
        *model_, WithCenter(EvalShParams{
                     view.rows(), nullptr, view.num_rows(), model_->sh(), {}, colors_.data()}));
  }
  void EvalActive(const Buffer<float>& colors) {
    backend_->sh().EvalSh(
        *model_,
        WithCenter(EvalShParams{
            region_->rows(), slots_.data(), region_->num_rows(), sh_.data(), {}, colors.data()}));
  }
  void Blend(const ViewGeometry& view, const Buffer<float>& features, const Buffer<float>& image) {
    backend_->blend().Blend(view, {features.data(), 3, nullptr, image.data(), nullptr, true});
  }
  void Transpose(const ViewGeometry& view, const Buffer<float>& residual) {
    backend_->blend().BlendTranspose(view, {residual.data(), 3, sums_.data(), kAllPixelRows});
  }
  void Forward(const ViewGeometry& view) {
    EvalSh(view);
    backend_->blend().Blend(view, {colors_.data(), 3, nullptr, image_.data(), nullptr, false});
  }
  void Loss(std::array<int32_t, 4> roi) {
    ImageLossParams params{image_.data(),   other_.data(), camera_.width, camera_.height, 0.2f, {},
                           gradient_.data()};
    std::copy(roi.begin(), roi.end(), params.roi);
    if (loss_.empty()) loss_ = backend_->Allocate<double>(1);
    params.loss = loss_.data();
    backend_->refit().ImageLoss(params);
  }

  Buffer<uint8_t> ActiveFlags(double share) {
    const double half = std::sqrt(share) / 2;
    std::vector<uint8_t> active(host_.NumGaussians(), 0);
    for (size_t g = 0; g < active.size(); ++g) {
      double at[3];
      for (size_t i = 0; i < 3; ++i) {
        at[i] = double(camera_.translation[i]);
        for (size_t j = 0; j < 3; ++j) {
          at[i] += double(camera_.rotation[3 * i + j]) * double(host_.means[3 * g + j]);
        }
      }
      const double x = (camera_.fx * at[0] / at[2] + camera_.cx) / camera_.width;
      const double y = (camera_.fy * at[1] / at[2] + camera_.cy) / camera_.height;
      active[g] = at[2] > 0.2 && std::fabs(x - 0.5) < half && std::fabs(y - 0.5) < half;
    }
    return backend_->Upload(std::span<const uint8_t>(active));
  }
  std::shared_ptr<const ViewGeometry> Restrict(const Buffer<uint8_t>& flags) {
    return backend_->blend().Restrict(*view_, flags.data(), size_t{1} << 32, 1e-3f);
  }
  void MakeMask() {
    const std::vector<uint8_t> mask(size_t(camera_.width) * size_t(camera_.height), 200);
    mask_ = backend_->Upload(std::span<const uint8_t>(mask));
    share_sums_ = backend_->Allocate<double>(2 * host_.NumGaussians());
  }
  void MakeTarget() {
    RegionTargetParams params{};
    params.render = other_.data();
    params.mask = mask_.data();
    params.map = {{-0.5f, 0, 0, 0, -0.2f, 0, 0, 0, 0.3f}, {}};
    params.unit = 1.0f / 8192;
    params.target = target_.data();
    params.weights = weights_.data();
    params.outside_weight = 0.8f;
    backend_->refit().RegionTarget(*region_, params);
    const int tiles_x = region_->tiles_x();
    roi_ = {camera_.width, camera_.height, 0, 0};
    for (const int32_t tile : region_->tiles()) {
      const int x = tile % tiles_x * kTileSize, y = tile / tiles_x * kTileSize;
      roi_ = {std::min(roi_[0], x), std::min(roi_[1], y),
              std::max(roi_[2], std::min(x + kTileSize, camera_.width)),
              std::max(roi_[3], std::min(y + kTileSize, camera_.height))};
    }
  }
  // The cost of every view in a sweep of mm.
  void MmIteration() {
    EvalActive(colors_);
    backend_->solve().LinearCombination(
        {colors_.data(), base_colors_.data(), 1, -1, change_.data(), region_->num_rows() * 3});
    Blend(*region_, change_, image_);
    backend_->refit().RegionResidual(*region_, {target_.data(), 1.0f / 8192, image_.data(),
                                                image_.data(), loss_.data(), weights_.data()});
    Transpose(*region_, image_);
    Gradient();
  }
  // The paper's step on the region: L1 + D-SSIM, its transpose and Adam on the active coefficients.
  void AdamIteration() {
    EvalActive(colors_);
    backend_->solve().LinearCombination(
        {colors_.data(), base_colors_.data(), 1, -1, change_.data(), region_->num_rows() * 3});
    Blend(*region_, change_, image_);
    Loss(roi_);
    Transpose(*region_, gradient_);
    backend_->Fill(sh_gradient_.data(), 0, sh_gradient_.size() * sizeof(float));
    Gradient();
    backend_->solve().Adam({sh_.data(), sh_gradient_.data(), m_.data(), v_.data(),
                            int64_t(sh_gradient_.size()), ++steps_, 0.0f, 0.9f, 0.999f, 1e-15f});
  }
  void Gradient() {
    backend_->sh().EvalShTranspose(*model_, WithCenter(EvalShTransposeParams{region_->rows(),
                                                                             slots_.data(),
                                                                             region_->num_rows(),
                                                                             sums_.data(),
                                                                             colors_.data(),
                                                                             {},
                                                                             sh_gradient_.data()}));
  }

  std::shared_ptr<Backend> backend_;
  std::string name_;
  const GaussianModel& host_;
  CameraParams camera_;
  std::unique_ptr<Model> model_;
  std::shared_ptr<const ViewGeometry> view_, region_;
  Buffer<float> image_, other_, gradient_, colors_, sums_;
  Buffer<int32_t> slots_;
  Buffer<float> sh_, sh_gradient_, m_, v_, base_colors_, change_;
  Buffer<int16_t> target_;
  Buffer<uint8_t> weights_, mask_;
  Buffer<double> loss_, share_sums_;
  std::array<int32_t, 4> roi_{};
  int64_t steps_ = 0;
};

// Stereo-HV of a view, renders included, from its geometry in the cache to a depth map in host
// memory. A second size: the same field of view at 1280x852.
void BenchStereo(std::shared_ptr<Backend> backend, const std::string& name,
                 const GaussianModel& model, const PosedCamera& view) {
  Renderer renderer(std::move(backend), model);
  PosedCamera large = view;
  const double scale = 1280.0 / view.camera.width;
  large.camera =
      Camera::Pinhole(view.camera.id, 1280, 852, view.camera.fx() * scale, view.camera.fy() * scale,
                      view.camera.cx() * scale, 852 * view.camera.cy() / view.camera.height);
  for (const PosedCamera& camera : {view, large}) {
    StereoHvEstimator stereo(renderer);
    Monitor monitor;
    std::vector<double> times;
    DepthEstimate estimate;
    for (int i = 0; i < 33; ++i) {
      const double start = Now();
      estimate = stereo.Estimate(camera, monitor);
      if (i > 2) times.push_back(Now() - start);
      if (times.size() > 2 && times.back() > 100) break;  // a slow backend
    }
    std::printf(
        "{\"benchmark\": \"device\", \"scene\": \"%s\", \"backend\": \"%s\", \"gaussians\": %zu, "
        "\"width\": %d, \"height\": %d, \"case\": \"stereo_hv\", \"ms\": %.4f, \"least_ms\": %.4f, "
        "\"valid\": %.4f, \"peak_device_mb\": %.1f}\n",
        name.c_str(), renderer.backend().Description().c_str(), model.NumGaussians(),
        camera.camera.width, camera.camera.height, Quantile(times, 0.5),
        *std::min_element(times.begin(), times.end()), estimate.valid_fraction,
        double(renderer.backend().PeakDeviceBytes()) / 1e6);
    std::fflush(stdout);
  }
}

int Main(int argc, char** argv) {
  std::string backend_name = "auto";
  std::vector<std::string> scenes;
  CLI::App app("renders and refit iterations on real scenes; one JSON line a case");
  app.add_option("--backend", backend_name, "auto, cpu or cuda");
  bool stereo_only = false;
  app.add_flag("--stereo", stereo_only, "only Stereo-HV depth, case stereo_hv");
  std::filesystem::path pictures;
  app.add_option("--renders", pictures,
                 "only renders; writes each picture to this folder, as .f32");
  app.add_option("scenes", scenes, "WORKSPACE:VIEW, with splat.ply in the workspace")->required();
  CLI11_PARSE(app, argc, argv);
  CheckOption(pictures.empty() || std::filesystem::is_directory(pictures),
              "--renders names a folder that is not there");
  for (const std::string& argument : scenes) {
    const size_t colon = argument.rfind(':');
    CheckOption(colon != std::string::npos, "a scene is WORKSPACE:VIEW");
    const std::filesystem::path root = argument.substr(0, colon);
    const Workspace workspace = Workspace::Open(root);
    const View& view = workspace.RequireView(argument.substr(colon + 1));
    const GaussianModel model = ReadSplat(root / "splat.ply");
    if (stereo_only) {
      BenchStereo(CreateBackend(backend_name), root.filename().string(), model,
                  workspace.reconstruction.Posed(view));
      continue;
    }
    Bench bench(CreateBackend(backend_name), root.filename().string(), model,
                ToCameraParams(workspace.reconstruction.Posed(view)));
    if (!pictures.empty()) {
      bench.Renders(pictures / (root.filename().string() + ".f32"));
      continue;
    }
    bench.WholeView();
    bench.Region(0.01, "/1%");
    bench.Region(0.1, "/10%");
    bench.Memory();
  }
  return 0;
}

}  // namespace
}  // namespace retint

int main(int argc, char** argv) {
  return retint::RunProgram("retint_bench_device", retint::Main, argc, argv);
}
