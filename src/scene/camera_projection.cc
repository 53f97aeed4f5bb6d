// SPDX-License-Identifier: BSD-3-Clause
#include "scene/camera_projection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include <Eigen/LU>

#include "base/error.h"

namespace retint {
namespace {

constexpr double kPi = std::numbers::pi;
// Perspective models end here, in degrees from the axis: a pinhole picture of more does not exist.
constexpr double kWidestPerspective = 89.9;

struct Focals {
  int count;                                        // 1: f, cx, cy; 2: fx, fy, cx, cy
  int Bends() const { return count == 1 ? 3 : 4; }  // index of the first parameter after them
};

Focals FocalsOf(CameraModelId model) {
  switch (model) {
    case CameraModelId::kSimplePinhole:
    case CameraModelId::kSimpleRadial:
    case CameraModelId::kRadial:
    case CameraModelId::kSimpleRadialFisheye:
    case CameraModelId::kRadialFisheye:
    case CameraModelId::kSimpleDivision:
    case CameraModelId::kSimpleFisheye:
      return {1};
    default:
      return {2};
  }
}

void CheckCamera(const Camera& camera) {
  const CameraModelInfo* info = FindCameraModel(static_cast<int>(camera.model));
  if (!info) throw InputError("its model is unknown");
  if (camera.params.size() != static_cast<size_t>(info->num_params)) {
    throw InputError(std::string(info->name) + " takes " + std::to_string(info->num_params) +
                     " parameters, not " + std::to_string(camera.params.size()));
  }
  for (const double value : camera.params) {
    if (!std::isfinite(value)) throw InputError("a parameter is not a finite number");
  }
}

// theta / rho of a point at rho from the axis, and its derivatives by rho, over rho, and by z.
struct Equidistant {
  double scale, by_rho_over_rho, by_z;
};

Equidistant EquidistantScale(double rho, double z) {
  const double squared = rho * rho + z * z;
  if (rho < 1e-4 * z) {  // the series: the next terms are below 1e-16
    const double t = rho * rho / (z * z);
    return {(1 - t / 3 + t * t / 5) / z, (-2.0 / 3 + 4 * t / 5) / (z * z * z), -1 / squared};
  }
  const double scale = std::atan2(rho, z) / rho;
  return {scale, (z / squared - scale) / (rho * rho), -1 / squared};
}

}  // namespace

CameraProjection::CameraProjection(const Camera& camera) {
  CheckCamera(camera);
  const std::vector<double>& p = camera.params;
  if (camera.model == CameraModelId::kEquirectangular) {
    kind_ = Kind::kEquirectangular;
    fx_ = p[0] / (2 * kPi), fy_ = p[1] / kPi;
    cx_ = p[0] / 2, cy_ = p[1] / 2;
  } else if (FocalsOf(camera.model).count == 1) {
    fx_ = fy_ = p[0], cx_ = p[1], cy_ = p[2];
  } else {
    fx_ = p[0], fy_ = p[1], cx_ = p[2], cy_ = p[3];
  }
  if (!(fx_ > 0 && fy_ > 0)) throw InputError("its focal length is not positive");
  ReadBends(camera);
  if (kind_ == Kind::kEucm && !(alpha_ >= 0 && alpha_ <= 1 && beta_ > 0)) {
    throw InputError("EUCM takes an alpha in [0, 1] and a positive beta");
  }
  bends_ = is_fov_ || sideways_ ||
           std::any_of(numerator_.begin(), numerator_.end(), [](double k) { return k != 0; }) ||
           std::any_of(denominator_.begin(), denominator_.end(), [](double m) { return m != 0; });
  fold_ = FoldRadius();
}

void CameraProjection::ReadBends(const Camera& camera) {
  const double* p =
      camera.params.data() +
      (camera.model == CameraModelId::kEquirectangular ? 0 : FocalsOf(camera.model).Bends());
  auto& k = numerator_;
  switch (camera.model) {
    case CameraModelId::kSimplePinhole:
    case CameraModelId::kPinhole:
    case CameraModelId::kEquirectangular:
      break;
    case CameraModelId::kSimpleFisheye:
    case CameraModelId::kFisheye:
      kind_ = Kind::kFisheye;
      break;
    case CameraModelId::kSimpleRadialFisheye:
      kind_ = Kind::kFisheye;
      [[fallthrough]];
    case CameraModelId::kSimpleRadial:
      k[0] = p[0];
      break;
    case CameraModelId::kRadialFisheye:
      kind_ = Kind::kFisheye;
      [[fallthrough]];
    case CameraModelId::kRadial:
      k[0] = p[0], k[1] = p[1];
      break;
    case CameraModelId::kOpenCV:
      k[0] = p[0], k[1] = p[1], p1_ = p[2], p2_ = p[3];
      break;
    case CameraModelId::kOpenCVFisheye:
      kind_ = Kind::kFisheye;
      std::copy_n(p, 4, k.begin());
      break;
    case CameraModelId::kFullOpenCV:
      k[0] = p[0], k[1] = p[1], p1_ = p[2], p2_ = p[3], k[2] = p[4];
      std::copy_n(p + 5, 3, denominator_.begin());
      break;
    case CameraModelId::kFov:
      is_fov_ = true;
      omega_ = p[0];
      break;
    case CameraModelId::kThinPrismFisheye:
      kind_ = Kind::kFisheye;
      k[0] = p[0], k[1] = p[1], p1_ = p[2], p2_ = p[3], k[2] = p[4], k[3] = p[5];
      prism_[0] = p[6], prism_[2] = p[7];
      break;
    case CameraModelId::kRadTanThinPrismFisheye:  // its p0 and p1 are the others' p2 and p1
      kind_ = Kind::kFisheye;
      std::copy_n(p, 6, k.begin());
      p2_ = p[6], p1_ = p[7];
      std::copy_n(p + 8, 4, prism_.begin());
      sideways_after_radial_ = true;
      break;
    case CameraModelId::kSimpleDivision:
    case CameraModelId::kDivision:
      kind_ = Kind::kDivision;
      k_ = p[0];
      break;
    case CameraModelId::kEucm:
      kind_ = Kind::kEucm;
      alpha_ = p[0], beta_ = p[1];
      break;
  }
  sideways_ = p1_ != 0 || p2_ != 0 ||
              std::any_of(prism_.begin(), prism_.end(), [](double s) { return s != 0; });
}

double CameraProjection::Radial(double s, double* by_s) const {
  if (is_fov_) {
    // atan(t r) / (w r), t = 2 tan(w / 2), both tending to a pinhole as w goes to 0.
    const double w = omega_, t = 2 * std::tan(w / 2);
    if (std::abs(w) < 1e-6) {
      *by_s = -w * w / 3;
      return 1 + w * w * (1.0 / 12 - s / 3);
    }
    const double x = t * t * s;
    if (x < 1e-6) {
      *by_s = t / w * t * t * (-1.0 / 3 + 2 * x / 5);
      return t / w * (1 - x / 3 + x * x / 5);
    }
    const double r = std::sqrt(s);
    const double atan_over_r = std::atan(t * r) / r;
    *by_s = (t / (1 + x) - atan_over_r) / (2 * w * s);
    return atan_over_r / w;
  }
  double above = 0, above_by_s = 0;
  for (size_t i = numerator_.size(); i-- > 0;) {
    above_by_s = above_by_s * s + static_cast<double>(i + 1) * numerator_[i];
    above = (above + numerator_[i]) * s;
  }
  double below = 0, below_by_s = 0;
  for (size_t i = denominator_.size(); i-- > 0;) {
    below_by_s = below_by_s * s + static_cast<double>(i + 1) * denominator_[i];
    below = (below + denominator_[i]) * s;
  }
  const double radial = (1 + above) / (1 + below);
  *by_s = (above_by_s - radial * below_by_s) / (1 + below);
  return radial;
}

double CameraProjection::Slope(double r) const {
  double by_s = 0;
  const double radial = Radial(r * r, &by_s);
  double below = 1, power = 1;
  for (const double m : denominator_) below += m * (power *= r * r);
  if (!(below > 0)) return -1;  // past a pole
  return radial + 2 * r * r * by_s;
}

double CameraProjection::FoldRadius() const {
  constexpr int kSteps = 4096;
  const bool fisheye = kind_ == Kind::kFisheye;
  const double widest = fisheye ? kPi : kWidestPerspective * kPi / 180;
  const auto radius = [&](double theta) { return fisheye ? theta : std::tan(theta); };
  if (!bends_) return radius(widest);
  for (int i = 1; i <= kSteps; ++i) {
    double high = radius(widest * i / kSteps);
    if (Slope(high) > 0) continue;
    double low = radius(widest * (i - 1) / kSteps);
    for (int halving = 0; halving < 60; ++halving) {
      const double middle = (low + high) / 2;
      (Slope(middle) > 0 ? low : high) = middle;
    }
    return low;
  }
  return radius(widest);
}

Eigen::Vector2d CameraProjection::Bend(const Vec2& plane, Mat2* by_plane) const {
  const double s = plane.squaredNorm();
  double by_s = 0;
  const double radial = Radial(s, &by_s);
  const Vec2 q = radial * plane;
  Mat2 q_by_plane = 2 * by_s * plane * plane.transpose();
  q_by_plane.diagonal().array() += radial;
  if (!sideways_) {
    *by_plane = q_by_plane;
    return q;
  }
  const Vec2 at = sideways_after_radial_ ? q : plane;
  const double a = at.x(), b = at.y(), r2 = at.squaredNorm();
  const auto& s4 = prism_;
  const Vec2 aside(2 * p1_ * a * b + p2_ * (r2 + 2 * a * a) + (s4[0] + s4[1] * r2) * r2,
                   2 * p2_ * a * b + p1_ * (r2 + 2 * b * b) + (s4[2] + s4[3] * r2) * r2);
  const double prism_x = 2 * (s4[0] + 2 * s4[1] * r2), prism_y = 2 * (s4[2] + 2 * s4[3] * r2);
  Mat2 by_at;
  by_at << 2 * p1_ * b + 6 * p2_ * a + prism_x * a, 2 * p1_ * a + 2 * p2_ * b + prism_x * b,
      2 * p2_ * b + 2 * p1_ * a + prism_y * a, 2 * p2_ * a + 6 * p1_ * b + prism_y * b;
  *by_plane = q_by_plane + (sideways_after_radial_ ? Mat2(by_at * q_by_plane) : by_at);
  return q + aside;
}

std::optional<double> CameraProjection::UnbendRadius(double bent, bool clamp) const {
  double by_s = 0;
  const double most = fold_ * Radial(fold_ * fold_, &by_s);
  if (bent >= most) return clamp ? std::optional(fold_) : std::nullopt;
  double low = 0, high = fold_, r = std::min(bent, 0.5 * fold_);
  for (int i = 0; i < 100; ++i) {  // Newton, kept inside the bracket
    const double radial = Radial(r * r, &by_s);
    const double error = r * radial - bent;
    (error > 0 ? high : low) = r;
    double next = r - error / (radial + 2 * r * r * by_s);
    if (!(next > low && next < high)) next = (low + high) / 2;
    if (std::abs(next - r) <= 1e-16 * r || next == r) return next;
    r = next;
  }
  return r;
}

std::optional<Eigen::Vector2d> CameraProjection::Unbend(const Vec2& bent) const {
  if (!bends_) return bent.norm() <= fold_ ? std::optional(bent) : std::nullopt;
  const double length = bent.norm();
  if (length == 0 && !sideways_) return bent;
  const auto radius = UnbendRadius(length, /*clamp=*/sideways_);
  if (!radius) return std::nullopt;
  Vec2 plane = length > 0 ? Vec2(bent * (*radius / length)) : Vec2::Zero();
  if (!sideways_) return plane;
  Mat2 by_plane;
  for (int i = 0; i < 50; ++i) {
    const Vec2 error = Bend(plane, &by_plane) - bent;
    if (!(by_plane.determinant() > 0)) return std::nullopt;
    const Vec2 step = by_plane.inverse() * error;
    plane -= step;
    if (!plane.allFinite() || plane.norm() > 2 * fold_) return std::nullopt;
    if (step.norm() <= 1e-15 * (1 + plane.norm())) break;
  }
  // If Newton's steps do not settle, there is nothing to find.
  const bool found = (Bend(plane, &by_plane) - bent).norm() <= 1e-12 * (1 + length) &&
                     by_plane.determinant() > 0 && plane.norm() <= fold_;
  return found ? std::optional(plane) : std::nullopt;
}

std::optional<Eigen::Vector2d> CameraProjection::PlaneFromCam(const Eigen::Vector3d& point,
                                                              Mat23* by_point) const {
  const double x = point.x(), y = point.y(), z = point.z();
  const double rho = std::hypot(x, y);
  switch (kind_) {
    case Kind::kPerspective:
      if (!(z > 0)) return std::nullopt;
      *by_point << 1 / z, 0, -x / (z * z), 0, 1 / z, -y / (z * z);
      return Vec2(x / z, y / z);
    case Kind::kFisheye: {
      if (rho == 0 && !(z > 0)) return std::nullopt;
      const Equidistant e = EquidistantScale(rho, z);
      const Vec2 xy(x, y);
      by_point->leftCols<2>() = e.by_rho_over_rho * xy * xy.transpose();
      by_point->leftCols<2>().diagonal().array() += e.scale;
      by_point->col(2) = e.by_z * xy;
      return Vec2(e.scale * xy);
    }
    case Kind::kDivision: {  // k r^2 rho - z r + rho = 0 for the radius r over rho
      const double inside = z * z - 4 * k_ * rho * rho;
      if (!(inside > 0)) return std::nullopt;
      const double root = std::sqrt(inside), sum = z + root;
      if (!(sum > 0)) return std::nullopt;
      const double scale = 2 / sum, by_sum = -2 / (sum * sum);
      const Vec2 xy(x, y);
      by_point->leftCols<2>() = by_sum * (-4 * k_ / root) * xy * xy.transpose();
      by_point->leftCols<2>().diagonal().array() += scale;
      by_point->col(2) = by_sum * (1 + z / root) * xy;
      return Vec2(scale * xy);
    }
    case Kind::kEucm: {
      const double length = std::sqrt(beta_ * rho * rho + z * z);
      const double under = alpha_ * length + (1 - alpha_) * z;
      const double widest = alpha_ > 0.5 ? (1 - alpha_) / alpha_ : alpha_ / (1 - alpha_);
      if (!(under > 0 && z > -widest * length)) return std::nullopt;
      const Eigen::Vector3d under_by(alpha_ * beta_ * x / length, alpha_ * beta_ * y / length,
                                     alpha_ * z / length + 1 - alpha_);
      const Vec2 plane(x / under, y / under);
      *by_point = -plane * under_by.transpose() / under;
      by_point->leftCols<2>().diagonal().array() += 1 / under;
      return plane;
    }
    case Kind::kEquirectangular: {  // longitude and latitude, x right, y down
      const double across2 = x * x + z * z, across = std::sqrt(across2), n2 = across2 + y * y;
      if (!(across > 0)) return std::nullopt;
      *by_point << z / across2, 0, -x / across2, -x * y / (across * n2), across / n2,
          -z * y / (across * n2);
      return Vec2(std::atan2(x, z), std::atan2(y, across));
    }
  }
  return std::nullopt;
}

std::optional<Eigen::Vector3d> CameraProjection::CamFromPlane(const Vec2& plane) const {
  const double s = plane.squaredNorm();
  switch (kind_) {
    case Kind::kPerspective:
      return Eigen::Vector3d(plane.x(), plane.y(), 1).normalized();
    case Kind::kFisheye: {
      const double theta = std::sqrt(s);
      const double sinc = theta > 1e-8 ? std::sin(theta) / theta : 1;
      return Eigen::Vector3d(plane.x() * sinc, plane.y() * sinc, std::cos(theta));
    }
    case Kind::kDivision:
      if (!(k_ * s < 1)) return std::nullopt;  // beyond the fold
      return Eigen::Vector3d(plane.x(), plane.y(), 1 + k_ * s).normalized();
    case Kind::kEucm: {
      const double inside = 1 - (2 * alpha_ - 1) * beta_ * s;
      if (!(inside > 0)) return std::nullopt;
      const double z =
          (1 - alpha_ * alpha_ * beta_ * s) / (alpha_ * std::sqrt(inside) + (1 - alpha_));
      return Eigen::Vector3d(plane.x(), plane.y(), z).normalized();
    }
    case Kind::kEquirectangular: {
      if (!(std::abs(plane.x()) <= kPi && std::abs(plane.y()) < kPi / 2)) return std::nullopt;
      const double across = std::cos(plane.y());
      return Eigen::Vector3d(across * std::sin(plane.x()), std::sin(plane.y()),
                             across * std::cos(plane.x()));
    }
  }
  return std::nullopt;
}

std::optional<Eigen::Vector2d> CameraProjection::ImgFromCam(const Eigen::Vector3d& point_in_cam,
                                                            Mat23* by_point) const {
  Mat23 jacobian;
  auto plane = PlaneFromCam(point_in_cam, &jacobian);
  if (!plane) return std::nullopt;
  if (kind_ == Kind::kPerspective || kind_ == Kind::kFisheye) {
    if (!(plane->squaredNorm() <= fold_ * fold_)) return std::nullopt;
    if (bends_) {
      Mat2 by_plane;
      plane = Bend(*plane, &by_plane);
      if (!(by_plane.determinant() > 0)) return std::nullopt;
      jacobian = by_plane * jacobian;
    }
  }
  if (by_point) *by_point = Vec2(fx_, fy_).asDiagonal() * jacobian;
  return Vec2(fx_ * plane->x() + cx_, fy_ * plane->y() + cy_);
}

std::optional<Eigen::Vector3d> CameraProjection::CamFromImg(
    const Eigen::Vector2d& pixel, Eigen::Matrix<double, 3, 2>* by_pixel) const {
  Vec2 plane((pixel.x() - cx_) / fx_, (pixel.y() - cy_) / fy_);
  if (kind_ == Kind::kPerspective || kind_ == Kind::kFisheye) {
    const auto flat = Unbend(plane);
    if (!flat) return std::nullopt;
    plane = *flat;
  }
  const auto ray = CamFromPlane(plane);
  if (!ray || !by_pixel) return ray;
  // d pixel = J d ray, and a ray of unit length moves across itself.
  Mat23 by_point;
  if (!ImgFromCam(*ray, &by_point)) return std::nullopt;
  Eigen::Matrix3d system;
  system << by_point, ray->transpose();
  *by_pixel = system.inverse().leftCols<2>();
  return ray;
}

Camera Resized(const Camera& camera, int width, int height) {
  const double sx = double(width) / camera.width, sy = double(height) / camera.height;
  if (camera.IsPinhole()) {
    return Camera::Pinhole(camera.id, width, height, camera.fx() * sx, camera.fy() * sy,
                           camera.cx() * sx, camera.cy() * sy);
  }
  Camera resized = camera;
  resized.width = width, resized.height = height;
  std::vector<double>& p = resized.params;
  if (camera.model == CameraModelId::kEquirectangular) {
    p[0] *= sx, p[1] *= sy;
  } else if (FocalsOf(camera.model).count == 1) {
    p[0] *= (sx + sy) / 2, p[1] *= sx, p[2] *= sy;
  } else {
    p[0] *= sx, p[1] *= sy, p[2] *= sx, p[3] *= sy;
  }
  return resized;
}

Camera WithoutZeroDistortion(const Camera& camera) {
  switch (camera.model) {
    case CameraModelId::kSimpleRadial:
    case CameraModelId::kRadial:
    case CameraModelId::kOpenCV:
    case CameraModelId::kFullOpenCV:
    case CameraModelId::kFov:
    case CameraModelId::kSimpleDivision:
    case CameraModelId::kDivision:
      break;
    default:
      return camera;
  }
  const Focals focals = FocalsOf(camera.model);
  const std::vector<double>& p = camera.params;
  const CameraModelInfo* info = FindCameraModel(static_cast<int>(camera.model));
  if (p.size() != static_cast<size_t>(info->num_params)) return camera;
  const bool bends =
      std::any_of(p.begin() + focals.Bends(), p.end(), [](double value) { return value != 0; });
  if (bends) return camera;
  const size_t at = focals.count == 1 ? 0 : 1;
  return Camera::Pinhole(camera.id, camera.width, camera.height, p[0], p[at], p[at + 1], p[at + 2]);
}

Camera Flattened(const Camera& camera) {
  if (camera.IsPinhole()) return camera;
  Eigen::Matrix<double, 2, 3> by_point;
  const auto middle =
      CameraProjection(camera).ImgFromCam(Eigen::Vector3d::UnitZ(), &by_point).value();
  return Camera::Pinhole(camera.id, camera.width, camera.height, by_point(0, 0), by_point(1, 1),
                         middle.x(), middle.y());
}

}  // namespace retint
