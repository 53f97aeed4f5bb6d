// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/painted_edit.h"

#include <algorithm>

#include "kernels/common/color_spaces.h"

namespace retint {
namespace {

// The edit's operations up to and with the picture's, or those that follow.
ColorEdit PartOf(const ColorEdit& edit, bool first) {
  const auto picture = std::find_if(edit.operations.begin(), edit.operations.end(),
                                    [](const ColorOperation& op) { return op.picture != nullptr; });
  const auto end = picture == edit.operations.end() ? picture : picture + 1;
  return first ? ColorEdit{{edit.operations.begin(), end}, 1}
               : ColorEdit{{end, edit.operations.end()}, 1};
}

}  // namespace

float LightOf(const float* rgb) {
  const float linear[3] = {LinearFromSrgb(rgb[0]), LinearFromSrgb(rgb[1]), LinearFromSrgb(rgb[2])};
  return Luminance(linear);
}

PaintedEdit::PaintedEdit(const ColorEdit& edit, OutOfRange out_of_range)
    : before_(PartOf(edit, true), out_of_range),
      after_(PartOf(edit, false), out_of_range),
      strength_(edit.strength) {
  for (const ColorOperation& op : edit.operations) {
    if (!op.picture) continue;
    picture_ = op.picture;
    paint_strength_ = op.strength;
  }
}

Eigen::Vector3f PaintedEdit::Apply(const Eigen::Vector3f& color, const Eigen::Vector3f& painted,
                                   float alpha) const {
  Eigen::Vector3f edited = before_.Apply(color);
  if (alpha > 0) edited += alpha * paint_strength_ * (painted - edited);
  return after_.Apply(edited);
}

}  // namespace retint
