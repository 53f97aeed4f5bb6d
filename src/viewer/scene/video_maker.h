// SPDX-License-Identifier: BSD-3-Clause
// Turns numbered pictures into an mp4 video with the program ffmpeg.
#pragma once

#include <deque>
#include <filesystem>

#include <QObject>
#include <QProcess>
#include <QString>

namespace retint {

class VideoMaker : public QObject {
  Q_OBJECT

 public:
  static QString Program();  // path of ffmpeg; empty: not installed

  explicit VideoMaker(QObject* parent = nullptr) : QObject(parent) {}
  ~VideoMaker() override;  // an unfinished film is removed

  // Makes `video` (.mp4) of <folder>/0000.png, 0001.png, ..., so many a second. Emits
  // finished() or failed(). One at a time: the next begins when the one before has ended.
  void Make(const std::filesystem::path& folder, const std::filesystem::path& video, int rate);
  bool IsBusy() const { return !films_.empty(); }
  // Whether a film of the pictures in `folder` is being made or waits.
  bool Needs(const std::filesystem::path& folder) const;

 Q_SIGNALS:
  void finished(const QString& video);
  void failed(const QString& message);

 private:
  struct Film {
    std::filesystem::path folder, video;
    int rate;  // frames a second
  };
  void MakeFirst();
  void FfmpegEnded(int code, QProcess::ExitStatus status);
  // The first film is made, or is not, for the reason `error`; then the next.
  void End(const QString& error = {});

  std::deque<Film> films_;  // the first is being made
  QProcess* process_ = nullptr;
  std::filesystem::path part_;  // ffmpeg's output, which becomes the film
};

}  // namespace retint
