// SPDX-License-Identifier: BSD-3-Clause
// The edit of a region as a value: a list of operations on colors, applied in
// order.
#pragma once

#include <algorithm>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "kernels/common/color_ops.h"
#include "recolor/color_operation.h"
#include "scene/gaussian_model.h"

namespace retint {

// y = gain c + offset, per RGB triple.
struct AffineColor {
  Eigen::Matrix3f gain = Eigen::Matrix3f::Identity();
  Eigen::Vector3f offset = Eigen::Vector3f::Zero();
};

// c* = f(c), f the operations one after the other. With a soft mask value M in
// [0, 1] a pixel y becomes y + M (f(y) - y). No operation: the identity.
struct ColorEdit {
  std::vector<ColorOperation> operations;  // at most kMaxColorOps
  float strength = 1;                      // of the whole list: f is c + strength (list(c) - c)
  // Of the colors that it meets; not null: it applies to their sRGB encodings. Whoever applies an
  // edit to the colors of a splat sets it (OnColorsOf()); files do not hold it.
  std::shared_ptr<const LightMap> light_map = nullptr;

  // Color filtering (ReCoGS): each channel times its factor.
  static ColorEdit Tint(const Eigen::Vector3f& tint);
  static ColorEdit FromAffine(const AffineColor& map);  // one matrix
  // The same for the colors of a splat.
  ColorEdit OnColorsOf(const GaussianModel& model) const;
  // Linear interpolation from identity (strength 0) to this edit (1).
  ColorEdit WithStrength(float factor) const;
  // Whether an operation brings colors that no screen shows into the range.
  bool BringsIntoRange() const;

  // Whether the whole list is one affine map, and that map. Precondition of
  // Affine(): it is.
  bool IsAffine() const;
  AffineColor Affine() const;
  // Whether an operation waits for a color of the region that it will be applied
  // to, as "make it this color" does until the main color is measured.
  bool NeedsMainColor() const;
  // Whether a view's target is more than a map of its colors: a picture was painted that no color
  // map explains, see PaintCarrier. As a map of colors, the edit is then the one outside the
  // painted layers.
  bool HasPaint() const;
  // OptionError naming the operation and its fault.
  void Check() const;
  bool operator==(const ColorEdit&) const = default;
};

// Colors that no screen shows are brought into the range if an operation does so, or left as they
// come out.
enum class OutOfRange { kBroughtIn, kLeft };

// Whether no screen shows a color, by more than the rounding of eight bits.
inline bool LeavesGamut(const float* rgb) {
  constexpr float kRounding = 0.5f / 255;
  const auto [least, most] = std::minmax({rgb[0], rgb[1], rgb[2]});
  return least < -kRounding || most > 1 + kRounding;
}

// An edit made ready to be applied to many colors. OptionError as Check(), and
// for an edit that still needs a main color.
class CompiledEdit {
 public:
  explicit CompiledEdit(const ColorEdit& edit, OutOfRange out_of_range = OutOfRange::kBroughtIn);
  CompiledEdit(const CompiledEdit&) = delete;
  CompiledEdit& operator=(const CompiledEdit&) = delete;

  // f(color), and mixed by a mask value in [0, 1].
  Eigen::Vector3f Apply(const Eigen::Vector3f& color) const;
  Eigen::Vector3f Apply(const Eigen::Vector3f& color, float mask) const;
  // f of many colors in place, [*, 3]; much faster than one by one.
  void ApplyToAll(std::span<float> colors) const;

  bool IsAffine() const { return affine_; }
  const AffineColor& affine() const { return map_; }  // where it is one
  // f as the kernels take it. It refers to this edit, in host memory.
  ColorMap Map() const;
  // If it is not affine: the operations without the edit's strength, reading tables().
  const ColorProgram& program() const { return program_; }
  std::span<const float> tables() const { return tables_; }

 private:
  bool affine_;
  AffineColor map_;
  ColorProgram program_{};
  std::vector<float> tables_;
};

// "R,G,B" (numbers >= 0) or "#rrggbb" (0-255 mapped to 0-1). OptionError
// otherwise.
ColorEdit ParseTint(std::string_view text);

}  // namespace retint
