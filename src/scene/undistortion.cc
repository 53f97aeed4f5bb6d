// SPDX-License-Identifier: BSD-3-Clause
#include "scene/undistortion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "base/error.h"
#include "scene/camera_projection.h"
#include "scene/image_checks.h"
#include "scene/smooth_map.h"

namespace retint {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kWidestHalf = 56 * kDegree;  // of a single face, from its axis
constexpr double kCubeHalf = 48 * kDegree;    // of a face of the cube: neighbors overlap by 6
constexpr double kMostScale = 1.5;            // of a face's resolution against the photo's middle
constexpr int kMostPixels = 16384;            // a face's longest side
constexpr int kSamples = 64;                  // a side of the photo, to find its field
constexpr double kSmoothPixels =
    1.0 / 4096;  // the error that a map may have between computed nodes
constexpr float kNowhere = std::numeric_limits<float>::quiet_NaN();

// The directions of a grid over the photo, borders included.
struct Field {
  std::vector<Eigen::Vector3d> rays;  // of the grid and of the fold between its nodes
  int sampled = 0, seen = 0;          // nodes, and those that have a ray
};

// The last ray on the way from a pixel that has one to one that has none.
Eigen::Vector3d RayAtFold(const CameraProjection& projection, Eigen::Vector2d with,
                          Eigen::Vector2d without) {
  constexpr int kHalvings = 30;
  Eigen::Vector3d last = projection.CamFromImg(with).value();
  for (int i = 0; i < kHalvings; ++i) {
    const Eigen::Vector2d middle = (with + without) / 2;
    const auto ray = projection.CamFromImg(middle);
    (ray ? with : without) = middle;
    if (ray) last = *ray;
  }
  return last;
}

Field SampleField(const CameraProjection& projection, const Camera& photo) {
  constexpr int kNodes = kSamples + 1;
  const auto pixel = [&](int i, int j) {
    return Eigen::Vector2d(double(i) * photo.width / kSamples, double(j) * photo.height / kSamples);
  };
  Field field;
  std::vector<bool> has_ray;
  for (int j = 0; j < kNodes; ++j) {
    for (int i = 0; i < kNodes; ++i) {
      const auto ray = projection.CamFromImg(pixel(i, j));
      ++field.sampled;
      field.seen += ray.has_value();
      has_ray.push_back(ray.has_value());
      if (ray) field.rays.push_back(*ray);
      // Near a fold rays spread fast: the field ends between two nodes.
      for (const auto& [x, y] : {std::pair(i - 1, j), std::pair(i, j - 1)}) {
        if (x < 0 || y < 0 || has_ray[size_t(y * kNodes + x)] == ray.has_value()) continue;
        field.rays.push_back(ray ? RayAtFold(projection, pixel(i, j), pixel(x, y))
                                 : RayAtFold(projection, pixel(x, y), pixel(i, j)));
      }
    }
  }
  return field;
}

// Pixels of the photo a unit of x / z and of y / z, near a ray; 0 where the lens sees nothing.
Eigen::Vector2d Resolution(const CameraProjection& projection, const Eigen::Vector3d& ray) {
  Eigen::Matrix<double, 2, 3> by_point;
  if (!(ray.z() > 0) || !projection.ImgFromCam(ray / ray.z(), &by_point)) return {0, 0};
  return {by_point.col(0).norm(), by_point.col(1).norm()};
}

// The one face that covers the whole field; nullopt for too wide a field.
std::optional<PinholeFace> OnlyFace(const CameraProjection& projection, const Field& field,
                                    Eigen::Vector2d middle) {
  const double most = std::tan(kWidestHalf);
  Eigen::AlignedBox2d box;
  Eigen::Vector2d finest = middle;
  for (const Eigen::Vector3d& ray : field.rays) {
    if (!(ray.z() > 0)) return std::nullopt;
    const Eigen::Vector2d at = ray.head<2>() / ray.z();
    if (at.cwiseAbs().maxCoeff() > most) return std::nullopt;
    box.extend(at);
    finest = finest.cwiseMax(Resolution(projection, ray));
  }
  Eigen::Vector2d focal = finest.cwiseMin(kMostScale * middle);
  const double longest = box.sizes().cwiseProduct(focal).maxCoeff();
  if (longest > kMostPixels) focal *= kMostPixels / longest;
  // Between two samples of the border the field may reach a little farther: a pixel all around.
  const int width = int(std::ceil(box.sizes().x() * focal.x())) + 2;
  const int height = int(std::ceil(box.sizes().y() * focal.y())) + 2;
  const Eigen::Vector2d principal =
      0.5 * Eigen::Vector2d(width, height) - box.center().cwiseProduct(focal);
  PinholeFace face;
  face.camera =
      Camera::Pinhole(0, width, height, focal.x(), focal.y(), principal.x(), principal.y());
  return face;
}

Eigen::Quaterniond FromRows(const Eigen::Vector3d& x, const Eigen::Vector3d& y,
                            const Eigen::Vector3d& z) {
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), y.transpose(), z.transpose();
  return Eigen::Quaterniond(rotation).normalized();
}

std::vector<PinholeFace> Cube(const Field& field, double focal) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(),
                        z = Eigen::Vector3d::UnitZ();
  focal = std::min(focal, 0.5 * kMostPixels / std::tan(kCubeHalf));
  const int half = std::max(1, int(std::ceil(focal * std::tan(kCubeHalf))));
  const Camera camera = Camera::Pinhole(0, 2 * half, 2 * half, focal, focal, half, half);
  const std::array<std::pair<const char*, Eigen::Quaterniond>, 6> sides = {
      {{"front", FromRows(x, y, z)},
       {"right", FromRows(-z, y, x)},
       {"back", FromRows(-x, y, -z)},
       {"left", FromRows(z, y, -x)},
       {"up", FromRows(x, z, -y)},
       {"down", FromRows(x, -z, y)}}};
  std::vector<PinholeFace> faces;
  for (const auto& [name, face_from_photo] : sides) {
    const bool seen = std::any_of(
        field.rays.begin(), field.rays.end(), [&, &turn = face_from_photo](const auto& ray) {
          const Eigen::Vector3d in_face = turn * ray;
          return in_face.z() > 0 && in_face.head<2>().cwiseAbs().maxCoeff() <= in_face.z();
        });
    if (seen) faces.push_back({name, camera, face_from_photo});
  }
  return faces;
}

bool InPicture(const Camera& camera, const Eigen::Vector2d& pixel) {
  return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() <= camera.width &&
         pixel.y() <= camera.height;
}

// xy of every pixel of a picture by `find(x, y)`, at the pixel's center, where that lies in `to`.
template <typename Find>
PixelMap MakeMap(int width, int height, const Camera& to, const Find& find) {
  PixelMap map{width, height, std::vector<float>(2 * size_t(width) * size_t(height), kNowhere)};
  ForSmooth<Eigen::Vector2d>(width, height, kSmoothPixels, find,
                             [&](int x, int y, const Eigen::Vector2d& at) {
                               if (!InPicture(to, at)) return;
                               float* out = &map.xy[2 * (size_t(y) * size_t(width) + size_t(x))];
                               out[0] = float(at.x());
                               out[1] = float(at.y());
                             });
  return map;
}

std::optional<Eigen::Vector2d> SeenInFace(const PinholeFace& face, const Eigen::Vector3d& ray) {
  const auto pixel = face.camera.ImgFromCam(face.face_from_photo * ray);
  return pixel && InPicture(face.camera, *pixel) ? pixel : std::nullopt;
}

}  // namespace

Undistortion Undistort(const Camera& photo) {
  const CameraProjection projection(photo);
  const Field field = SampleField(projection, photo);
  if (3 * field.seen < field.sampled) {
    const int share = 100 * field.seen / field.sampled;
    throw InputError("its distortion folds the picture: only " + std::to_string(share) +
                     " % of the photo's pixels have a ray");
  }
  Undistortion undistortion;
  undistortion.photo = photo;
  Eigen::Vector2d middle = Resolution(projection, Eigen::Vector3d::UnitZ());
  if (!(middle.minCoeff() > 0)) throw InputError("its distortion folds the picture in its middle");
  if (auto only = OnlyFace(projection, field, middle)) {
    undistortion.faces.push_back(std::move(*only));
  } else {
    undistortion.faces = Cube(field, std::sqrt(middle.x() * middle.y()));
  }
  return undistortion;
}

std::string DescribeCamera(const Camera& camera) {
  const CameraModelInfo* info = FindCameraModel(static_cast<int>(camera.model));
  const std::string text =
      std::string(info ? info->name : "unknown") + " " + SizeText(camera.width, camera.height);
  if (WithoutZeroDistortion(camera).IsPinhole()) return text;
  try {
    const Undistortion lens = Undistort(camera);
    const Camera& face = lens.faces.front().camera;
    const std::string size = SizeText(face.width, face.height);
    if (lens.faces.size() == 1) return text + ", undistorted to " + size;
    return text + ", shown as " + std::to_string(lens.faces.size()) + " pinhole views of " + size;
  } catch (const InputError& error) {
    return text + ", cannot be shown: " + error.what();
  }
}

PixelMap PhotoFromFace(const Undistortion& undistortion, size_t face) {
  const Camera& camera = undistortion.faces.at(face).camera;
  return PhotoFromFace(undistortion, face, camera.width, camera.height);
}

PixelMap PhotoFromFace(const Undistortion& undistortion, size_t face, int width, int height) {
  const PinholeFace& from = undistortion.faces.at(face);
  const CameraProjection projection(undistortion.photo);
  const Eigen::Matrix3d photo_from_face =
      from.face_from_photo.conjugate().toRotationMatrix() * from.camera.K().inverse();
  const double step_x = double(from.camera.width) / width;
  const double step_y = double(from.camera.height) / height;
  return MakeMap(width, height, undistortion.photo, [&](double x, double y) {
    return projection.ImgFromCam(photo_from_face * Eigen::Vector3d(x * step_x, y * step_y, 1));
  });
}

PixelMap FaceFromPhoto(const Undistortion& undistortion, size_t face) {
  const PinholeFace& to = undistortion.faces.at(face);
  const CameraProjection projection(undistortion.photo);
  return MakeMap(undistortion.photo.width, undistortion.photo.height, to.camera,
                 [&](double x, double y) -> std::optional<Eigen::Vector2d> {
                   const auto ray = projection.CamFromImg({x, y});
                   return ray ? to.camera.ImgFromCam(to.face_from_photo * *ray) : std::nullopt;
                 });
}

int BestFace(const Undistortion& undistortion, const Eigen::Vector3d& ray, Eigen::Vector2d* pixel) {
  int best = -1;
  double most = -1;
  for (size_t i = 0; i < undistortion.faces.size(); ++i) {
    const PinholeFace& face = undistortion.faces[i];
    const double toward = (face.face_from_photo * ray).z();
    const auto found = toward > most ? SeenInFace(face, ray) : std::nullopt;
    if (!found) continue;
    best = int(i);
    most = toward;
    *pixel = *found;
  }
  return best;
}

}  // namespace retint
