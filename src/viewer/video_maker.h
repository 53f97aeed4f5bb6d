// SPDX-License-Identifier: BSD-3-Clause
// Turns numbered pictures into a film with the program ffmpeg, where that is installed.
#pragma once

#include <filesystem>

#include <QObject>
#include <QProcess>
#include <QString>

namespace retint {

class VideoMaker : public QObject {
  Q_OBJECT

 public:
  static QString Program();  // where ffmpeg is; empty: not installed

  explicit VideoMaker(QObject* parent = nullptr) : QObject(parent) {}
  ~VideoMaker() override;  // stops ffmpeg; an unfinished film is removed

  // `video` (.mp4) of <folder>/0000.png, 0001.png, ..., 30 a second. finished() or failed().
  void Make(const std::filesystem::path& folder, const std::filesystem::path& video);
  bool IsBusy() const { return process_ != nullptr; }

 Q_SIGNALS:
  void finished(const QString& video);
  void failed(const QString& message);

 private:
  void Ended(int code, QProcess::ExitStatus status);
  void Stop();

  QProcess* process_ = nullptr;
  std::filesystem::path part_, video_;  // written, and what it becomes
};

}  // namespace retint
