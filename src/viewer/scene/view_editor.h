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

#include "viewer/scene/scene_controller.h"

namespace retint {

class ViewEditor : public QObject {
  Q_OBJECT

 public:
  explicit ViewEditor(SceneController* controller, QObject* parent = nullptr);

  // The picture `name` (SceneFacts), its render or its photo, with the edits of all regions so far.
  // What is saved is the edit of `region`.
  void Start(RegionId region, const std::string& name, TargetKind of);
  // Opens a picture; false when there is no program for it. The desktop's, unless a test has its
  // own.
  void SetOpener(std::function<bool(const QString& path)> opener) { opener_ = std::move(opener); }

 Q_SIGNALS:
  void opened(const QString& path);
  void taken(const QString& path);  // a picture that was saved is now part of the edit
  void failed(const QString& message);

 private:
  struct Picture {
    RegionId region = 0;
    std::string view;                // or the distorted photo that it shows
    std::vector<std::string> shown;  // views that show it
    std::string bytes;               // as it was last written or taken
    std::string cut;                 // as it was when it was no picture
  };
  void Watch(const QString& path, const Picture& picture);
  void Look();
  bool Take(const std::string& path, Picture& picture);

  SceneController* controller_;
  std::function<bool(const QString&)> opener_;
  QTemporaryDir folder_;
  int written_ = 0;                          // pictures, for folders of their own
  std::map<std::string, Picture> pictures_;  // by path
  QFileSystemWatcher watcher_;
  QTimer rest_;  // a program may save in several steps
};

}  // namespace retint
