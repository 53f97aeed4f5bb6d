// SPDX-License-Identifier: BSD-3-Clause
// --photos: the edited photos as programs of photogrammetry take them.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "colmap_io/mask_names.h"
#include "colmap_io/sparse.h"
#include "colmap_io/workspace.h"
#include "tests/e2e/command.h"
#include "tests/support/data.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// How far photos are from the originals, in levels.
struct Change {
  double inside = 0, outside = 0;  // mean, and largest
};

Change ChangeOf(const fs::path& before, const fs::path& after, const Mask& mask) {
  const Image8 was = ReadImage8(before), is = ReadImage8(after);
  EXPECT_EQ(was.width, is.width);
  EXPECT_EQ(was.height, is.height);
  Change change;
  double count = 0;
  for (size_t i = 0; i < was.data.size(); ++i) {
    const double difference = std::abs(int(was.data[i]) - int(is.data[i]));
    if (mask.data[i / 3] > 250) change.inside += difference, ++count;
    if (mask.data[i / 3] == 0) change.outside = std::max(change.outside, difference);
  }
  change.inside /= std::max(count, 1.0);
  return change;
}

// In a JPEG, blocks of up to 16 x 16 pixels that hold a changed one are quantized again, and
// decoders smooth the colors of the blocks beside them.
Mask Near(const Mask& mask) {
  constexpr int kBlock = 16;
  Mask blocks(mask.width / kBlock + 1, mask.height / kBlock + 1), near(mask.width, mask.height);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      if (mask(x, y) != 0) blocks(x / kBlock, y / kBlock) = 255;
    }
  }
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      for (int v = y / kBlock - 1; v <= y / kBlock + 1; ++v) {
        for (int u = x / kBlock - 1; u <= x / kBlock + 1; ++u) {
          if (blocks.Contains(u, v) && blocks(u, v) != 0) near(x, y) = 255;
        }
      }
    }
  }
  return near;
}

// One sweep of the fit is enough: photos are edited, not fitted.
CommandResult Recolor(const std::string& capture, const std::string& view, const fs::path& temp,
                      const std::vector<std::string>& more = {}) {
  const std::string folder = DataPath(capture).string();
  std::vector<std::string> arguments = {"recolor",
                                        folder,
                                        "--view",
                                        view,
                                        "--mask",
                                        ViewFile(folder + "/masks", view).string(),
                                        "--tint",
                                        "0.2,0.4,1",
                                        "--set",
                                        "iterations=1",
                                        "--output",
                                        (temp / "out.ply").string(),
                                        "--photos",
                                        (temp / "photos").string(),
                                        "--no-report-html",
                                        "--progress",
                                        "none"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return RunRetint(arguments);
}

TEST(Photos, AFlowerIsEditedInEveryPhotoAndNothingElseIs) {
  RETINT_REQUIRE_DATA("flower/masks");
  const TempFolder temp;
  const CommandResult result =
      Recolor("flower", "012.jpg", temp.path(), {"--mask-names", "metashape"});
  ASSERT_EQ(result.code, 0) << result.err;
  int edited = 0;
  for (const fs::path& photo : ListFolder(DataPath("flower/images"))) {
    const fs::path written = temp / "photos/images" / photo.filename();
    const Mask mask =
        ReadMask(MaskFile(temp / "photos/masks", photo.filename().string(), MaskNames::kMetashape));
    if (fs::equivalent(written, photo)) continue;
    ++edited;
    const Change change = ChangeOf(photo, written, mask);
    EXPECT_GT(change.inside, 20) << photo;
    EXPECT_EQ(ChangeOf(photo, written, Near(mask)).outside, 0) << photo;
    // The same quality: the file is about as large.
    EXPECT_NEAR(double(fs::file_size(written)) / double(fs::file_size(photo)), 1, 0.2) << photo;
  }
  EXPECT_GT(edited, 20);
}

std::vector<std::string> RefitOf(const fs::path& workspace, const fs::path& masks,
                                 const fs::path& output) {
  return {"refit",      workspace.string(),
          "--masks",    masks.string(),
          "--to",       "#3060ff",
          "--output",   (output / "out.ply").string(),
          "--set",      "iterations=1",
          "--photos",   (output / "photos").string(),
          "--progress", "none"};
}

// Every photo has its name, in any format; photos without masks are the originals.
TEST(Photos, UntouchedPhotosAreLinksAndMissingOnesAreNamed) {
  const TempFolder temp;
  fs::copy(TinyWorkspace(), temp / "ws", fs::copy_options::recursive);
  std::vector<std::string> names;
  for (const View* view : Workspace::Open(temp / "ws").reconstruction.ViewsByName()) {
    names.push_back(view->name);
  }
  const fs::path object = ListFolder(temp / "ws/truth/masks").front();
  fs::create_directory(temp / "masks");
  // One mask by its stem, inverted.
  Mask mask = ReadMask(ViewFile(object, names[0]));
  for (uint8_t& value : mask.data) value = uint8_t(255 - value);
  WritePng(MaskFile(temp / "masks", names[0], MaskNames::kStem), mask);
  fs::remove(temp / "ws/images" / names[1]);
  std::vector<std::string> arguments = RefitOf(temp / "ws", temp / "masks", temp.path());
  arguments.push_back("--invert-masks");
  for (int again = 0; again < 2; ++again) {  // also over its own output
    const CommandResult result = RunRetint(arguments);
    ASSERT_EQ(result.code, 0) << result.err;
    EXPECT_THAT(result.err, HasSubstr((temp / "ws/images" / names[1]).string()));
    EXPECT_FALSE(fs::exists(temp / "photos/images" / names[1]));
    for (size_t k = 2; k < names.size(); ++k) {
      EXPECT_TRUE(fs::equivalent(temp / "photos/images" / names[k], temp / "ws/images" / names[k]));
    }
    for (uint8_t& value : mask.data) value = uint8_t(255 - value);
    const Change change =
        ChangeOf(temp / "ws/images" / names[0], temp / "photos/images" / names[0], mask);
    EXPECT_GT(change.inside, 10);
    EXPECT_EQ(change.outside, 0) << "a PNG has no loss";
    for (uint8_t& value : mask.data) value = uint8_t(255 - value);
  }
}

TEST(Photos, TheWorkspaceIsNotWrittenOver) {
  const TempFolder temp;
  fs::copy(TinyWorkspace(), temp / "ws", fs::copy_options::recursive);
  const fs::path object = ListFolder(temp / "ws/truth/masks").front();
  std::vector<std::string> arguments = RefitOf(temp / "ws", object, temp.path());
  *std::find(arguments.begin(), arguments.end(), (temp / "photos").string()) =
      (temp / "ws").string();
  const CommandResult result = RunRetint(arguments);
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.err, HasSubstr("name another folder"));
}

// RealityScan's FULL_OPENCV with zeros is a pinhole.
TEST(Photos, ZeroDistortionIsNoDistortion) {
  const TempFolder temp;
  const fs::path ws = temp / "ws";
  fs::copy(TinyWorkspace(), ws, fs::copy_options::recursive);
  const fs::path object = ListFolder(ws / "truth/masks").front();
  Reconstruction model = Workspace::Open(ws).reconstruction;
  std::string bytes[2];
  for (int zeros = 0; zeros < 2; ++zeros) {
    if (zeros == 1) {
      for (auto& [id, camera] : model.cameras) {
        ASSERT_TRUE(camera.IsPinhole());
        camera.params = {camera.fx(), camera.fy(), camera.cx(), camera.cy(), 0, 0,
                         0,           0,           0,           0,           0, 0};
        camera.model = CameraModelId::kFullOpenCV;
      }
      fs::remove_all(ws / "sparse");
      WriteReconstructionBinary(ws / "sparse/0", model);
    }
    const CommandResult result = RunRetint(RefitOf(ws, object, temp.path()));
    ASSERT_EQ(result.code, 0) << result.err;
    bytes[zeros] = ReadFile(temp / "out.ply");
    for (const fs::path& photo : ListFolder(temp / "photos/images"))
      bytes[zeros] += ReadFile(photo);
  }
  EXPECT_TRUE(bytes[0] == bytes[1]);
}

}  // namespace
}  // namespace retint
