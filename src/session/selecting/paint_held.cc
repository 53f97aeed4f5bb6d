// SPDX-License-Identifier: BSD-3-Clause
#include "session/selecting/paint_held.h"

#include <fmt/format.h>

#include "scene/mask_pixels.h"
#include "session/pictures/photo_paint.h"
#include "session/pictures/pictures.h"

namespace retint {

std::vector<std::string> WarningsOfPaint(const Workspace& workspace,
                                         const std::vector<PaintedView>& painted,
                                         const std::map<std::string, Mask>& masks) {
  constexpr double kLeast = 0.5;  // of the paint
  std::vector<std::string> warnings;
  for (const PaintedView& view : OnViews(workspace, painted)) {
    const auto found = masks.find(view.name);
    if (found == masks.end() || found->second.NumPixels() != view.mask.NumPixels()) continue;
    size_t all = 0, held = 0;
    for (size_t p = 0; p < view.mask.data.size(); ++p) {
      if (!IsInside(view.mask.data[p]) || (!view.seen.Empty() && view.seen.data[p] == 0)) continue;
      ++all;
      held += IsInside(found->second.data[p]) ? 1 : 0;
    }
    const double part = all > 0 ? double(held) / double(all) : 1;
    if (part >= kLeast) continue;
    warnings.push_back(
        fmt::format("the mask of view {} holds {:.0f} % of what is painted in it: the scene has no "
                    "clear surface there, or shows something in front of it",
                    view.name, 100 * part));
  }
  return warnings;
}

std::string WarningOfMissingMasks(size_t with_mask, const Pictures& pictures) {
  const size_t count = pictures.all().size();
  if (with_mask >= count) return {};
  return fmt::format("{} of {} views have no mask and take no part", count - with_mask, count);
}

}  // namespace retint
