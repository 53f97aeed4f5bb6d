// SPDX-License-Identifier: BSD-3-Clause
#include "editing/main_colors.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "base/error.h"
#include "editing/compare_pictures.h"
#include "opening/photo_paint.h"
#include "recolor/main_color.h"
#include "recolor/palette.h"
#include "scene/mask_pixels.h"
#include "selection/shrunk_view.h"

namespace retint {
namespace {

constexpr size_t kMostViews = 8;
constexpr size_t kMostPixels = 40000;  // a view

struct MaskedView {
  PosedCamera camera;
  const Mask* mask;
};

std::vector<MaskedView> SomeOf(std::vector<MaskedView> views) {
  std::erase_if(views, [](const MaskedView& view) { return !IsMeasured(*view.mask); });
  std::vector<MaskedView> some;
  for (const size_t i : ViewsMeasuredOf(views.size())) some.push_back(views[i]);
  return some;
}

std::vector<MaskedView> ViewsOf(const std::vector<PaintedView>& painted) {
  std::vector<MaskedView> views;
  for (const PaintedView& view : painted) views.push_back({view.camera, &view.mask});
  return SomeOf(std::move(views));
}

std::vector<MaskedView> ViewsOf(const std::map<std::string, Mask>& masks,
                                const Reconstruction& model) {
  std::vector<MaskedView> views;
  for (const auto& [name, mask] : masks) {
    const View* view = model.FindView(name);
    if (view) views.push_back({model.Posed(*view), &mask});
  }
  return SomeOf(std::move(views));
}

// [N, 3]
std::vector<float> PixelsOf(const std::vector<MaskedView>& views, Renderer& renderer) {
  std::vector<float> pixels;
  for (const MaskedView& view : views) {
    const std::vector<float> more = PixelsInside(view.camera, *view.mask, renderer);
    pixels.insert(pixels.end(), more.begin(), more.end());
  }
  return pixels;
}

std::vector<float> Edited(const std::vector<float>& pixels, const ColorEdit& edit) {
  const CompiledEdit compiled(edit);
  std::vector<float> edited = pixels;
  for (size_t i = 0; i < edited.size(); i += 3) {
    const Eigen::Map<Eigen::Vector3f> pixel(&edited[i]);
    const Eigen::Vector3f color = compiled.Apply(Eigen::Vector3f(pixel));
    std::copy_n(color.data(), 3, &edited[i]);
  }
  return edited;
}

void SetMainColor(ColorOperation& op, const std::vector<float>& pixels,
                  const std::vector<float>& elsewhere) {
  const auto main = FindMainColor(pixels, elsewhere);
  if (!main) throw InputError("the selection has no pixel whose color could be measured");
  std::copy(main->rgb.begin(), main->rgb.end(), op.Get("from").begin());
  op.Get("brightest")[0] = main->brightest;
}

void SetPalette(ColorOperation& op, const std::vector<float>& pixels) {
  const auto wanted = op.values.size() / kPairValues;
  const std::vector<PaletteColor> palette = FindPalette(pixels, int(wanted));
  if (palette.empty()) {
    throw InputError("the selection has no pixel whose color could be measured");
  }
  for (size_t i = 0; i < wanted; ++i) {
    float* pair = &op.values[i * kPairValues];
    if (i < palette.size()) {
      std::copy(palette[i].rgb.begin(), palette[i].rgb.end(), pair);
    } else if (pair[3] != kUnset) {
      throw InputError("palette: color " + std::to_string(i + 1) + " is to be changed, but only " +
                       std::to_string(palette.size()) + " different ones were found");
    }
  }
  op.values.resize(std::min(wanted, palette.size()) * kPairValues);
}

ColorEdit OperationsBefore(const ColorEdit& edit, size_t i) {
  return {{edit.operations.begin(), edit.operations.begin() + ptrdiff_t(i)}, 1};
}

// The measurements of an operation on the selection's pixels, after the operations before it.
// `elsewhere`: PixelsElsewhere().
void Measure(ColorOperation& op, const ColorEdit& before, const std::vector<float>& pixels,
             const std::vector<float>& elsewhere = {}) {
  const std::vector<float> edited = Edited(pixels, before);
  if (op.kind == ColorOperationKind::kPalette) {
    SetPalette(op, edited);
  } else {
    SetMainColor(op, edited, Edited(elsewhere, before));
  }
}

// Pixels of small pictures: up to eight views of a selection that was painted in a few, to see how
// bright it gets.
std::vector<float> PixelsElsewhere(const RegionSelection& selection, const Reconstruction& model,
                                   Renderer& renderer) {
  if (selection.source.painted.empty()) return {};
  std::vector<MaskedView> views = ViewsOf(selection.masks, model);
  for (MaskedView& view : views) view.camera = Shrunk(view.camera);
  return PixelsOf(views, renderer);
}

}  // namespace

std::vector<float> PixelsInside(const PosedCamera& camera, const Mask& mask, Renderer& renderer) {
  const Image image = std::move(renderer.Render(camera).rgb);
  // Of the image, which may be smaller than the mask.
  const size_t about =
      CountInside(mask) * image.NumPixels() / std::max<size_t>(1, mask.NumPixels());
  const size_t step = about / kMostPixels + 1;
  std::vector<float> pixels;
  size_t inside = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const int i = int((x + 0.5) * mask.width / image.width);
      const int j = int((y + 0.5) * mask.height / image.height);
      if (!IsInside(mask(i, j)) || inside++ % step != 0) continue;
      pixels.insert(pixels.end(), &image(x, y), &image(x, y) + 3);
    }
  }
  return pixels;
}

bool IsMeasured(const Mask& mask) { return CountInside(mask) > 0; }

std::vector<size_t> ViewsMeasuredOf(size_t count) {
  std::vector<size_t> measured(std::min(count, kMostViews));
  for (size_t i = 0; i < measured.size(); ++i) {
    measured[i] = count <= kMostViews ? i : i * count / kMostViews;
  }
  return measured;
}

std::vector<float> PixelsOfSelection(const RegionSelection& selection, const Workspace& workspace,
                                     Renderer& renderer, std::span<const float> sh) {
  renderer.SetSh(sh);
  const std::vector<PaintedView> painted = OnViews(workspace, selection.source.painted);
  return PixelsOf(
      painted.empty() ? ViewsOf(selection.masks, workspace.reconstruction) : ViewsOf(painted),
      renderer);
}

ColorEdit WithMainColors(ColorEdit edit, const RegionSelection& selection, OpenScene& scene,
                         std::span<const float> sh) {
  std::vector<float> pixels, elsewhere;
  for (size_t i = 0; i < edit.operations.size(); ++i) {
    ColorOperation& op = edit.operations[i];
    if (!op.NeedsMeasuring()) continue;
    const ColorEdit before = OperationsBefore(edit, i);
    if (op.kind == ColorOperationKind::kPicture) {
      ComparePictures(op, before, selection, scene, sh);
      continue;
    }
    if (pixels.empty()) {
      pixels = PixelsOfSelection(selection, scene.workspace(), scene.renderer(), sh);
    }
    if (op.kind == ColorOperationKind::kRecolor && elsewhere.empty()) {
      scene.renderer().SetSh(sh);
      elsewhere = PixelsElsewhere(selection, scene.reconstruction(), scene.renderer());
    }
    Measure(op, before, pixels, elsewhere);
  }
  return edit;
}

ColorEdit WithMainColors(ColorEdit edit, const std::vector<float>& pixels) {
  for (size_t i = 0; i < edit.operations.size(); ++i) {
    ColorOperation& op = edit.operations[i];
    if (op.NeedsMeasuring()) Measure(op, OperationsBefore(edit, i), pixels);
  }
  return edit;
}

}  // namespace retint
