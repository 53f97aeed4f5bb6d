// SPDX-License-Identifier: BSD-3-Clause
#include "opening/photo_paint.h"

#include <algorithm>
#include <utility>

#include "base/error.h"
#include "scene/image_checks.h"
#include "scene/mask_pixels.h"

namespace retint {
namespace {

const DistortedPhoto& PhotoOf(const Workspace& workspace, const PaintedView& painted) {
  const DistortedPhoto* photo =
      workspace.photo_pixels ? workspace.photo_pixels->FindPhoto(painted.name) : nullptr;
  if (!photo) throw InputError("the workspace has no distorted photo " + painted.name);
  const Camera& camera = photo->lens->photo;
  RequireSize("the mask painted on " + painted.name, painted.mask, camera);
  if (!painted.seen.Empty()) RequireSize("what is seen in " + painted.name, painted.seen, camera);
  return *photo;
}

bool AnySeenInside(const PaintedView& view) {
  for (size_t p = 0; p < view.mask.data.size(); ++p) {
    if (IsInside(view.mask.data[p]) && (view.seen.Empty() || view.seen.data[p] != 0)) return true;
  }
  return false;
}

}  // namespace

PosedCamera PosedPhoto(const Workspace& workspace, const DistortedPhoto& photo) {
  const View& view = workspace.reconstruction.views.at(photo.faces.front());
  const Rigid3d& face = view.cam_from_world;
  const Eigen::Quaterniond photo_from_face = photo.lens->faces.front().face_from_photo.conjugate();
  return {photo.lens->photo, {photo_from_face * face.rotation, photo_from_face * face.translation}};
}

PosedCamera PosedPicture(const Workspace& workspace, const UserPicture& picture) {
  return picture.photo ? PosedPhoto(workspace, *picture.photo)
                       : workspace.reconstruction.Posed(*picture.faces.front());
}

std::vector<std::string> PaintedNames(const Workspace& workspace, const PaintedView& painted) {
  if (!IsOnPhoto(painted)) return {painted.name};
  std::vector<std::string> names;
  for (const ViewId face : PhotoOf(workspace, painted).faces) {
    names.push_back(workspace.reconstruction.views.at(face).name);
  }
  return names;
}

std::vector<PaintedView> OnViews(const Workspace& workspace, const PaintedView& painted) {
  if (!IsOnPhoto(painted)) return {painted};
  const PhotoPixels& pixels = *workspace.photo_pixels;
  std::vector<PaintedView> views;
  for (const ViewId face : PhotoOf(workspace, painted).faces) {
    const View& view = workspace.reconstruction.views.at(face);
    PaintedView on{view.name, workspace.reconstruction.Posed(view),
                   pixels.ToView(face, painted.mask), pixels.Reach(face), painted.outlined_by};
    if (!painted.seen.Empty()) {
      const Mask seen = pixels.ToView(face, painted.seen);
      for (size_t p = 0; p < seen.data.size(); ++p) {
        if (!IsInside(seen.data[p])) on.seen.data[p] = 0;
      }
    }
    views.push_back(std::move(on));
  }
  return views;
}

std::vector<PaintedView> OnViews(const Workspace& workspace,
                                 const std::vector<PaintedView>& painted) {
  std::vector<PaintedView> all;
  for (const PaintedView& one : painted) {
    std::vector<PaintedView> views = OnViews(workspace, one);
    if (views.size() > 1 && std::ranges::any_of(views, AnySeenInside)) {
      std::erase_if(views, [](const PaintedView& view) { return !AnySeenInside(view); });
    }
    std::move(views.begin(), views.end(), std::back_inserter(all));
  }
  return all;
}

Mask FromViews(const Workspace& workspace, const PaintedView& painted, std::vector<Mask> on_views) {
  if (!IsOnPhoto(painted)) return std::move(on_views.front());
  return workspace.photo_pixels->ToPhoto(PhotoOf(workspace, painted), on_views);
}

}  // namespace retint
