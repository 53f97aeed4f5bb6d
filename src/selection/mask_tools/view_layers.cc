// SPDX-License-Identifier: BSD-3-Clause
#include "selection/mask_tools/view_layers.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/error.h"
#include "base/parallel.h"
#include "kernels/common/color_spaces.h"
#include "selection/depth_sampling.h"

namespace retint {

void CheckLayers(const ViewLayers& layers) {
  CheckOption(layers.color.NumPixels() > 0, "a view without pixels has no outline");
  CheckOption(layers.depth.Empty() || (layers.depth.width == layers.color.width &&
                                       layers.depth.height == layers.color.height),
              "color and depth of a view need one size");
}

PixelArray<float, 4> Features(const ViewLayers& layers) {
  PixelArray<float, 4> features(layers.color.width, layers.color.height);
  ParallelRanges(layers.color.height, 16, [&](int64_t begin, int64_t end) {
    for (int y = int(begin); y < int(end); ++y) {
      for (int x = 0; x < layers.color.width; ++x) {
        float rgb[3];
        for (int c = 0; c < 3; ++c) rgb[c] = std::clamp(layers.color(x, y, c), 0.0f, 1.0f);
        const OkLab lab = OkLabFromSrgb(rgb);
        float* const out = &features(x, y);
        out[0] = lab.lightness, out[1] = lab.a, out[2] = lab.b, out[3] = 0;
        if (!layers.depth.Empty() && HasDepth(layers.depth, x, y)) {
          out[3] = std::log(layers.depth(x, y));
        }
      }
    }
  });
  return features;
}

}  // namespace retint
