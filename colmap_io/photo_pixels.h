// SPDX-License-Identifier: BSD-3-Clause
// Photos of distorted cameras beside the pinhole views that show them: carries pictures from the
// one's pixels to the other's. Lookup maps are cached. Any thread may call the const functions.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "scene/image.h"
#include "scene/reconstruction.h"
#include "scene/undistortion.h"

namespace retint {

// A photo whose pixels are not those of the views that show it.
struct DistortedPhoto {
  std::string name;  // the image's
  std::shared_ptr<const Undistortion> lens;
  std::vector<ViewId> faces;  // views of the reconstruction, in the order of lens->faces
};

class PhotoPixels {
 public:
  // Replaces every view of `model` whose camera is not pinhole by its faces, with new pinhole
  // cameras, observations and tracks. A view of a single face keeps its id and name; those of
  // several are called "<image name>@<face name>". Pinhole views keep every bit. InputError,
  // "camera 3 (OPENCV): ...", for a camera that cannot be undistorted.
  explicit PhotoPixels(Reconstruction* model);

  // By name; without the photos whose views show their own pixels.
  const std::vector<DistortedPhoto>& photos() const { return photos_; }
  // The photo that a view shows a part of, or all; null for a view that shows its own pixels.
  const DistortedPhoto* PhotoOf(ViewId view) const;
  const DistortedPhoto* FindPhoto(std::string_view name) const;

  // The view's picture of its photo, 0 where the photo does not reach: bicubic, masks bilinear. The
  // photo may be larger or smaller than its camera says.
  Image ToView(ViewId view, const Image& photo) const;
  Mask ToView(ViewId view, const Mask& photo) const;
  // 255 where the view's pixels lie in the photo, else 0.
  Mask Reach(ViewId view) const;

  // The photo's picture from one picture of each of its views: bilinear, each pixel from the faces
  // that see it, blended if they overlap; 0 for pixels without a ray.
  Image ToPhoto(const DistortedPhoto& photo, const std::vector<Image>& faces) const;
  Mask ToPhoto(const DistortedPhoto& photo, const std::vector<Mask>& faces) const;
  ScalarImage ToPhoto(const DistortedPhoto& photo, const std::vector<ScalarImage>& faces) const;
  // The nearest pixel's depth: z of the photo's camera, or distance (Undistortion).
  DepthMap DepthToPhoto(const DistortedPhoto& photo, const std::vector<DepthMap>& faces) const;

 private:
  using MapKey = std::tuple<const Undistortion*, size_t, bool>;  // face, whether of the photo
  using MapPtr = std::shared_ptr<const PixelMap>;

  void Replace(const View& view, const std::shared_ptr<const Undistortion>& lens,
               const std::vector<CameraId>& cameras, Reconstruction* model);
  MapPtr Map(const DistortedPhoto& photo, size_t face, bool of_photo) const;
  // The face that `view` is of its photo.
  std::pair<const DistortedPhoto*, size_t> FaceOf(ViewId view) const;
  template <typename Array>
  Array Compose(const DistortedPhoto& photo, const std::vector<Array>& faces) const;

  std::vector<DistortedPhoto> photos_;
  std::map<ViewId, size_t> photo_of_;
  mutable std::mutex mutex_;
  mutable std::vector<std::pair<MapKey, MapPtr>> maps_;  // newest last
};

}  // namespace retint
