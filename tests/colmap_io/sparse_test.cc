// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/sparse.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "tests/colmap_io/bytes.h"
#include "tests/colmap_io/tiny_model.h"
#include "tests/support/data.h"
#include "tests/support/file_size_limit.h"

namespace retint {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::ThrowsMessage;

std::string TinyCamerasBin() {
  Bytes b;
  b.U64(2);
  b.U32(1).U32(1).U64(64).U64(48).F64(50).F64(51.5).F64(32).F64(24);
  b.U32(4).U32(0).U64(30).U64(20).F64(25.25).F64(15).F64(10);
  return b.str();
}

std::string TinyImagesBin() {
  Bytes b;
  b.U64(3);
  b.U32(2).F64(0.8).F64(0).F64(-0.6).F64(0).F64(1).F64(0.1).F64(-2.5).U32(1);
  b.Text("a.jpg").U8(0).U64(3);
  b.F64(10.5).F64(20.25).U64(7).F64(0.1).F64(0.2).U64(~uint64_t{0}).F64(63).F64(47).U64(9);
  b.U32(3).F64(0.8).F64(0).F64(-0.6).F64(0).F64(1e-300).F64(0.1).F64(-2.5).U32(4);
  b.Text("sub/b c.png").U8(0).U64(1).F64(1).F64(2).U64(9);
  b.U32(10).F64(0.8).F64(0).F64(-0.6).F64(0).F64(-3).F64(0.1).F64(-2.5).U32(1);
  b.Text("\xC3\xA9t\xC3\xA9.jpg").U8(0).U64(0);
  return b.str();
}

std::string TinyPointsBin() {
  Bytes b;
  b.U64(2);
  b.U64(7).F64(0.1).F64(-0.2).F64(3e10).U8(255).U8(0).U8(17).F64(0.5).U64(1).U32(2).U32(0);
  b.U64(9).F64(1.0 / 3).F64(2).F64(3).U8(1).U8(2).U8(3).F64(-1).U64(2);
  b.U32(2).U32(2).U32(3).U32(0);
  return b.str();
}

constexpr const char* kTinyCamerasTxt =
    "# Camera list with one line of data per camera:\n"
    "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n"
    "# Number of cameras: 2\n"
    "1 PINHOLE 64 48 50 51.5 32 24\n"
    "4 SIMPLE_PINHOLE 30 20 25.25 15 10\n";
constexpr const char* kTinyImagesTxt =
    "# Image list with two lines of data per image:\n"
    "#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n"
    "#   POINTS2D[] as (X, Y, POINT3D_ID)\n"
    "# Number of images: 3, mean observations per image: 1\n"
    "2 0.80000000000000004 0 -0.59999999999999998 0 1 0.10000000000000001 -2.5 1 a.jpg\n"
    "10.5 20.25 7 0.10000000000000001 0.20000000000000001 -1 63 47 9\n"
    "3 0.80000000000000004 0 -0.59999999999999998 0 1e-300 0.10000000000000001 "
    "-2.5 4 sub/b c.png\n"
    "1 2 9\n"
    "10 0.80000000000000004 0 -0.59999999999999998 0 -3 0.10000000000000001 -2.5 1 "
    "\xC3\xA9t\xC3\xA9.jpg\n"
    "\n";
constexpr const char* kTinyPointsTxt =
    "# 3D point list with one line of data per point:\n"
    "#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n"
    "# Number of points: 2, mean track length: 1.5\n"
    "7 0.10000000000000001 -0.20000000000000001 30000000000 255 0 17 0.5 2 0\n"
    "9 0.33333333333333331 2 3 1 2 3 -1 2 2 3 0\n";

TEST(SparseTest, BinaryIsTheFormatsBytes) {
  const TempFolder folder;
  WriteReconstructionBinary(folder.path(), TinyModel());
  EXPECT_EQ(ReadFile(folder / "cameras.bin"), TinyCamerasBin());
  EXPECT_EQ(ReadFile(folder / "images.bin"), TinyImagesBin());
  EXPECT_EQ(ReadFile(folder / "points3D.bin"), TinyPointsBin());
}

TEST(SparseTest, TextIsColmapsOwn) {
  const TempFolder folder;
  WriteReconstructionText(folder.path(), TinyModel());
  EXPECT_EQ(ReadFile(folder / "cameras.txt"), kTinyCamerasTxt);
  EXPECT_EQ(ReadFile(folder / "images.txt"), kTinyImagesTxt);
  EXPECT_EQ(ReadFile(folder / "points3D.txt"), kTinyPointsTxt);
}

TEST(SparseTest, ReadsBothAndTellsOfNothing) {
  const TempFolder folder;
  WriteFile(folder / "b/cameras.bin", TinyCamerasBin());
  WriteFile(folder / "b/images.bin", TinyImagesBin());
  WriteFile(folder / "b/points3D.bin", TinyPointsBin());
  WriteFile(folder / "t/cameras.txt", kTinyCamerasTxt);
  WriteFile(folder / "t/images.txt", kTinyImagesTxt);
  WriteFile(folder / "t/points3D.txt", kTinyPointsTxt);
  std::vector<std::string> warnings;
  ExpectSame(ReadReconstruction(folder / "b", &warnings), TinyModel());
  ExpectSame(ReadReconstruction(folder / "t", &warnings), TinyModel());
  EXPECT_THAT(warnings, IsEmpty());
}

TEST(SparseTest, EveryCameraModelRoundTrips) {
  Reconstruction model;
  for (int id = 0; FindCameraModel(id) != nullptr; ++id) {
    Camera camera{static_cast<CameraId>(id + 1), FindCameraModel(id)->id, 640, 480, {}};
    for (int p = 0; p < FindCameraModel(id)->num_params; ++p)
      camera.params.push_back(p + 0.1 * id + 1);
    model.cameras[camera.id] = camera;
  }
  ASSERT_EQ(model.cameras.size(), 18u);
  const TempFolder folder;
  WriteReconstructionBinary(folder / "b", model);
  WriteReconstructionText(folder / "t", model);
  EXPECT_EQ(ReadReconstruction(folder / "b").cameras, model.cameras);
  EXPECT_EQ(ReadReconstruction(folder / "t").cameras, model.cameras);
}

TEST(SparseTest, EmptyModelRoundTrips) {
  const TempFolder folder;
  WriteReconstructionBinary(folder / "b", {});
  WriteReconstructionText(folder / "t", {});
  ExpectSame(ReadReconstruction(folder / "b"), {});
  ExpectSame(ReadReconstruction(folder / "t"), {});
}

TEST(SparseTest, PointWithoutTrackEndsInABlankAsColmaps) {
  const TempFolder folder;
  Reconstruction model;
  model.points[3] = {3, {1, 2, 3}, {4, 5, 6}, 0.5, {}};
  WriteReconstructionText(folder.path(), model);
  EXPECT_THAT(ReadFile(folder / "points3D.txt"), ::testing::EndsWith("\n3 1 2 3 4 5 6 0.5 \n"));
  ExpectSame(ReadReconstruction(folder.path()), model);
}

TEST(SparseTest, BinaryIsPreferredOverText) {
  const TempFolder folder;
  WriteReconstructionText(folder.path(), {});
  WriteReconstructionBinary(folder.path(), TinyModel());
  EXPECT_EQ(ReadReconstruction(folder.path()).views.size(), 3u);
}

TEST(SparseTest, ToleratesWhatOtherProgramsWrite) {
  const TempFolder folder;
  // A byte order mark, Windows line ends, tabs, blank lines, a sign, exponents, no end of line.
  WriteFile(folder / "cameras.txt",
            "\xEF\xBB\xBF# made by hand\r\n\r\n1\tSIMPLE_PINHOLE 64  48 +5e1 32 2.4E1\r\n");
  WriteFile(folder / "images.txt",
            "# NB IMAGES : 2\n\n  5 1 0 0 0 0 0 1e-400 1 my photo.jpg \n\n"
            "6 2 0 0 0 0 0 0 1 b.jpg");
  WriteFile(folder / "points3D.txt", "# none");
  std::vector<std::string> warnings;
  const Reconstruction model = ReadReconstruction(folder.path(), &warnings);
  EXPECT_THAT(warnings, IsEmpty());
  EXPECT_THAT(model.cameras.at(1).params, ElementsAre(50, 32, 24));
  ASSERT_EQ(model.views.size(), 2u);
  EXPECT_EQ(model.views.at(5).name, "my photo.jpg");
  EXPECT_EQ(model.views.at(5).cam_from_world.translation.z(), 0);
  EXPECT_EQ(model.views.at(6).cam_from_world.rotation.w(), 1) << "normalised";
}

TEST(SparseTest, CommentBetweenAnImagesTwoLinesIsItsPoints) {
  // As COLMAP reads it: the second line is never skipped.
  const TempFolder folder;
  WriteFile(folder / "cameras.txt", kTinyCamerasTxt);
  WriteFile(folder / "images.txt", "2 1 0 0 0 0 0 0 1 a.jpg\n# comment\n");
  EXPECT_THAT([&] { ReadReconstruction(folder.path()); },
              ThrowsMessage<InputError>(HasSubstr("images.txt:2: POINTS2D X is not a number")));
}

TEST(SparseTest, RotationsThatAreNearlyUnitKeepTheirBits) {
  Reconstruction model = TinyModel();
  Eigen::Quaterniond& kept = model.views.at(2).cam_from_world.rotation;
  kept.coeffs() *= 1 + 1e-13;
  Eigen::Quaterniond& normalised = model.views.at(3).cam_from_world.rotation;
  normalised.coeffs() *= 1 + 1e-6;  // six printed digits
  const TempFolder folder;
  WriteReconstructionBinary(folder.path(), model);
  const Reconstruction back = ReadReconstruction(folder.path());
  EXPECT_EQ(back.views.at(2).cam_from_world.rotation.coeffs(), kept.coeffs());
  EXPECT_NEAR(back.views.at(3).cam_from_world.rotation.norm(), 1, 1e-15);
  // Normalized values do not change any more.
  WriteReconstructionBinary(folder / "again", back);
  ExpectSame(ReadReconstruction(folder / "again"), back);
}

TEST(SparseTest, ViewsWithoutCameraAreLeftOutAndTold) {
  Reconstruction model = TinyModel();
  model.cameras.erase(4);
  const TempFolder folder;
  for (const bool binary : {true, false}) {
    const auto path = folder / (binary ? "b" : "t");
    binary ? WriteReconstructionBinary(path, model) : WriteReconstructionText(path, model);
    std::vector<std::string> warnings;
    const Reconstruction back = ReadReconstruction(path, &warnings);
    EXPECT_EQ(back.views.count(3), 0u);
    EXPECT_EQ(back.views.size(), 2u);
    // Point 9 was seen by it.
    ASSERT_EQ(back.points.at(9).track.size(), 1u);
    EXPECT_EQ(back.points.at(9).track[0].view_id, 2u);
    EXPECT_THAT(warnings,
                ElementsAre(HasSubstr("left out 1 view whose camera is missing: sub/b c.png"),
                            HasSubstr("left out 1 track element")));
  }
}

TEST(SparseTest, DanglingReferencesAreDroppedAndTold) {
  Reconstruction model = TinyModel();
  model.views.erase(10);
  model.points.at(7).track.push_back({10, 0});                    // no such view
  model.points.at(7).track.push_back({2, 3});                     // no such observation
  model.views.at(2).observations.push_back({{5, 5}, 1'000'000});  // no such point
  const TempFolder folder;
  WriteReconstructionBinary(folder.path(), model);
  std::vector<std::string> warnings;
  const Reconstruction back = ReadReconstruction(folder.path(), &warnings);
  EXPECT_EQ(back.points.at(7).track.size(), 2u) << "{2, 3} exists by now";
  EXPECT_EQ(back.views.at(2).observations[3].point_id, kInvalidPointId);
  EXPECT_EQ(back.views.at(2).observations[0].point_id, 7u);
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("left out 1 track element"),
                                    HasSubstr("1 observation of missing points")));
}

TEST(SparseTest, MissingPointsAreAWarning) {
  const TempFolder folder;
  WriteFile(folder / "cameras.bin", TinyCamerasBin());
  WriteFile(folder / "images.bin", TinyImagesBin());
  std::vector<std::string> warnings;
  const Reconstruction model = ReadReconstruction(folder.path(), &warnings);
  EXPECT_THAT(model.points, IsEmpty());
  EXPECT_EQ(model.views.size(), 3u);
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("points3D.bin: is missing"),
                                    HasSubstr("3 observations of missing points")));
}

TEST(SparseTest, FewerRecordsThanTheCommentTellsIsAWarning) {
  const TempFolder folder;
  WriteReconstructionText(folder.path(), TinyModel());
  std::string points = ReadFile(folder / "points3D.txt");
  WriteFile(folder / "points3D.txt", points.substr(0, points.find("\n9 ") + 1));
  std::vector<std::string> warnings;
  EXPECT_EQ(ReadReconstruction(folder.path(), &warnings).points.size(), 1u);
  ASSERT_FALSE(warnings.empty());
  EXPECT_THAT(warnings[0], HasSubstr("points3D.txt: its comment tells of 2 records, 1 follow"));
}

TEST(SparseTest, RigsAndFramesAreIgnoredInReadingAndNeverMixed) {
  const TempFolder folder;
  WriteReconstructionBinary(folder.path(), TinyModel());
  WriteFile(folder / "rigs.bin", "whatever");
  WriteFile(folder / "frames.bin", "");
  ExpectSame(ReadReconstruction(folder.path()), TinyModel());
  // COLMAP would pose this model's images by the other's frames.
  EXPECT_THAT([&] { WriteReconstructionBinary(folder.path(), {}); },
              ThrowsMessage<RunError>(HasSubstr("rigs.bin: belongs to another model")));
  ExpectSame(ReadReconstruction(folder.path()), TinyModel());
}

TEST(SparseTest, WritesAllFilesOrNone) {
  const TempFolder folder;
  WriteReconstructionBinary(folder.path(), TinyModel());
  std::filesystem::remove(folder / "points3D.bin");
  std::filesystem::create_directory(folder / "points3D.bin");  // in the third file's way
  EXPECT_THROW(WriteReconstructionBinary(folder.path(), {}), RunError);
  EXPECT_EQ(ReadFile(folder / "cameras.bin"), TinyCamerasBin());
  EXPECT_EQ(ReadFile(folder / "images.bin"), TinyImagesBin());
}

TEST(SparseTest, FullDiskLeavesTheOldModel) {
  Reconstruction model;
  for (PointId id = 0; id < 10'000; ++id) model.points[id] = {id, {1, 2, 3}, {4, 5, 6}, 0, {}};
  const TempFolder folder;
  WriteReconstructionBinary(folder.path(), TinyModel());
  {
    const FileSizeLimit limit(100'000);  // enough for cameras and images
    EXPECT_THAT([&] { WriteReconstructionBinary(folder.path(), model); },
                ThrowsMessage<RunError>(HasSubstr("points3D.bin: cannot write")));
    EXPECT_THROW(WriteReconstructionText(folder / "t", model), RunError);
  }
  ExpectSame(ReadReconstruction(folder.path()), TinyModel());
  EXPECT_FALSE(IsFolder(folder / "t"));
}

TEST(SparseTest, NamesThatCannotBeStoredAreRefused) {
  const TempFolder folder;
  Reconstruction model = TinyModel();
  model.views.at(2).name = "two\nlines.jpg";
  EXPECT_THAT([&] { WriteReconstructionText(folder.path(), model); },
              ThrowsMessage<InputError>(HasSubstr("image 2: its name cannot be stored")));
  EXPECT_NO_THROW(WriteReconstructionBinary(folder.path(), model));
  model.views.at(2).name = std::string("a\0b", 3);
  EXPECT_THROW(WriteReconstructionBinary(folder.path(), model), InputError);
}

}  // namespace
}  // namespace retint
