// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/lens_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <type_traits>
#include <utility>

#include "base/parallel.h"
#include "scene/camera_projection.h"
#include "scene/smooth_map.h"

namespace retint {
namespace {

constexpr size_t kKept = 6;

// The four pixels about a position of a picture, and their weights.
struct Corners {
  std::array<size_t, 4> pixels;
  std::array<float, 4> weights;
};

Corners CornersAt(float x, float y, int width, int height) {
  x = std::clamp(x - 0.5F, 0.0F, float(width - 1));
  y = std::clamp(y - 0.5F, 0.0F, float(height - 1));
  const int left = int(x), top = int(y);
  const int right = std::min(left + 1, width - 1), below = std::min(top + 1, height - 1);
  const float fx = x - float(left), fy = y - float(top);
  const auto at = [&](int i, int j) { return size_t(j) * size_t(width) + size_t(i); };
  return {{at(left, top), at(right, top), at(left, below), at(right, below)},
          {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy}};
}

// Calls visit(index of the pixel, corners in a picture of the face of `width` x `height`) for each
// pixel that has a ray.
template <typename Visit>
void ForMapped(const PixelMap& map, const Camera& face, int width, int height, const Visit& visit) {
  const float sx = float(width) / float(face.width), sy = float(height) / float(face.height);
  ParallelRanges(map.height, 16, [&](int64_t begin, int64_t end) {
    const auto from = size_t(begin) * size_t(map.width), to = size_t(end) * size_t(map.width);
    for (size_t i = from; i < to; ++i) {
      const float x = map.xy[2 * i], y = map.xy[2 * i + 1];
      if (!std::isnan(x)) visit(i, CornersAt(x * sx, y * sy, width, height));
    }
  });
}

}  // namespace

LensPicture::LensPicture(std::shared_ptr<const Undistortion> lens, int width, int height)
    : lens_(std::move(lens)), map_{width, height, {}} {}

bool LensPicture::IsOf(const Undistortion* lens, int width, int height) const {
  return lens == lens_.get() && width == map_.width && height == map_.height;
}

PosedCamera LensPicture::Face(const Rigid3d& photo_from_world) const {
  const PinholeFace& face = lens_->faces.front();
  const double scale = double(map_.width) / lens_->photo.width;
  const int width = std::max(1, int(std::lround(face.camera.width * scale)));
  const int height = std::max(1, int(std::lround(face.camera.height * scale)));
  return {Resized(face.camera, width, height),
          {face.face_from_photo * photo_from_world.rotation,
           face.face_from_photo * photo_from_world.translation}};
}

const PixelMap& LensPicture::Map() const {
  std::call_once(once_, [this] {
    const CameraProjection projection(lens_->photo);
    const PinholeFace& face = lens_->faces.front();
    const double sx = double(lens_->photo.width) / map_.width;
    const double sy = double(lens_->photo.height) / map_.height;
    map_.xy.assign(2 * size_t(map_.width) * size_t(map_.height),
                   std::numeric_limits<float>::quiet_NaN());
    const auto find = [&](double x, double y) -> std::optional<Eigen::Vector2d> {
      const auto ray = projection.CamFromImg({x * sx, y * sy});
      return ray ? face.camera.ImgFromCam(face.face_from_photo * *ray) : std::nullopt;
    };
    constexpr double kTolerance = 1.0 / 16;  // of a pixel of the face
    ForSmooth<Eigen::Vector2d>(
        map_.width, map_.height, kTolerance, find, [&](int x, int y, const Eigen::Vector2d& at) {
          float* out = &map_.xy[2 * (size_t(y) * size_t(map_.width) + size_t(x))];
          out[0] = float(at.x()), out[1] = float(at.y());
        });
  });
  return map_;
}

template <typename Array>
Array LensPicture::BentArray(const Array& face) const {
  using Value = typename decltype(face.data)::value_type;
  constexpr auto kChannels = size_t(Array::kChannels);
  Array bent(map_.width, map_.height);
  ForMapped(Map(), lens_->faces.front().camera, face.width, face.height,
            [&](size_t i, const Corners& at) {
              for (size_t c = 0; c < kChannels; ++c) {
                float sum = std::is_integral_v<Value> ? 0.5F : 0;
                for (size_t k = 0; k < 4; ++k) {
                  sum += at.weights[k] * float(face.data[at.pixels[k] * kChannels + c]);
                }
                bent.data[i * kChannels + c] = Value(sum);
              }
            });
  return bent;
}

Mask LensPicture::Bent(const Mask& face) const { return BentArray(face); }
Image LensPicture::Bent(const Image& face) const { return BentArray(face); }

QImage LensPicture::Bent(const QImage& face) const {
  QImage bent(map_.width, map_.height, QImage::Format_RGB32);
  bent.fill(Qt::black);
  // Rows of 32-bit pixels have no padding.
  const auto* from = reinterpret_cast<const QRgb*>(face.constBits());
  auto* to = reinterpret_cast<QRgb*>(bent.bits());
  ForMapped(Map(), lens_->faces.front().camera, face.width(), face.height(),
            [&](size_t i, const Corners& at) {
              float red = 0.5F, green = 0.5F, blue = 0.5F;
              for (size_t k = 0; k < 4; ++k) {
                const QRgb pixel = from[at.pixels[k]];
                red += at.weights[k] * float(qRed(pixel));
                green += at.weights[k] * float(qGreen(pixel));
                blue += at.weights[k] * float(qBlue(pixel));
              }
              to[i] = qRgb(int(red), int(green), int(blue));
            });
  return bent;
}

std::shared_ptr<const LensPicture> LensPictures::Get(
    const std::shared_ptr<const Undistortion>& lens, int width, int height) {
  const std::lock_guard lock(mutex_);
  const auto found = std::ranges::find_if(
      pictures_, [&](const auto& one) { return one->IsOf(lens.get(), width, height); });
  if (found != pictures_.end()) {
    std::rotate(found, found + 1, pictures_.end());
    return pictures_.back();
  }
  if (pictures_.size() == kKept) pictures_.erase(pictures_.begin());
  return pictures_.emplace_back(std::make_shared<const LensPicture>(lens, width, height));
}

}  // namespace retint
