// SPDX-License-Identifier: BSD-3-Clause
#include "selecting/view_mask.h"

#include <algorithm>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"
#include "opening/photo_paint.h"
#include "scene/image_checks.h"
#include "scene/mask_pixels.h"
#include "scene/photo_rays.h"
#include "selecting/network_mask.h"
#include "selection/mask_tools/scissors.h"
#include "selection/mask_tools/scribbles.h"
#include "selection/view_depth.h"

namespace retint {
namespace {

// Points beside the view would name nothing.
void CheckWithin(const ObjectPrompt& prompt, const UserPicture& picture) {
  const auto check = [&](const auto& points, const char* what) {
    for (const Eigen::Vector2d& at : points) {
      CheckOption(at.x() >= 0 && at.y() >= 0 && at.x() < picture.width && at.y() < picture.height,
                  fmt::format("{} {:g},{:g} lies outside view {}, which is {} pixels", what, at.x(),
                              at.y(), picture.name, SizeText(picture.width, picture.height)));
    }
  };
  check(prompt.inside, "the point");
  check(prompt.outside, "the point");
  if (!prompt.rectangle) return;
  check(*prompt.rectangle, "the rectangle's corner");
  const auto& [least, most] = *prompt.rectangle;
  CheckOption(((most - least).array() >= 1).all(), "the rectangle holds no pixel");
}

Mask Scribbled(SelectionPipeline& selection, const UserPicture& picture,
               const ViewMaskRequest& request, const Strokes& strokes, const ViewLayers& layers,
               Monitor& monitor, std::optional<SceneAnswer>* asked) {
  const auto& [inside, outside] = strokes;
  if (request.this_view_alone) return MaskFromScribbles(layers, inside, outside, monitor);
  Mask undecided;
  Mask mask = MaskFromScribbles(layers, inside, outside, monitor, &undecided);
  const bool any = std::any_of(undecided.data.begin(), undecided.data.end(),
                               [](uint8_t value) { return value > 0; });
  if (!any) return mask;
  auto answer = AskScene(selection, picture, mask, undecided, monitor);
  if (answer && answer->may_stand) mask = answer->mask;
  if (asked) *asked = std::move(answer);
  for (size_t p = 0; p < mask.data.size(); ++p) {  // strokes are proof
    if (IsInside(inside.data[p])) mask.data[p] = 255;
    if (!outside.Empty() && IsInside(outside.data[p])) mask.data[p] = 0;
  }
  return mask;
}

Mask Selected(SelectionPipeline& selection, const UserPicture& picture,
              const ViewMaskRequest& request, const ViewLayers& layers, Monitor& monitor,
              std::optional<SceneAnswer>* asked) {
  if (!request.mask.Empty()) return request.mask;
  if (request.network || !request.inside.Empty()) {
    Strokes strokes{request.inside, request.outside};
    if (request.network) {
      strokes = StrokesOf(*request.network, layers.color, strokes, request.prompt, monitor);
    }
    return Scribbled(selection, picture, request, strokes, layers, monitor, asked);
  }
  if (request.wand) return MagicWand(layers, *request.wand);
  if (!request.scissors.empty()) return CutOut(layers.color, request.scissors);
  return {layers.color.width, layers.color.height, 255};
}

Mask Kept(const ViewMaskRequest& request, const ViewLayers& layers, Mask mask) {
  if (request.sphere) {
    mask = Intersection(mask, InSphere(layers, request.sphere->center, request.sphere->radius));
  }
  if (request.box) mask = Intersection(mask, InBox(layers, request.box->min, request.box->max));
  if (request.like) {
    const auto rgb = ColorAt(layers, request.like->x, request.like->y);
    mask = Intersection(mask, LikeColor(layers, rgb, request.like->tolerance));
  }
  return mask;
}

}  // namespace

void ViewMaskRequest::Check() const {
  const bool outlined = network || !inside.Empty();
  const int selecting = !mask.Empty() + outlined + wand.has_value() + int(!scissors.empty());
  CheckOption(selecting <= 1,
              "select by one of a mask, strokes, a network, a wand and scissors, not by more");
  CheckOption(selecting == 1 || sphere || box || like,
              "there is nothing to select by: neither a mask, strokes, a network, a wand nor "
              "scissors, nor a "
              "sphere, a box or a color");
  CheckOption(network || prompt.Empty(), "points and a rectangle need a network");
  CheckOption(outside.Empty() || outlined, "strokes outside need strokes inside");
}

ViewLayers LayersOf(OpenScene& scene, const UserPicture& picture, std::span<const float> sh,
                    bool photo) {
  const Pictures pictures = scene.pictures();
  const Reconstruction& model = scene.reconstruction();
  scene.renderer().SetSh(sh);
  ViewLayers layers;
  layers.camera = PosedPicture(scene.workspace(), picture);
  layers.color = pictures.Compose(picture, [&](const View& face) {
    if (photo) return scene.workspace().ReadPhoto(face);
    return std::move(scene.renderer().Render(model.Posed(face)).rgb);
  });
  for (const bool median : {false, true}) {
    (median ? layers.surface : layers.depth) =
        pictures.ComposeDepth(picture, [&](const View& face) {
          return SurfaceDepth(scene.renderer(), model.Posed(face), &face, model, median);
        });
  }
  if (picture.photo) layers.rays = PhotoRays(*picture.photo->lens);
  return layers;
}

Mask MakeViewMask(SelectionPipeline& selection, const UserPicture& picture,
                  const ViewMaskRequest& request, Monitor& monitor,
                  std::optional<SceneAnswer>* asked) {
  request.Check();
  for (const Mask* drawn : {&request.mask, &request.inside, &request.outside}) {
    if (drawn->Empty()) continue;
    CheckOption(drawn->width == picture.width && drawn->height == picture.height,
                "a mask of view " + picture.name + " is " + SizeText(drawn->width, drawn->height) +
                    ", the view is " + SizeText(picture.width, picture.height));
  }
  CheckWithin(request.prompt, picture);
  const ViewLayers layers =
      LayersOf(selection.scene(), picture, selection.scene().original().sh, request.photo);
  Mask mask = Kept(request, layers, Selected(selection, picture, request, layers, monitor, asked));
  if (request.snap_edge > 0) mask = RefineEdge(layers, mask, request.snap_edge, monitor);
  if (!AnyInside(mask)) {
    throw InputError("no pixel of view " + picture.name + " is selected");
  }
  return mask;
}

}  // namespace retint
