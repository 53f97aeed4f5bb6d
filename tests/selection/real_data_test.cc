// SPDX-License-Identifier: BSD-3-Clause
// The registration's and the masks' targets on real captures, with the Gaussians' own depth (the
// roughest that there is).
#include <algorithm>
#include <map>

#include <gtest/gtest.h>

#include "colmap_io/image_io.h"
#include "colmap_io/workspace.h"
#include "selection/mask_projector.h"
#include "selection/registration.h"
#include "splat_io/splat_io.h"
#include "tests/support/data.h"

namespace retint {
namespace {

// A capture with one painted view.
struct Capture {
  Workspace workspace;
  Renderer renderer;
  const View& view;
  PosedCamera posed;
  Mask mask;
  DepthMap depth;

  Capture(const std::string& name, const std::string& view_name)
      : workspace(Workspace::Open(DataPath(name))),
        renderer(CreateBackend("cpu"), ReadSplat(DataPath(name + "/splat.ply"))),
        view(workspace.RequireView(view_name)),
        posed(workspace.reconstruction.Posed(view)),
        mask(ReadMask(DataPath(name + "/masks/" + view_name + ".png"))) {
    RenderRequest request;
    request.rgb = false;
    request.depth_median = true;
    depth = renderer.Render(posed, request).depth_median;
  }
  SelectionCloud Cloud() const { return MakeCloud(posed, view.name, mask, depth, {}, {}, {}); }
  RegistrationSummary Registered(SelectionCloud& cloud) const {
    return Register(cloud, posed, &view, mask, depth, workspace.reconstruction, {});
  }
  ProjectedMasks Project(const std::vector<const View*>& views) {
    SelectionCloud cloud = Cloud();
    Registered(cloud);
    Monitor monitor;
    return ProjectMasks(cloud, {{view.name, posed, mask}}, workspace.reconstruction, views,
                        renderer, {}, monitor);
  }
};

struct Overlap {
  double iou = 0, precision = 0;
};

Overlap Compare(const Mask& mask, const Mask& truth) {
  double both = 0, in_mask = 0, in_truth = 0;
  for (size_t i = 0; i < truth.data.size(); ++i) {
    const bool a = mask.data[i] >= 128, b = truth.data[i] >= 128;
    both += a && b;
    in_mask += a;
    in_truth += b;
  }
  return {both / (in_mask + in_truth - both), both / std::max(1.0, in_mask)};
}

TEST(RealData, RegistrationBringsADisturbedFoxBack) {
  RETINT_REQUIRE_DATA("fox");
  const Capture fox("fox", "0025.jpg");
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

TEST(RealData, FlowerMasksAgreeWithTheTruth) {
  RETINT_REQUIRE_DATA("flower");
  Capture flower("flower", "012.jpg");
  // Six of the 24 other views, the corners and the middle; all 24 are in docs/benchmarks.md.
  std::vector<const View*> views = {&flower.view};
  for (const char* name : {"000.jpg", "004.jpg", "010.jpg", "014.jpg", "020.jpg", "024.jpg"}) {
    views.push_back(&flower.workspace.RequireView(name));
  }
  const auto projected = flower.Project(views);
  double sum = 0;
  for (const auto& [name, mask] : projected.masks) {
    if (name == flower.view.name) continue;
    sum += Compare(mask, ReadMask(DataPath("flower/truth/" + name + ".png"))).iou;
  }
  EXPECT_GT(sum / 6, 0.89);  // the target; 0.92 is reached
}

TEST(RealData, FoxMasksStayOnTheFox) {
  RETINT_REQUIRE_DATA("fox");
  Capture fox("fox", "0025.jpg");
  std::vector<const View*> views = {&fox.view, &fox.workspace.RequireView("0001.jpg")};
  const auto all = fox.workspace.reconstruction.ViewsByName();
  for (size_t i = 3; i < all.size(); i += 8) {
    if (all[i] != views[0] && all[i] != views[1]) views.push_back(all[i]);
  }
  const auto projected = fox.Project(views);
  const Overlap other =
      Compare(projected.masks.at("0001.jpg"), ReadMask(DataPath("fox/truth/0001.jpg.png")));
  EXPECT_GT(other.precision, 0.95);
  EXPECT_GT(other.iou, 0.35);  // the other cheek cannot be seen from 0025
  EXPECT_GT(Compare(projected.masks.at("0025.jpg"), fox.mask).iou, 0.95);
}

}  // namespace
}  // namespace retint
