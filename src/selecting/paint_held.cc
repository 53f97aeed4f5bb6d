// SPDX-License-Identifier: BSD-3-Clause
#include "selecting/paint_held.h"

#include <algorithm>

#include <fmt/format.h>

#include "opening/photo_paint.h"
#include "opening/pictures.h"
#include "scene/mask_pixels.h"
#include "selecting/paint_picture.h"

namespace retint {
namespace {

// None for a view without a mask.
PaintCounts CountsOf(const PaintedView& view, const std::map<std::string, Mask>& masks) {
  const auto found = masks.find(view.name);
  return found == masks.end() ? PaintCounts() : CountPaint(view, found->second);
}

}  // namespace

std::vector<std::string> WarningsOfPaint(const Workspace& workspace,
                                         const std::vector<PaintedView>& painted,
                                         const std::map<std::string, Mask>& masks) {
  constexpr double kLeast = 0.5;  // of the paint
  std::vector<std::string> warnings;
  for (const PaintedView& view : OnViews(workspace, painted)) {
    const PaintCounts counts = CountsOf(view, masks);
    if (counts.painted == 0) continue;
    const double part = double(counts.kept) / double(counts.painted);
    if (part >= kLeast) continue;
    warnings.push_back(
        fmt::format("the mask of view {} holds {:.0f} % of what is painted in it: the scene has no "
                    "clear surface there, or shows something in front of it",
                    view.name, 100 * part));
  }
  return warnings;
}

std::string VerdictOfPaint(const Workspace& workspace, const std::vector<PaintedView>& painted,
                           const std::map<std::string, Mask>& masks) {
  PaintCounts all;
  for (const PaintedView& view : OnViews(workspace, painted)) all += CountsOf(view, masks);
  const auto carried = std::count_if(masks.begin(), masks.end(),
                                     [](const auto& mask) { return AnyInside(mask.second); });
  std::string verdict = all.Words();
  if (!verdict.empty()) verdict += ", ";
  return verdict +
         fmt::format("carried to {} of {} views", carried, workspace.reconstruction.views.size());
}

std::string WarningOfMissingMasks(size_t with_mask, const Pictures& pictures) {
  const size_t count = pictures.all().size();
  if (with_mask >= count) return {};
  return fmt::format("{} of {} views have no mask and take no part", count - with_mask, count);
}

}  // namespace retint
