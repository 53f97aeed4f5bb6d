// SPDX-License-Identifier: BSD-3-Clause
// The picture of a distorted camera on the screen. It is composed of pictures of the pinhole views
// of its photo, which can be rendered.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <type_traits>
#include <vector>

#include <QImage>

#include "scene/camera.h"
#include "scene/image.h"
#include "scene/undistortion.h"

namespace retint {

class LensPicture {
 public:
  // `width` x `height` pixels, at most 65535 per side. The rays of the pixels are found on first
  // use, on any thread.
  LensPicture(std::shared_ptr<const Undistortion> lens, int width, int height);
  bool IsOf(const Undistortion* lens, int width, int height) const;

  // The cameras to render for a photo with this pose: the lens's faces, at the size that the
  // picture can use.
  std::vector<PosedCamera> Faces(const Rigid3d& photo_from_world) const;
  // Composes the picture from those of the faces, at any scale: bilinear, with overlapping faces
  // blended (FaceWeight). Pixels without a ray are 0 and black.
  QImage Bent(const std::vector<QImage>& faces) const;  // RGB32
  Mask Bent(const std::vector<Mask>& faces) const;
  Image Bent(const std::vector<Image>& faces) const;

 private:
  // A sample of a face for a pixel of one row. The weights of a pixel add up to 1.
  struct Tap {
    float x, y, weight;  // x, y: pixels of the lens's face
    uint16_t column, face;
  };

  template <typename Array>
  Array BentArray(const std::vector<Array>& faces) const;
  template <size_t kChannels, typename Read, typename Write>
  void ForPixels(const std::vector<std::array<int, 2>>& sizes, float start, const Read& read,
                 const Write& write) const;
  void FindTaps() const;

  std::shared_ptr<const Undistortion> lens_;
  int width_, height_;
  mutable std::once_flag once_;
  mutable std::vector<std::vector<Tap>> rows_;  // by column, then by face
};

// The picture of `camera`, made by `draw`. With a lens, it draws the lens's faces and composes the
// picture from them; null: no lens.
template <typename Draw>
auto DrawThrough(const LensPicture* lens, const PosedCamera& camera, const Draw& draw) {
  using Picture = std::decay_t<std::invoke_result_t<const Draw&, const PosedCamera&>>;
  if (!lens) return Picture(draw(camera));
  std::vector<Picture> faces;
  for (const PosedCamera& face : lens->Faces(camera.cam_from_world)) faces.push_back(draw(face));
  return lens->Bent(faces);
}

// Keeps the newest few.
class LensPictures {
 public:
  std::shared_ptr<const LensPicture> Get(const std::shared_ptr<const Undistortion>& lens, int width,
                                         int height);

 private:
  std::mutex mutex_;
  std::vector<std::shared_ptr<const LensPicture>> pictures_;  // newest last
};

}  // namespace retint
