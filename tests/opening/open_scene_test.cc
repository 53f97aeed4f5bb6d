// SPDX-License-Identifier: BSD-3-Clause
#include "opening/open_scene.h"

#include <gtest/gtest.h>

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "opening/find_splat.h"
#include "reporting/export.h"
#include "tests/saving/saved_scene.h"
#include "tests/support/data.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

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
  WriteFile(temp / "chair.usda", "");
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

TEST(OpenScene, NoOutputReplacesWhatItIsMadeOf) {
  TempFolder temp;
  const TinyScene tiny(7);
  WriteTinyScene(tiny, temp.path());
  const auto folder = temp / "ws";
  const auto photo = folder / "images" / ViewName(0);
  WritePng(photo, Image8(tiny.cameras[0].camera.width, tiny.cameras[0].camera.height));
  const auto session = OpenTinyScene(temp.path());
  Monitor monitor;
  for (const auto& input : {photo, folder / "sparse/0/cameras.bin", folder / "sparse/0/images.bin",
                            folder / "splat.ply"}) {
    const std::string bytes = ReadFile(input);
    EXPECT_THROW(WriteFile(input, "{}"), OptionError) << input;
    EXPECT_EQ(ReadFile(input), bytes);
  }
  const auto shown = ViewFile(folder / "views", ViewName(0));
  fs::create_directories(shown.parent_path());
  fs::create_symlink(photo, shown);
  EXPECT_THROW(ExportViews(*session, session->scene().reconstruction().ViewsByName(),
                           session->refits().CurrentSh(), folder / "views", monitor),
               OptionError);
  EXPECT_THROW(ExportFrames(*session, {tiny.cameras[0]}, session->refits().CurrentSh(),
                            temp / "frames", monitor, {photo}),
               OptionError)
      << "the photo would go with the frames of an earlier film";
  EXPECT_TRUE(IsFile(photo));
  // A splat may take the place of the splat, and a new file any other place.
  session->WriteSplat(folder / "splat.ply", monitor);
  WriteSplat(folder / "splat.ply", tiny.model);
  WriteFile(folder / "report.json", "{}");
}

}  // namespace
}  // namespace retint
