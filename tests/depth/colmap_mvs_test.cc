// SPDX-License-Identifier: BSD-3-Clause
// With a script that plays `colmap`, and with the real one where it is installed.
#include "depth/colmap_mvs.h"

#include <sys/stat.h>

#include <cmath>
#include <cstdlib>
#include <sstream>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "base/process.h"
#include "colmap_io/depth_map_io.h"
#include "colmap_io/image_io.h"
#include "colmap_io/workspace.h"
#include "tests/depth/plane_scene.h"
#include "tests/support/data.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class ColmapMvs : public testing::Test {
 protected:
  ColmapMvs() {
    view_.camera = Camera::Pinhole(7, 96, 72, 90, 94, 46, 37);
    view_.cam_from_world.rotation =
        Eigen::Quaterniond(Eigen::AngleAxisd(0.05, Eigen::Vector3d(3, -1, 2).normalized()));
    view_.cam_from_world.translation = {0.1, -0.2, 0.3};
  }

  // A script that knows where the workspace is ($workspace), then does `body`.
  ColmapMvsOptions Playing(const std::string& body) {
    const fs::path path = folder_ / "colmap";
    WriteFile(path, "#!/bin/sh\nfolder='" + folder_.path().string() +
                        "'\nprintf '%s\\n' \"$@\" >\"$folder/arguments\"\n"
                        "while [ $# -gt 1 ]; do\n"
                        "  if [ \"$1\" = --workspace_path ]; then workspace=$2; fi\n  shift\ndone\n"
                        "echo \"$workspace\" >\"$folder/where\"\n" +
                        body);
    chmod(path.c_str(), 0755);
    ColmapMvsOptions options;
    options.program = path.string();
    return options;
  }
  DepthEstimate Estimate(const ColmapMvsOptions& options) {
    return ColmapMvsEstimator(renderer_, options).Estimate(view_, monitor_);
  }
  // Where the last run's workspace was.
  fs::path Where() const {
    std::string text = ReadFile(folder_ / "where");
    while (!text.empty() && text.back() == '\n') text.pop_back();
    return text;
  }
  std::string Failure(const ColmapMvsOptions& options) {
    try {
      Estimate(options);
    } catch (const RunError& error) {
      return error.what();
    }
    return "it did not fail";
  }

  TempFolder folder_;
  PlaneScene plane_{4, 0.1, 0.2};
  Renderer renderer_{CreateBackend("cpu"), plane_.Model(4, 0.08, 1)};
  PosedCamera view_;
  Monitor monitor_;
};

TEST_F(ColmapMvs, ReadsTheMapThatTheProgramLeaves) {
  DepthMap map(96, 72, 0.0f);
  for (int y = 0; y < 72; ++y) {
    for (int x = 0; x < 48; ++x) map(x, y) = 3.5f;
  }
  WriteDepthMap(folder_ / "map.bin", map);
  std::vector<double> progress;
  Monitor monitor([&](const Progress& step) { progress.push_back(step.fraction); });
  const DepthEstimate estimate =
      ColmapMvsEstimator(
          renderer_,
          Playing(
              "for i in 1 2 3; do echo \" Sweep $i: 0.1s\"; done\n"
              "cp \"$folder/map.bin\" \"$workspace/stereo/depth_maps/view.png.photometric.bin\"\n"))
          .Estimate(view_, monitor);
  EXPECT_EQ(estimate.method, "colmap-mvs");
  EXPECT_NEAR(estimate.depth(20, 30), 3.5, 1e-5);
  EXPECT_EQ(estimate.valid(20, 30), 255);
  // The half that the program did not measure is the Gaussians', a rough depth: 2 %.
  const double z = [&] {
    const Eigen::Vector3d center = view_.Center();
    const Eigen::Vector3d far = view_.Unproject({80.5, 30.5}, 1) - center;
    // Where center + t far meets z = distance + slope_x x + slope_y y.
    return (plane_.distance + plane_.slope_x * center.x() + plane_.slope_y * center.y() -
            center.z()) /
           (far.z() - plane_.slope_x * far.x() - plane_.slope_y * far.y());
  }();
  EXPECT_NEAR(estimate.depth(80, 30) / z, 1, 0.02);
  EXPECT_EQ(estimate.valid(80, 30), 0);
  EXPECT_NEAR(estimate.valid_fraction, 0.5, 0.02) << "small holes at the rim may be closed";
  EXPECT_THAT(estimate.reason, HasSubstr("COLMAP measured"));
  EXPECT_TRUE(std::is_sorted(progress.begin(), progress.end()));
  EXPECT_EQ(progress.back(), 1);
  EXPECT_FALSE(fs::exists(Where())) << "the temporary workspace is removed";
}

TEST_F(ColmapMvs, WritesADenseWorkspaceOfRendersWithKnownPoses) {
  ColmapMvsOptions options = Playing("cp -r \"$workspace\" \"$folder/kept\"\nexit 3\n");
  options.sources = 4;
  options.angle = 10;
  EXPECT_THROW(Estimate(options), RunError);
  const Workspace kept = Workspace::Open(folder_ / "kept");
  ASSERT_EQ(kept.reconstruction.views.size(), 5u);
  const View& own = kept.RequireView("view.png");
  EXPECT_TRUE(kept.reconstruction.Posed(own).cam_from_world.translation.isApprox(
      view_.cam_from_world.translation, 1e-12));
  EXPECT_TRUE(kept.reconstruction.Posed(own).cam_from_world.rotation.isApprox(
      view_.cam_from_world.rotation, 1e-12));
  EXPECT_EQ(kept.reconstruction.cameras.at(1).params, view_.camera.params);
  for (const auto& [id, view] : kept.reconstruction.views) {
    const PosedCamera camera = kept.reconstruction.Posed(view);
    const Image render = renderer_.Render(camera).rgb, photo = kept.ReadPhoto(view);
    double worst = 0;
    for (size_t i = 0; i < photo.data.size(); ++i) {
      const double expected = std::clamp(render.data[i], 0.0f, 1.0f);
      worst = std::max(worst, std::abs(photo.data[i] - expected));
    }
    EXPECT_LE(worst, 0.5 / 255 + 1e-6) << view.name << ": rounded to 8 bits, nothing else";
  }
  // Rays to the middle of the scene, about 4 away, meet at about the angle asked for.
  const Eigen::Vector3d middle = view_.Unproject({46, 37}, 4.2);
  for (int k = 1; k <= 4; ++k) {
    const View& source = kept.RequireView("source" + std::to_string(k) + ".png");
    const Eigen::Vector3d a = middle - view_.Center();
    const Eigen::Vector3d b = middle - kept.reconstruction.Posed(source).Center();
    const double degrees = std::acos(a.normalized().dot(b.normalized())) * 180 / M_PI;
    EXPECT_NEAR(degrees, 10, 1.5) << source.name;
  }
  EXPECT_EQ(ReadFile(folder_ / "kept/stereo/patch-match.cfg"),
            "view.png\nsource1.png, source2.png, source3.png, source4.png\n");
  for (const char* name : {"depth_maps", "normal_maps", "consistency_graphs"}) {
    EXPECT_TRUE(fs::is_directory(folder_ / "kept/stereo" / name)) << name;
  }
}

TEST_F(ColmapMvs, GivesTheRangeOfDepthsToSearch) {
  EXPECT_THROW(Estimate(Playing("exit 3\n")), RunError);
  std::istringstream arguments(ReadFile(folder_ / "arguments"));
  std::string line;
  std::getline(arguments, line);
  EXPECT_EQ(line, "patch_match_stereo");
  double nearest = 0, farthest = 0;
  for (std::string value; std::getline(arguments, line);) {
    if (line.ends_with("depth_min") && std::getline(arguments, value)) nearest = std::stod(value);
    if (line.ends_with("depth_max") && std::getline(arguments, value)) farthest = std::stod(value);
  }
  RenderRequest request;
  request.depth_median = true;
  std::vector<float> depths = renderer_.Render(view_, request).depth_median.data;
  std::erase(depths, 0.0f);
  const auto [low, high] = std::minmax_element(depths.begin(), depths.end());
  EXPECT_LT(nearest, *low);
  EXPECT_GT(nearest, 0.5 * *low);
  EXPECT_GT(farthest, *high);
  EXPECT_LT(farthest, 2 * *high);
}

TEST_F(ColmapMvs, TellsWhatTheProgramSaid) {
  const std::string text =
      Failure(Playing("for i in 1 2 3 4 5; do echo step $i; done; echo 'no memory' >&2; exit 9\n"));
  EXPECT_THAT(text, AllOf(HasSubstr("exit code 9"), HasSubstr("step 4 / step 5 / no memory"),
                          Not(HasSubstr("step 3")), HasSubstr((folder_ / "colmap").string())));
  EXPECT_THAT(Failure(Playing("exit 1\n")), HasSubstr("printed nothing"));
  EXPECT_THAT(Failure(Playing("exit 0\n")), HasSubstr("left no depth map"));
  EXPECT_FALSE(fs::exists(Where()));
}

TEST_F(ColmapMvs, RefusesADamagedMap) {
  EXPECT_THROW(Estimate(Playing("printf '96&72&1&short' "
                                ">\"$workspace/stereo/depth_maps/view.png.photometric.bin\"\n")),
               InputError);
}

TEST_F(ColmapMvs, EndsTheProgramWhenCancelled) {
  const ColmapMvsOptions options = Playing("touch \"$folder/ready\"\nsleep 600\n");
  std::thread user([&] {
    while (!fs::exists(folder_ / "ready")) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    monitor_.Cancel();
  });
  EXPECT_THROW(Estimate(options), Cancelled);
  user.join();
  EXPECT_FALSE(fs::exists(Where()));
}

TEST_F(ColmapMvs, RefusesBadOptionsAndMissingPrograms) {
  ColmapMvsOptions options;
  options.program = "retint-no-such-program";
  try {
    ColmapMvsEstimator(renderer_, options);
    FAIL() << "a missing program was taken";
  } catch (const OptionError& error) {
    EXPECT_THAT(error.what(),
                AllOf(HasSubstr("retint-no-such-program"), HasSubstr("`colmap_program`")));
  }
  options = Playing("exit 0\n");
  options.sources = 1;
  EXPECT_THROW(ColmapMvsEstimator(renderer_, options), OptionError);
  options.sources = 8;
  options.angle = 0;
  EXPECT_THROW(ColmapMvsEstimator(renderer_, options), OptionError);
  // A view that looks away has nothing to measure.
  view_.cam_from_world.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(3, Eigen::Vector3d::UnitY()));
  EXPECT_THROW(Estimate(Playing("exit 0\n")), InputError);
}

TEST_F(ColmapMvs, TheRealOneSaysThatItHasNoCuda) {
  if (FindProgram("colmap").empty()) GTEST_SKIP() << "needs colmap";
  std::string version;
  RunProcess(FindProgram("colmap"), {"help"}, monitor_,
             [&](std::string_view line) { version += line; });
  if (version.find("without CUDA") == std::string::npos) {
    GTEST_SKIP() << "this COLMAP was built with CUDA";
  }
  EXPECT_THAT(Failure({}), AllOf(HasSubstr("was built without CUDA"), HasSubstr("`colmap_program`"),
                                 HasSubstr("it said: ")));
}

}  // namespace
}  // namespace retint
