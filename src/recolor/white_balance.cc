// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/white_balance.h"

#include <cmath>
#include <cstdio>

#include "kernels/common/color_spaces.h"
#include "recolor/color_edit.h"

namespace retint {

namespace {

constexpr float kGray = 0.01f;  // chroma in OKLab: half of the least that can be seen beside a gray

std::string NotGray(const Eigen::Vector3f& rgb, const Eigen::Vector2f& found) {
  char text[160];
  const Eigen::Vector3i bytes = (255 * rgb).array().round().cast<int>();
  std::snprintf(text, sizeof(text),
                "white balance cannot make #%02x%02x%02x fully gray within its range: it goes as "
                "far as temperature %g and tint %g",
                bytes[0], bytes[1], bytes[2], double(found[0]), double(found[1]));
  return text;
}

}  // namespace

// Steps of half the size wherever no neighbor is nearer to gray.
GrayBalance WhiteBalanceOfGray(std::span<const float> color) {
  constexpr float kFirst = 64, kLast = 0.5f;  // of temperature and tint
  const auto& range = TypeOf(ColorOperationKind::kWhiteBalance).parameters;
  const Eigen::Vector2f least_values(range[0].min, range[1].min);
  const Eigen::Vector2f most_values(range[0].max, range[1].max);
  const Eigen::Vector3f rgb(color.data());
  if (rgb.maxCoeff() <= 0) {
    return {0, 0, "no white balance can be told from black (#000000), so colors stay as they are"};
  }
  const auto chroma = [&](const Eigen::Vector2f& at) {
    const ColorOperation balance =
        ColorOperation::Make(ColorOperationKind::kWhiteBalance, {at[0], at[1]});
    const Eigen::Vector3f balanced = CompiledEdit({{balance}, 1}).Apply(rgb);
    const OkLab lab = OkLabFromSrgb(balanced.data());
    return std::hypot(lab.a, lab.b);
  };
  Eigen::Vector2f best(0, 0);
  float least = chroma(best);
  for (float step = kFirst; step >= kLast; step /= 2) {
    for (bool better = true; better;) {
      better = false;
      const Eigen::Vector2f center = best;
      for (int i = 0; i < 9; ++i) {
        const Eigen::Vector2f aside(float(i % 3 - 1), float(i / 3 - 1));
        const Eigen::Vector2f at =
            (center + step * aside).cwiseMax(least_values).cwiseMin(most_values);
        const float here = chroma(at);
        if (!(here < least)) continue;
        least = here;
        best = at;
        better = true;
      }
    }
  }
  return {best[0], best[1], least > kGray ? NotGray(rgb, best) : ""};
}

}  // namespace retint
