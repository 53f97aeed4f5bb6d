// SPDX-License-Identifier: BSD-3-Clause
// An edit with paint (ColorEdit::HasPaint()), a color at a time.
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "recolor/color_edit.h"
#include "recolor/picture_edit.h"

namespace retint {

inline constexpr float kMostPaintLight = 4;  // ratio

// The luminance of a displayed color, in linear light.
float LightOf(const float* rgb);

class PaintedEdit {
 public:
  explicit PaintedEdit(const ColorEdit& edit, OutOfRange out_of_range = OutOfRange::kBroughtIn);

  // The result of the edit at its full strength on a color that `painted` covers by `alpha`:
  // operations before the picture, the painted color, later operations.
  Eigen::Vector3f Apply(const Eigen::Vector3f& color, const Eigen::Vector3f& painted,
                        float alpha) const;

  float strength() const { return strength_; }
  // Null if the edit has no pictures.
  const std::shared_ptr<const PictureEdit>& picture() const { return picture_; }

 private:
  CompiledEdit before_, after_;  // up to and with the picture operation's color map; the later ones
  float paint_strength_ = 1, strength_;
  std::shared_ptr<const PictureEdit> picture_;
};

}  // namespace retint
