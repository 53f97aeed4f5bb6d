// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/canvas/photo_loader.h"

#include <algorithm>
#include <cmath>
#include <exception>

#include <QImageReader>

#include "colmap_io/image_io.h"
#include "colmap_io/photo.h"
#include "scene/camera_projection.h"
#include "scene/contact_sheet.h"
#include "viewer/canvas/render_thread.h"
#include "viewer/scene/post.h"

namespace retint {
namespace {

constexpr size_t kPhotosKept = 4;

// The whole photo of a distorted camera, with the pixels to show; null if it is unreadable.
QImage ReadWhole(const Workspace& workspace, const View& view, bool own_pixels) {
  try {
    const Camera& camera = workspace.PhotoCamera(view);
    const Image photo =
        own_pixels ? ReadPhotoOfSize(workspace.PhotoPath(view), camera.width, camera.height)
                   : workspace.ReadPhoto(view);
    return ToQImage(ToImage8(photo)).convertToFormat(QImage::Format_RGB32);
  } catch (const std::exception&) {
    return {};
  }
}

// The thumbnail of a view that shows a part of its photo, from a small reading of the file, pixel
// by pixel.
QImage ReadUndistorted(const Workspace& workspace, const View& view, int side) {
  const QImage photo = ReadPicture(workspace.PhotoPath(view), 4 * side);
  if (photo.isNull()) return {};
  const DistortedPhoto& of = *workspace.PhotoOf(view);
  const auto face = size_t(std::find(of.faces.begin(), of.faces.end(), view.id) - of.faces.begin());
  const Camera& camera = of.lens->faces[face].camera;
  const QSize size =
      QSize(camera.width, camera.height).scaled(side, side, Qt::KeepAspectRatio).expandedTo({1, 1});
  const PixelMap map = PhotoFromFace(*of.lens, face, size.width(), size.height());
  QImage image(size, QImage::Format_RGB32);
  image.fill(Qt::black);
  const double sx = double(photo.width()) / of.lens->photo.width;
  const double sy = double(photo.height()) / of.lens->photo.height;
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      const float* at = &map.xy[2 * (size_t(y) * size_t(map.width) + size_t(x))];
      if (std::isnan(at[0])) continue;
      image.setPixel(x, y,
                     photo.pixel(std::min(int(double(at[0]) * sx), photo.width() - 1),
                                 std::min(int(double(at[1]) * sy), photo.height() - 1)));
    }
  }
  return image;
}

}  // namespace

SmallPicture SmallPictureOf(const SceneFacts& facts, const UserPicture& picture) {
  const PosedCamera shown = facts.Shown(picture);
  const double side = std::max(shown.camera.width, shown.camera.height);
  const double scale = PhotoLoader::kThumbnailSide / side;
  const auto scaled = [&](int size) { return std::max(1, int(std::lround(size * scale))); };
  const int width = scaled(shown.camera.width), height = scaled(shown.camera.height);
  if (const auto lens = facts.Lens(picture, width, height)) {
    return {{Resized(shown.camera, width, height), shown.cam_from_world}, lens};
  }
  return {Scaled(shown, scale), nullptr};
}

QImage ReadPicture(const std::filesystem::path& path, int side) {
  QImageReader reader(QString::fromStdString(path.string()));
  reader.setAutoTransform(false);  // as COLMAP does
  const QSize size = reader.size();
  if (side > 0 && size.isValid()) {
    reader.setScaledSize(size.scaled(side, side, Qt::KeepAspectRatio).expandedTo({1, 1}));
  }
  QImage image = reader.read();
  if (image.isNull()) {
    // Qt does not know this format here.
    try {
      image = ToQImage(ReadImage8(path));
    } catch (const std::exception&) {
      return {};
    }
  }
  if (side > 0 && (image.width() > side || image.height() > side)) {
    image = image.scaled(side, side, Qt::KeepAspectRatio, Qt::SmoothTransformation);
  }
  return image.convertToFormat(QImage::Format_RGB32);
}

PhotoLoader::PhotoLoader(QObject* parent) : QObject(parent) { pool_.setMaxThreadCount(1); }

PhotoLoader::~PhotoLoader() {
  pool_.clear();
  pool_.waitForDone();
  PoolIsDone();
}

void PhotoLoader::SetScene(std::shared_ptr<const SceneFacts> facts) {
  pool_.clear();
  facts_ = std::move(facts);
  thumbnails_.clear();
  photos_.clear();
  asked_thumbnails_.clear();
  asked_photos_.clear();
}

QImage PhotoLoader::Thumbnail(const std::string& name) {
  const auto found = thumbnails_.find(name);
  if (found != thumbnails_.end()) return found->second;
  if (facts_ && asked_thumbnails_.insert(name).second) Read(name, true);
  return {};
}

QImage PhotoLoader::Photo(const std::string& name) {
  const auto found = photos_.find(name);
  if (found != photos_.end()) return found->second;
  if (facts_ && asked_photos_.insert(name).second) Read(name, false);
  return {};
}

bool PhotoLoader::IsMissing(const std::string& name) const {
  const auto found = thumbnails_.find(name);
  return found != thumbnails_.end() && found->second.isNull();
}

bool PhotoLoader::IsUnreadable(const std::string& name) const {
  const auto found = photos_.find(name);
  return found != photos_.end() && found->second.isNull();
}

void PhotoLoader::Read(const std::string& name, bool small) {
  const UserPicture* picture = facts_->FindPicture(name);
  if (!picture) return;
  const auto job = [this, facts = facts_, picture, name, small] {
    const Workspace& workspace = *facts->workspace;
    const View& view = *picture->faces.front();
    const int side = small ? kThumbnailSide : 0;
    const bool own_pixels = picture->photo || !workspace.PhotoOf(view);
    QImage image;
    if (workspace.PhotoOf(view) && !small) {
      image = ReadWhole(workspace, view, own_pixels);
    } else if (!own_pixels) {
      image = ReadUndistorted(workspace, view, side);
    } else if (!workspace.has_virtual_views) {
      image = ReadPicture(workspace.PhotoPath(view), side);
    }
    Post(this, [this, facts, name, small, image] {
      if (facts != facts_) return;  // from a closed scene
      if (small) {
        thumbnails_[name] = image;
        Q_EMIT thumbnailReady(QString::fromStdString(name));
        return;
      }
      if (photos_.size() >= kPhotosKept) {
        asked_photos_.erase(photos_.begin()->first);
        photos_.erase(photos_.begin());
      }
      photos_[name] = image;
      Q_EMIT photoReady(QString::fromStdString(name));
    });
  };
  PostToPool(pool_, job, small ? 0 : 1);  // the user waits for a whole photo
}

}  // namespace retint
