// SPDX-License-Identifier: BSD-3-Clause
// Moves the canvas's camera: between pictures, toward the point under the cursor, by held keys, and
// back to the place that a session stored.
#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

#include "scene/camera_projection.h"
#include "viewer/canvas/canvas.h"

namespace retint {
namespace {

// Reads `count` finite numbers from the list `object[key]` into `values`; false if it has another
// form.
bool ReadNumbers(const nlohmann::json& object, const char* key, double* values, size_t count) {
  if (!object.contains(key) || !object[key].is_array() || object[key].size() != count) return false;
  for (size_t i = 0; i < count; ++i) {
    if (!object[key][i].is_number()) return false;
    values[i] = object[key][i].get<double>();
    if (!std::isfinite(values[i])) return false;
  }
  return true;
}

}  // namespace

const UserPicture* Canvas::picture() const {
  return facts_ && navigation_.view() ? &facts_->PictureOf(*navigation_.view()) : nullptr;
}

bool Canvas::GoTo(const std::string& name) {
  if (!controller_->IsOpen()) return false;
  const auto facts = controller_->facts();
  const UserPicture* to = facts->FindPicture(name);
  if (!to) return false;
  navigation_.GoTo(*to->faces.front(), facts->Shown(*to));
  CameraMoved();
  photos_->Photo(to->name);  // read it now: the user may hold P
  SayMissingPhoto();
  return true;
}

void Canvas::StepView(int by) {
  if (!controller_->IsOpen()) return;
  const std::vector<UserPicture>& pictures = controller_->facts()->pictures->all();
  const auto count = static_cast<std::ptrdiff_t>(pictures.size());
  std::ptrdiff_t at = 0;
  if (const UserPicture* shown = picture()) {
    at = shown - pictures.data();
  } else {
    // From a free camera: to the nearest picture.
    const Eigen::Vector3d here = navigation_.Rendered().Center();
    const auto away = [&](const UserPicture& one) {
      return (one.faces.front()->cam_from_world.OriginInSource() - here).norm();
    };
    at = std::ranges::min_element(pictures, {}, away) - pictures.begin();
    by = 0;
  }
  const std::ptrdiff_t index = (at + by % count + count) % count;
  GoTo(pictures[static_cast<size_t>(index)].name);
}

void Canvas::FrameSelection() {
  if (!controller_->IsOpen()) return;
  if (cloud_ && cloud_shown_ && !cloud_->points.empty()) {
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    for (const auto& point : cloud_->points) center += point.cast<double>();
    center /= static_cast<double>(cloud_->points.size());
    double radius = 0;
    for (const auto& point : cloud_->points) {
      radius = std::max(radius, (point.cast<double>() - center).norm());
    }
    navigation_.Frame(center, radius);
  } else {
    navigation_.Frame(navigation_.center(), navigation_.radius());
  }
  CameraMoved();
}

void Canvas::ResetCamera() {
  navigation_.Reset();
  CameraMoved();
}

void Canvas::Probe(const QPointF& at, ProbeFor what) {
  const PosedCamera camera = navigation_.Rendered();
  const QRectF rect = ImageRect(camera);
  if (!rect.contains(at)) return;
  const QPointF at_pixel = (at - rect.topLeft()) * devicePixelRatioF();
  const Eigen::Vector2d pixel(at_pixel.x(), at_pixel.y());
  if (camera.camera.IsPinhole()) return renderer_->Probe(camera, pixel, what);
  // Along the same ray through a pinhole. If a photo has several pinhole views, through the best
  // one.
  const auto ray = CameraProjection(camera.camera).CamFromImg(pixel);
  if (!ray) return;
  if (const UserPicture* shown = picture(); shown && shown->faces.size() > 1) {
    Eigen::Vector2d face_pixel;
    const int face = BestFace(*shown->photo->lens, *ray, &face_pixel);
    if (face < 0) return;
    const View& view = *shown->faces[static_cast<size_t>(face)];
    return renderer_->Probe(controller_->facts()->Posed(view), face_pixel, what);
  }
  const PosedCamera flat{Flattened(camera.camera), camera.cam_from_world};
  if (const auto flat_pixel = flat.camera.ImgFromCam(*ray)) {
    renderer_->Probe(flat, *flat_pixel, what);
  }
}

void Canvas::OnProbed(const PosedCamera& camera, const Eigen::Vector2d& pixel, ProbeFor what,
                      double depth) {
  if (!controller_->IsOpen()) return;
  if (what == ProbeFor::kPivot) {
    // A drag is going on. If the ray hits nothing, the drag turns about the focus.
    if (gesture_ == MouseGesture::kOrbit && depth > 0) {
      navigation_.SetPivot(camera.Unproject(pixel, depth));
    }
    return;
  }
  if (depth <= 0) {
    Q_EMIT hint(tr("There is nothing under the cursor to look at"));
    return;
  }
  navigation_.SetFocus(camera.Unproject(pixel, depth));
  CameraMoved();
}

std::string Canvas::CameraState() const {
  const PosedCamera camera = navigation_.Rendered();
  const Eigen::Quaterniond& q = camera.cam_from_world.rotation;
  const Eigen::Vector3d& t = camera.cam_from_world.translation;
  const Eigen::Vector3d& f = navigation_.focus();
  nlohmann::json state = {
      {"rotation_wxyz", {q.w(), q.x(), q.y(), q.z()}},
      {"translation", {t.x(), t.y(), t.z()}},
      {"focus", {f.x(), f.y(), f.z()}},
      {"fov_y", 2 * std::atan(0.5 * camera.camera.height / Flattened(camera.camera).fy())}};
  if (picture()) state["view"] = picture()->name;
  return state.dump();
}

bool Canvas::RestoreCamera(const std::string& text) {
  const auto state = nlohmann::json::parse(text, nullptr, false);
  if (!state.is_object() || !controller_->IsOpen()) return false;
  if (state.contains("view") && state["view"].is_string() &&
      GoTo(state["view"].get<std::string>())) {
    return true;
  }
  double q[4], t[3], f[3];
  if (!ReadNumbers(state, "rotation_wxyz", q, 4) || !ReadNumbers(state, "translation", t, 3) ||
      !ReadNumbers(state, "focus", f, 3) || !state.contains("fov_y") ||
      !state["fov_y"].is_number()) {
    return false;
  }
  const Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
  const double fov = state["fov_y"].get<double>();
  if (!(rotation.norm() > 1e-6) || !(fov > 0.01 && fov < 3.1)) return false;
  const double focal = 0.5 / std::tan(0.5 * fov);
  PosedCamera camera{Camera::Pinhole(0, 1, 1, focal, focal, 0.5, 0.5),
                     {rotation.normalized(), Eigen::Vector3d(t[0], t[1], t[2])}};
  navigation_.SetFree(camera, {f[0], f[1], f[2]});
  CameraMoved();
  return true;
}

void Canvas::FlyStep() {
  const auto axis = [this](const char* plus, const char* minus) {
    return double(flying_.count(plus)) - double(flying_.count(minus));
  };
  const Eigen::Vector3d direction(axis("fly.right", "fly.left"), axis("fly.down", "fly.up"),
                                  axis("fly.forward", "fly.back"));
  // A busy window must not make the camera jump.
  const double seconds = std::min(0.1, fly_clock_.restart() / 1000.0);
  if (direction.isZero() || !controller_->IsOpen()) return;
  navigation_.Fly(direction, seconds, fly_factor_);
  CameraMoved();
}

}  // namespace retint
