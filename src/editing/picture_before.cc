// SPDX-License-Identifier: BSD-3-Clause
#include "editing/picture_before.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "opening/picture_likeness.h"
#include "scene/contact_sheet.h"

namespace retint {
namespace {

// As a file of 8 bits holds it.
void Round8(Image& image) {
  for (float& value : image.data) {
    value = std::round(std::clamp(value, 0.0F, 1.0F) * 255) / 255;
  }
}

// The view's render as it comes out of the file of 8 bits that the picture was: one in a photo's
// pixels is resampled twice, and so is this.
Image RenderBefore(const EditedPicture& picture, const View& view, OpenScene& scene,
                   std::span<const float> sh) {
  if (!picture.of_photo) {
    Image render = scene.Render(view, sh);
    Round8(render);
    return render;
  }
  const PhotoPixels& pixels = *scene.workspace().photo_pixels;
  const DistortedPhoto& photo = *scene.workspace().PhotoOf(view);
  std::vector<Image> faces;
  for (const ViewId face : photo.faces) {
    faces.push_back(scene.Render(scene.reconstruction().views.at(face), sh));
  }
  Image whole = pixels.ToPhoto(photo, faces);
  Round8(whole);
  Image render = pixels.ToView(view.id, whole);
  Round8(render);
  return render;
}

}  // namespace

Image ViewBefore(const EditedPicture& picture, OpenScene& scene, std::span<const float> sh) {
  const View& view = scene.workspace().RequireView(picture.view);
  Image render = RenderBefore(picture, view, scene, sh);
  if (!scene.workspace().HasPhoto(view)) return render;
  Image photo = scene.workspace().ReadPhoto(view);
  return MeanDifference(picture.image, photo) < MeanDifference(picture.image, render)
             ? std::move(photo)
             : std::move(render);
}

Image BeforePicture(const EditedPicture& picture, const ColorEdit& before, const Mask& share,
                    OpenScene& scene, std::span<const float> sh) {
  if (!picture.before.Empty()) return ToImage(picture.before);
  Image view = ViewBefore(picture, scene, sh);
  if (before.operations.empty()) return view;
  const CompiledEdit compiled(before);
  for (size_t p = 0; p < share.data.size(); ++p) {
    if (share.data[p] == 0) continue;
    const Eigen::Vector3f color =
        compiled.Apply(Eigen::Vector3f(&view.data[3 * p]), float(share.data[p]) / 255);
    std::copy_n(color.data(), 3, &view.data[3 * p]);
  }
  return view;
}

}  // namespace retint
