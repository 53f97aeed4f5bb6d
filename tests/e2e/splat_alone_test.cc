// SPDX-License-Identifier: BSD-3-Clause
// A splat without a workspace, and one in another frame than its workspace.
#include <algorithm>
#include <regex>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "colmap_io/nerfstudio.h"
#include "colmap_io/workspace.h"
#include "scene/transform.h"
#include "splat_io/splat_io.h"
#include "tests/e2e/command.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using testing::HasSubstr;

std::string Splat() { return (TinyWorkspace() / "splat.ply").string(); }

double MeanRedness(const Image& image, const Mask& mask, bool inside) {
  double sum = 0, count = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      if ((mask(x, y) > 0) != inside) continue;
      sum += image(x, y, 0) - 0.5 * (image(x, y, 1) + image(x, y, 2));
      count += 1;
    }
  }
  return sum / count;
}

TEST(SplatAlone, APaintedViewIsRecolored) {
  TempFolder temp;
  CommandResult result = RunRetint(
      {"cameras", Splat(), "--views", "8", "--output", (temp / "ws").string(), "--quiet"});
  ASSERT_EQ(result.code, 0) << result.err;
  const Workspace workspace = Workspace::Open(temp / "ws");
  EXPECT_EQ(workspace.reconstruction.views.size(), 8u);
  EXPECT_GT(workspace.reconstruction.points.size(), 50u);
  const View& view = *workspace.reconstruction.ViewsByName().front();
  const Image before = workspace.ReadPhoto(view);
  // The middle of the first view is painted red, without naming the workspace: the same views are
  // placed again.
  Mask mask(before.width, before.height, 0);
  for (int y = before.height * 2 / 5; y < before.height * 3 / 5; ++y) {
    for (int x = before.width * 2 / 5; x < before.width * 3 / 5; ++x) mask(x, y) = 255;
  }
  WritePng(temp / "mask.png", mask);
  result = RunRetint({"recolor", Splat(), "--views", "8", "--view", view.name, "--mask",
                      (temp / "mask.png").string(), "--to", "#ff0000", "--target", "photo",
                      "--output", (temp / "red.ply").string(), "--progress", "none"});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("8 of 8 views have no photo, and are fitted to their renders"));
  result = RunRetint({"render", (temp / "ws").string(), "--splat", (temp / "red.ply").string(),
                      "--view", view.name, "--output", (temp / "after").string(), "--quiet"});
  ASSERT_EQ(result.code, 0) << result.err;
  const Image after = ReadImage(temp / "after" / (view.name + ".png"));
  EXPECT_GT(MeanRedness(after, mask, true), MeanRedness(before, mask, true) + 0.2);
  // Parts of the object beyond the paint may change too; most of the picture does not.
  EXPECT_LT(MeanRedness(after, mask, false), MeanRedness(before, mask, false) + 0.1);
}

// --views is stronger than the number of a job, and refused for a session, which has its views.
TEST(SplatAlone, ViewsOfAJobGiveWayAndThoseOfASessionStay) {
  TempFolder temp;
  const std::string job = (temp / "job.json").string(), session = (temp / "s.retint").string();
  CommandResult result = RunRetint(
      {"cameras", Splat(), "--views", "6", "--output", (temp / "ws").string(), "--quiet"});
  ASSERT_EQ(result.code, 0) << result.err;
  const Workspace workspace = Workspace::Open(temp / "ws");
  const View& view = *workspace.reconstruction.ViewsByName().front();
  const Image photo = workspace.ReadPhoto(view);
  WritePng(temp / "mask.png", Mask(photo.width, photo.height, 255));
  WriteFile(job, R"({"retint_job": 1, "scene": {"views": 6, "splat": ")" + Splat() +
                     R"("}, "regions": [{"name": "a", "masks": {")" + view.name +
                     R"(": "mask.png"}, "options": {}, "edit": {"operations": [{"op": "gray"}]}}],
                     "options": {"mm": {"iterations": 1}}, "outputs": {"session": "s.retint"}})");
  result = RunRetint({"run", job, "--no-cache", "--progress", "none"});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(RunRetint({"info", job, "--compare", "1"}).out, HasSubstr("views        6,"));
  EXPECT_THAT(RunRetint({"info", session, "--compare", "1"}).out, HasSubstr("views        6,"));
  EXPECT_THAT(RunRetint({"info", job, "--compare", "1", "--views", "8"}).out,
              HasSubstr("views        8,"));
  result = RunRetint({"info", session, "--compare", "1", "--views", "40"});
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.err, HasSubstr("s.retint has its own"));
}

std::vector<std::string> CamerasTo(const std::filesystem::path& folder, const std::string& views) {
  return {"cameras", Splat(), "--views", views, "--output", folder.string(), "--quiet"};
}

TEST(SplatAlone, CamerasDoNotWriteOverAWorkspace) {
  TempFolder temp;
  const auto refused = [&](const std::filesystem::path& folder, bool overwrite,
                           const std::string& reason) {
    SCOPED_TRACE(folder);
    std::vector<std::string> arguments = CamerasTo(folder, "4");
    if (overwrite) arguments.push_back("--overwrite");
    const auto before = FilesBelow(folder);
    const CommandResult result = RunRetint(arguments);
    EXPECT_EQ(result.code, 2);
    EXPECT_THAT(result.err, HasSubstr(reason));
    EXPECT_EQ(CountLines(result.err), 1);
    EXPECT_EQ(FilesBelow(folder), before);
  };
  std::filesystem::copy(TinyWorkspace(), temp / "capture",
                        std::filesystem::copy_options::recursive);
  const std::string model = ReadFile(temp / "capture/sparse/0/images.bin");
  refused(temp / "capture", false, "holds a model already");
  refused(temp / "capture", true, "holds a model that retint cameras did not write");
  EXPECT_EQ(ReadFile(temp / "capture/sparse/0/images.bin"), model);
  WritePng(temp / "photos/images/IMG_1.jpg.png", Image8(4, 4));
  refused(temp / "photos", false, "holds pictures already");
  WritePng(temp / "photos/images/view_002.png", Image8(4, 4));
  refused(temp / "photos", true, "images/view_002.png would count as a photo of a new view");
}

TEST(SplatAlone, CamerasReplaceEarlierOnesWhole) {
  TempFolder temp;
  const auto ws = temp / "ws";
  ASSERT_EQ(RunRetint(CamerasTo(ws, "6")).code, 0);
  CommandResult result = RunRetint(CamerasTo(ws, "4"));
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.err, HasSubstr("(--overwrite)"));
  WritePng(ws / "images/mine.png", Image8(4, 4));
  std::vector<std::string> again = CamerasTo(ws, "4");
  again.push_back("--overwrite");
  result = RunRetint(again);
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(Workspace::Open(ws).reconstruction.views.size(), 4u);
  EXPECT_THAT(FilesBelow(ws / "images"), testing::Each(testing::Not(HasSubstr("view_005.png"))));
  EXPECT_THAT(FilesBelow(ws / "images"), testing::Contains(HasSubstr("view_004.png")));
  EXPECT_THAT(FilesBelow(ws / "images"), testing::Contains(HasSubstr("mine.png")));
  // Without pictures, no old one counts as a photo of the new views.
  again.push_back("--no-images");
  ASSERT_EQ(RunRetint(again).code, 0);
  EXPECT_THAT(FilesBelow(ws / "images"), testing::Each(testing::Not(HasSubstr("view_"))));
  EXPECT_TRUE(std::filesystem::exists(ws / "images/mine.png"));
}

double Psnr(const std::string& info) {
  std::smatch found;
  EXPECT_TRUE(std::regex_search(info, found, std::regex("PSNR +([0-9.]+) dB"))) << info;
  return found.empty() ? 0 : std::stod(found[1]);
}

TEST(SplatElsewhere, AlignFindsTheFrame) {
  TempFolder temp;
  GaussianModel model = ReadSplat(Splat());
  const Sim3d splat_from_world{
      0.3, Eigen::Quaterniond(0.2, -0.5, 0.6, 0.4).normalized(), {4, -1, 2}};
  Transform(splat_from_world, model);
  WriteSplat(temp / "moved.ply", model);
  const std::string workspace = TinyWorkspace().string(), moved = (temp / "moved.ply").string();
  CommandResult result = RunRetint({"info", workspace, "--splat", Splat()});
  const double original = Psnr(result.out);
  result = RunRetint({"info", workspace, "--splat", moved, "--progress", "none"});
  EXPECT_THAT(result.err, HasSubstr("retint align"));

  result =
      RunRetint({"align", workspace, "--splat", moved, "--output", (temp / "back.ply").string(),
                 "--transform", (temp / "t.json").string(), "--progress", "none"});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("found from   points"));
  EXPECT_EQ(result.err, "");
  const Sim3d found = ReadWorldFromSplat(temp / "t.json");
  EXPECT_NEAR(found.scale, 1 / 0.3, 0.02 / 0.3);
  EXPECT_LT(found.rotation.angularDistance(splat_from_world.rotation.conjugate()), 0.02);
  // Fitted to the photos, it may show them a little better than the original does.
  constexpr double kLost = 0.1;
  result = RunRetint({"info", workspace, "--splat", (temp / "back.ply").string()});
  EXPECT_GE(Psnr(result.out), original - kLost) << result.err;
  for (const std::string& given : {(temp / "t.json").string(), std::string()}) {
    std::vector<std::string> info = {"info", workspace, "--splat", moved};
    if (!given.empty()) info.insert(info.end(), {"--world-from-splat", given});
    result = RunRetint(info);
    ASSERT_EQ(result.code, 0) << result.err;
    if (given.empty()) {
      EXPECT_LT(Psnr(result.out), original - 3);
    } else {
      EXPECT_GE(Psnr(result.out), original - kLost);
    }
  }
}

// Neither turned nor scaled, however rough the sparse points are.
TEST(SplatElsewhere, AlignKnowsATranslation) {
  TempFolder temp;
  GaussianModel model = ReadSplat(Splat());
  const Sim3d splat_from_world{1, Eigen::Quaterniond::Identity(), {0.25, 0.1, -0.2}};
  Transform(splat_from_world, model);
  WriteSplat(temp / "moved.ply", model);
  const CommandResult result =
      RunRetint({"align", TinyWorkspace().string(), "--splat", (temp / "moved.ply").string(),
                 "--transform", (temp / "t.json").string(), "--progress", "none"});
  ASSERT_EQ(result.code, 0) << result.err;
  const Sim3d found = ReadWorldFromSplat(temp / "t.json");
  EXPECT_EQ(found.scale, 1);
  EXPECT_EQ(found.rotation.w(), 1);
  // The scene is some units wide, and its renders here 160 pixels.
  EXPECT_LT((found.translation + splat_from_world.translation).norm(), 0.02);
}

// The same shapes without their colors, all gray: no frame makes them look like the photos.
TEST(SplatElsewhere, AlignWarnsOfAnotherScene) {
  TempFolder temp;
  GaussianModel model = ReadSplat(Splat());
  std::fill(model.sh.begin(), model.sh.end(), 0.0F);
  WriteSplat(temp / "other.ply", model);
  const CommandResult result =
      RunRetint({"align", TinyWorkspace().string(), "--splat", (temp / "other.ply").string(),
                 "--transform", (temp / "t.json").string(), "--progress", "none"});
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("warning: renders and photos still disagree ("));
  EXPECT_THAT(result.err, HasSubstr("the splat seems to be of another scene"));
  EXPECT_TRUE(std::filesystem::exists(temp / "t.json"));
}

}  // namespace
}  // namespace retint
