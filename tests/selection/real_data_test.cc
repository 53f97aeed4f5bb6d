// SPDX-License-Identifier: BSD-3-Clause
// The registration's targets on a real capture, with the default depth and with the Gaussians' own,
// the roughest that there is. The masks' are in tests/e2e/captures_test.cc.
#include <map>
#include <string>

#include <gtest/gtest.h>

#include "colmap_io/image_io.h"
#include "colmap_io/workspace.h"
#include "depth/factory.h"
#include "selection/registration.h"
#include "splat_io/splat_io.h"
#include "tests/support/data.h"

namespace retint {
namespace {

// A capture with one painted view and its depth.
struct Capture {
  Workspace workspace;
  Renderer renderer;
  const View& view;
  PosedCamera posed;
  Mask mask;
  DepthEstimate depth;

  Capture(const std::string& name, const std::string& view_name, const std::string& method)
      : workspace(Workspace::Open(DataPath(name))),
        renderer(CreateBackend("cpu"), ReadSplat(DataPath(name + "/splat.ply"))),
        view(workspace.RequireView(view_name)),
        posed(workspace.reconstruction.Posed(view)),
        mask(ReadMask(DataPath(name + "/masks/" + view_name + ".png"))) {
    Monitor monitor;
    depth = MakeDepthEstimator(method, renderer, &workspace, {})->Estimate(posed, monitor);
  }
  SelectionCloud Cloud() const {
    return MakeCloud(posed, view.name, mask, depth.depth, depth.valid, {}, {});
  }
  RegistrationSummary Registered(SelectionCloud& cloud) const {
    return Register(cloud, posed, &view, mask, depth.depth, workspace.reconstruction, {});
  }
};

class RealRegistration : public testing::TestWithParam<std::string> {};

TEST_P(RealRegistration, BringsADisturbedFoxBack) {
  RETINT_REQUIRE_DATA("fox");
  const Capture fox("fox", "0025.jpg", GetParam());
  const SelectionCloud truth = fox.Cloud();
  // The residual is judged by pairs of our own: the nearest source pixel of each tracked point.
  std::map<std::pair<int, int>, size_t> by_pixel;
  for (size_t i = 0; i < truth.points.size(); ++i) {
    by_pixel[{truth.points[i].x, truth.points[i].y}] = i;
  }
  std::vector<std::pair<size_t, Eigen::Vector3d>> pairs;
  for (const auto& observation : fox.view.observations) {
    const auto found = fox.workspace.reconstruction.points.find(observation.point_id);
    if (found == fox.workspace.reconstruction.points.end()) continue;
    const auto at = fox.posed.Project(found->second.xyz);
    if (!at) continue;
    const auto pixel = by_pixel.find({int(at->x()), int(at->y())});
    if (pixel == by_pixel.end()) continue;
    const auto& point = truth.points[pixel->second];
    const double z = fox.posed.Project(point.position.cast<double>())->z();
    if (std::abs(z / at->z() - 1) < 0.15) pairs.emplace_back(pixel->second, found->second.xyz);
  }
  ASSERT_GT(pairs.size(), 100u);
  const auto rms = [&](const SelectionCloud& cloud) {
    double squared = 0;
    for (const auto& [i, xyz] : pairs) {
      squared += (cloud.points[i].position.cast<double>() - xyz).squaredNorm();
    }
    return std::sqrt(squared / double(pairs.size()));
  };
  const double undisturbed = rms(truth);
  SelectionCloud same = truth;
  const auto summary = fox.Registered(same);
  EXPECT_LE(summary.heldout_after, summary.heldout_before);
  EXPECT_LT(rms(same), 1.02 * undisturbed) << summary.BriefReport();  // a few points trade places

  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  for (const auto& point : truth.points) center += point.position.cast<double>();
  center /= double(truth.points.size());
  const Eigen::Vector3d axis = Eigen::Vector3d(1, -2, 0.7).normalized();
  const Eigen::Quaterniond rotation(Eigen::AngleAxisd(2 * M_PI / 180, axis));
  for (const double scale : {0.95, 1.05}) {
    SelectionCloud cloud = truth;
    for (auto& point : cloud.points) {
      const Eigen::Vector3d from = point.position.cast<double>() - center;
      point.position =
          (center + scale * (rotation * from) + Eigen::Vector3d(0.1, -0.08, 0.15)).cast<float>();
      point.normal = (rotation * point.normal.cast<double>()).cast<float>();
    }
    EXPECT_GT(rms(cloud), 1.5 * undisturbed);
    const auto report = fox.Registered(cloud);
    EXPECT_TRUE(report.accepted);
    EXPECT_LT(rms(cloud), 1.2 * undisturbed) << report.BriefReport();
  }
}

INSTANTIATE_TEST_SUITE_P(Depths, RealRegistration, testing::Values("stereo-hv", "gaussian"),
                         [](const auto& method) {
                           return std::string(method.param == "gaussian" ? "Gaussian" : "StereoHv");
                         });

}  // namespace
}  // namespace retint
