// SPDX-License-Identifier: BSD-3-Clause
#include "selection/evidence.h"

#include <cstdint>
#include <span>

namespace retint {

PaintedImage LookedUpFrom(const PosedCamera& view, const PosedCamera& painted, const float* depth,
                          const uint8_t* mask) {
  const PosedCamera relative{painted.camera,
                             painted.cam_from_world * view.cam_from_world.Inverse()};
  return {ToCameraParams(relative), depth, mask};
}

Evidence LookUpPaint(Backend& backend, const PosedCamera& view, const DepthMap& depth,
                     const std::vector<PaintedSurface>& painted, double tolerance,
                     double unknown_weight) {
  std::vector<Buffer<float>> depths;
  std::vector<Buffer<uint8_t>> masks;
  std::vector<PaintedImage> images;
  for (const auto& surface : painted) {
    depths.push_back(backend.Upload(std::span<const float>(surface.depth.data)));
    masks.push_back(backend.Upload(std::span<const uint8_t>(surface.mask->data)));
    images.push_back(LookedUpFrom(view, surface.camera, depths.back().data(), masks.back().data()));
  }
  const auto surface = backend.Upload(std::span<const float>(depth.data));
  const auto residual = backend.Allocate<float>(2 * depth.NumPixels());
  backend.mask().Evidence({.camera = ToCameraParams(view),
                           .depth = surface.data(),
                           .painted = images,
                           .tolerance = static_cast<float>(tolerance),
                           .unknown_weight = static_cast<float>(unknown_weight),
                           .scale = 1,
                           .residual = residual.data()});
  const auto found = backend.Download(residual.data(), residual.size());
  Evidence evidence{ScalarImage(depth.width, depth.height), ScalarImage(depth.width, depth.height)};
  for (size_t i = 0; i < depth.NumPixels(); ++i) {
    const float weight = found[2 * i + 1];
    evidence.weight.data[i] = weight;
    evidence.inside.data[i] = weight > 0 ? found[2 * i] / weight : 0;
  }
  return evidence;
}

}  // namespace retint
