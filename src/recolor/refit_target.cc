// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/refit_target.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "base/error.h"
#include "base/parallel.h"
#include "render/color_encoding.h"
#include "scene/image_checks.h"

namespace retint {
namespace {

constexpr int64_t kPixels = 1 << 16;  // a task

void CheckSize(const RefitTarget& target, int width, int height, size_t values, int channels,
               const char* what) {
  const Camera& camera = target.camera.camera;
  if (width != camera.width || height != camera.height ||
      values != size_t(std::max(width, 0)) * size_t(std::max(height, 0)) * size_t(channels)) {
    throw InputError("view '" + target.name + "': " + what + " is " + SizeText(width, height) +
                     ", the camera is " + SizeText(camera.width, camera.height));
  }
}

}  // namespace

void CheckTarget(const RefitTarget& target) {
  if (!target.mask) throw InputError("view '" + target.name + "': has no mask");
  CheckSize(target, target.mask->width, target.mask->height, target.mask->data.size(), 1, "mask");
}

namespace {

bool HasBackground(const Renderer& renderer) {
  const auto& background = renderer.background();
  return std::any_of(background.begin(), background.end(), [](float value) { return value != 0; });
}

Image WithoutBackground(Image image, const PosedCamera& camera, Renderer& renderer) {
  RenderRequest request;
  request.rgb = false;
  request.alpha = true;
  const ScalarImage alpha = renderer.Render(camera, request).alpha;
  const SingleColors colors(renderer.light_map());
  std::array<float, 3> background = renderer.background();
  colors.FromSrgb(background.data());
  ParallelRanges(int64_t(alpha.data.size()), kPixels, [&](int64_t begin, int64_t end) {
    for (size_t p = size_t(begin); p < size_t(end); ++p) {
      const float through = 1 - alpha.data[p];
      float* const color = &image.data[3 * p];
      colors.FromSrgb(color);
      for (size_t c = 0; c < 3; ++c) color[c] -= through * background[c];
      colors.ToSrgb(color);
    }
  });
  return image;
}

}  // namespace

std::shared_ptr<const Image> PhotoOf(const RefitTarget& target, Renderer& renderer) {
  if (!target.photo) return nullptr;
  std::shared_ptr<const Image> photo = target.photo();
  CheckSize(target, photo->width, photo->height, photo->data.size(), 3, "photo");
  if (!HasBackground(renderer)) return photo;
  return std::make_shared<const Image>(WithoutBackground(*photo, target.camera, renderer));
}

Image MadeFor(const RefitTarget& target, Renderer& renderer, Mask* leaves) {
  if (!target.edited) return {};
  Image made = target.edited(renderer, leaves);
  CheckSize(target, made.width, made.height, made.data.size(), 3, "edited picture");
  return HasBackground(renderer) ? WithoutBackground(std::move(made), target.camera, renderer)
                                 : made;
}

UploadedEdit::UploadedEdit(Backend& backend, const CompiledEdit& edit) {
  if (edit.IsAffine()) {
    map = edit.Map();
    return;
  }
  ColorProgram resident = edit.program();
  if (!edit.tables().empty()) tables = backend.Upload(edit.tables());
  resident.tables = tables.data();
  program = backend.Upload(std::span<const ColorProgram>(&resident, 1));
  map.program = program.data();
}

std::vector<double> AreasOf(const std::vector<RefitTarget>& targets) {
  constexpr double kLeast = 0.05;  // of a view's pixels
  std::vector<double> areas(targets.size());
  ParallelTasks(int64_t(targets.size()), [&](int64_t t) {
    const auto& mask = targets[size_t(t)].mask->data;
    const auto empty = std::count(mask.begin(), mask.end(), uint8_t{0});
    areas[size_t(t)] = double(mask.size()) - double(empty) + kLeast * double(mask.size());
  });
  return areas;
}

ViewReducer ShareTargets(Backend& backend, const std::vector<RefitTarget>& targets) {
  return ViewReducer(backend, targets.size(), [&] { return AreasOf(targets); });
}

}  // namespace retint
