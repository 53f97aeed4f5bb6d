// SPDX-License-Identifier: BSD-3-Clause
// Every camera model against its published formula, written down here once more in COLMAP's terms
// and differentiated by dual numbers.
#include "scene/camera_projection.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <ceres/jet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "base/error.h"

namespace retint {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

using Id = CameraModelId;

template <typename T>
using Pair = Eigen::Matrix<T, 2, 1>;
template <typename T>
using Triple = Eigen::Matrix<T, 3, 1>;

template <typename T>
Pair<T> Fisheye(const Triple<T>& p) {
  using std::atan2, std::sqrt;
  const T rho = sqrt(p.x() * p.x() + p.y() * p.y());
  if (rho == T(0)) return {p.x() / p.z(), p.y() / p.z()};
  const T theta = atan2(rho, p.z());
  return {theta * p.x() / rho, theta * p.y() / rho};
}

template <typename T>
Pair<T> Aside(const Pair<T>& at, double p1, double p2) {
  const T u = at.x(), v = at.y(), r2 = u * u + v * v;
  return {2.0 * p1 * u * v + p2 * (r2 + 2.0 * u * u), 2.0 * p2 * u * v + p1 * (r2 + 2.0 * v * v)};
}

template <typename T>
T Polynomial(const T& r2, const std::vector<double>& coefficients) {
  T sum(1), power(1);
  for (const double k : coefficients) sum += k * (power *= r2);
  return sum;
}

// The published projection of a model, to the plane before focal length and principal point.
template <typename T>
Pair<T> Published(Id model, const std::vector<double>& e, const Triple<T>& p) {
  using std::atan, std::sqrt, std::tan;
  const Pair<T> flat(p.x() / p.z(), p.y() / p.z());
  const Pair<T> fish = Fisheye(p);
  const T flat2 = flat.squaredNorm(), fish2 = fish.squaredNorm();
  switch (model) {
    case Id::kSimplePinhole:
    case Id::kPinhole:
      return flat;
    case Id::kSimpleRadial:
    case Id::kRadial:
      return flat * Polynomial(flat2, e);
    case Id::kOpenCV:
      return flat * Polynomial(flat2, {e[0], e[1]}) + Aside(flat, e[2], e[3]);
    case Id::kFullOpenCV:
      return flat *
                 (Polynomial(flat2, {e[0], e[1], e[4]}) / Polynomial(flat2, {e[5], e[6], e[7]})) +
             Aside(flat, e[2], e[3]);
    case Id::kFov: {
      const T r = sqrt(flat2);
      return flat * (atan(r * 2.0 * tan(e[0] / 2)) / (r * e[0]));
    }
    case Id::kSimpleFisheye:
    case Id::kFisheye:
      return fish;
    case Id::kSimpleRadialFisheye:
    case Id::kRadialFisheye:
    case Id::kOpenCVFisheye:
      return fish * Polynomial(fish2, e);
    case Id::kThinPrismFisheye: {
      const Pair<T> prism(e[6] * fish2, e[7] * fish2);
      return fish * Polynomial(fish2, {e[0], e[1], e[4], e[5]}) + Aside(fish, e[2], e[3]) + prism;
    }
    case Id::kRadTanThinPrismFisheye: {
      const Pair<T> q = fish * Polynomial(fish2, {e[0], e[1], e[2], e[3], e[4], e[5]});
      const T r2 = q.squaredNorm();
      const Pair<T> prism(e[8] * r2 + e[9] * r2 * r2, e[10] * r2 + e[11] * r2 * r2);
      return q + Aside(q, e[7], e[6]) + prism;
    }
    case Id::kSimpleDivision:
    case Id::kDivision: {
      const T root = sqrt(p.z() * p.z() - 4.0 * e[0] * (p.x() * p.x() + p.y() * p.y()));
      return Pair<T>(p.x(), p.y()) * (2.0 / (p.z() + root));
    }
    case Id::kEucm: {
      const T length = sqrt(e[1] * (p.x() * p.x() + p.y() * p.y()) + p.z() * p.z());
      return Pair<T>(p.x(), p.y()) / (e[0] * length + (1 - e[0]) * p.z());
    }
    case Id::kEquirectangular:
      break;
  }
  return flat;
}

template <typename T>
Pair<T> PublishedPixel(const Camera& camera, const Triple<T>& p) {
  using std::atan2, std::sqrt;
  const std::vector<double>& c = camera.params;
  if (camera.model == Id::kEquirectangular) {
    const T theta = atan2(p.x(), p.z());
    const T phi = atan2(-p.y(), T(sqrt(p.x() * p.x() + p.z() * p.z())));
    return {(theta / (2 * std::numbers::pi) + 0.5) * c[0], (0.5 - phi / std::numbers::pi) * c[1]};
  }
  const bool one_focal = camera.model == Id::kSimplePinhole || camera.model == Id::kSimpleRadial ||
                         camera.model == Id::kRadial || camera.model == Id::kSimpleRadialFisheye ||
                         camera.model == Id::kRadialFisheye ||
                         camera.model == Id::kSimpleDivision || camera.model == Id::kSimpleFisheye;
  const size_t extra = one_focal ? 3 : 4;
  const Pair<T> plane = Published<T>(
      camera.model, std::vector<double>(c.begin() + std::ptrdiff_t(extra), c.end()), p);
  return {c[0] * plane.x() + c[extra - 2], c[extra - 3] * plane.y() + c[extra - 1]};
}

Camera Make(Id model, std::vector<double> params) {
  return {1, model, 640, 480, std::move(params)};
}

// Distortions as strong as those of real lenses, each with a field that covers the whole image.
std::vector<Camera> Lenses() {
  return {
      Make(Id::kSimplePinhole, {500, 321, 239}),
      Make(Id::kPinhole, {500, 510, 321, 239}),
      Make(Id::kSimpleRadial, {500, 321, 239, -0.18}),
      Make(Id::kSimpleRadial, {500, 321, 239, 0.4}),
      Make(Id::kRadial, {500, 321, 239, -0.3, 0.12}),
      Make(Id::kOpenCV, {500, 510, 321, 239, -0.28, 0.09, 0.001, -0.002}),
      Make(Id::kOpenCVFisheye, {284, 285, 321, 239, 0.0008, 0.031, -0.03, 0.005}),
      Make(Id::kOpenCVFisheye, {150, 151, 321, 239, 0.02, -0.004, 0.0005, 0}),
      Make(Id::kFullOpenCV, {500, 510, 321, 239, 0.2, -0.1, 0.001, -0.002, 0.02, 0.2, 0.02, 1e-3}),
      Make(Id::kFov, {400, 410, 321, 239, 0.9}),
      Make(Id::kFov, {400, 410, 321, 239, 1e-3}),
      Make(Id::kSimpleRadialFisheye, {280, 321, 239, -0.03}),
      Make(Id::kRadialFisheye, {280, 321, 239, -0.03, 0.004}),
      Make(Id::kThinPrismFisheye,
           {280, 285, 321, 239, -0.03, 0.004, 1e-3, -2e-3, 1e-4, -1e-4, 2e-3, -1e-3}),
      Make(Id::kRadTanThinPrismFisheye, {240, 241, 321, 239, -0.03, 0.01, -0.004, 1e-3, -1e-4, 1e-5,
                                         1e-3, -5e-4, 1e-3, -2e-4, -5e-4, 1e-4}),
      Make(Id::kSimpleDivision, {400, 321, 239, -0.3}),
      Make(Id::kSimpleDivision, {400, 321, 239, 0.2}),
      Make(Id::kDivision, {150, 152, 321, 239, -0.4}),  // sees behind itself
      Make(Id::kSimpleFisheye, {200, 321, 239}),
      Make(Id::kFisheye, {130, 132, 321, 239}),  // so does this one
      Make(Id::kEucm, {300, 302, 321, 239, 0.6, 1.1}),
      Make(Id::kEucm, {300, 302, 321, 239, 0.3, 0.9}),
      Make(Id::kEquirectangular, {640, 480}),
  };
}

class LensTest : public ::testing::TestWithParam<Camera> {
 protected:
  template <typename Check>
  void ForPixels(const Check& check) const {
    const Camera& camera = GetParam();
    for (double y = 0.5; y < camera.height; y += 17) {
      for (double x = 0.5; x < camera.width; x += 23) check(Eigen::Vector2d(x, y));
    }
    check(Eigen::Vector2d(321, 239));  // the principal point
    check(Eigen::Vector2d(camera.width - 0.5, camera.height - 0.5));
  }
};

TEST_P(LensTest, PixelsComeBack) {
  const CameraProjection projection(GetParam());
  ForPixels([&](const Eigen::Vector2d& pixel) {
    const auto ray = projection.CamFromImg(pixel);
    ASSERT_TRUE(ray.has_value()) << pixel.transpose();
    EXPECT_NEAR(ray->norm(), 1, 1e-14);
    const auto back = projection.ImgFromCam(3.7 * *ray);  // of any length
    ASSERT_TRUE(back.has_value()) << pixel.transpose();
    EXPECT_LT((*back - pixel).norm(), 1e-9) << pixel.transpose();
  });
}

TEST_P(LensTest, IsThePublishedFormula) {
  const CameraProjection projection(GetParam());
  ForPixels([&](const Eigen::Vector2d& pixel) {
    const Eigen::Vector3d point = 2.5 * projection.CamFromImg(pixel).value();
    const Pair<double> published = PublishedPixel<double>(GetParam(), point);
    if (!published.allFinite()) return;  // 0 / 0 of the formula on the axis itself
    // Pixels of some hundreds, from formulas of a dozen operations.
    EXPECT_LT((projection.ImgFromCam(point).value() - published).norm(), 1e-9);
  });
}

TEST_P(LensTest, ResizedShowsTheSame) {
  const CameraProjection projection(GetParam());
  const Camera small = Resized(GetParam(), 320, 240), wide = Resized(GetParam(), 1283, 961);
  EXPECT_EQ(wide.width, 1283);
  EXPECT_EQ(wide.height, 961);
  ForPixels([&](const Eigen::Vector2d& pixel) {
    const Eigen::Vector3d ray = projection.CamFromImg(pixel).value();
    const auto at = CameraProjection(small).ImgFromCam(ray);
    ASSERT_TRUE(at.has_value());
    EXPECT_LT((*at - pixel / 2).norm(), 1e-9);
    // A single focal length cannot follow two scales, which differ here by a part in 800.
    const auto odd = CameraProjection(wide).ImgFromCam(ray);
    ASSERT_TRUE(odd.has_value());
    EXPECT_LT((*odd - pixel.cwiseProduct(Eigen::Vector2d(1283 / 640.0, 961 / 480.0))).norm(), 1);
  });
}

TEST_P(LensTest, FlattenedShowsTheMiddleAsLarge) {
  if (GetParam().model == Id::kEquirectangular) return;
  const CameraProjection projection(GetParam());
  const Camera flat = Flattened(GetParam());
  ASSERT_TRUE(flat.IsPinhole());
  const Eigen::Vector3d aside(0.003, -0.002, 1);
  EXPECT_LT((projection.ImgFromCam(aside).value() - flat.ImgFromCam(aside).value()).norm(), 1e-3);
}

TEST_P(LensTest, DerivativesAreThoseOfDualNumbers) {
  using Jet = ceres::Jet<double, 3>;
  const CameraProjection projection(GetParam());
  ForPixels([&](const Eigen::Vector2d& pixel) {
    Eigen::Matrix<double, 3, 2> by_pixel;
    const Eigen::Vector3d ray = projection.CamFromImg(pixel, &by_pixel).value();
    const Eigen::Vector3d point = 2.5 * ray;
    Eigen::Matrix<double, 2, 3> by_point;
    projection.ImgFromCam(point, &by_point).value();
    if (ray.head<2>().norm() > 1e-6) {  // the formulas divide by the distance from the axis
      const Triple<Jet> dual(Jet(point.x(), 0), Jet(point.y(), 1), Jet(point.z(), 2));
      const Pair<Jet> published = PublishedPixel<Jet>(GetParam(), dual);
      for (int row = 0; row < 2; ++row) {
        EXPECT_LT((by_point.row(row) - published[row].v.transpose()).norm(), 1e-9 * by_point.norm())
            << pixel.transpose();
      }
    }
    // The inverse: a step of the ray across itself is a step of the pixel, and the other way round.
    const Eigen::Matrix2d both = 2.5 * by_point * by_pixel;
    EXPECT_LT((both - Eigen::Matrix2d::Identity()).norm(), 1e-9) << pixel.transpose();
    EXPECT_LT((ray.transpose() * by_pixel).norm(), 1e-9 * by_pixel.norm());
  });
}

INSTANTIATE_TEST_SUITE_P(All, LensTest, ::testing::ValuesIn(Lenses()), [](const auto& lens) {
  return std::to_string(lens.index) + "_" +
         std::string(FindCameraModel(static_cast<int>(lens.param.model))->name);
});

TEST(CameraProjectionTest, LensesCoverEveryModel) {
  for (int id = 0; FindCameraModel(id) != nullptr; ++id) {
    bool found = false;
    for (const Camera& camera : Lenses()) found = found || static_cast<int>(camera.model) == id;
    EXPECT_TRUE(found) << FindCameraModel(id)->name;
  }
}

TEST(CameraProjectionTest, BeyondTheFoldThereIsNothing) {
  // r (1 - 0.5 r^2) turns at r = sqrt(2 / 3), where it is 0.5443: 272.2 pixels from the center.
  const CameraProjection projection(Make(Id::kSimpleRadial, {500, 320, 240, -0.5}));
  EXPECT_TRUE(projection.CamFromImg({320 + 272, 240}).has_value());
  EXPECT_FALSE(projection.CamFromImg({320 + 273, 240}).has_value());
  EXPECT_TRUE(projection.ImgFromCam({0.81, 0, 1}).has_value());
  // The bare formula would put this ray inside the picture again.
  EXPECT_FALSE(projection.ImgFromCam({1.2, 0, 1}).has_value());
}

TEST(CameraProjectionTest, TakesOnlyRaysThatTheModelKnows) {
  EXPECT_FALSE(CameraProjection(Make(Id::kSimpleRadial, {500, 320, 240, 0}))
                   .ImgFromCam({0, 0, -1})
                   .has_value());
  const CameraProjection fisheye(Make(Id::kSimpleFisheye, {130, 320, 240}));
  const auto behind = fisheye.ImgFromCam({1, 0, -0.2});
  ASSERT_TRUE(behind.has_value());
  EXPECT_NEAR(behind->x(), 320 + 130 * std::atan2(1, -0.2), 1e-9);
  EXPECT_FALSE(fisheye.ImgFromCam({0, 0, -1}).has_value());
  const CameraProjection sphere(Make(Id::kEquirectangular, {640, 480}));
  EXPECT_FALSE(sphere.CamFromImg({-1, 240}).has_value());
  EXPECT_FALSE(sphere.CamFromImg({320, 481}).has_value());
  EXPECT_NEAR(sphere.CamFromImg({0.5, 240}).value().z(), -1, 1e-4);  // half a pixel from behind
}

TEST(CameraProjectionTest, RefusesWhatNoLensIs) {
  const auto made = [](Camera camera) { return [camera] { CameraProjection{camera}; }; };
  EXPECT_THAT(made(Make(Id::kOpenCV, {500, 500, 320, 240})),
              ThrowsMessage<InputError>(HasSubstr("OPENCV takes 8 parameters, not 4")));
  EXPECT_THAT(
      made(Make(Id::kSimpleRadial, {500, 320, 240, std::numeric_limits<double>::quiet_NaN()})),
      ThrowsMessage<InputError>(HasSubstr("not a finite number")));
  EXPECT_THAT(made(Make(Id::kOpenCVFisheye, {-300, 300, 320, 240, 0, 0, 0, 0})),
              ThrowsMessage<InputError>(HasSubstr("focal length is not positive")));
  EXPECT_THAT(made(Make(Id::kEucm, {300, 300, 320, 240, 1.5, 1})),
              ThrowsMessage<InputError>(HasSubstr("alpha in [0, 1]")));
}

}  // namespace
}  // namespace retint
