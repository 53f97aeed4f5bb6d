// SPDX-License-Identifier: BSD-3-Clause
#include "session/opening/open_scene.h"

#include <gtest/gtest.h>

#include "base/files.h"
#include "tests/session/session_scene.h"
#include "tests/support/data.h"

namespace retint {
namespace {

TEST(FindSplat, TakesTheOneThatIsNamedSplat) {
  TempFolder temp;
  EXPECT_FALSE(FindSplat(temp.path()));
  WriteFile(temp / "a.ply", "");
  WriteFile(temp / "splat.ply", "");
  WriteFile(temp / "z.ply", "");
  EXPECT_EQ(FindSplat(temp.path()), temp / "splat.ply");
}

TEST(FindSplat, TakesTheOnlyOneAndNoneOfSeveral) {
  TempFolder temp;
  WriteFile(temp / "notes.txt", "");
  WriteFile(temp / "transforms.json", "");
  WriteFile(temp / "table.glb", "");
  WriteFile(temp / ".hidden.ply", "");
  WriteFile(temp / "Scene.PLY", "");
  EXPECT_EQ(FindSplat(temp.path()), temp / "Scene.PLY");
  WriteFile(temp / "other.ply", "");
  EXPECT_FALSE(FindSplat(temp.path()));
}

TEST(FindSplat, TakesTheNewestIterationThatHoldsASplat) {
  TempFolder temp;
  const auto iterations = temp / "point_cloud";
  WriteFile(iterations / "iteration_7000/point_cloud.ply", "");
  WriteFile(iterations / "iteration_30000/point_cloud.ply", "");
  WriteFile(iterations / "iteration_40000/cameras.json", "");
  WriteFile(iterations / "latest/point_cloud.ply", "");
  EXPECT_EQ(FindSplat(temp.path()), iterations / "iteration_30000/point_cloud.ply");
}

TEST(FindSplat, FindsNothingInAFolderThatIsNotThere) {
  TempFolder temp;
  EXPECT_FALSE(FindSplat(temp / "missing"));
}

TEST(OpenScene, AnotherRendererShowsTheSame) {
  const TinyScene tiny(7);
  SessionOptions options;
  options.backend = "cpu";
  options.background = {0.25F, 0.5F, 1};
  OpenScene scene(MakeWorkspace(tiny), tiny.model, options);
  const View& view = *scene.train_views()[0];
  const Image shown = scene.Render(view, scene.original().sh);
  const auto other = scene.MakeRenderer();
  EXPECT_EQ(other->Render(scene.reconstruction().Posed(view)).rgb.data, shown.data);
}

}  // namespace
}  // namespace retint
