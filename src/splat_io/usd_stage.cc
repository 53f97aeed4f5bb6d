// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/usd_stage.h"

#include <array>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>

#include "base/error.h"
#include "base/printable.h"

namespace retint {
namespace {

constexpr std::pair<std::string_view, size_t> kArrays[] = {
    {"positions", 3},
    {"orientations", 4},
    {"scales", 3},
    {"opacities", 1},
    {"positionsh", 3},
    {"orientationsh", 4},
    {"scalesh", 3},
    {"opacitiesh", 1},
    {"radiance:sphericalHarmonicsCoefficients", 3},
    {"radiance:sphericalHarmonicsCoefficientsh", 3},
};

constexpr std::string_view kOfSplats[] = {"radiance:sphericalHarmonicsDegree",
                                          "projectionModeHint"};
constexpr std::string_view kOfAll[] = {"visibility", "xformOpOrder", "colorSpace:name"};
constexpr std::string_view kOperation = "xformOp:", kInverse = "!invert!",
                           kReset = "!resetXformStack!";

// One operation of xformOpOrder (openusd.org, UsdGeomXformable).
class Operation {
 public:
  Operation(const UsdPrim& prim, std::string_view name, const std::filesystem::path& path)
      : prim_(prim), name_(name), path_(path) {}

  Eigen::Matrix4d Matrix() const {
    const bool inverted = name_.starts_with(kInverse);
    const std::string_view attribute = inverted ? name_.substr(kInverse.size()) : name_;
    const auto found = prim_.attributes.find(attribute);
    if (found == prim_.attributes.end()) Fail("is missing");
    const UsdValue& value = found->second;
    if (value.numbers.empty())
      Fail(value.animated ? "is animated, which is not supported" : "has no value");
    std::string_view kind = attribute.substr(std::min(attribute.size(), kOperation.size()));
    kind = kind.substr(0, kind.find(':'));
    const Eigen::Matrix4d matrix = Of(kind, value.numbers);
    if (!inverted) return matrix;
    if (std::abs(matrix.determinant()) < 1e-30) Fail("cannot be inverted");
    return matrix.inverse();
  }

 private:
  [[noreturn]] void Fail(const std::string& fault) const {
    throw InputError(path_, "prim " + Printable(prim_.name.substr(0, 80)) + ": " +
                                Printable(name_.substr(0, 80)) + " " + fault);
  }

  void Expect(const std::vector<double>& numbers, size_t count) const {
    if (numbers.size() != count) Fail("is not made of " + std::to_string(count) + " numbers");
  }

  static Eigen::Matrix3d AboutAxis(int axis, double degrees) {
    return Eigen::AngleAxisd(degrees * (EIGEN_PI / 180), Eigen::Vector3d::Unit(axis))
        .toRotationMatrix();
  }

  Eigen::Matrix4d Of(std::string_view kind, const std::vector<double>& n) const {
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    auto linear = matrix.topLeftCorner<3, 3>();
    // The last letter of rotateX, scaleY, translateZ.
    const int axis = kind.empty() ? -1 : kind.back() - 'X';
    const bool of_axis = axis >= 0 && axis < 3;
    if (kind == "transform") {
      Expect(n, 16);
      matrix = Eigen::Map<const Eigen::Matrix4d>(n.data());  // rows become columns
    } else if (kind == "translate") {
      Expect(n, 3);
      matrix.topRightCorner<3, 1>() = Eigen::Vector3d(n[0], n[1], n[2]);
    } else if (kind == "scale") {
      Expect(n, 3);
      linear = Eigen::Vector3d(n[0], n[1], n[2]).asDiagonal();
    } else if (kind == "orient") {
      Expect(n, 4);
      const Eigen::Quaterniond q(n[0], n[1], n[2], n[3]);
      if (!(q.norm() > 0)) Fail("is no rotation");
      linear = q.normalized().toRotationMatrix();
    } else if (of_axis && kind.size() == 7 && kind.starts_with("rotate")) {
      Expect(n, 1);
      linear = AboutAxis(axis, n[0]);
    } else if (of_axis && kind.size() == 10 && kind.starts_with("translate")) {
      Expect(n, 1);
      matrix(axis, 3) = n[0];
    } else if (of_axis && kind.size() == 6 && kind.starts_with("scale")) {
      Expect(n, 1);
      matrix(axis, axis) = n[0];
    } else if (kind.size() == 9 && kind.starts_with("rotate")) {
      Expect(n, 3);
      Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
      for (const char letter : kind.substr(6)) {  // the first letter is the first rotation
        if (letter < 'X' || letter > 'Z') Fail("is of an unknown kind");
        turn = AboutAxis(letter - 'X', n[static_cast<size_t>(letter - 'X')]) * turn;
      }
      linear = turn;
    } else {
      Fail("is of an unknown kind");
    }
    return matrix;
  }

  const UsdPrim& prim_;
  std::string_view name_;
  const std::filesystem::path& path_;
};

}  // namespace

size_t UsdArrayComponents(std::string_view name) {
  for (const auto& [array, components] : kArrays) {
    if (name == array) return components;
  }
  return 0;
}

bool IsUsdAttribute(std::string_view type, std::string_view name) {
  if (name.starts_with(kOperation)) return true;
  for (const std::string_view one : kOfAll) {
    if (name == one) return true;
  }
  if (type != kUsdSplatType) return false;
  for (const std::string_view one : kOfSplats) {
    if (name == one) return true;
  }
  return UsdArrayComponents(name) > 0;
}

bool IsShown(const UsdStage& stage, const UsdPrim& prim) {
  for (const UsdPrim* at = &prim;; at = &stage.prims[static_cast<size_t>(at->parent)]) {
    const auto visibility = at->attributes.find("visibility");
    const bool hidden =
        visibility != at->attributes.end() && visibility->second.text == "invisible";
    if (!at->defined || !at->active || hidden) return false;
    if (at->parent < 0) return true;
  }
}

Eigen::Matrix4d StageFromPrim(const UsdStage& stage, const UsdPrim& prim,
                              const std::filesystem::path& path) {
  Eigen::Matrix4d stage_from_prim = Eigen::Matrix4d::Identity();
  for (const UsdPrim* at = &prim;; at = &stage.prims[static_cast<size_t>(at->parent)]) {
    const auto order = at->attributes.find("xformOpOrder");
    Eigen::Matrix4d local = Eigen::Matrix4d::Identity();
    bool reset = false;
    if (order != at->attributes.end()) {
      for (const std::string& name : order->second.tokens) {
        reset = reset || name == kReset;
        local = name == kReset ? Eigen::Matrix4d(Eigen::Matrix4d::Identity())
                               : Eigen::Matrix4d(local * Operation(*at, name, path).Matrix());
      }
    }
    stage_from_prim = local * stage_from_prim;
    if (reset || at->parent < 0) return stage_from_prim;
  }
}

}  // namespace retint
