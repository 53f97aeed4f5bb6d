// SPDX-License-Identifier: BSD-3-Clause
// "Edit this view elsewhere": writes a view as a picture and opens it in the desktop's program for
// pictures. Each time it is saved there, it becomes an operation of the region's edit.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include <QFileSystemWatcher>
#include <QObject>
#include <QTemporaryDir>
#include <QTimer>

#include "scene/image.h"
#include "viewer/scene/scene_controller.h"

namespace retint {

class ViewEditor : public QObject {
  Q_OBJECT

 public:
  explicit ViewEditor(SceneController* controller, QObject* parent = nullptr);

  // Writes the picture `name` (SceneFacts), a render or a photo, as the region's picture step has
  // it (RefitService::PictureStepOf), and opens it. Saved changes become that step.
  void Start(RegionId region, const std::string& name, TargetKind of);
  // Opens a picture; false if there is no program for it. The default uses the desktop; tests
  // replace it.
  void SetOpener(std::function<bool(const QString& path)> opener) { opener_ = std::move(opener); }

 Q_SIGNALS:
  void opened(const QString& path);
  // A saved picture is now part of the edit. `detail`: how much detail the paint can show.
  void taken(retint::RegionId region, const QString& path, const retint::PaintDetail& detail);
  // Bad pictures are reported as failures of the scene controller.
  void failed(const QString& message);

 private:
  struct Picture {
    RegionId region = 0;
    std::string view;                // view, or the distorted photo that it shows
    std::vector<std::string> shown;  // views that show it
    std::string bytes = {};          // when it was last written or read
    std::string cut = {};            // content that was not a complete picture
    int looks = 0;                   // number of looks at an incomplete file
    Image8 before = {}, written = {};
  };
  void Watch(const QString& path, const Picture& picture);
  void Look();
  bool IsWhole(const std::string& path, const std::string& bytes, Picture& picture);
  void Take(const std::string& path, const Picture& picture);

  SceneController* controller_;
  std::function<bool(const QString&)> opener_;
  QTemporaryDir folder_;
  int written_ = 0;                          // number of pictures, for separate folders
  std::map<std::string, Picture> pictures_;  // by path
  QFileSystemWatcher watcher_;
  QTimer rest_;  // a program may save in several steps
};

}  // namespace retint
