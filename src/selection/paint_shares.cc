// SPDX-License-Identifier: BSD-3-Clause
#include "selection/paint_shares.h"

#include <cstddef>

#include "base/error.h"

namespace retint {

std::vector<float> PaintShares(Renderer& renderer, const PosedCamera& view, const Mask& mask,
                               std::span<const float> base) {
  constexpr double kDoubtPart = 0.1;
  const size_t count = size_t(renderer.model().count());
  CheckOption(base.empty() || base.size() == count, "a selection needs one share a Gaussian");
  CheckOption(mask.width == view.camera.width && mask.height == view.camera.height,
              "the paint is not of its view's size");
  Backend& backend = renderer.backend();
  const auto paint = backend.Upload(std::span<const uint8_t>(mask.data));
  const auto sums = backend.Allocate<double>(2 * count);  // painted, in total
  backend.blend().AccumulateShares(*renderer.Geometry(view), paint.data(), sums.data());
  const std::vector<double> seen = backend.Download(sums.data(), sums.size());
  double visible = 0, pixels = 0;
  for (size_t g = 0; g < count; ++g) {
    visible += seen[2 * g + 1] > 0;
    pixels += seen[2 * g + 1];
  }
  const double doubt = pixels > 0 ? kDoubtPart * pixels / visible : 1;
  std::vector<float> shares(count);
  for (size_t g = 0; g < count; ++g) {
    const double before = base.empty() ? 0 : double(base[g]);
    shares[g] = float((seen[2 * g] + doubt * before) / (seen[2 * g + 1] + doubt));
  }
  return shares;
}

}  // namespace retint
