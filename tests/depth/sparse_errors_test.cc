// SPDX-License-Identifier: BSD-3-Clause
#include "depth/sparse_errors.h"

#include <gtest/gtest.h>

#include "base/error.h"

namespace retint {
namespace {

// Eleven points at depths 1 to 11, each in a pixel of its own, seen by a camera that is moved and
// turned; one more point is seen by nobody.
class SparseErrorsTest : public testing::Test {
 protected:
  SparseErrorsTest() {
    model_.cameras[1] = Camera::Pinhole(1, 24, 8, 20, 20, 12, 4);
    View& view = model_.views[1];
    view.id = 1;
    view.name = "a.png";
    view.camera_id = 1;
    view.cam_from_world.rotation =
        Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()));
    view.cam_from_world.translation = {0.5, -1, 2};
    const PosedCamera camera = model_.Posed(view);
    for (int k = 0; k <= 10; ++k) {
      const Eigen::Vector2d pixel(2 * k + 1.5, 3.5);
      model_.points[PointId(k)].xyz = camera.Unproject(pixel, k + 1);
      view.observations.push_back({pixel, PointId(k)});
    }
    model_.points[99].xyz = camera.Unproject({1.5, 6.5}, 5);
    view.observations.push_back({{1.5, 6.5}, kInvalidPointId});
  }
  const View& view() const { return model_.views.at(1); }
  Reconstruction model_;
};

TEST_F(SparseErrorsTest, MeasuresMedianAndNinetyPercent) {
  // The k-th point is too far by k percent: of eleven, the sixth is the median, the tenth the 90 %.
  DepthMap depth(24, 8, 0.0f);
  for (int k = 0; k <= 10; ++k) depth(2 * k + 1, 3) = float(k + 1) * (1 + 0.01f * float(k));
  const SparseErrors errors = CompareWithSparse(depth, model_, view());
  EXPECT_EQ(errors.points, 11u);
  EXPECT_EQ(errors.compared, 11u);
  // Depths are floats of at most 12.1: relative 6e-8, and 1e-6 in the workspace's unit.
  EXPECT_NEAR(errors.median, 0.05, 1e-6);
  EXPECT_NEAR(errors.ninety, 0.09, 1e-6);
  EXPECT_NEAR(errors.bias, 0.05, 1e-6);
  EXPECT_NEAR(errors.median_length, 6 * 0.05, 1e-5);
  EXPECT_NEAR(errors.ninety_length, 10 * 0.09, 1e-5);
}

TEST_F(SparseErrorsTest, KnowsWhichSideIsWrongAndWhatIsUnknown) {
  DepthMap depth(24, 8, 0.0f);
  for (int k = 0; k <= 10; ++k) depth(2 * k + 1, 3) = k < 4 ? 0 : 0.9f * float(k + 1);
  const SparseErrors errors = CompareWithSparse(depth, model_, view());
  EXPECT_EQ(errors.points, 11u);
  EXPECT_EQ(errors.compared, 7u);
  EXPECT_NEAR(errors.median, 0.1, 1e-6);
  EXPECT_NEAR(errors.bias, -0.1, 1e-6) << "nearer than the points";
}

TEST_F(SparseErrorsTest, LeavesOutWhatTheImageDoesNotShow) {
  Reconstruction& model = model_;
  model.points.at(0).xyz = model.Posed(view()).Unproject({-3, 3.5}, 1);    // beside the image
  model.points.at(1).xyz = model.Posed(view()).Unproject({3.5, 3.5}, -2);  // behind the camera
  const SparseErrors errors = CompareWithSparse(DepthMap(24, 8, 1.0f), model, view());
  EXPECT_EQ(errors.points, 9u);
  model.views.at(1).observations.clear();
  const SparseErrors none = CompareWithSparse(DepthMap(24, 8, 1.0f), model, view());
  EXPECT_EQ(none.points, 0u);
  EXPECT_EQ(none.median, 0);
  EXPECT_THROW(CompareWithSparse(DepthMap(8, 24, 1.0f), model, view()), OptionError);
}

}  // namespace
}  // namespace retint
