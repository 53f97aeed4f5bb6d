// SPDX-License-Identifier: BSD-3-Clause
#include "selecting/scene_answer.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/error.h"
#include "opening/photo_paint.h"
#include "scene/mask_pixels.h"

namespace retint {
namespace {

// 255 where at least `least` of the pixels in the square of `radius` around are set, those beside
// the mask left out; `least` < 0: all of them.
Mask Counted(const Mask& mask, int radius, int least) {
  const int width = mask.width, height = mask.height;
  std::vector<int> sums(size_t(width + 1) * size_t(height + 1), 0);  // of all above and left
  const auto sum = [&](int x, int y) -> int& {
    return sums[size_t(y) * size_t(width + 1) + size_t(x)];
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      sum(x + 1, y + 1) = sum(x, y + 1) + sum(x + 1, y) - sum(x, y) + (mask(x, y) != 0);
    }
  }
  Mask counted(width, height);
  for (int y = 0; y < height; ++y) {
    const int y0 = std::max(0, y - radius), y1 = std::min(height, y + radius + 1);
    for (int x = 0; x < width; ++x) {
      const int x0 = std::max(0, x - radius), x1 = std::min(width, x + radius + 1);
      const int set = sum(x1, y1) - sum(x0, y1) - sum(x1, y0) + sum(x0, y0);
      const int wanted = least < 0 ? (x1 - x0) * (y1 - y0) : least;
      if (set >= wanted) counted(x, y) = 255;
    }
  }
  return counted;
}

}  // namespace

Mask OutlinesDiffer(const Mask& a, const Mask& b) {
  constexpr double kThin = 0.0025;  // half of a line's width, as a share of the longer side
  Mask differs(a.width, a.height);
  for (size_t p = 0; p < differs.data.size(); ++p) {
    if (IsInside(a.data[p]) != IsInside(b.data[p])) differs.data[p] = 255;
  }
  const int radius =
      std::max(1, static_cast<int>(std::lround(kThin * std::max(a.width, a.height))));
  return Counted(Counted(differs, radius, -1), radius, 1);  // an opening
}

std::optional<SceneAnswer> AskScene(SelectionPipeline& selection, const UserPicture& picture,
                                    const Mask& own, const Mask& undecided, Monitor& monitor) {
  PaintedView painted{picture.name, PosedPicture(selection.scene().workspace(), picture), own,
                      undecided};
  for (uint8_t& value : painted.seen.data) value = IsInside(value) ? 0 : 255;
  SceneAnswer answer;
  try {
    const auto masks = selection.Decide({std::move(painted)}, picture.faces, monitor);
    answer.mask = selection.scene().pictures().ComposeMask(
        picture, [&](const View& face) { return masks.at(face.name); });
  } catch (const InputError&) {
    return std::nullopt;
  }
  answer.differs = OutlinesDiffer(own, answer.mask);
  answer.changed =
      double(CountInside(answer.differs)) / double(std::max<size_t>(1, CountInside(own)));
  answer.may_stand = MayStandFor(own, answer.mask);
  return answer;
}

}  // namespace retint
