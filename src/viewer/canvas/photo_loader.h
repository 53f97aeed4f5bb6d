// SPDX-License-Identifier: BSD-3-Clause
// Reads the photos of pictures (SceneFacts) in the background: thumbnails for lists and frusta,
// whole photos to compare with. If a picture is a pinhole view of a distorted photo, it gets the
// undistorted part. The image of a missing or damaged photo is null.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>

#include <QImage>
#include <QObject>
#include <QThreadPool>

#include "viewer/scene/scene_controller.h"

namespace retint {

class PhotoLoader : public QObject {
  Q_OBJECT

 public:
  explicit PhotoLoader(QObject* parent = nullptr);
  ~PhotoLoader() override;

  // Forgets everything of the previous scene; null: no scene.
  void SetScene(std::shared_ptr<const SceneFacts> facts);

  // By the picture's name. The image if it has been read. Otherwise null, and photoReady() or
  // thumbnailReady() follows once. An unreadable photo stays null.
  QImage Thumbnail(const std::string& name);  // at most kThumbnailSide wide and high
  QImage Photo(const std::string& name);      // keeps the newest few
  // Whether the thumbnail could not be read.
  bool IsMissing(const std::string& name) const;
  // Whether the whole photo could not be read.
  bool IsUnreadable(const std::string& name) const;

  static constexpr int kThumbnailSide = 160;

 Q_SIGNALS:
  void thumbnailReady(const QString& name);
  void photoReady(const QString& name);

 private:
  void Read(const std::string& name, bool small);

  QThreadPool pool_;
  std::shared_ptr<const SceneFacts> facts_;
  std::map<std::string, QImage> thumbnails_, photos_;
  std::set<std::string> asked_thumbnails_, asked_photos_;
};

// The camera of a thumbnail, at most kThumbnailSide wide and high, and the lens to draw it through
// (DrawThrough).
struct SmallPicture {
  PosedCamera camera;
  std::shared_ptr<const LensPicture> lens;
};
SmallPicture SmallPictureOf(const SceneFacts& facts, const UserPicture& picture);

// Reads `path`, at most side x side pixels large (0: full size); null if it is unreadable.
QImage ReadPicture(const std::filesystem::path& path, int side);

}  // namespace retint
