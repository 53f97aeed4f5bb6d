// SPDX-License-Identifier: BSD-3-Clause
// Models that other people's programs wrote.
#include <cmath>
#include <cstring>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "colmap_io/sparse.h"
#include "scene/camera_projection.h"
#include "tests/colmap_io/tiny_model.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::ThrowsMessage;

struct RealModel {
  const char* folder;
  size_t cameras, views, points;
};

void PrintTo(const RealModel& model, std::ostream* out) { *out << model.folder; }

// The records of a binary images or points3D file by id, found apart from the library's reader.
std::string SortedById(const std::string& bytes, bool images) {
  const auto at = [&](size_t offset, size_t size) {
    uint64_t value = 0;
    std::memcpy(&value, bytes.data() + offset, size);
    return value;
  };
  std::map<uint64_t, std::string> records;
  size_t offset = 8;
  for (uint64_t i = 0, count = at(0, 8); i < count; ++i) {
    size_t end = offset;
    if (images) {
      end = bytes.find('\0', offset + 4 + 56 + 4) + 1;
      end += 8 + 24 * at(end, 8);
    } else {
      end += 8 + 24 + 3 + 8;
      end += 8 + 8 * at(end, 8);
    }
    records[at(offset, images ? 4 : 8)] = bytes.substr(offset, end - offset);
    offset = end;
  }
  std::string sorted = bytes.substr(0, 8);
  for (const auto& [id, record] : records) sorted += record;
  return sorted;
}

class BinaryModelTest : public ::testing::TestWithParam<RealModel> {};

TEST_P(BinaryModelTest, ReadsWholeAndWritesTheSameBytesSorted) {
  RETINT_REQUIRE_DATA(GetParam().folder);
  const auto source = DataPath(GetParam().folder);
  std::vector<std::string> warnings;
  const Reconstruction model = ReadReconstruction(source, &warnings);
  EXPECT_THAT(warnings, IsEmpty());
  EXPECT_EQ(model.cameras.size(), GetParam().cameras);
  EXPECT_EQ(model.views.size(), GetParam().views);
  EXPECT_EQ(model.points.size(), GetParam().points);

  // COLMAP before 3.9 writes images and points in the order of a hash table.
  const TempFolder folder;
  WriteReconstructionBinary(folder / "b", model);
  EXPECT_TRUE(ReadFile(folder / "b/cameras.bin") == ReadFile(source / "cameras.bin"));
  EXPECT_TRUE(ReadFile(folder / "b/images.bin") ==
              SortedById(ReadFile(source / "images.bin"), true));
  EXPECT_TRUE(ReadFile(folder / "b/points3D.bin") ==
              SortedById(ReadFile(source / "points3D.bin"), false));

  // 17 digits keep every bit.
  WriteReconstructionText(folder / "t", model);
  const Reconstruction from_text = ReadReconstruction(folder / "t");
  ExpectSame(from_text, model);
  WriteReconstructionText(folder / "t2", from_text);
  for (const char* part : {"cameras.txt", "images.txt", "points3D.txt"}) {
    EXPECT_TRUE(ReadFile(folder / "t" / part) == ReadFile(folder / "t2" / part)) << part;
  }
}

INSTANTIATE_TEST_SUITE_P(Real, BinaryModelTest,
                         ::testing::Values(RealModel{"fox/sparse/0", 1, 50, 12914},
                                           RealModel{"flower/sparse/0", 1, 25, 9199},
                                           RealModel{"colmap/sceaux_bin", 1, 11, 7862},
                                           RealModel{"colmap/rigs", 1, 5, 2013},
                                           RealModel{"colmap/unicode_names/0", 1, 2, 129},
                                           RealModel{"colmap/two_views_dense/sparse", 2, 2, 1}));

class TextModelTest : public ::testing::TestWithParam<RealModel> {};

TEST_P(TextModelTest, ReadsWholeAndIsStableFromThenOn) {
  RETINT_REQUIRE_DATA(GetParam().folder);
  std::vector<std::string> warnings;
  const Reconstruction model = ReadReconstruction(DataPath(GetParam().folder), &warnings);
  EXPECT_THAT(warnings, IsEmpty());
  EXPECT_EQ(model.cameras.size(), GetParam().cameras);
  EXPECT_EQ(model.views.size(), GetParam().views);
  EXPECT_EQ(model.points.size(), GetParam().points);
  for (const auto& [id, view] : model.views) {
    EXPECT_NEAR(view.cam_from_world.rotation.norm(), 1, 1e-9) << view.name;
  }
  const TempFolder folder;
  WriteReconstructionText(folder / "t", model);
  ExpectSame(ReadReconstruction(folder / "t"), model);
  WriteReconstructionBinary(folder / "b", model);
  ExpectSame(ReadReconstruction(folder / "b"), model);
}

INSTANTIATE_TEST_SUITE_P(
    Real, TextModelTest,
    ::testing::Values(RealModel{"colmap/sceaux_txt", 1, 11, 7862},
                      RealModel{"colmap/sceaux_not_shared_txt", 11, 11, 8024},
                      RealModel{"colmap/sceaux_txt_missing_cams_and_subfolders", 1, 9, 6319}));

TEST(RealModelsTest, TextAndBinaryOfOneModelAgree) {
  RETINT_REQUIRE_DATA("colmap/sceaux_bin");
  RETINT_REQUIRE_DATA("colmap/sceaux_txt");
  const Reconstruction binary = ReadReconstruction(DataPath("colmap/sceaux_bin"));
  const Reconstruction text = ReadReconstruction(DataPath("colmap/sceaux_txt"));
  // The text has six significant digits: half a unit in the sixth of numbers below 4000 is 0.005,
  // and a little for ties.
  const auto tolerance = [](double value) { return 6e-6 * std::abs(value) + 1e-12; };
  ASSERT_EQ(binary.points.size(), text.points.size());
  for (const auto& [id, point] : binary.points) {
    const SparsePoint& other = text.points.at(id);
    for (int k = 0; k < 3; ++k) ASSERT_NEAR(point.xyz[k], other.xyz[k], tolerance(point.xyz[k]));
    ASSERT_EQ(point.color, other.color);
    ASSERT_EQ(point.track.size(), other.track.size());
  }
  for (const auto& [id, view] : binary.views) {
    const View& other = text.views.at(id);
    EXPECT_EQ(view.name, other.name);
    EXPECT_LT(view.cam_from_world.rotation.angularDistance(other.cam_from_world.rotation), 1e-5);
    ASSERT_EQ(view.observations.size(), other.observations.size());
    for (size_t i = 0; i < view.observations.size(); ++i) {
      ASSERT_EQ(view.observations[i].point_id, other.observations[i].point_id);
      ASSERT_NEAR(view.observations[i].xy.x(), other.observations[i].xy.x(), 0.0051);
    }
  }
}

// Poses, intrinsics and pixels fit together only when every convention is COLMAP's.
TEST(RealModelsTest, ReprojectionErrorIsColmaps) {
  const std::pair<const char*, double> kCaptures[] = {{"fox/sparse/0", 0.70},
                                                      {"flower/sparse/0", 0.66}};
  for (const auto& [name, mean_error] : kCaptures) {
    RETINT_REQUIRE_DATA(name);
    const Reconstruction model = ReadReconstruction(DataPath(name));
    double sum = 0, deviation = 0;
    for (const auto& [id, point] : model.points) {
      double of_point = 0;
      for (const TrackElement& element : point.track) {
        const View& view = model.views.at(element.view_id);
        const Observation& observation = view.observations.at(element.observation_idx);
        ASSERT_EQ(observation.point_id, id);
        const auto pixel = model.Posed(view).Project(point.xyz);
        ASSERT_TRUE(pixel.has_value());
        of_point += (pixel->head<2>() - observation.xy).norm();
      }
      of_point /= static_cast<double>(point.track.size());
      sum += of_point;
      deviation += std::abs(of_point - point.error);
    }
    const auto count = static_cast<double>(model.points.size());
    // The captures' README gives it to two decimals. The errors in the files are those before
    // undistortion, which stretches pixels by a percent or so.
    EXPECT_NEAR(sum / count, mean_error, 0.01) << name;
    EXPECT_LT(deviation / count, 0.01) << name;
  }
}

// The same of cameras with distortion, to COLMAP's own figure of every point.
TEST(RealModelsTest, ReprojectionErrorsThroughTheLensAreColmaps) {
  for (const char* name : {"colmap/sceaux_bin", "colmap/rigs", "colmap/unicode_names/0"}) {
    RETINT_REQUIRE_DATA(name);
    const Reconstruction model = ReadReconstruction(DataPath(name));
    std::map<CameraId, CameraProjection> projections;
    for (const auto& [id, camera] : model.cameras) projections.emplace(id, camera);
    size_t compared = 0;
    for (const auto& [id, point] : model.points) {
      double of_point = 0;
      for (const TrackElement& element : point.track) {
        const View& view = model.views.at(element.view_id);
        const auto pixel =
            projections.at(view.camera_id).ImgFromCam(view.cam_from_world * point.xyz);
        ASSERT_TRUE(pixel.has_value());
        of_point += (*pixel - view.observations.at(element.observation_idx).xy).norm();
      }
      // COLMAP computed it from the same doubles.
      EXPECT_NEAR(of_point / static_cast<double>(point.track.size()), point.error, 1e-3) << name;
      ++compared;
    }
    EXPECT_GT(compared, 100u) << name;
  }
}

TEST(RealModelsTest, NamesKeepSpacesAccentsAndFolders) {
  RETINT_REQUIRE_DATA("colmap/unicode_names");
  RETINT_REQUIRE_DATA("colmap/sceaux_txt_missing_cams_and_subfolders");
  const Reconstruction unicode = ReadReconstruction(DataPath("colmap/unicode_names/0"));
  EXPECT_NE(unicode.FindView("Co\xCC\x81pia de IMG_5139.png"), nullptr);
  const Reconstruction folders =
      ReadReconstruction(DataPath("colmap/sceaux_txt_missing_cams_and_subfolders"));
  EXPECT_NE(folders.FindView("sub2/100_7106.JPG"), nullptr);
}

TEST(RealModelsTest, DamagedModelsAreRefusedByFileAndPlace) {
  RETINT_REQUIRE_DATA("colmap/truncated");
  EXPECT_THAT([] { ReadReconstruction(DataPath("colmap/truncated")); },
              ThrowsMessage<InputError>(AllOf(HasSubstr("images.bin: truncated: "),
                                              HasSubstr("observations of image 14"))));
  RETINT_REQUIRE_DATA("colmap/t265_fisheye_malformed");
  EXPECT_THAT(
      [] { ReadReconstruction(DataPath("colmap/t265_fisheye_malformed")); },
      ThrowsMessage<InputError>(AllOf(HasSubstr("images.txt:5: IMAGE_ID is not an integer: \"1,\""),
                                      HasSubstr("not by commas"))));
}

// COLMAP writes an image's pose twice, as its own and as its frame's.
TEST(RealModelsTest, FramesHaveThePosesOfTheirImages) {
  for (const char* name : {"colmap/rigs", "colmap/unicode_names/0"}) {
    RETINT_REQUIRE_DATA(name);
    const TempFolder folder;
    for (const char* file : {"cameras.bin", "points3D.bin", "rigs.bin", "frames.bin"}) {
      std::filesystem::copy(DataPath(name) / file, folder / file);
    }
    const Reconstruction images = ReadReconstruction(DataPath(name));
    const Reconstruction frames = ReadReconstruction(folder.path());
    ASSERT_EQ(frames.views.size(), images.views.size());
    for (const auto& [id, view] : images.views) {
      const View& same = frames.views.at(id);
      EXPECT_EQ(same.camera_id, view.camera_id);
      // One product with the rig's own pose, which is none.
      EXPECT_LT((same.cam_from_world.translation - view.cam_from_world.translation).norm(), 1e-12);
      EXPECT_LT(same.cam_from_world.rotation.angularDistance(view.cam_from_world.rotation), 1e-7);
    }
    // Cut off anywhere it is refused by name.
    const std::string bytes = ReadFile(folder / "frames.bin");
    for (size_t length = 0; length < bytes.size(); length += 7) {
      WriteFile(folder / "frames.bin", bytes.substr(0, length));
      EXPECT_THAT([&] { ReadReconstruction(folder.path()); },
                  ThrowsMessage<InputError>(HasSubstr("frames.bin")));
    }
  }
}

TEST(RealModelsTest, TruncatedPointsAreRefusedToo) {
  RETINT_REQUIRE_DATA("colmap/truncated/points3D.bin");
  const TempFolder folder;
  WriteReconstructionBinary(folder.path(), TinyModel());
  WriteFile(folder / "points3D.bin", ReadFile(DataPath("colmap/truncated/points3D.bin")));
  EXPECT_THAT([&] { ReadReconstruction(folder.path()); },
              ThrowsMessage<InputError>(HasSubstr("points3D.bin: truncated: ")));
}

}  // namespace
}  // namespace retint
