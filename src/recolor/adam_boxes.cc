// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/adam_boxes.h"

#include <algorithm>

namespace retint {
namespace {

// The 11x11 window reaches 5 pixels; SSIM inside the region's bounds and its gradient reach twice
// that.
constexpr int kLossHalo = 10;

// Pixel bounds of a region's tiles: x0, y0, x1, y1, half-open.
std::array<int32_t, 4> TileBounds(const ViewGeometry& region) {
  const CameraParams& camera = region.camera();
  const int tiles_x = region.tiles_x();
  std::array<int32_t, 4> bounds = {camera.width, camera.height, 0, 0};
  for (const int32_t tile : region.tiles()) {
    const int x = tile % tiles_x * kTileSize, y = tile / tiles_x * kTileSize;
    bounds = {std::min(bounds[0], x), std::min(bounds[1], y),
              std::max(bounds[2], std::min(x + kTileSize, camera.width)),
              std::max(bounds[3], std::min(y + kTileSize, camera.height))};
  }
  return bounds;
}

size_t BoxValues(const std::array<int32_t, 4>& box) {
  return size_t(box[2] - box[0]) * size_t(box[3] - box[1]) * 3;
}

}  // namespace

size_t AdamView::Bytes() const {
  return RegionView::Bytes() + (render.size() + photo.size()) * sizeof(uint16_t) + mask.size();
}

std::shared_ptr<const ViewGeometry> AdamBoxes::Restrict(RefitViews& views,
                                                        const ViewGeometry& whole,
                                                        size_t budget_bytes) {
  return views.backend().blend().Restrict(whole, views.active_flags(), budget_bytes);
}

std::unique_ptr<RegionView> AdamBoxes::Make(RefitViews& views, const ViewGeometry& whole,
                                            const ViewGeometry& region,
                                            const TargetImages& images) {
  Backend& backend = views.backend();
  const CameraParams& camera = region.camera();
  auto view = std::make_unique<AdamView>();
  view->map = images.map;
  view->roi = TileBounds(region);
  view->box = {std::max(view->roi[0] - kLossHalo, 0), std::max(view->roi[1] - kLossHalo, 0),
               std::min(view->roi[2] + kLossHalo, camera.width),
               std::min(view->roi[3] + kLossHalo, camera.height)};
  const auto pack = [&](float* image) {
    auto packed = backend.Allocate<uint16_t>(BoxValues(view->box));
    const auto& [x0, y0, x1, y1] = view->box;
    backend.refit().PackBox({.image = image,
                             .width = camera.width,
                             .height = camera.height,
                             .box = {x0, y0, x1, y1},
                             .packed = packed.data(),
                             .unit = kUnit});
    return packed;
  };
  float* const render = views.scratch().images[0].data();
  // Beyond the region, too.
  backend.blend().Blend(whole, {.features = views.OriginalColors(whole),
                                .channels = 3,
                                .image = render,
                                .pixel_rows = region.pixel_rows()});
  view->render = pack(render);
  if (images.source) view->photo = pack(images.source);
  view->mask = backend.Upload(std::span<const uint8_t>(images.target.mask->data));
  return view;
}

}  // namespace retint
