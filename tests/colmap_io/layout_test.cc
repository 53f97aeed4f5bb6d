// SPDX-License-Identifier: BSD-3-Clause
// Workspaces as other tools leave them.
#include <clocale>
#include <cstdlib>
#include <memory>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "colmap_io/nerfstudio.h"
#include "colmap_io/sparse.h"
#include "colmap_io/workspace.h"
#include "tests/colmap_io/tiny_model.h"
#include "tests/support/data.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::ThrowsMessage;

Reconstruction WithViews(int count) {
  Reconstruction model = TinyModel();
  model.points.clear();
  View view = model.views.begin()->second;
  view.observations.clear();
  model.views.clear();
  for (int i = 0; i < count; ++i) {
    view.id = ViewId(i + 1);
    view.name = std::to_string(i) + ".png";
    model.views.emplace(view.id, view);
  }
  return model;
}

TEST(Layout, TheLargestOfSeveralModelsIsTakenUnlessOneIsNamed) {
  const TempFolder folder;
  WriteReconstructionBinary(folder / "sparse/0", WithViews(2));
  WriteReconstructionText(folder / "sparse/1", WithViews(5));
  WriteReconstructionBinary(folder / "sparse/10", WithViews(3));
  const Workspace largest = Workspace::Open(folder.path());
  EXPECT_EQ(largest.reconstruction.views.size(), 5u);
  EXPECT_THAT(largest.warnings.at(0), HasSubstr("several models; using 1"));
  for (const char* name : {"10", "sparse/10", "sparse/10/"}) {
    EXPECT_EQ(Workspace::Open(folder.path(), {}, name).reconstruction.views.size(), 3u) << name;
  }
  EXPECT_THAT([&] { Workspace::Open(folder.path(), {}, "2"); },
              ThrowsMessage<InputError>(AllOf(HasSubstr("no sparse model \"2\""),
                                              HasSubstr("sparse/1, sparse/10, sparse/0"))));
}

// COLMAP 3.12 and newer: a rig of two cameras, whose frames have two images each.
TEST(Layout, TheViewsOfFramesCountWhereImagesAreMissing) {
  const TempFolder folder;
  WriteReconstructionBinary(folder / "sparse/0", WithViews(3));
  WriteReconstructionText(folder / "sparse/1", WithViews(1));
  fs::remove(folder / "sparse/1/images.txt");
  const CameraId camera = WithViews(1).cameras.begin()->first;
  const std::string first = "CAMERA " + std::to_string(camera);
  const std::string second = "CAMERA " + std::to_string(camera + 1000);
  WriteFile(folder / "sparse/1/rigs.txt", "1 2 " + first + " " + second + " 1 1 0 0 0 0 0 0\n");
  WriteFile(folder / "sparse/1/frames.txt", "1 1 1 0 0 0 0 0 5 2 " + first + " 1 " + second +
                                                " 2\n" + "2 1 1 0 0 0 0 0 6 2 " + first + " 3 " +
                                                second + " 4\n");
  // Two frames of four images are more than three.
  EXPECT_EQ(FindModels(folder.path()).front(), folder / "sparse/1");
  // Frames that cannot be read do not keep others from being found.
  WriteFile(folder / "sparse/1/frames.txt", "1 1 nothing\n");
  EXPECT_EQ(FindModels(folder.path()).front(), folder / "sparse/0");
  // images.* has the last word where it is there.
  WriteReconstructionText(folder / "sparse/2", WithViews(2));
  WriteFile(folder / "sparse/2/rigs.txt", "1 1 " + first + "\n");
  WriteFile(folder / "sparse/2/frames.txt", "1 1 1 0 0 0 0 0 5 4 " + first + " 1 " + first + " 2 " +
                                                first + " 3 " + first + " 4\n");
  EXPECT_EQ(FindModels(folder.path()).front(), folder / "sparse/0");
}

// `colmap automatic_reconstructor`: distorted models in sparse/N, their photos elsewhere, and
// undistorted ones with photos in dense/N.
TEST(Layout, TheDenseModelIsTakenWhereOnlyItHasPhotos) {
  const TempFolder folder;
  WriteReconstructionBinary(folder / "sparse/0", WithViews(2));
  WriteReconstructionBinary(folder / "dense/0/sparse", WithViews(2));
  WritePng(folder / "dense/0/images/0.png", Image8(64, 48));
  fs::create_directories(folder / "dense/0/stereo/depth_maps");
  const Workspace workspace = Workspace::Open(folder.path());
  EXPECT_EQ(workspace.sparse_folder, folder / "dense/0/sparse");
  EXPECT_EQ(workspace.image_folder, folder / "dense/0/images");
  EXPECT_TRUE(fs::equivalent(workspace.depth_map_folder, folder / "dense/0/stereo/depth_maps"));
  EXPECT_EQ(Workspace::Open(folder.path(), {}, "sparse/0").sparse_folder, folder / "sparse/0");
  EXPECT_EQ(Workspace::Open(folder.path(), {}, "dense/0").sparse_folder, folder / "dense/0/sparse");
}

TEST(Layout, NerfstudiosColmapFolderIsFound) {
  const TempFolder folder;
  WriteReconstructionBinary(folder / "colmap/sparse/0", WithViews(2));
  WriteFile(folder / "transforms.json", "{}");
  WritePng(folder / "images/1.png", Image8(64, 48));
  const Workspace workspace = Workspace::Open(folder.path());
  EXPECT_EQ(workspace.sparse_folder, folder / "colmap/sparse/0");
  EXPECT_EQ(workspace.image_folder, folder / "images");
  EXPECT_TRUE(workspace.HasPhoto(workspace.RequireView("1.png")));
}

// 3DGS: cameras of one size, photos of several.
TEST(Layout, ThePhotosOfTheCamerasSizeAreTaken) {
  const TempFolder folder;
  WriteReconstructionBinary(folder / "sparse/0", WithViews(2));
  WritePng(folder / "images/0.png", Image8(128, 96));
  WritePng(folder / "images_2/0.png", Image8(64, 48, 51));
  WritePng(folder / "images_4/0.png", Image8(32, 24));
  const Workspace workspace = Workspace::Open(folder.path());
  EXPECT_EQ(workspace.image_folder, folder / "images_2");
  // None of that size: the first, scaled.
  fs::remove_all(folder / "images_2");
  EXPECT_EQ(Workspace::Open(folder.path()).image_folder, folder / "images");
  fs::remove_all(folder / "images");
  const Workspace small = Workspace::Open(folder.path());
  EXPECT_EQ(small.image_folder, folder / "images_4");
  const Image photo = small.ReadPhoto(small.RequireView("0.png"));
  EXPECT_EQ(photo.width, 64);
  EXPECT_EQ(photo.height, 48);
}

TEST(Layout, PhotosWithAnotherExtensionOrWithoutTheirFolderAreFound) {
  const TempFolder folder;
  WriteReconstructionBinary(folder / "sparse/0", TinyModel());
  WritePng(folder / "images/a.jpg.png", Image8(1, 1));  // a mask's name: not the photo
  WritePng(folder / "images/b c.png", Image8(30, 20));
  WritePng(folder / "images/\xC3\xA9t\xC3\xA9.png", Image8(64, 48));
  const Workspace workspace = Workspace::Open(folder.path());
  EXPECT_FALSE(workspace.HasPhoto(workspace.RequireView("a.jpg")));
  EXPECT_EQ(workspace.PhotoPath(workspace.RequireView("sub/b c.png")), folder / "images/b c.png");
  EXPECT_FALSE(workspace.ReadPhoto(workspace.RequireView("\xC3\xA9t\xC3\xA9.jpg")).Empty());
  // Of every kind of picture that is read.
  for (const char* name : {"a.TIF", "a.tiff", "a.webp", "a.bmp", "a.JP2"}) {
    WriteFile(folder / "images" / name, "");
    EXPECT_EQ(workspace.PhotoPath(workspace.RequireView("a.jpg")), folder / "images" / name);
    fs::remove(folder / "images" / name);
  }
}

// Two cameras that name their photos alike.
TEST(Layout, APhotoWithoutItsFolderIsTakenForOneViewAlone) {
  const TempFolder folder;
  Reconstruction model = WithViews(3);
  model.views.begin()->second.name = "left/0.png";
  std::next(model.views.begin())->second.name = "right/0.png";
  std::next(model.views.begin(), 2)->second.name = "right/1.png";
  WriteReconstructionBinary(folder / "sparse/0", model);
  for (const char* name : {"0.png", "1.png"}) {
    WritePng(folder / "images" / name, Image8(64, 48));
  }
  Workspace workspace = Workspace::Open(folder.path());
  EXPECT_FALSE(workspace.HasPhoto(workspace.RequireView("left/0.png")));
  EXPECT_FALSE(workspace.HasPhoto(workspace.RequireView("right/0.png")));
  EXPECT_TRUE(workspace.HasPhoto(workspace.RequireView("right/1.png")));
  WritePng(folder / "images/left/0.png", Image8(64, 48));
  workspace = Workspace::Open(folder.path());
  EXPECT_TRUE(workspace.HasPhoto(workspace.RequireView("left/0.png")));
  EXPECT_FALSE(workspace.HasPhoto(workspace.RequireView("right/0.png")));
}

TEST(Layout, PartsMayBeTextAndBinaryMixed) {
  const TempFolder folder;
  WriteReconstructionBinary(folder / "b", TinyModel());
  WriteReconstructionText(folder / "t", TinyModel());
  fs::create_directories(folder / "sparse");
  fs::copy(folder / "t/cameras.txt", folder / "sparse/cameras.txt");
  fs::copy(folder / "b/images.bin", folder / "sparse/images.bin");
  fs::copy(folder / "t/points3D.txt", folder / "sparse/points3D.txt");
  WriteFile(folder / "sparse/database.db", "not of interest");
  std::vector<std::string> warnings;
  // Text has 17 digits, which are all; its rotations may lose one.
  ExpectSame(ReadReconstruction(folder / "sparse", &warnings), TinyModel(), 1e-15);
  EXPECT_THAT(warnings, IsEmpty());
}

TEST(Layout, FramesWithoutImagesHavePoses) {
  RETINT_REQUIRE_DATA("colmap/unicode_names/1");
  const Workspace workspace = Workspace::Open(DataPath("colmap/unicode_names/1"));
  EXPECT_EQ(workspace.reconstruction.views.size(), 45u);
  EXPECT_FALSE(workspace.reconstruction.points.empty());
  const View& view = workspace.RequireView("image_00002");
  EXPECT_EQ(view.id, 2u);
  EXPECT_FALSE(workspace.HasPhoto(view));
  EXPECT_THAT(workspace.warnings,
              testing::Contains(HasSubstr("images.bin: is missing; poses come from frames.bin")));
  // One more level is looked at; the model with most views is taken, 45 against 2.
  EXPECT_EQ(Workspace::Open(DataPath("colmap/unicode_names")).sparse_folder,
            DataPath("colmap/unicode_names") / "1");
}

TEST(Layout, MovingTheWorldKeepsEveryPixel) {
  const TempFolder folder;
  WriteReconstructionBinary(folder / "sparse/0", TinyModel());
  Workspace workspace = Workspace::Open(folder.path());
  const Reconstruction before = workspace.reconstruction;
  const Sim3d move{2.5, Eigen::Quaterniond(0.5, -0.5, 0.1, 0.7).normalized(), {3, -1, 4}};
  workspace.Transform(move);
  EXPECT_EQ(workspace.depth_scale, 2.5);
  for (const auto& [id, view] : before.views) {
    const Eigen::Vector3d point(0.3, 0.2, -2);
    const Eigen::Vector3d old = view.cam_from_world * point;
    const Eigen::Vector3d moved =
        workspace.reconstruction.views.at(id).cam_from_world * (move * point);
    // The same ray, 2.5 times as far.
    EXPECT_LT((moved - 2.5 * old).norm(), 1e-12);
  }
  EXPECT_LT((workspace.reconstruction.points.at(9).xyz - move * before.points.at(9).xyz).norm(),
            1e-12);
}

// --- nerfstudio --------------------------------------------------------------------------------

constexpr const char* kTransforms = R"({
 "w": 64, "h": 48, "fl_x": 50, "fl_y": 51, "cx": 31, "cy": 25, "camera_model": "OPENCV",
 "applied_transform": [[1,0,0,0],[0,0,1,0],[0,-1,0,0]],
 "frames": [
  {"file_path": "./images/a.png",
   "transform_matrix": [[1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]]},
  {"file_path": "images/b.png", "k1": 0.1, "fl_x": 60,
   "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]})";

TEST(Nerfstudio, CamerasComeWithColmapsAxesInColmapsWorld) {
  const TempFolder folder;
  WriteFile(folder / "transforms.json", kTransforms);
  WritePng(folder / "images/a.png", Image8(64, 48));
  const Workspace workspace = Workspace::Open(folder.path());
  const View& view = workspace.RequireView("images/a.png");
  EXPECT_TRUE(workspace.HasPhoto(view));
  const PosedCamera posed = workspace.reconstruction.Posed(view);
  EXPECT_EQ(posed.camera.params, (std::vector<double>{50, 51, 31, 25}));
  // The file's world is (x, z, -y) of COLMAP's: its (1, 2, 3) is ours (1, -3, 2).
  EXPECT_LT((posed.Center() - Eigen::Vector3d(1, -3, 2)).norm(), 1e-12);
  // It looks along the file's -z, which is our +y; its up, the file's +y, is our +z.
  const Eigen::Vector3d ahead = posed.cam_from_world * Eigen::Vector3d(1, -3 + 5, 2);
  EXPECT_LT((ahead - Eigen::Vector3d(0, 0, 5)).norm(), 1e-12);
  const Eigen::Vector3d above = posed.cam_from_world * Eigen::Vector3d(1, -3, 2 + 1);
  EXPECT_LT((above - Eigen::Vector3d(0, -1, 0)).norm(), 1e-12);
  const View& distorted = workspace.RequireView("images/b.png");
  const Camera& camera = workspace.reconstruction.cameras.at(distorted.camera_id);
  EXPECT_EQ(camera.model, CameraModelId::kOpenCV);
  EXPECT_EQ(camera.params, (std::vector<double>{60, 51, 31, 25, 0.1, 0, 0, 0}));
}

// A file of one frame: its header and the frame.
std::string OneFrame(const std::string& all, const std::string& frame) {
  return "{" + all + R"("w": 64, "h": 32, "fl_x": 50, "frames": [{"transform_matrix":
    [[1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]], )" +
         frame + "}]}";
}

TEST(Nerfstudio, LensesAreThoseOfTheirNames) {
  const TempFolder folder;
  const auto camera = [&](const std::string& all) {
    WriteFile(folder / "transforms.json", OneFrame(all + ", ", R"("file_path": "a.png")"));
    return Workspace::Open(folder.path()).reconstruction.cameras.at(1);
  };
  const Camera sphere = camera(R"("camera_model": "EQUIRECTANGULAR")");
  EXPECT_EQ(sphere.model, CameraModelId::kEquirectangular);
  EXPECT_EQ(sphere.params, (std::vector<double>{64, 32}));
  const Camera fisheye = camera(R"("is_fisheye": true, "k1": 0.1, "k4": 0.4)");
  EXPECT_EQ(fisheye.model, CameraModelId::kOpenCVFisheye);
  EXPECT_EQ(fisheye.params, (std::vector<double>{50, 50, 32, 16, 0.1, 0, 0, 0.4}));
  const Camera cubic = camera(R"("camera_model": "OPENCV", "k1": 0.1, "p2": 0.2, "k3": 0.3)");
  EXPECT_EQ(cubic.model, CameraModelId::kFullOpenCV);
  EXPECT_EQ(cubic.params, (std::vector<double>{50, 50, 32, 16, 0.1, 0, 0, 0.2, 0.3, 0, 0, 0}));
  EXPECT_EQ(camera(R"("camera_model": "SIMPLE_PINHOLE")").model, CameraModelId::kPinhole);
  // Others would show something else than their photos.
  EXPECT_THAT([&] { camera(R"("camera_model": "FISHEYE624")"); },
              ThrowsMessage<InputError>(HasSubstr("camera_model FISHEYE624 is not supported")));
  EXPECT_THAT([&] { camera(R"("camera_model": "OPENCV", "k4": 0.1)"); },
              ThrowsMessage<InputError>(HasSubstr("k4 of camera_model OPENCV")));
}

TEST(Nerfstudio, NamesLeadNowhereElseAndTheirPhotosAreFound) {
  const TempFolder folder;
  const auto open = [&](const std::string& file) {
    WriteFile(folder / "data/transforms.json", OneFrame("", R"("file_path": ")" + file + "\""));
    return Workspace::Open(folder / "data");
  };
  const auto expect = [&](const std::string& file, const std::string& name) {
    const Workspace workspace = open(file);
    const View& view = workspace.reconstruction.views.at(1);
    EXPECT_EQ(view.name, name) << file;
    EXPECT_TRUE(workspace.HasPhoto(view)) << file;
  };
  WritePng(folder / "photos/a.png", Image8(64, 32));
  expect("../photos/a.png", "photos/a.png");
  const std::string whole = (folder / "photos/a.png").string();
  expect(whole, whole.substr(1));
  WritePng(folder / "data/train/a.png", Image8(64, 32));
  expect("./train/a", "train/a");
  expect(R"(.\\train\\a.png)", "train/a.png");
}

TEST(Nerfstudio, TheScaleThatWasAppliedIsUndone) {
  const TempFolder folder;
  for (const char* moved : {R"("applied_transform": [[1,0,0,4],[0,1,0,0],[0,0,1,0]], )", ""}) {
    WriteFile(folder / "transforms.json", OneFrame(std::string(R"("applied_scale": 0.5, )") + moved,
                                                   R"("file_path": "a.png")"));
    const Workspace workspace = Workspace::Open(folder.path());
    const Eigen::Vector3d center =
        workspace.reconstruction.Posed(workspace.reconstruction.views.at(1)).Center();
    EXPECT_LT((center - Eigen::Vector3d(*moved ? -2 : 2, 4, 6)).norm(), 1e-12);
  }
}

// Its points are in the frame of its poses, here that of kTransforms' world.
TEST(Nerfstudio, PointsAreThoseOfThePlyThatIsNamed) {
  const TempFolder folder;
  const std::string text = kTransforms;
  WriteFile(folder / "transforms.json",
            text.substr(0, text.rfind('}')) + R"(, "ply_file_path": "sparse_pc.ply"})");
  WriteFile(folder / "sparse_pc.ply",
            "ply\nformat ascii 1.0\nelement camera 1\nproperty list uchar int x\n"
            "element vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
            "property uint8 red\nproperty uint8 green\nproperty uint8 blue\nend_header\n"
            "2 7 8\n1 2 3 10 20 30\n0 0 1 255 0 0\n");
  const Workspace workspace = Workspace::Open(folder.path());
  EXPECT_THAT(workspace.warnings, IsEmpty());
  ASSERT_EQ(workspace.reconstruction.points.size(), 2u);
  const SparsePoint& point = workspace.reconstruction.points.at(1);
  EXPECT_LT((point.xyz - Eigen::Vector3d(1, -3, 2)).norm(), 1e-6);
  EXPECT_EQ(point.color, (Eigen::Matrix<uint8_t, 3, 1>(10, 20, 30)));
  EXPECT_TRUE(point.track.empty());
  // Unreadable files are left out, and reported.
  for (const char* bad : {"not a ply\n",
                          "ply\nformat ascii 1.0\nelement vertex 9999999999\nproperty float x\n"
                          "property float y\nproperty float z\nend_header\n1 2 3\n",
                          "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
                          "property float y\nproperty float z\nend_header\n1 nan 3\n"}) {
    WriteFile(folder / "sparse_pc.ply", bad);
    const Workspace without = Workspace::Open(folder.path());
    EXPECT_TRUE(without.reconstruction.points.empty());
    EXPECT_THAT(without.warnings, testing::Contains(HasSubstr("sparse_pc.ply")));
  }
}

TEST(Nerfstudio, FilesOfOtherThingsAreRefused) {
  const TempFolder folder;
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"[1", "not a JSON object"},
      {"{}", "has no frames"},
      {R"({"frames": [{"file_path": "a"}]})", "transform_matrix is not a pose"},
      {R"({"frames": [{"file_path": "a", "transform_matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0]}]})",
       "has no usable w, h and fl_x"},
      {R"({"w": 9, "h": 9, "fl_x": 9, "frames":
          [{"file_path": "a", "transform_matrix": [1,0,0,0, 0,1,0,0, 0,0,-1,0]}]})",
       "transform_matrix is not a pose"}};
  for (const auto& [text, fault] : cases) {
    WriteFile(folder / "transforms.json", text);
    EXPECT_THAT([&] { Workspace::Open(folder.path()); },
                ThrowsMessage<InputError>(AllOf(HasSubstr("transforms.json"), HasSubstr(fault))));
  }
}

TEST(Nerfstudio, AFrameWithoutAPoseIsLeftOut) {
  const TempFolder folder;
  std::string text = kTransforms;
  const std::string from = "[[1,0,0,1],[0,1,0,2]";
  text.replace(text.find(from), from.size(), "[[1,0,0,1],[0,-1,0,2]");
  WriteFile(folder / "transforms.json", text);
  const Workspace workspace = Workspace::Open(folder.path());
  ASSERT_EQ(workspace.reconstruction.views.size(), 1u);
  EXPECT_EQ(workspace.reconstruction.views.begin()->second.name, "images/b.png");
  EXPECT_THAT(
      workspace.warnings,
      testing::Contains(HasSubstr("images/a.png: transform_matrix is not a pose; it is left out")));
}

TEST(Nerfstudio, SimilaritiesComeFromFilesAndNumbers) {
  const TempFolder folder;
  // x_splat = 0.5 (R x + t), R a quarter turn about z.
  WriteFile(folder / "d.json", R"({"transform": [[0,-1,0,1],[1,0,0,2],[0,0,1,3]], "scale": 0.5})");
  const Sim3d from_parser = ReadWorldFromSplat(folder / "d.json");
  EXPECT_NEAR(from_parser.scale, 2, 1e-12);
  EXPECT_LT((from_parser * Eigen::Vector3d(0.5, 1, 1.5)).norm(), 1e-12);
  EXPECT_LT((from_parser * Eigen::Vector3d(0, 1.5, 1.5) - Eigen::Vector3d(1, 1, 0)).norm(), 1e-12);
  WriteFile(folder / "ours.json", WorldFromSplatToJson(from_parser));
  const Sim3d read = ReadWorldFromSplat(folder / "ours.json");
  const Eigen::Vector3d any(0.3, -7, 2);
  EXPECT_LT((read * any - from_parser * any).norm(), 1e-12);
  const Sim3d parsed = ParseWorldFromSplat("0 2 0 -4, -2 0 0 2, 0 0 2 -6");
  EXPECT_LT(
      (parsed * any - Eigen::Vector3d(2 * any.y() - 4, 2 - 2 * any.x(), 2 * any.z() - 6)).norm(),
      1e-12);
  for (const char* bad : {"1 2 3", "1 0 0 0 0 1 0 0 0 0 -1 0", "1 0 0 0 0 2 0 0 0 0 1 0", "file"}) {
    EXPECT_THROW(ParseWorldFromSplat(bad), OptionError) << bad;
  }
  WriteFile(folder / "bad.json", R"({"transform": [1, 2], "scale": 1})");
  EXPECT_THROW(ReadWorldFromSplat(folder / "bad.json"), InputError);
}

// Qt takes over the user's locale, in which numbers may have a decimal comma.
TEST(Layout, NumbersOfAFrameHaveAPointInEveryLocale) {
  const TempFolder folder;
  const std::shared_ptr<void> restored(nullptr, [](void*) { std::setlocale(LC_NUMERIC, "C"); });
  const char* const name = "de_DE.UTF-8";
  if (!std::setlocale(LC_NUMERIC, name)) {
    const std::string make = "localedef -i de_DE -f UTF-8 '" + (folder / name).string() + "'";
    const bool is_made = std::system((make + " >/dev/null 2>&1").c_str()) == 0;
    setenv("LOCPATH", folder.path().c_str(), 1);
    if (!is_made || !std::setlocale(LC_NUMERIC, name)) GTEST_SKIP() << "there is no " << name;
  }
  ASSERT_EQ(std::string(std::localeconv()->decimal_point), ",");
  const Sim3d parsed = ParseWorldFromSplat("1 0 0 0.5, 0 1 0 -0.25, 0 0 1 +1e-3");
  const Sim3d again = ParseWorldFromSplat(WorldFromSplatToText(parsed));
  const std::string text = WorldFromSplatToText(parsed);
  EXPECT_EQ(parsed.translation, Eigen::Vector3d(0.5, -0.25, 1e-3));
  EXPECT_EQ(again.translation, parsed.translation);
  EXPECT_EQ(text, "1 0 0 0.5 0 1 0 -0.25 0 0 1 0.001");
}

}  // namespace
}  // namespace retint
