// SPDX-License-Identifier: BSD-3-Clause
// Rays to pixels and back for every camera model of COLMAP up to 4.1, with the parameters in
// COLMAP's order (src/colmap/sensor/models.h). Frames: the camera looks along +z, x right, y down;
// the center of the top-left pixel is (0.5, 0.5).
//
// Most models take a point to a plane, bend the plane, and scale it to pixels:
//   (u, v) = (x, y) / z                        perspective models
//   (u, v) = (x, y) theta / |(x, y)|           fisheye models, theta = the angle to the axis
//   q = R(r^2) (u, v),  r = |(u, v)|,  R(s) = (1 + k_1 s + ...) / (1 + m_1 s + ...)
//   bent = q + (2 p1 a b + p2 (r^2 + 2 a^2) + s0 r^2 + s1 r^4,
//               2 p2 a b + p1 (r^2 + 2 b^2) + s2 r^2 + s3 r^4)
// with (a, b) = (u, v), or q for RAD_TAN_THIN_PRISM_FISHEYE. FOV has R = atan(2 r tan(w / 2)) / (r
// w). Division models (Fitzgibbon 2001), EUCM (Khomutenko et al. 2018) and EQUIRECTANGULAR have
// closed forms of their own.
#pragma once

#include <array>
#include <optional>

#include <Eigen/Core>

#include "scene/camera.h"

namespace retint {

// A camera's intrinsics, ready to use. Immutable.
class CameraProjection {
 public:
  // InputError, without a file, for a wrong number of parameters or impossible values: not finite,
  // no positive focal length, EUCM's alpha outside [0, 1] or its beta not positive.
  explicit CameraProjection(const Camera& camera);

  // Pixel of a point that is not zero. nullopt if the model has none: behind a perspective camera,
  // or beyond the angle at which the distortion folds the picture over itself. `by_point` is the
  // derivative.
  std::optional<Eigen::Vector2d> ImgFromCam(const Eigen::Vector3d& point_in_cam,
                                            Eigen::Matrix<double, 2, 3>* by_point = nullptr) const;

  // The ray of unit length through a pixel, the inverse of the above; nullopt if no ray leads to
  // it. `by_pixel` is the derivative.
  std::optional<Eigen::Vector3d> CamFromImg(const Eigen::Vector2d& pixel,
                                            Eigen::Matrix<double, 3, 2>* by_pixel = nullptr) const;

 private:
  enum class Kind { kPerspective, kFisheye, kDivision, kEucm, kEquirectangular };
  using Vec2 = Eigen::Vector2d;
  using Mat2 = Eigen::Matrix2d;
  using Mat23 = Eigen::Matrix<double, 2, 3>;

  void ReadBends(const Camera& camera);
  // R and its derivative by s = r^2.
  double Radial(double s, double* by_s) const;
  // d (r R) / dr, which must stay positive.
  double Slope(double r) const;
  double FoldRadius() const;
  Vec2 Bend(const Vec2& plane, Mat2* by_plane) const;
  std::optional<Vec2> Unbend(const Vec2& bent) const;
  // The plane's radius whose r R is `bent`, at most the fold.
  std::optional<double> UnbendRadius(double bent, bool clamp) const;

  std::optional<Vec2> PlaneFromCam(const Eigen::Vector3d& point, Mat23* by_point) const;
  std::optional<Eigen::Vector3d> CamFromPlane(const Vec2& plane) const;

  Kind kind_ = Kind::kPerspective;
  double fx_ = 1, fy_ = 1, cx_ = 0, cy_ = 0;  // EQUIRECTANGULAR: pixels a radian, picture's middle
  std::array<double, 6> numerator_ = {};      // k
  std::array<double, 3> denominator_ = {};    // m
  double p1_ = 0, p2_ = 0;
  std::array<double, 4> prism_ = {};  // s
  bool bends_ = false;                // any of the above
  bool sideways_ = false;             // p or s
  bool sideways_after_radial_ = false;
  bool is_fov_ = false;
  double omega_ = 0;             // FOV
  double k_ = 0;                 // division models
  double alpha_ = 0, beta_ = 1;  // EUCM
  double fold_ = 0;              // radius of the plane within which Bend is one to one
};

// The camera whose pictures are these scaled to another size. Of a distorted one with a single
// focal length both axes get the mean scale.
Camera Resized(const Camera& camera, int width, int height);
// A camera whose distortion is zero throughout as the PINHOLE that it is: RealityScan writes
// FULL_OPENCV for undistorted photos. Others, fisheyes among them, stay as they are.
Camera WithoutZeroDistortion(const Camera& camera);
// The pinhole camera of the same size that shows the middle of the picture as large.
Camera Flattened(const Camera& camera);

}  // namespace retint
