// SPDX-License-Identifier: BSD-3-Clause
// Turns numbered pictures into a film: with the program ffmpeg where that is installed, else as
// motion JPEG (session/pictures/video.h).
#pragma once

#include <filesystem>
#include <memory>

#include <QObject>
#include <QProcess>
#include <QString>
#include <QThread>

#include "base/monitor.h"

namespace retint {

class VideoMaker : public QObject {
  Q_OBJECT

 public:
  static QString Program();  // where ffmpeg is; empty: not installed

  explicit VideoMaker(QObject* parent = nullptr) : QObject(parent) {}
  ~VideoMaker() override;  // an unfinished film is removed

  // What a film ends in: .mp4 where ffmpeg is, else .avi.
  static QString Extension() { return Program().isEmpty() ? ".avi" : ".mp4"; }
  // `video`, with either of them, of <folder>/0000.png, 0001.png, ..., 30 a second. finished() or
  // failed().
  void Make(const std::filesystem::path& folder, const std::filesystem::path& video);
  bool IsBusy() const { return process_ || thread_; }

 Q_SIGNALS:
  void finished(const QString& video);
  void failed(const QString& message);

 private:
  void MakeByFfmpeg(const std::filesystem::path& folder);
  void MakeHere(const std::filesystem::path& folder);
  void Ended(int code, QProcess::ExitStatus status);
  void Stop();

  QProcess* process_ = nullptr;
  std::unique_ptr<QThread> thread_;     // makes the film without ffmpeg
  std::shared_ptr<Monitor> monitor_;    // of that thread
  std::filesystem::path part_, video_;  // written, and what it becomes
};

}  // namespace retint
