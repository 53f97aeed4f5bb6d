// SPDX-License-Identifier: BSD-3-Clause
#include "render/renderer.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/error.h"
#include "kernels/common/color_ops.h"
#include "render/color_encoding.h"

namespace retint {
namespace {

std::string DescribeCamera(const Camera& camera) { return "camera " + std::to_string(camera.id); }

void CheckPinhole(const Camera& camera) {
  if (camera.IsPinhole()) return;
  const CameraModelInfo* info = FindCameraModel(static_cast<int>(camera.model));
  const std::string model(info ? info->name : "unknown");
  if (camera.model == CameraModelId::kPinhole || camera.model == CameraModelId::kSimplePinhole) {
    throw InputError(DescribeCamera(camera) + " (" + model + ") has " +
                     std::to_string(camera.params.size()) + " parameters, expected " +
                     std::to_string(info->num_params));
  }
  throw InputError(DescribeCamera(camera) + " has the distorted model " + model +
                   ", which cannot be rendered; undistort the workspace first: colmap "
                   "image_undistorter --image_path IMAGES --input_path SPARSE --output_path DENSE");
}

Buffer<ColorProgram> UploadOperation(Backend& backend, const ColorOp& op, const float* tables) {
  ColorProgram program{};
  program.count = 1;
  program.strength = 1;
  program.ops[0] = op;
  program.tables = tables;
  return backend.Upload(std::span<const ColorProgram>(&program, 1));
}

}  // namespace

CameraParams ToCameraParams(const PosedCamera& view) {
  const Camera& camera = view.camera;
  CheckPinhole(camera);
  const Eigen::Matrix3d rotation = view.cam_from_world.rotation.normalized().toRotationMatrix();
  const Eigen::Vector3d translation = view.cam_from_world.translation;
  const Eigen::Vector3d center = -(rotation.transpose() * translation);
  if (camera.width <= 0 || camera.height <= 0 || !(camera.fx() > 0) || !(camera.fy() > 0) ||
      !std::isfinite(camera.fx() + camera.fy() + camera.cx() + camera.cy())) {
    throw InputError(DescribeCamera(camera) + " has no usable size, focal length or center");
  }
  if (!rotation.allFinite() || !translation.allFinite()) {
    throw InputError("a view of " + DescribeCamera(camera) + " has a pose that is not finite");
  }
  CameraParams params{};
  params.fx = static_cast<float>(camera.fx());
  params.fy = static_cast<float>(camera.fy());
  params.cx = static_cast<float>(camera.cx());
  params.cy = static_cast<float>(camera.cy());
  params.width = camera.width;
  params.height = camera.height;
  for (int row = 0; row < 3; ++row) {
    for (int col = 0; col < 3; ++col) {
      params.rotation[3 * row + col] = static_cast<float>(rotation(row, col));
    }
    params.translation[row] = static_cast<float>(translation[row]);
    params.center[row] = static_cast<float>(center[row]);
  }
  return params;
}

void RendererOptions::Check() const {
  for (const float channel : background) {
    CheckOption(std::isfinite(channel), "background must be finite");
  }
}

// The buffers that every call reuses.
struct Renderer::Scratch {
  Buffer<float> background, features, image, scalar;
};

Renderer::Renderer(std::shared_ptr<Backend> backend, const GaussianModel& model,
                   RendererOptions options, std::shared_ptr<GeometryCache> cache)
    : backend_(std::move(backend)),
      background_(options.background),
      light_map_(LightMapOf(model.traits)),
      makes_room_(options.makes_room),
      cache_(cache ? std::move(cache) : std::make_shared<GeometryCache>(options.cache_bytes)),
      scratch_(std::make_unique<Scratch>()) {
  options.Check();
  model.Validate();
  model_ =
      backend_->blend().UploadModel({.means = model.means.data(),
                                     .quats_wxyz = model.quats_wxyz.data(),
                                     .log_scales = model.log_scales.data(),
                                     .opacity_logits = model.opacity_logits.data(),
                                     .sh = model.sh.data(),
                                     .count = static_cast<int64_t>(model.NumGaussians()),
                                     .sh_degree = model.sh_degree,
                                     .compensate = model.traits.render_model == RenderModel::kMip});
  std::array<float, 3> background = options.background;
  if (light_map_) {
    std::vector<float> curve;
    const ColorEncoding encoding(*light_map_, curve);
    if (!curve.empty()) curve_ = backend_->Upload(std::span<const float>(curve));
    encode_ = UploadOperation(*backend_, encoding.encode, curve_.data());
    decode_ = UploadOperation(*backend_, encoding.decode, curve_.data());
    // Black is nothing behind the Gaussians, also where a space has another number for it.
    if (background != std::array<float, 3>{}) {
      ApplyColorOp(encoding.decode, curve.data(), background.data());
    }
  }
  scratch_->background = backend_->Upload(std::span<const float>(background));
}

Renderer::~Renderer() = default;

size_t Renderer::cached_bytes() const { return cache_->bytes(); }

std::shared_ptr<const ViewGeometry> Renderer::Geometry(const PosedCamera& view, bool cache) {
  const CameraParams params = ToCameraParams(view);
  if (auto found = cache_->Find(params)) return found;
  std::shared_ptr<const ViewGeometry> geometry;
  try {
    geometry = backend_->blend().PrepareView(*model_, params);
  } catch (const std::bad_alloc&) {
    if (!cache_->Clear()) throw;
    geometry = backend_->blend().PrepareView(*model_, params);
  }
  if (cache) cache_->Insert(geometry);
  return geometry;
}

bool Renderer::HasGeometry(const PosedCamera& view) const {
  return cache_->Contains(ToCameraParams(view));
}

std::unique_ptr<GeometryCache::Reservation> Renderer::Reserve() {
  return makes_room_ ? std::make_unique<GeometryCache::Reservation>(cache_) : nullptr;
}

void Renderer::BlendRgb(const ViewGeometry& geometry, float* rgb, float* alpha) {
  const int64_t rows = geometry.num_rows();
  float* colors = backend_->Grow(scratch_->features, size_t(rows) * 3);
  const float* const center = geometry.camera().center;
  backend_->sh().EvalSh(*model_, {.rows = geometry.rows(),
                                  .count = rows,
                                  .sh = model_->sh(),
                                  .center = {center[0], center[1], center[2]},
                                  .colors = colors});
  backend_->blend().Blend(geometry, {.features = colors,
                                     .channels = 3,
                                     .background = scratch_->background.data(),
                                     .image = rgb,
                                     .alpha = alpha});
  ToSrgb(geometry.camera().width, geometry.camera().height, rgb);
}

void Renderer::Map(const ColorProgram* program, int width, int height, float* rgb) {
  if (!light_map_) return;
  ColorMap map{};
  map.program = program;
  backend_->refit().EditImage({.image = rgb,
                               .mask = nullptr,
                               .map = map,
                               .width = width,
                               .height = height,
                               .box = {0, 0, width, height},
                               .out = rgb});
}

void Renderer::ToSrgb(int width, int height, float* rgb) {
  Map(encode_.data(), width, height, rgb);
}

void Renderer::ToColorsOfModel(int width, int height, float* rgb) {
  Map(decode_.data(), width, height, rgb);
}

DeviceRender Renderer::RenderOnDevice(const PosedCamera& view, const RenderRequest& request) {
  const auto geometry = Geometry(view, request.cache);
  DeviceRender output;
  output.width = geometry->camera().width;
  output.height = geometry->camera().height;
  const size_t pixels = size_t(output.width) * size_t(output.height);
  if (request.alpha) output.alpha = backend_->Allocate<float>(pixels);
  if (request.rgb) {
    output.rgb = backend_->Allocate<float>(pixels * 3);
    BlendRgb(*geometry, output.rgb.data(), output.alpha.data());
  }
  const bool alpha_left = request.alpha && !request.rgb;
  if (request.depth_median || request.depth_expected || alpha_left) {
    if (request.depth_median) output.depth_median = backend_->Allocate<float>(pixels);
    if (request.depth_expected) output.depth_expected = backend_->Allocate<float>(pixels);
    backend_->blend().Depth(*geometry, {.median = output.depth_median.data(),
                                        .expected = output.depth_expected.data(),
                                        .alpha = alpha_left ? output.alpha.data() : nullptr,
                                        .threshold = request.median_threshold,
                                        .pixel_rows = request.pixel_rows,
                                        .along_rays = request.along_rays ? model_.get() : nullptr});
  }
  return output;
}

RenderOutput Renderer::Render(const PosedCamera& view, const RenderRequest& request) {
  RenderOutput output;
  Render(view, request, &output);
  return output;
}

void Renderer::Render(const PosedCamera& view, const RenderRequest& request, RenderOutput* output) {
  const auto geometry = Geometry(view, request.cache);
  const CameraParams& camera = geometry->camera();
  const int width = camera.width, height = camera.height;
  const size_t pixels = size_t(width) * size_t(height);
  const auto fetch = [&](const float* from, auto& image) {
    using Array = std::remove_reference_t<decltype(image)>;
    if (!from) {
      image = Array();
      return;
    }
    const bool fits = image.width == width && image.height == height &&
                      image.data.size() == pixels * size_t(Array::kChannels);
    if (!fits) image = Array(width, height);
    backend_->CopyToHost(image.data.data(), from, image.data.size() * sizeof(float));
  };

  const float* rgb = nullptr;
  const float* rgb_alpha = nullptr;
  if (request.rgb) {
    float* image = backend_->Grow(scratch_->image, pixels * 3);
    float* alpha = request.alpha ? backend_->Grow(scratch_->scalar, pixels) : nullptr;
    BlendRgb(*geometry, image, alpha);
    rgb = image;
    rgb_alpha = alpha;
  }
  fetch(rgb, output->rgb);
  fetch(rgb_alpha, output->alpha);

  const bool alpha_left = request.alpha && !request.rgb;
  float *median = nullptr, *expected = nullptr;
  if (request.depth_median || request.depth_expected || alpha_left) {
    float* const planes = backend_->Grow(scratch_->image, pixels * 3);
    float* const left = alpha_left ? planes + 2 * pixels : nullptr;
    if (request.depth_median) median = planes;
    if (request.depth_expected) expected = planes + pixels;
    backend_->blend().Depth(*geometry, {.median = median,
                                        .expected = expected,
                                        .alpha = left,
                                        .threshold = request.median_threshold,
                                        .pixel_rows = request.pixel_rows,
                                        .along_rays = request.along_rays ? model_.get() : nullptr});
    if (left) fetch(left, output->alpha);
  }
  fetch(median, output->depth_median);
  fetch(expected, output->depth_expected);
}

void Renderer::SetSh(std::span<const float> sh) {
  const size_t count = size_t(model_->count()) * size_t(model_->num_sh_coeffs()) * 3;
  CheckOption(sh.size() == count, "SetSh got " + std::to_string(sh.size()) +
                                      " coefficients, the model has " + std::to_string(count));
  backend_->CopyToDevice(model_->sh(), sh.data(), sh.size_bytes());
}

}  // namespace retint
