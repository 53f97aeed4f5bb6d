// SPDX-License-Identifier: BSD-3-Clause
// Paint on pictures of some views, carried to all views.
#pragma once

#include <memory>
#include <vector>

#include "recolor/gaussian_paint.h"
#include "recolor/painted_edit.h"
#include "render/renderer.h"
#include "scene/camera.h"
#include "scene/gaussian_model.h"
#include "scene/image.h"

namespace retint {

// A view's target under an edit with painted layers (ColorEdit::HasPaint()). A painted view shows
// its picture, and beside it the layers of others. The surface in a pixel of another view is
// looked up in the painted views by its depth. If one of them sees the same surface, within 2 %
// of the depth and not at a grazing angle, the pixel gets the color painted there. That is
// averaged over the pixel's footprint in the painted picture. It is multiplied by the ratio of
// the surface's luminance in this view to that in the painted one (linear light, mean of some
// pixels), so that highlights move with the viewer. Several are merged by the squared cosine of
// the angle at which the painted views see the surface. If depth is too rough for that, as on
// fur, the pixel gets the color of the Gaussians that it shows (FindGaussianPaint), if most of it
// is painted. Everything else gets the rest of the edit, whose picture operation is then its
// color map.
//
// Uses one renderer from one thread. The first call for a renderer fixes the look of the painted
// views: later ones must find the same coefficients in it.
class PaintCarrier {
 public:
  // `cameras`: of the views of the edit's layers, in their order, else OptionError. `model`: the
  // renderers'; it must outlive this. `paint`: FindGaussianPaint() of the layers, where it is
  // known.
  PaintCarrier(const ColorEdit& edit, std::vector<PosedCamera> cameras, const GaussianModel& model,
               std::shared_ptr<const GaussianPaint> paint = nullptr);
  ~PaintCarrier();

  // The target of a view: y + M (edited(y) - y) of `photo`, or where null of the render. `mask` and
  // `photo` have the view's size. `leaves` as RefitTarget::edited has it.
  Image Target(Renderer& renderer, const PosedCamera& view, const Mask& mask, const Image* photo,
               Mask* leaves = nullptr);

 private:
  struct Source;
  struct Carried;
  struct Blended;
  struct Shown;
  void Prepare(Renderer& renderer);
  Blended BlendPaint(Renderer& renderer, const PosedCamera& view) const;
  void Carry(size_t k, const Shown& shown, Carried& carried) const;

  PaintedEdit edit_, unclipped_;
  std::vector<Source> sources_;
  const GaussianModel& model_;
  std::shared_ptr<const GaussianPaint> paint_;
  bool prepared_ = false;
  std::vector<float> of_gaussians_;  // [N, 4] color times cover, and cover; once prepared
};

}  // namespace retint
