// SPDX-License-Identifier: BSD-3-Clause
// Poses from rigs.* and frames.* (COLMAP 3.12 and newer), in the layout of COLMAP doc/format.rst.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "colmap_io/sparse.h"
#include "tests/colmap_io/bytes.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::ThrowsMessage;

constexpr char kCameras[] =
    "# Number of cameras: 3\n"
    "1 PINHOLE 64 48 50 50 32 24\n"
    "2 PINHOLE 64 48 60 60 32 24\n"
    "3 SIMPLE_RADIAL 30 20 25 15 10 0.01\n";
// Rig 7: camera 1, camera 2 half a turn about x and one to the right of it, an inertial sensor,
// and camera 3, whose place nobody knows. Rig 8: camera 3 alone.
constexpr char kRigs[] =
    "# Rig calib list with one line of data per calib:\n"
    "#   RIG_ID, NUM_SENSORS, REF_SENSOR_TYPE, REF_SENSOR_ID, SENSORS[] as (SENSOR_TYPE, "
    "SENSOR_ID, HAS_POSE, [QW, QX, QY, QZ, TX, TY, TZ])\n"
    "# Number of rigs: 2\n"
    "7 4 CAMERA 1 CAMERA 2 1 0 1 0 0 -1 0 0 IMU 1 1 1 0 0 0 0 0 0 CAMERA 3 0\n"
    "8 1 CAMERA 3\n";
// Frame 4 of rig 7 stands at (0, 0, -5) and looks along z; frame 5 is turned about z by 90 degrees.
constexpr char kFrames[] =
    "# Frame list with one line of data per frame:\n"
    "#   FRAME_ID, RIG_ID, RIG_FROM_WORLD[QW, QX, QY, QZ, TX, TY, TZ], NUM_DATA_IDS, DATA_IDS[] as "
    "(SENSOR_TYPE, SENSOR_ID, DATA_ID)\n"
    "# Number of frames: 3\n"
    "4 7 1 0 0 0 0 0 5 4 CAMERA 1 11 CAMERA 2 12 IMU 1 900 CAMERA 3 13\n"
    "5 7 1 0 0 1 0.5 0 0 1 CAMERA 2 14\n"
    "6 8 1 0 0 0 1 2 3 1 CAMERA 3 15\n";

// The same two files as COLMAP's binary ones, spelled out apart from the library.
std::string BinaryRigs() {
  Bytes b;  // a sensor is its kind (0: camera, 1: inertial) and its id
  b.U64(2).U32(7).U32(4).U32(0).U32(1);
  b.U32(0).U32(2).U8(1).Pose({0, 1, 0, 0, -1, 0, 0});
  b.U32(1).U32(1).U8(1).Pose({1, 0, 0, 0, 0, 0, 0}).U32(0).U32(3).U8(0);
  b.U32(8).U32(1).U32(0).U32(3);
  return b.str();
}

std::string BinaryFrames() {
  Bytes b;
  b.U64(3).U32(4).U32(7).Pose({1, 0, 0, 0, 0, 0, 5}).U32(4);
  b.U32(0).U32(1).U64(11).U32(0).U32(2).U64(12).U32(1).U32(1).U64(900).U32(0).U32(3).U64(13);
  b.U32(5).U32(7).Pose({1, 0, 0, 1, 0.5, 0, 0}).U32(1).U32(0).U32(2).U64(14);
  b.U32(6).U32(8).Pose({1, 0, 0, 0, 1, 2, 3}).U32(1).U32(0).U32(3).U64(15);
  return b.str();
}

void ExpectPoint(const Reconstruction& model, ViewId id, CameraId camera,
                 const Eigen::Vector3d& in_world, const Eigen::Vector3d& in_cam) {
  SCOPED_TRACE("view " + std::to_string(id));
  ASSERT_EQ(model.views.count(id), 1u);
  const View& view = model.views.at(id);
  EXPECT_EQ(view.camera_id, camera);
  EXPECT_LT((view.cam_from_world * in_world - in_cam).norm(), 1e-12);
}

// The contents of both files, computed by hand.
void ExpectPoses(const Reconstruction& model) {
  EXPECT_EQ(model.views.size(), 4u);
  const Eigen::Vector3d point(1, 2, 3);
  ExpectPoint(model, 11, 1, point, {1, 2, 8});
  ExpectPoint(model, 12, 2, point, {0, -2, -8});  // (1, 2, 8) turned about x, one to the left
  // The frame's turn takes (1, 2, 3) to (-2, 1, 3), its shift to (-1.5, 1, 3); then the rig.
  ExpectPoint(model, 14, 2, point, {-2.5, -1, -3});
  ExpectPoint(model, 15, 3, point, {2, 4, 6});
  EXPECT_EQ(model.views.at(11).name, "image_00011");
}

struct Parts {
  const char* name;
  bool binary_rigs, binary_frames;
};

class RigsAndFrames : public ::testing::TestWithParam<Parts> {};

TEST_P(RigsAndFrames, GivePosesWhereImagesAreMissing) {
  const TempFolder folder;
  const auto [name, binary_rigs, binary_frames] = GetParam();
  WriteFile(folder / "cameras.txt", kCameras);
  WriteFile(folder / (binary_rigs ? "rigs.bin" : "rigs.txt"),
            binary_rigs ? BinaryRigs() : std::string(kRigs));
  WriteFile(folder / (binary_frames ? "frames.bin" : "frames.txt"),
            binary_frames ? BinaryFrames() : std::string(kFrames));
  std::vector<std::string> warnings;
  ExpectPoses(ReadReconstruction(folder.path(), &warnings));
  EXPECT_THAT(warnings, Contains(HasSubstr("left out 1 images of cameras whose place")));
  EXPECT_THAT(warnings, Contains(HasSubstr(binary_frames ? "images.bin: is missing; poses come "
                                                           "from frames.bin"
                                                         : "images.txt: is missing; poses come "
                                                           "from frames.txt")));
}

INSTANTIATE_TEST_SUITE_P(Layouts, RigsAndFrames,
                         ::testing::Values(Parts{"text", false, false}, Parts{"binary", true, true},
                                           Parts{"binary_rigs", true, false},
                                           Parts{"binary_frames", false, true}),
                         [](const auto& one) { return std::string(one.param.name); });

TEST(RigsAndFramesTest, BinaryComesBeforeText) {
  const TempFolder folder;
  WriteFile(folder / "cameras.txt", kCameras);
  WriteFile(folder / "rigs.bin", BinaryRigs());
  WriteFile(folder / "frames.bin", BinaryFrames());
  WriteFile(folder / "rigs.txt", "not read");
  WriteFile(folder / "frames.txt", "not read");
  ExpectPoses(ReadReconstruction(folder.path()));
}

TEST(RigsAndFramesTest, AreNotReadBesideImages) {
  const TempFolder folder;
  WriteFile(folder / "cameras.txt", kCameras);
  WriteFile(folder / "rigs.txt", "whatever");
  WriteFile(folder / "frames.txt", "whatever");
  WriteFile(folder / "images.txt", "11 1 0 0 0 1 2 3 1 a.jpg\n\n");
  const Reconstruction model = ReadReconstruction(folder.path());
  ASSERT_EQ(model.views.size(), 1u);
  EXPECT_EQ(model.views.at(11).name, "a.jpg");
}

TEST(RigsAndFramesTest, NeedEachOther) {
  const TempFolder folder;
  WriteFile(folder / "cameras.txt", kCameras);
  WriteFile(folder / "frames.txt", kFrames);
  EXPECT_THAT([&] { ReadReconstruction(folder.path()); },
              ThrowsMessage<InputError>(HasSubstr("images.txt: is missing from the COLMAP model")));
}

TEST(RigsAndFramesTest, AFileCutBetweenRecordsIsTold) {
  const TempFolder folder;
  const std::string frames = kFrames;
  WriteFile(folder / "cameras.txt", kCameras);
  WriteFile(folder / "rigs.txt", kRigs);
  WriteFile(folder / "frames.txt", frames.substr(0, frames.find("6 8 1")));
  std::vector<std::string> warnings;
  EXPECT_EQ(ReadReconstruction(folder.path(), &warnings).views.size(), 3u);
  EXPECT_THAT(warnings, Contains(HasSubstr("frames.txt: its comment tells of 3 records, 2")));
}

// Every fault names the file and the line.
TEST(RigsAndFramesTest, FaultsOfTextAreNamed) {
  const struct {
    const char* file;
    const char* text;
    const char* fault;
  } faults[] = {
      {"rigs.txt", "7 2 CAMERA 1 CAMERA 2 1 1 0 0 0 1 2\n", "rigs.txt:1: TZ is missing"},
      {"rigs.txt", "7 3 CAMERA 1 CAMERA 2 0\n", "SENSOR_TYPE is missing"},
      {"rigs.txt", "7 99999999999 CAMERA 1\n", "NUM_SENSORS"},
      {"rigs.txt", "# one\n7 1 CAMERA one\n", "rigs.txt:2: SENSOR_ID is not an integer"},
      {"rigs.txt", "7 1 CAMERA 1\n7 1 CAMERA 2\n", "rig 7 comes twice"},
      {"frames.txt", "4 7 0 0 0 0 0 0 5 0\n", "frames.txt:1: frame 4 has a zero rotation"},
      {"frames.txt", "4 7 1 0 0 nan 0 0 5 0\n", "QZ is NaN"},
      {"frames.txt", "4 7 1 0 0 0 0 0 5 4000000000 CAMERA 1 11\n", "SENSOR_TYPE is missing"},
      {"frames.txt", "4 7 1 0 0 0 0 0 5 1 CAMERA 1 99999999999\n", "id is out of range"},
      {"frames.txt", "4 7 1 0 0 0 0 0 5 2 CAMERA 1 11 CAMERA 2 11\n", "image 11 comes twice"},
  };
  for (const auto& [file, text, fault] : faults) {
    SCOPED_TRACE(text);
    const TempFolder folder;
    WriteFile(folder / "cameras.txt", kCameras);
    WriteFile(folder / "rigs.txt", kRigs);
    WriteFile(folder / "frames.txt", kFrames);
    WriteFile(folder / file, text);
    EXPECT_THAT([&] { ReadReconstruction(folder.path()); },
                ThrowsMessage<InputError>(testing::AllOf(HasSubstr(file), HasSubstr(fault))));
  }
}

}  // namespace
}  // namespace retint
