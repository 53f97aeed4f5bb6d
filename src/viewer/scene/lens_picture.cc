// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/scene/lens_picture.h"

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

// The four pixels around a position in a picture, and their weights.
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

}  // namespace

LensPicture::LensPicture(std::shared_ptr<const Undistortion> lens, int width, int height)
    : lens_(std::move(lens)), width_(width), height_(height) {}

bool LensPicture::IsOf(const Undistortion* lens, int width, int height) const {
  return lens == lens_.get() && width == width_ && height == height_;
}

std::vector<PosedCamera> LensPicture::Faces(const Rigid3d& photo_from_world) const {
  std::vector<PosedCamera> cameras;
  const double scale = double(width_) / lens_->photo.width;
  for (const PinholeFace& face : lens_->faces) {
    const int width = std::max(1, int(std::lround(face.camera.width * scale)));
    const int height = std::max(1, int(std::lround(face.camera.height * scale)));
    cameras.push_back({Resized(face.camera, width, height),
                       {face.face_from_photo * photo_from_world.rotation,
                        face.face_from_photo * photo_from_world.translation}});
  }
  return cameras;
}

void LensPicture::FindTaps() const {
  const CameraProjection projection(lens_->photo);
  const double sx = double(lens_->photo.width) / width_;
  const double sy = double(lens_->photo.height) / height_;
  const bool single = lens_->faces.size() == 1;
  constexpr double kTolerance = 1.0 / 16;  // of a pixel of the face
  rows_.resize(size_t(height_));
  std::vector<float> xy;
  for (size_t f = 0; f < lens_->faces.size(); ++f) {
    const PinholeFace& face = lens_->faces[f];
    xy.assign(2 * size_t(width_) * size_t(height_), std::numeric_limits<float>::quiet_NaN());
    const auto find = [&](double x, double y) -> std::optional<Eigen::Vector2d> {
      const auto ray = projection.CamFromImg({x * sx, y * sy});
      return ray ? face.camera.ImgFromCam(face.face_from_photo * *ray) : std::nullopt;
    };
    ForSmooth<Eigen::Vector2d>(
        width_, height_, kTolerance, find, [&](int x, int y, const Eigen::Vector2d& at) {
          const bool inside = at.x() >= 0 && at.y() >= 0 && at.x() <= face.camera.width &&
                              at.y() <= face.camera.height;
          // A single face covers rays beyond it by its border. If there are several, another face
          // shows them.
          if (!single && !inside) return;
          float* out = &xy[2 * (size_t(y) * size_t(width_) + size_t(x))];
          out[0] = float(at.x()), out[1] = float(at.y());
        });
    ParallelRanges(height_, 16, [&](int64_t begin, int64_t end) {
      for (int64_t y = begin; y < end; ++y) {
        const float* at = &xy[2 * size_t(y) * size_t(width_)];
        for (int x = 0; x < width_; ++x, at += 2) {
          if (std::isnan(at[0])) continue;
          rows_[size_t(y)].push_back(
              {at[0], at[1], FaceWeight(*lens_, f, at[0], at[1]), uint16_t(x), uint16_t(f)});
        }
      }
    });
  }
  if (single) return;
  ParallelRanges(height_, 16, [&](int64_t begin, int64_t end) {
    for (int64_t y = begin; y < end; ++y) {
      std::vector<Tap>& row = rows_[size_t(y)];
      std::ranges::stable_sort(row, {}, &Tap::column);
      for (auto first = row.begin(); first != row.end();) {
        float sum = 0;
        auto last = first;
        for (; last != row.end() && last->column == first->column; ++last) sum += last->weight;
        for (; first != last; ++first) first->weight /= sum;
      }
    }
  });
}

// For each pixel with a ray, calls write(index of the pixel, sums). The sums are the weighted
// values of read(face, index of its pixel) around the place where the pixel looks, plus `start`.
// `sizes` are those of the faces' pictures.
template <size_t kChannels, typename Read, typename Write>
void LensPicture::ForPixels(const std::vector<std::array<int, 2>>& sizes, float start,
                            const Read& read, const Write& write) const {
  std::call_once(once_, [this] { FindTaps(); });
  std::vector<std::array<float, 2>> scales;
  for (size_t f = 0; f < sizes.size(); ++f) {
    const Camera& camera = lens_->faces[f].camera;
    scales.push_back(
        {float(sizes[f][0]) / float(camera.width), float(sizes[f][1]) / float(camera.height)});
  }
  ParallelRanges(height_, 16, [&](int64_t begin, int64_t end) {
    for (int64_t y = begin; y < end; ++y) {
      const std::vector<Tap>& row = rows_[size_t(y)];
      for (auto tap = row.begin(); tap != row.end();) {
        const uint16_t column = tap->column;
        std::array<float, kChannels> sums;
        sums.fill(start);
        for (; tap != row.end() && tap->column == column; ++tap) {
          const auto& [width, height] = sizes[tap->face];
          const auto& [sx, sy] = scales[tap->face];
          const Corners at = CornersAt(tap->x * sx, tap->y * sy, width, height);
          for (size_t k = 0; k < 4; ++k) {
            const std::array<float, kChannels> values = read(tap->face, at.pixels[k]);
            const float weight = tap->weight * at.weights[k];
            for (size_t c = 0; c < kChannels; ++c) sums[c] += weight * values[c];
          }
        }
        write(size_t(y) * size_t(width_) + column, sums);
      }
    }
  });
}

template <typename Array>
Array LensPicture::BentArray(const std::vector<Array>& faces) const {
  using Value = typename decltype(faces.front().data)::value_type;
  constexpr auto kChannels = size_t(Array::kChannels);
  Array bent(width_, height_);
  std::vector<std::array<int, 2>> sizes;
  for (const Array& face : faces) sizes.push_back({face.width, face.height});
  ForPixels<kChannels>(
      sizes, std::is_integral_v<Value> ? 0.5F : 0.0F,
      [&](size_t face, size_t pixel) {
        const Value* from = &faces[face].data[pixel * kChannels];
        std::array<float, kChannels> values;
        for (size_t c = 0; c < kChannels; ++c) values[c] = float(from[c]);
        return values;
      },
      [&](size_t i, const std::array<float, kChannels>& sums) {
        for (size_t c = 0; c < kChannels; ++c) bent.data[i * kChannels + c] = Value(sums[c]);
      });
  return bent;
}

Mask LensPicture::Bent(const std::vector<Mask>& faces) const { return BentArray(faces); }
Image LensPicture::Bent(const std::vector<Image>& faces) const { return BentArray(faces); }

QImage LensPicture::Bent(const std::vector<QImage>& faces) const {
  QImage bent(width_, height_, QImage::Format_RGB32);
  bent.fill(Qt::black);
  // Rows of 32-bit pixels have no padding.
  auto* to = reinterpret_cast<QRgb*>(bent.bits());
  std::vector<const QRgb*> from;
  std::vector<std::array<int, 2>> sizes;
  for (const QImage& face : faces) {
    from.push_back(reinterpret_cast<const QRgb*>(face.constBits()));
    sizes.push_back({face.width(), face.height()});
  }
  ForPixels<3>(
      sizes, 0.5F,
      [&](size_t face, size_t pixel) -> std::array<float, 3> {
        const QRgb rgb = from[face][pixel];
        return {float(qRed(rgb)), float(qGreen(rgb)), float(qBlue(rgb))};
      },
      [&](size_t i, const std::array<float, 3>& sums) {
        to[i] = qRgb(int(sums[0]), int(sums[1]), int(sums[2]));
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
