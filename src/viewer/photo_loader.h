// SPDX-License-Identifier: BSD-3-Clause
// Photos of the views, read in the background: small ones for lists and frusta, whole ones to
// compare with; where a view shows only a part of its photo, that part, undistorted. What is
// missing or damaged is a null picture.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>

#include <QImage>
#include <QObject>
#include <QThreadPool>

#include "viewer/scene_controller.h"

namespace retint {

class PhotoLoader : public QObject {
  Q_OBJECT

 public:
  explicit PhotoLoader(QObject* parent = nullptr);
  ~PhotoLoader() override;

  // Forgets everything of the scene before; null: no scene.
  void SetScene(std::shared_ptr<const SceneFacts> facts);

  // What has been read; else null, and photoReady() or thumbnailReady() follows (once; a photo that
  // cannot be read stays null).
  QImage Thumbnail(const std::string& view);  // at most kThumbnailSide wide and high
  QImage Photo(const std::string& view);      // the few newest are kept
  // Whether reading the small one was tried, in vain.
  bool IsMissing(const std::string& view) const;
  // Whether reading the whole photo was tried, in vain.
  bool IsUnreadable(const std::string& view) const;

  static constexpr int kThumbnailSide = 160;

 Q_SIGNALS:
  void thumbnailReady(const QString& view);
  void photoReady(const QString& view);

 private:
  void Read(const std::string& view, bool small);

  QThreadPool pool_;
  std::shared_ptr<const SceneFacts> facts_;
  std::map<std::string, QImage> thumbnails_, photos_;
  std::set<std::string> asked_thumbnails_, asked_photos_;
};

// What to render for a view's small picture, and how that is made of it; no lens: it is it.
struct SmallView {
  PosedCamera camera;
  std::shared_ptr<const LensPicture> lens;
};
SmallView SmallViewOf(const SceneFacts& facts, const View& view);

// `path` as a picture of at most side x side pixels (0: whole); null when it cannot be read.
QImage ReadPicture(const std::filesystem::path& path, int side);

}  // namespace retint
