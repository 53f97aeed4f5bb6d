// SPDX-License-Identifier: BSD-3-Clause
// Between a splat's blended colors and sRGB.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "kernels/common/color_ops.h"
#include "scene/gaussian_model.h"
#include "scene/splat_traits.h"

namespace retint {

// The operations kEncode and kDecode of a map. Their table, its curve, is added to `tables`.
struct ColorEncoding {
  ColorOp encode = {}, decode = {};
  ColorEncoding() = default;
  ColorEncoding(const LightMap& map, std::vector<float>& tables);
};

// The same for single colors in host memory. Null map: the colors are sRGB and stay.
class SingleColors {
 public:
  explicit SingleColors(const std::shared_ptr<const LightMap>& map);
  bool maps() const { return maps_; }
  void ToSrgb(float* rgb) const;  // [3], in place
  void FromSrgb(float* rgb) const;

 private:
  bool maps_;
  std::vector<float> tables_;
  ColorEncoding encoding_;
};

// The sRGB colors of Gaussians without what depends on the direction, in [0, 1].
class BaseColors {
 public:
  explicit BaseColors(const GaussianModel& model)
      : model_(model), colors_(LightMapOf(model.traits)) {}
  Eigen::Vector3f Of(size_t gaussian) const;

 private:
  const GaussianModel& model_;
  SingleColors colors_;
};

}  // namespace retint
