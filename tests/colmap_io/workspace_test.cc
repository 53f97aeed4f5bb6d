// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/workspace.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "colmap_io/depth_map_io.h"
#include "colmap_io/image_io.h"
#include "colmap_io/sparse.h"
#include "tests/colmap_io/tiny_model.h"
#include "tests/support/data.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::ThrowsMessage;

TEST(WorkspaceTest, FindsTheModelInEveryLayout) {
  for (const char* layout : {"sparse/0", "sparse", ".", "0"}) {
    const TempFolder folder;
    WriteReconstructionBinary(folder / layout, TinyModel());
    fs::create_directory(folder / "images");
    const Workspace workspace = Workspace::Open(folder.path());
    EXPECT_TRUE(fs::equivalent(workspace.sparse_folder, folder / layout)) << layout;
    EXPECT_EQ(workspace.image_folder, folder / "images");
    EXPECT_EQ(workspace.reconstruction.views.size(), 3u);
    EXPECT_THAT(workspace.warnings, IsEmpty());
    EXPECT_TRUE(workspace.depth_map_folder.empty());
  }
}

TEST(WorkspaceTest, PrefersSparse0AndTellsOfOtherModels) {
  const TempFolder folder;
  WriteReconstructionBinary(folder / "sparse/0", TinyModel());
  WriteReconstructionBinary(folder / "sparse/1", {});
  WriteReconstructionBinary(folder.path(), {});
  const Workspace workspace = Workspace::Open(folder.path());
  EXPECT_EQ(workspace.sparse_folder, folder / "sparse/0");
  EXPECT_THAT(workspace.warnings, ElementsAre(HasSubstr("sparse: holds several models; using 0")));
}

TEST(WorkspaceTest, SparseFolderAsRootFindsTheImagesAboveIt) {
  const TempFolder folder;
  WriteReconstructionBinary(folder / "sparse/0", TinyModel());
  fs::create_directory(folder / "images");
  for (const char* root : {"sparse/0", "sparse/0/", "sparse"}) {
    EXPECT_TRUE(fs::equivalent(Workspace::Open(folder / root).image_folder, folder / "images"))
        << root;
  }
}

TEST(WorkspaceTest, ImageFolderMayBeNamed) {
  const TempFolder folder;
  WriteReconstructionBinary(folder / "sparse/0", TinyModel());
  fs::create_directories(folder / "images_2");
  EXPECT_EQ(Workspace::Open(folder.path(), folder / "images_2").image_folder, folder / "images_2");
  EXPECT_THAT([&] { Workspace::Open(folder.path(), folder / "photos"); },
              ThrowsMessage<InputError>(HasSubstr("photos: no such folder of images")));
}

TEST(WorkspaceTest, PhotosAreNeededOnlyWhenRead) {
  const TempFolder folder;
  WriteReconstructionBinary(folder / "sparse/0", TinyModel());
  const Workspace workspace = Workspace::Open(folder.path());
  const View& view = workspace.RequireView("a.jpg");
  EXPECT_FALSE(workspace.HasPhoto(view));
  EXPECT_THAT([&] { workspace.ReadPhoto(view); },
              ThrowsMessage<InputError>(
                  AllOf(HasSubstr("images/a.jpg"), HasSubstr("No such file or directory"))));
}

TEST(WorkspaceTest, PhotosMustHaveTheirCamerasSize) {
  const TempFolder folder;
  WriteReconstructionBinary(folder / "sparse/0", TinyModel());
  // The reader goes by the content, not by the name.
  WritePng(folder / "images/a.jpg", Image8(64, 48, 51));
  WritePng(folder / "images/sub/b c.png", Image8(64, 48));
  const Workspace workspace = Workspace::Open(folder.path());
  const Image photo = workspace.ReadPhoto(workspace.RequireView("a.jpg"));
  EXPECT_EQ(photo.width, 64);
  EXPECT_EQ(photo(63, 47, 2), 0.2f);
  EXPECT_TRUE(workspace.HasPhoto(workspace.RequireView("sub/b c.png")));
  EXPECT_THAT(
      [&] { workspace.ReadPhoto(workspace.RequireView("sub/b c.png")); },
      ThrowsMessage<InputError>(HasSubstr("b c.png: photo is 64x48, its camera says 30x20")));
}

TEST(WorkspaceTest, UnknownViewsAreAnsweredWithTheNearest) {
  const TempFolder folder;
  WriteReconstructionBinary(folder / "sparse/0", TinyModel());
  const Workspace workspace = Workspace::Open(folder.path());
  EXPECT_EQ(workspace.RequireView("\xC3\xA9t\xC3\xA9.jpg").id, 10u);
  EXPECT_THAT(
      [&] { workspace.RequireView("a.jpeg"); },
      ThrowsMessage<InputError>(HasSubstr("no view is named \"a.jpeg\"; nearest: a.jpg, ")));
}

TEST(WorkspaceTest, DistortedViewsBecomePinholeOnes) {
  const TempFolder folder;
  Reconstruction model = TinyModel();
  // A camera that no view uses is in nobody's way, whatever its distortion.
  model.cameras[9] = {9, CameraModelId::kOpenCV, 10, 10, {1, 1, 5, 5, -99, 0, 0, 0}};
  WriteReconstructionBinary(folder / "sparse/0", model);
  Workspace pinhole = Workspace::Open(folder.path());
  EXPECT_NO_THROW(pinhole.UndistortViews());
  EXPECT_EQ(pinhole.photo_pixels, nullptr);

  model.cameras[4] = {4, CameraModelId::kSimpleRadial, 30, 20, {25, 15, 10, 0.1}};
  WriteReconstructionBinary(folder / "sparse/0", model);
  Workspace workspace = Workspace::Open(folder.path());
  workspace.UndistortViews();
  size_t distorted = 0;
  for (const auto& [id, view] : workspace.reconstruction.views) {
    EXPECT_TRUE(workspace.reconstruction.cameras.at(view.camera_id).IsPinhole());
    EXPECT_EQ(workspace.PhotoCamera(view), model.cameras.at(model.views.at(id).camera_id));
    EXPECT_EQ(view.name, model.views.at(id).name);
    distorted += workspace.PhotoOf(view) != nullptr;
  }
  EXPECT_GT(distorted, 0u);
}

TEST(WorkspaceTest, LensesThatFoldAreRefusedByName) {
  const TempFolder folder;
  Reconstruction model = TinyModel();
  model.cameras[4] = {4, CameraModelId::kSimpleRadial, 30, 20, {25, 15, 10, -9}};
  WriteReconstructionBinary(folder / "sparse/0", model);
  EXPECT_THAT([&] { Workspace::Open(folder.path()).UndistortViews(); },
              ThrowsMessage<InputError>(
                  AllOf(HasSubstr("sparse/0: camera 4 (SIMPLE_RADIAL): its distortion folds"),
                        Not(HasSubstr("\n")))));
}

TEST(WorkspaceTest, DepthMapsGeometricBeforePhotometric) {
  const TempFolder folder;
  WriteReconstructionBinary(folder / "sparse", TinyModel());
  const auto maps = folder / "stereo/depth_maps";
  WriteDepthMap(maps / "a.jpg.photometric.bin", DepthMap(64, 48, 2));
  WriteDepthMap(maps / "a.jpg.geometric.bin", DepthMap(64, 48, 1));
  WriteDepthMap(maps / "sub/b c.png.photometric.bin", DepthMap(30, 20, 3));
  const Workspace workspace = Workspace::Open(folder.path());
  EXPECT_EQ(workspace.FindDepthMap(workspace.RequireView("a.jpg")), maps / "a.jpg.geometric.bin");
  EXPECT_EQ(workspace.FindDepthMap(workspace.RequireView("sub/b c.png")),
            maps / "sub/b c.png.photometric.bin");
  EXPECT_EQ(workspace.FindDepthMap(workspace.reconstruction.views.at(10)), std::nullopt);
}

TEST(WorkspaceTest, BadRootsAreRefused) {
  const TempFolder folder;
  WriteFile(folder / "file", "x");
  EXPECT_THAT([&] { Workspace::Open(folder / "none"); },
              ThrowsMessage<InputError>(HasSubstr("none: no such folder")));
  EXPECT_THAT([&] { Workspace::Open(folder / "file"); },
              ThrowsMessage<InputError>(HasSubstr("file: is not a folder")));
  EXPECT_THAT([&] { Workspace::Open(folder.path()); },
              ThrowsMessage<InputError>(HasSubstr("holds no COLMAP model")));
  WriteReconstructionBinary(folder / "sparse/0", {});
  EXPECT_THAT([&] { Workspace::Open(folder.path()); },
              ThrowsMessage<InputError>(HasSubstr("the model has no usable view")));
  Reconstruction no_cameras = TinyModel();
  no_cameras.cameras.clear();
  WriteReconstructionBinary(folder / "sparse/0", no_cameras);
  EXPECT_THAT([&] { Workspace::Open(folder.path()); },
              ThrowsMessage<InputError>(
                  AllOf(HasSubstr("no usable view"), HasSubstr("whose camera is missing"))));
}

TEST(WorkspaceTest, RealDenseWorkspace) {
  RETINT_REQUIRE_DATA("colmap/two_views_dense");
  Workspace workspace = Workspace::Open(DataPath("colmap/two_views_dense"));
  workspace.UndistortViews();
  EXPECT_EQ(workspace.photo_pixels, nullptr);
  const View& view = workspace.RequireView("frame_0213.png");
  const Image photo = workspace.ReadPhoto(view);
  EXPECT_EQ(photo.width, 727);
  EXPECT_EQ(photo.height, 1331);
  const auto path = workspace.FindDepthMap(view);
  ASSERT_TRUE(path.has_value());
  EXPECT_THAT(path->string(), EndsWith("frame_0213.png.geometric.bin"));
  EXPECT_EQ(ReadDepthMap(*path).width, 727);
}

TEST(WorkspaceTest, RealCapturesAreComplete) {
  for (const char* name : {"fox", "flower"}) {
    RETINT_REQUIRE_DATA(name);
    Workspace workspace = Workspace::Open(DataPath(name));
    EXPECT_THAT(workspace.warnings, IsEmpty());
    workspace.UndistortViews();
    EXPECT_EQ(workspace.photo_pixels, nullptr);
    for (const auto& [id, view] : workspace.reconstruction.views) {
      EXPECT_TRUE(workspace.HasPhoto(view)) << view.name;
    }
    EXPECT_FALSE(workspace.ReadPhoto(workspace.reconstruction.views.begin()->second).Empty());
  }
}

}  // namespace
}  // namespace retint
