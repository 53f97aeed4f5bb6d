// SPDX-License-Identifier: BSD-3-Clause
#include "selection/splat_raster.h"

#include <algorithm>
#include <cmath>

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

namespace retint {
namespace {

struct Box {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;  // half-open
};

// Pixels whose centres lie within `reach` of `at`, clipped to the image.
Box BoxAround(const Eigen::Vector2d& at, double reach_x, double reach_y, const Camera& camera) {
  const auto clip = [](double value, int size) {
    return static_cast<int>(std::clamp(value, 0.0, double(size)));
  };
  return {clip(std::ceil(at.x() - reach_x - 0.5), camera.width),
          clip(std::ceil(at.y() - reach_y - 0.5), camera.height),
          clip(std::floor(at.x() + reach_x - 0.5) + 1, camera.width),
          clip(std::floor(at.y() + reach_y - 0.5) + 1, camera.height)};
}

// `project(point, &splat)` gives each point its box; `cover(splat, x, y)` its coverage of a pixel.
// Bands of rows run in parallel; the maximum does not depend on their order.
template <typename Splat, typename Project, typename Cover>
ScalarImage Draw(const SelectionCloud& cloud, const Camera& camera, const Project& project,
                 const Cover& cover) {
  constexpr int kBandRows = 32;
  std::vector<Splat> splats(cloud.points.size());
  tbb::parallel_for(tbb::blocked_range<size_t>(0, splats.size(), 4096), [&](const auto& range) {
    for (size_t i = range.begin(); i < range.end(); ++i) project(cloud.points[i], &splats[i]);
  });
  std::erase_if(splats, [](const Splat& splat) {
    return splat.box.x0 >= splat.box.x1 || splat.box.y0 >= splat.box.y1;
  });
  ScalarImage image(camera.width, camera.height);
  const int bands = (camera.height + kBandRows - 1) / kBandRows;
  tbb::parallel_for(0, bands, [&](int band) {
    const int first = band * kBandRows, last = std::min(camera.height, first + kBandRows);
    for (const auto& splat : splats) {
      for (int y = std::max(first, splat.box.y0); y < std::min(last, splat.box.y1); ++y) {
        for (int x = splat.box.x0; x < splat.box.x1; ++x) {
          float& pixel = image(x, y);
          if (pixel < splat.coverage) pixel = std::max(pixel, cover(splat, x, y));
        }
      }
    }
  });
  return image;
}

bool IsHidden(const DepthMap& depth, int x, int y, double z, double tolerance) {
  const float front = depth(x, y);
  return front > 0 && z > front * (1 + tolerance);
}

struct Quad {
  Box box;
  float coverage = 0, z = 0;
};

struct Surfel {
  Box box;
  float coverage = 0, radius = 0, footprint = 0;
  Eigen::Vector3f center, normal;  // camera frame
};

}  // namespace

ScalarImage DrawQuads(const SelectionCloud& cloud, const PosedCamera& view, const DepthMap& depth,
                      double side, double depth_tolerance) {
  const auto project = [&](const SelectionPoint& point, Quad* quad) {
    const auto at = view.Project(point.position.cast<double>());
    if (!at) return;
    quad->box = BoxAround(at->head<2>(), side / 2, side / 2, view.camera);
    quad->coverage = point.coverage;
    quad->z = static_cast<float>(at->z());
  };
  return Draw<Quad>(cloud, view.camera, project, [&](const Quad& quad, int x, int y) {
    return IsHidden(depth, x, y, quad.z, depth_tolerance) ? 0.0f : quad.coverage;
  });
}

ScalarImage DrawSurfels(const SelectionCloud& cloud, const PosedCamera& view, const DepthMap& depth,
                        double scale, double depth_tolerance) {
  const Eigen::Matrix3d rotation = view.cam_from_world.rotation.toRotationMatrix();
  const auto project = [&](const SelectionPoint& point, Surfel* surfel) {
    const Eigen::Vector3d center =
        rotation * point.position.cast<double>() + view.cam_from_world.translation;
    const auto at = view.camera.ImgFromCam(center);
    // A disc that reaches the camera's plane has no bounded box: leave it out.
    const double radius = scale * point.footprint, reach = radius + 0.5 * point.footprint;
    if (!at || center.z() <= reach) return;
    const double nearest = center.z() - reach;
    surfel->box = BoxAround(*at, std::max(0.5, view.camera.fx() * reach / nearest),
                            std::max(0.5, view.camera.fy() * reach / nearest), view.camera);
    surfel->coverage = point.coverage;
    surfel->radius = static_cast<float>(radius);
    surfel->footprint = point.footprint;
    surfel->center = center.cast<float>();
    surfel->normal = point.normal.isZero()
                         ? (-center.normalized()).cast<float>().eval()
                         : (rotation * point.normal.cast<double>()).cast<float>().eval();
  };
  const auto fx = static_cast<float>(view.camera.fx()), fy = static_cast<float>(view.camera.fy());
  const auto cx = static_cast<float>(view.camera.cx()), cy = static_cast<float>(view.camera.cy());
  return Draw<Surfel>(cloud, view.camera, project, [&](const Surfel& surfel, int x, int y) {
    const Eigen::Vector3f ray((float(x) + 0.5f - cx) / fx, (float(y) + 0.5f - cy) / fy, 1);
    const float slope = surfel.normal.dot(ray);
    const float z = surfel.normal.dot(surfel.center) / slope;
    const float distance = (z * ray - surfel.center).norm();
    const float fade = (surfel.radius - distance) / std::max(surfel.footprint, 1e-12f) + 0.5f;
    if (!(fade > 0) || IsHidden(depth, x, y, z, depth_tolerance)) return 0.0f;
    return surfel.coverage * std::min(1.0f, fade);
  });
}

}  // namespace retint
