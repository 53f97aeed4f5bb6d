// SPDX-License-Identifier: BSD-3-Clause
#include "synthetic/lens.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "base/error.h"
#include "base/option_name.h"
#include "scene/camera_projection.h"
#include "scene/undistortion.h"
#include "synthetic/tracer.h"

namespace retint {

using namespace synthetic;

Camera MakeLens(std::string_view model, const Camera& camera) {
  const CameraModelInfo* info = FindCameraModel(model);
  Camera lens = camera;
  const double f = camera.fx(), cx = camera.cx(), cy = camera.cy();
  switch (info ? info->id : CameraModelId::kPinhole) {
    case CameraModelId::kSimpleRadial:
      lens.params = {f, cx, cy, -0.15};
      break;
    case CameraModelId::kOpenCV:
      lens.params = {f, f, cx, cy, -0.2, 0.05, 1e-3, -1e-3};
      break;
    case CameraModelId::kOpenCVFisheye:
      lens.params = {f, f, cx, cy, -0.02, 0.003, 0, 0};
      break;
    case CameraModelId::kEquirectangular:
      lens.width = 4 * camera.width;
      lens.height = 2 * camera.width;
      lens.params = {double(lens.width), double(lens.height)};
      break;
    default:
      throw OptionError(OptionName("camera_model") + " '" + std::string(model) +
                        "': there are PINHOLE, SIMPLE_RADIAL, OPENCV, OPENCV_FISHEYE and "
                        "EQUIRECTANGULAR");
  }
  lens.model = info->id;
  return lens;
}

void TakeThroughLens(std::string_view model, const SyntheticOptions& options, SyntheticScene* scene,
                     Monitor& monitor) {
  TakeThroughLens(MakeLens(model, scene->reconstruction.cameras.begin()->second), options, scene,
                  monitor);
}

void TakeThroughLens(Camera lens, const SyntheticOptions& options, SyntheticScene* scene,
                     Monitor& monitor) {
  Reconstruction& reconstruction = scene->reconstruction;
  const CameraId id = reconstruction.cameras.begin()->first;
  const Camera pinhole = reconstruction.cameras.at(id);
  lens.id = id;
  const CameraProjection projection(lens);
  const bool distance = Undistort(lens).DepthIsDistance();
  const SyntheticTracer tracer(options, monitor);
  size_t done = 0;
  for (auto& [view_id, view] : reconstruction.views) {
    monitor.Step("photos", double(done), double(scene->views.size()));
    const Rigid3d& pose = view.cam_from_world;
    const Eigen::Quaterniond world_from_cam = pose.rotation.conjugate();
    const auto ray_of = [&](double x, double y) -> std::optional<Ray> {
      const auto ray = projection.CamFromImg({x, y});
      if (!ray) return std::nullopt;
      const Vec3 direction = distance ? *ray : Vec3(*ray / ray->z());
      return Ray{pose.OriginInSource(), world_from_cam * direction};
    };
    SyntheticView& truth = scene->views[done++];
    const std::string name = truth.name;
    truth = tracer.Trace(lens.width, lens.height, ray_of);
    truth.name = name;
    for (Observation& observation : view.observations) {
      const Eigen::Vector2d flat = pinhole.CamFromImg(observation.xy).value();
      observation.xy = projection.ImgFromCam({flat.x(), flat.y(), 1}).value();
    }
  }
  reconstruction.cameras.at(id) = lens;
}

}  // namespace retint
