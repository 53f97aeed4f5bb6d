// SPDX-License-Identifier: BSD-3-Clause
#include "editing/edited_photo.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "editing/compare_pictures.h"
#include "recolor/paint_carrier.h"
#include "scene/camera_projection.h"
#include "scene/image_checks.h"

namespace retint {
namespace {

const Mask* MaskOf(const Region& region, const View& view) {
  const auto found = region.selection->masks.find(view.name);
  return found == region.selection->masks.end() ? nullptr : &found->second;
}

// At another size.
template <typename Array>
Array Scaled(Array array, int width, int height) {
  if (array.width == width && array.height == height) return array;
  Array scaled(width, height);
  const int type = CV_MAKETYPE(sizeof(array.data[0]) == 1 ? CV_8U : CV_32F, Array::kChannels);
  const cv::Mat from(array.height, array.width, type, array.data.data());
  cv::Mat to(height, width, type, scaled.data.data());
  cv::resize(from, to, to.size(), 0, 0, array.width > width ? cv::INTER_AREA : cv::INTER_LINEAR);
  return scaled;
}

// The region's mask in the pixels of the picture.
Mask PictureMask(const Pictures& pictures, const Region& region, const UserPicture& picture) {
  return pictures.ComposeMask(picture, [&](const View& face) {
    if (const Mask* mask = MaskOf(region, face)) return *mask;
    const Camera& camera = pictures.CameraOf(face);
    return Mask(camera.width, camera.height);
  });
}

// By how much paint changes the views of a distorted photo, in its pixels.
Image ChangeByPaint(OpenScene& scene, const Region& region, const ColorEdit& edit,
                    const UserPicture& picture, const Image& photo) {
  return scene.pictures().Compose(picture, [&](const View& face) {
    const Image before = scene.workspace().photo_pixels->ToView(face.id, photo);
    Image change = before;
    if (const Mask* mask = MaskOf(region, face)) {
      ApplyEdit(scene, region, edit, scene.reconstruction().Posed(face), *mask, change);
    }
    for (size_t i = 0; i < change.data.size(); ++i) change.data[i] -= before.data[i];
    return change;
  });
}

}  // namespace

void ApplyEdit(OpenScene& scene, const Region& region, const ColorEdit& edit,
               const PosedCamera& camera, const Mask& mask, Image& picture) {
  if (edit.HasPaint()) {
    PaintCarrier carrier(edit, LayerCameras(edit, scene.workspace()), scene.original(),
                         region.paint);
    picture = carrier.Target(scene.renderer(), camera, mask, &picture);
    return;
  }
  const CompiledEdit compiled(edit);
  for (size_t i = 0; i < picture.NumPixels(); ++i) {
    if (mask.data[i] == 0) continue;
    Eigen::Map<Eigen::Vector3f> pixel(picture.data.data() + 3 * i);
    pixel = compiled.Apply(Eigen::Vector3f(pixel), static_cast<float>(mask.data[i]) / 255.0F);
  }
}

bool IsEdited(const RegionSet& regions, const UserPicture& picture) {
  return std::ranges::any_of(regions.regions, [&](const Region& region) {
    return region.visible && std::ranges::any_of(picture.faces, [&](const View* face) {
             const Mask* mask = MaskOf(region, *face);
             return mask && AnySet(*mask);
           });
  });
}

Image EditedPhoto(OpenScene& scene, const RegionSet& regions, const UserPicture& picture,
                  Image photo) {
  const Pictures pictures = scene.pictures();
  for (const Region& region : regions.regions) {
    if (!region.visible) continue;
    const ColorEdit edit = region.EffectiveEdit();
    const Mask mask = Scaled(PictureMask(pictures, region, picture), photo.width, photo.height);
    if (!AnySet(mask)) continue;
    if (!picture.photo || !edit.HasPaint()) {
      PosedCamera camera = scene.reconstruction().Posed(*picture.faces.front());
      camera.camera = Resized(camera.camera, photo.width, photo.height);
      ApplyEdit(scene, region, edit, camera, mask, photo);
      continue;
    }
    const Image change =
        Scaled(ChangeByPaint(scene, region, edit, picture, photo), photo.width, photo.height);
    for (size_t i = 0; i < photo.data.size(); ++i) {
      if (mask.data[i / 3] != 0) photo.data[i] += change.data[i];
    }
  }
  return photo;
}

}  // namespace retint
