// SPDX-License-Identifier: BSD-3-Clause
// The photos of pictures (SceneFacts), read in the background: small ones for lists and frusta,
// whole ones to compare with; where a picture is a pinhole view of a distorted photo, that part,
// undistorted. A missing or damaged photo is a null picture.
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

  // Forgets everything of the scene before; null: no scene.
  void SetScene(std::shared_ptr<const SceneFacts> facts);

  // By the picture's name. The picture if it has been read; else null, and photoReady() or
  // thumbnailReady() follows (once; a photo that cannot be read stays null).
  QImage Thumbnail(const std::string& name);  // at most kThumbnailSide wide and high
  QImage Photo(const std::string& name);      // the few newest are kept
  // Whether reading the small one was tried, in vain.
  bool IsMissing(const std::string& name) const;
  // Whether reading the whole photo was tried, in vain.
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

// The camera of a small picture, at most kThumbnailSide wide and high, and how that is made
// (DrawThrough).
struct SmallPicture {
  PosedCamera camera;
  std::shared_ptr<const LensPicture> lens;
};
SmallPicture SmallPictureOf(const SceneFacts& facts, const UserPicture& picture);

// `path` as a picture of at most side x side pixels (0: whole); null when it cannot be read.
QImage ReadPicture(const std::filesystem::path& path, int side);

}  // namespace retint
