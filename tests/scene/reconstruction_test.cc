// SPDX-License-Identifier: BSD-3-Clause
#include "scene/reconstruction.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace retint {
namespace {

using ::testing::ElementsAre;

Reconstruction Model(const std::vector<std::string>& names) {
  Reconstruction model;
  model.cameras[3] = Camera::Pinhole(3, 10, 10, 100, 100, 5, 5);
  ViewId id = 40;
  for (const std::string& name : names) {
    View view;
    view.id = --id;
    view.name = name;
    view.camera_id = 3;
    view.cam_from_world.translation = {0, 0, static_cast<double>(id)};
    model.views[id] = view;
  }
  return model;
}

TEST(ReconstructionTest, FindsViewsByWholeName) {
  const Reconstruction model = Model({"a/0001.jpg", "a/0002.jpg"});
  ASSERT_NE(model.FindView("a/0002.jpg"), nullptr);
  EXPECT_EQ(model.FindView("a/0002.jpg")->id, 38u);
  EXPECT_EQ(model.FindView("0002.jpg"), nullptr);
  EXPECT_EQ(model.FindView(""), nullptr);
}

TEST(ReconstructionTest, NearestNamesFirst) {
  const Reconstruction model = Model({"0025.jpg", "0026.png", "tree.jpg", "0125.jpg"});
  // One letter off, then two, ties by name.
  EXPECT_THAT(model.NearestNames("0025.jpeg", 2), ElementsAre("0025.jpg", "0125.jpg"));
  EXPECT_THAT(model.NearestNames("0026.png", 1), ElementsAre("0026.png"));
  EXPECT_THAT(model.NearestNames("x", 9), ::testing::SizeIs(4));
  EXPECT_THAT(Model({}).NearestNames("x"), ::testing::IsEmpty());
}

TEST(ReconstructionTest, ViewsByNameAreSortedByName) {
  const Reconstruction model = Model({"b", "a", "c"});
  std::vector<std::string> names;
  for (const View* view : model.ViewsByName()) names.push_back(view->name);
  EXPECT_THAT(names, ElementsAre("a", "b", "c"));
}

TEST(ReconstructionTest, PosedJoinsCameraAndPose) {
  const Reconstruction model = Model({"a"});
  const PosedCamera posed = model.Posed(model.views.at(39));
  EXPECT_EQ(posed.camera.id, 3u);
  EXPECT_EQ(posed.Center(), Eigen::Vector3d(0, 0, -39));
}

}  // namespace
}  // namespace retint
