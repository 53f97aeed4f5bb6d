// SPDX-License-Identifier: BSD-3-Clause
// Turns numbered pictures into a film: with the program ffmpeg where that is installed, else as
// motion JPEG (session/pictures/video.h).
#pragma once

#include <deque>
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
  // failed(). One at a time: the next begins when the one before has ended.
  void Make(const std::filesystem::path& folder, const std::filesystem::path& video);
  bool IsBusy() const { return !films_.empty(); }
  // Whether a film of the pictures in `folder` is being made or waits.
  bool Needs(const std::filesystem::path& folder) const;

 Q_SIGNALS:
  void finished(const QString& video);
  void failed(const QString& message);

 private:
  struct Film {
    std::filesystem::path folder, video;
  };
  void MakeFirst();
  void MakeByFfmpeg(const Film& film);
  void MakeHere(const Film& film);
  void FfmpegEnded(int code, QProcess::ExitStatus status);
  // The first film is made, or is not, for the reason `error`; then the next.
  void End(const QString& error = {});

  std::deque<Film> films_;  // the first is being made
  QProcess* process_ = nullptr;
  std::unique_ptr<QThread> thread_;   // makes the film without ffmpeg
  std::shared_ptr<Monitor> monitor_;  // of that thread
  std::filesystem::path part_;        // what ffmpeg writes, which becomes the film
};

}  // namespace retint
