// SPDX-License-Identifier: BSD-3-Clause
// W and its transpose on arrays of the host, by Gaussian; a few channels (1 to kMaxChannels).
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "render/renderer.h"

namespace retint {

// W c: [N, channels] -> [H, W, channels].
inline std::vector<float> BlendFeatures(Renderer& renderer, const PosedCamera& view,
                                        std::span<const float> features, int channels = 1) {
  Backend& backend = renderer.backend();
  const auto geometry = renderer.Geometry(view);
  const size_t pixels = size_t(geometry->camera().width) * size_t(geometry->camera().height);
  const auto by_gaussian = backend.Upload(features);
  const auto by_row = backend.Allocate<float>(size_t(geometry->num_rows()) * size_t(channels));
  const auto image = backend.Allocate<float>(pixels * size_t(channels));
  backend.blend().GatherRows(*geometry, by_gaussian.data(), channels, by_row.data());
  BlendParams blend{};
  blend.features = by_row.data();
  blend.channels = channels;
  blend.image = image.data();
  backend.blend().Blend(*geometry, blend);
  return backend.Download(image.data(), image.size());
}

// W^T r: [H, W, channels] -> [N, channels], zero where not visible.
inline std::vector<float> BlendTransposeToGaussians(Renderer& renderer, const PosedCamera& view,
                                                    std::span<const float> residual,
                                                    int channels = 1) {
  Backend& backend = renderer.backend();
  const auto geometry = renderer.Geometry(view);
  const auto image = backend.Upload(residual);
  const auto by_row = backend.Allocate<float>(size_t(geometry->num_rows()) * size_t(channels));
  const auto sums = backend.Allocate<float>(size_t(renderer.model().count()) * size_t(channels));
  BlendTransposeParams transpose{};
  transpose.residual = image.data();
  transpose.channels = channels;
  transpose.result = by_row.data();
  backend.blend().BlendTranspose(*geometry, transpose);
  backend.blend().AddRows(*geometry, by_row.data(), channels, sums.data());
  return backend.Download(sums.data(), sums.size());
}

}  // namespace retint
