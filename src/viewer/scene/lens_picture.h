// SPDX-License-Identifier: BSD-3-Clause
// The picture of a distorted camera, on the screen: made from those of the pinhole views that show
// its photo, which can be rendered.
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
  // Of `width` x `height` pixels, at most 65535 a side. Where its pixels look is found when it is
  // first needed; any thread may ask.
  LensPicture(std::shared_ptr<const Undistortion> lens, int width, int height);
  bool IsOf(const Undistortion* lens, int width, int height) const;

  // What to render, of the photo that was taken there: the lens's faces, as large as the picture
  // has use for.
  std::vector<PosedCamera> Faces(const Rigid3d& photo_from_world) const;
  // The picture of theirs, which may have been rendered at another scale: bilinear, faces that
  // overlap fade into each other (FaceWeight), 0 and black where no ray leads.
  QImage Bent(const std::vector<QImage>& faces) const;  // RGB32
  Mask Bent(const std::vector<Mask>& faces) const;
  Image Bent(const std::vector<Image>& faces) const;

 private:
  // What a pixel of one row takes from a face. The weights of a pixel add up to 1.
  struct Tap {
    float x, y, weight;  // x, y: in the pixels of the lens's face
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

// The picture of `camera`: what `draw` makes of it or, where it is shown through a lens (null: it
// is not), of the lens's faces, bent together.
template <typename Draw>
auto DrawThrough(const LensPicture* lens, const PosedCamera& camera, const Draw& draw) {
  using Picture = std::decay_t<std::invoke_result_t<const Draw&, const PosedCamera&>>;
  if (!lens) return Picture(draw(camera));
  std::vector<Picture> faces;
  for (const PosedCamera& face : lens->Faces(camera.cam_from_world)) faces.push_back(draw(face));
  return lens->Bent(faces);
}

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
