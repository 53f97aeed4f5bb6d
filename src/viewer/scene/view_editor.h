// SPDX-License-Identifier: BSD-3-Clause
// "Edit this view elsewhere": a view is written as a picture and opened in the desktop's program
// for pictures. Whenever it is saved there, it becomes an operation of the region's edit.
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

  // The picture `name` (SceneFacts), its render or its photo, as the picture step of the region has
  // it (RefitService::PictureStepOf). What is saved becomes that step.
  void Start(RegionId region, const std::string& name, TargetKind of);
  // Opens a picture; false when there is no program for it. The desktop's, unless a test has its
  // own.
  void SetOpener(std::function<bool(const QString& path)> opener) { opener_ = std::move(opener); }

 Q_SIGNALS:
  void opened(const QString& path);
  // A picture that was saved is now part of the edit, whose paint can have so much detail.
  void taken(retint::RegionId region, const QString& path, const retint::PaintDetail& detail);
  // One that cannot be is the scene controller's failure.
  void failed(const QString& message);

 private:
  struct Picture {
    RegionId region = 0;
    std::string view;                // or the distorted photo that it shows
    std::vector<std::string> shown;  // views that show it
    std::string bytes = {};          // as it was last written or taken
    std::string cut = {};            // as it was when it was no picture
    int looks = 0;                   // at what is cut off
    Image8 before = {}, written = {};
  };
  void Watch(const QString& path, const Picture& picture);
  void Look();
  bool IsWhole(const std::string& path, const std::string& bytes, Picture& picture);
  void Take(const std::string& path, const Picture& picture);

  SceneController* controller_;
  std::function<bool(const QString&)> opener_;
  QTemporaryDir folder_;
  int written_ = 0;                          // pictures, for folders of their own
  std::map<std::string, Picture> pictures_;  // by path
  QFileSystemWatcher watcher_;
  QTimer rest_;  // a program may save in several steps
};

}  // namespace retint
