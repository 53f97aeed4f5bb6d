// SPDX-License-Identifier: BSD-3-Clause
#include "selecting/paint_picture.h"

#include <array>

#include <fmt/format.h>

#include "base/error.h"
#include "opening/photo_paint.h"
#include "scene/contact_sheet.h"
#include "scene/image_checks.h"
#include "scene/mask_pixels.h"

namespace retint {
namespace {

using Color = std::array<float, 3>;
constexpr Color kKept = {0.15F, 0.80F, 0.30F}, kAdded = {1.00F, 0.85F, 0.10F},
                kLeftOut = {0.95F, 0.15F, 0.15F};
constexpr float kOpacity = 0.55F;  // of the colors on the gray

// Null: the pixel stays gray.
const Color* ColorOf(bool seen, bool painted, bool masked) {
  if (!seen || !(painted || masked)) return nullptr;
  return !painted ? &kAdded : masked ? &kKept : &kLeftOut;
}

bool IsSeen(const PaintedView& view, size_t pixel) {
  return view.seen.Empty() || view.seen.data[pixel] > 0;
}

// As PicturesOfPaint() has it. A photo that cannot be read must not cost the report.
Image Under(OpenScene& scene, const View& view, const Camera& camera) {
  try {
    Image picture = scene.Picture(view);
    if (picture.width == camera.width && picture.height == camera.height) return picture;
  } catch (const InputError&) {
  }
  return scene.Render(view, scene.original().sh);
}

}  // namespace

PaintCounts& PaintCounts::operator+=(const PaintCounts& other) {
  painted += other.painted;
  kept += other.kept;
  added += other.added;
  return *this;
}

std::string PaintCounts::Words() const {
  constexpr double kNoticed = 0.01;  // of the paint
  if (painted == 0) return {};
  const double in = double(kept) / double(painted), beside = double(added) / double(painted);
  std::string words = 1 - in < kNoticed ? "all of your paint is in"
                                        : fmt::format("{:.0f} % of your paint is in", 100 * in);
  if (beside >= kNoticed) words += fmt::format(", and {:.0f} % beside it", 100 * beside);
  return words;
}

PaintCounts CountPaint(const PaintedView& view, const Mask& mask) {
  PaintCounts counts;
  if (mask.width != view.mask.width || mask.height != view.mask.height) return counts;
  for (size_t p = 0; p < mask.data.size(); ++p) {
    if (!IsSeen(view, p)) continue;
    const bool painted = IsInside(view.mask.data[p]), masked = IsInside(mask.data[p]);
    counts.painted += painted;
    counts.kept += painted && masked;
    counts.added += masked && !painted;
  }
  return counts;
}

Image8 PaintPicture(const Image& photo, const PaintedView& view, const Mask& mask) {
  RequireSize("the paint of view " + view.name, view.mask, view.camera.camera);
  RequireSize("the mask of view " + view.name, mask, view.camera.camera);
  RequireSize("the photo of view " + view.name, photo, view.camera.camera);
  Image out(photo.width, photo.height);
  for (size_t p = 0; p < photo.NumPixels(); ++p) {
    const float* rgb = &photo.data[3 * p];
    const float gray = 0.299F * rgb[0] + 0.587F * rgb[1] + 0.114F * rgb[2];
    const Color* color =
        ColorOf(IsSeen(view, p), IsInside(view.mask.data[p]), IsInside(mask.data[p]));
    for (size_t c = 0; c < 3; ++c) {
      out.data[3 * p + c] = color ? kOpacity * (*color)[c] + (1 - kOpacity) * gray : gray;
    }
  }
  return ToImage8(out);
}

std::vector<PaintedPicture> PicturesOfPaint(OpenScene& scene,
                                            const std::vector<PaintedView>& painted,
                                            const std::map<std::string, Mask>& masks) {
  std::vector<PaintedPicture> pictures;
  for (const PaintedView& one : OnViews(scene.workspace(), painted)) {
    const auto mask = masks.find(one.name);
    const View* view = scene.reconstruction().FindView(one.name);
    if (!view || mask == masks.end()) continue;
    pictures.push_back({one.name, CountPaint(one, mask->second),
                        PaintPicture(Under(scene, *view, one.camera.camera), one, mask->second)});
  }
  scene.renderer().SetSh(scene.original().sh);
  return pictures;
}

}  // namespace retint
