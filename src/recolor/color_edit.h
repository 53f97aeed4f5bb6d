// SPDX-License-Identifier: BSD-3-Clause
// The edit as a value: an affine map on colour, so that edits other than a tint fit.
#pragma once

#include <string_view>

#include <Eigen/Core>

namespace retint {

// c* = gain * c + offset, per RGB triple. A tint t (colour filtering) is gain = diag(t), offset =
// 0. With a soft mask value M in [0, 1]: y* = y + M (gain y + offset - y).
struct ColorEdit {
  Eigen::Matrix3f gain = Eigen::Matrix3f::Identity();
  Eigen::Vector3f offset = Eigen::Vector3f::Zero();

  static ColorEdit Tint(const Eigen::Vector3f& tint);
  // Linear interpolation from identity (strength 0) to this edit (1).
  ColorEdit WithStrength(float strength) const;
  Eigen::Vector3f Apply(const Eigen::Vector3f& color, float mask) const {
    return color + mask * (gain * color + offset - color);
  }
  // OptionError for negative, NaN or infinite values.
  void Check() const;
};

// "R,G,B" (numbers >= 0) or "#rrggbb" (0-255 mapped to 0-1). OptionError otherwise.
ColorEdit ParseTint(std::string_view text);

}  // namespace retint
