// SPDX-License-Identifier: BSD-3-Clause
// The sixteen coordinate systems of SPZ_ADOBE_coordinate_system against their names.
#include <string>
#include <string_view>

#include <gmock/gmock.h>
#include <Eigen/Geometry>

#include "kernels/common/sh.h"
#include "splat_io/compression.h"
#include "splat_io/splat_io.h"
#include "tests/splat_io/ply_text.h"
#include "tests/splat_io/random_scene.h"

namespace retint {
namespace {

// Directions of the axes: left or right, up or down, front or back.
constexpr std::string_view kSystems[] = {"LDB", "RDB", "LUB", "RUB", "LDF", "RDF", "LUF", "RUF",
                                         "LBD", "RBD", "LBU", "RBU", "LFD", "RFD", "LFU", "RFU"};

// From a system to right-down-front.
Eigen::Matrix3d FromSystem(std::string_view system) {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 3; ++i) {
    const size_t axis = std::string_view("RLDUFB").find(system[size_t(i)]);
    matrix(static_cast<int>(axis / 2), i) = axis % 2 == 0 ? 1 : -1;
  }
  return matrix;
}

Eigen::Matrix3d Covariance(const GaussianModel& model, size_t g) {
  const float* q = &model.quats_wxyz[4 * g];
  const Eigen::Matrix3d rotation =
      Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
  const Eigen::Vector3d scales =
      Eigen::Map<const Eigen::Vector3f>(&model.log_scales[3 * g]).cast<double>().array().exp();
  return rotation * scales.cwiseAbs2().asDiagonal() * rotation.transpose();
}

double Red(const GaussianModel& model, size_t g, const Eigen::Vector3d& direction) {
  double basis[16], red = 0;
  ShBasis(model.sh_degree, direction.x(), direction.y(), direction.z(), basis);
  for (size_t k = 0; k < 16; ++k) red += basis[k] * model.sh[3 * (16 * g + k)];
  return red;
}

std::string Unzipped(const std::string& packed) {
  UnsetVector<char> bytes;
  Gunzip(
      packed, 16, [](std::string_view) { return size_t{8} << 20; }, [](size_t) {}, bytes);
  return {bytes.begin(), bytes.end()};
}

TEST(SpzAxes, EverySystemIsTurnedAsItsNameSays) {
  const TempFolder folder;
  const size_t count = 4;
  WriteSplat(folder / "plain.spz", RandomScene(count, 3));
  std::string bytes = Unzipped(ReadFile(folder / "plain.spz"));
  bytes[14] = 2;
  const auto read = [&](uint32_t system) {
    SpillFile(folder / "a.spz", bytes + PlyText::Raw(uint32_t{0xADBE0003}) +
                                    PlyText::Raw(uint32_t{4}) + PlyText::Raw(system));
    return ReadSplat(folder / "a.spz");
  };
  const GaussianModel numbers = read(6);  // right-down-front, as they are in the file
  for (uint32_t system = 1; system <= 16; ++system) {
    SCOPED_TRACE(kSystems[system - 1]);
    const Eigen::Matrix3d turn = FromSystem(kSystems[system - 1]);
    GaussianModel model = read(system);
    for (size_t g = 0; g < count; ++g) {
      const Eigen::Map<const Eigen::Vector3f> mean(&model.means[3 * g]), was(&numbers.means[3 * g]);
      EXPECT_LT((mean.cast<double>() - turn * was.cast<double>()).norm(), 1e-5);
      const Eigen::Matrix3d expected = turn * Covariance(numbers, g) * turn.transpose();
      EXPECT_LT((Covariance(model, g) - expected).norm(), 1e-5 * expected.norm());
      for (const Eigen::Vector3d& direction :
           {Eigen::Vector3d(0.6, 0.48, 0.64), Eigen::Vector3d(-0.48, 0.6, -0.64)}) {
        EXPECT_NEAR(Red(model, g, turn * direction), Red(numbers, g, direction), 1e-5);
      }
    }
    // An edit goes back through the same turn; nothing else does.
    WriteSplat(folder / "b.spz", model);
    const std::string whole = ReadFile(folder / "a.spz");
    EXPECT_EQ(Unzipped(ReadFile(folder / "b.spz")), whole);
    model.sh[48 + 3 * 1] += 0.25F;
    WriteSplat(folder / "b.spz", model);
    const GaussianModel back = ReadSplat(folder / "b.spz");
    for (size_t i = 0; i < model.sh.size(); ++i) {
      // A turn gives values of every bucket, which are rounded to 16/128 of bands 2 and 3.
      EXPECT_NEAR(back.sh[i], model.sh[i], i / 48 == 1 ? 0.13 : 0) << i;
    }
  }
}

}  // namespace
}  // namespace retint
