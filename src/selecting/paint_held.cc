// SPDX-License-Identifier: BSD-3-Clause
#include "selecting/paint_held.h"

#include <algorithm>

#include <fmt/format.h>

#include "opening/photo_paint.h"
#include "opening/pictures.h"
#include "scene/mask_pixels.h"

namespace retint {
namespace {

// Pixels of a painted view: of its paint, of that what its mask holds, and what that holds beside
// it.
struct HeldPixels {
  size_t painted = 0, held = 0, added = 0;
};

// None for a view without a mask.
HeldPixels CountHeld(const PaintedView& view, const std::map<std::string, Mask>& masks) {
  HeldPixels pixels;
  const auto found = masks.find(view.name);
  if (found == masks.end() || found->second.NumPixels() != view.mask.NumPixels()) return pixels;
  for (size_t p = 0; p < view.mask.data.size(); ++p) {
    if (!view.seen.Empty() && view.seen.data[p] == 0) continue;
    const bool painted = IsInside(view.mask.data[p]), masked = IsInside(found->second.data[p]);
    pixels.painted += painted;
    pixels.held += painted && masked;
    pixels.added += masked && !painted;
  }
  return pixels;
}

double Part(size_t part, size_t whole) { return whole > 0 ? double(part) / double(whole) : 0; }

}  // namespace

std::vector<std::string> WarningsOfPaint(const Workspace& workspace,
                                         const std::vector<PaintedView>& painted,
                                         const std::map<std::string, Mask>& masks) {
  constexpr double kLeast = 0.5;  // of the paint
  std::vector<std::string> warnings;
  for (const PaintedView& view : OnViews(workspace, painted)) {
    const HeldPixels pixels = CountHeld(view, masks);
    const double part = Part(pixels.held, pixels.painted);
    if (pixels.painted == 0 || part >= kLeast) continue;
    warnings.push_back(
        fmt::format("the mask of view {} holds {:.0f} % of what is painted in it: the scene has no "
                    "clear surface there, or shows something in front of it",
                    view.name, 100 * part));
  }
  return warnings;
}

std::string VerdictOfPaint(const Workspace& workspace, const std::vector<PaintedView>& painted,
                           const std::map<std::string, Mask>& masks) {
  constexpr double kNoticed = 0.01;  // of the paint
  HeldPixels all;
  for (const PaintedView& view : OnViews(workspace, painted)) {
    const HeldPixels pixels = CountHeld(view, masks);
    all.painted += pixels.painted;
    all.held += pixels.held;
    all.added += pixels.added;
  }
  const auto carried = std::count_if(masks.begin(), masks.end(),
                                     [](const auto& mask) { return AnyInside(mask.second); });
  std::string verdict;
  if (all.painted > 0) {
    const double left_out = 1 - Part(all.held, all.painted), added = Part(all.added, all.painted);
    verdict = left_out < kNoticed
                  ? "all of your paint is in"
                  : fmt::format("{:.0f} % of your paint is in", 100 * (1 - left_out));
    if (added >= kNoticed) verdict += fmt::format(", and {:.0f} % beside it", 100 * added);
    verdict += ", ";
  }
  return verdict +
         fmt::format("carried to {} of {} views", carried, workspace.reconstruction.views.size());
}

std::string WarningOfMissingMasks(size_t with_mask, const Pictures& pictures) {
  const size_t count = pictures.all().size();
  if (with_mask >= count) return {};
  return fmt::format("{} of {} views have no mask and take no part", count - with_mask, count);
}

}  // namespace retint
