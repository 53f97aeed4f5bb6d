// SPDX-License-Identifier: BSD-3-Clause
// The picture of a distorted camera, on the screen: made from that of the one pinhole view that
// shows all of its photo, which can be rendered.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

#include <QImage>

#include "scene/camera.h"
#include "scene/image.h"
#include "scene/undistortion.h"

namespace retint {

class LensPicture {
 public:
  // Of `width` x `height` pixels; `lens` has one face. Where its pixels look is found when it is
  // first needed; any thread may ask.
  LensPicture(std::shared_ptr<const Undistortion> lens, int width, int height);
  bool IsOf(const Undistortion* lens, int width, int height) const;

  // What to render, of the photo that was taken there: as large as the picture has use for.
  PosedCamera Face(const Rigid3d& photo_from_world) const;
  // The picture of that, which may have been rendered at another scale: bilinear, 0 and black where
  // no ray leads.
  QImage Bent(const QImage& face) const;  // RGB32
  Mask Bent(const Mask& face) const;
  Image Bent(const Image& face) const;

 private:
  template <typename Array>
  Array BentArray(const Array& face) const;
  const PixelMap& Map() const;

  std::shared_ptr<const Undistortion> lens_;
  mutable std::once_flag once_;
  mutable PixelMap map_;  // in the pixels of the lens's face
};

// The few newest of them.
class LensPictures {
 public:
  std::shared_ptr<const LensPicture> Get(const std::shared_ptr<const Undistortion>& lens, int width,
                                         int height);

 private:
  std::mutex mutex_;
  std::vector<std::shared_ptr<const LensPicture>> pictures_;  // newest last
};

}  // namespace retint
