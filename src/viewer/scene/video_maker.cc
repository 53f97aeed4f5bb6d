// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/scene/video_maker.h"

#include <utility>

#include <QStandardPaths>

#include "session/pictures/video.h"

namespace retint {
namespace {

constexpr int kFramesPerSecond = 30;

QString Text(const std::filesystem::path& path) { return QString::fromStdString(path.string()); }

// Of the numbers' length; ffmpeg reads a % in a folder's name as a pattern too.
QString Pattern(const std::filesystem::path& folder) {
  int digits = 4;
  while (digits < 9 &&
         !std::filesystem::exists(folder / (std::string(size_t(digits), '0') + ".png"))) {
    ++digits;
  }
  return Text(folder).replace("%", "%%") + "/%0" + QString::number(digits) + "d.png";
}

}  // namespace

QString VideoMaker::Program() { return QStandardPaths::findExecutable("ffmpeg"); }

VideoMaker::~VideoMaker() { Stop(); }

void VideoMaker::Stop() {
  if (thread_) {
    thread_->disconnect(this);
    monitor_->Cancel();
    thread_->wait();
    thread_.reset();
  }
  if (!process_) return;
  process_->disconnect(this);
  process_->kill();
  process_->waitForFinished();
  delete std::exchange(process_, nullptr);
  std::error_code ignored;
  std::filesystem::remove(part_, ignored);
}

void VideoMaker::Make(const std::filesystem::path& folder, const std::filesystem::path& video) {
  Stop();
  video_ = video;
  if (video.extension() == ".avi") return MakeHere(folder);
  MakeByFfmpeg(folder);
}

void VideoMaker::MakeHere(const std::filesystem::path& folder) {
  monitor_ = std::make_shared<Monitor>();
  const auto error = std::make_shared<std::string>();
  thread_.reset(QThread::create([folder, video = video_, monitor = monitor_, error] {
    try {
      FilmOfFrames(folder, video, kFramesPerSecond, *monitor);
    } catch (const std::exception& caught) {
      *error = caught.what();
    }
  }));
  connect(thread_.get(), &QThread::finished, this, [this, error, made = thread_.get()] {
    if (thread_.get() != made) return;  // stopped meanwhile
    thread_.release()->deleteLater();
    if (error->empty()) return Q_EMIT finished(Text(video_));
    Q_EMIT failed(QString::fromStdString(*error));
  });
  thread_->start();
}

void VideoMaker::MakeByFfmpeg(const std::filesystem::path& folder) {
  part_ =
      video_.parent_path() / std::string(".").append(video_.stem().string()).append(".part.mp4");
  process_ = new QProcess(this);
  process_->setProcessChannelMode(QProcess::MergedChannels);
  connect(process_, &QProcess::finished, this, &VideoMaker::Ended);
  connect(process_, &QProcess::errorOccurred, this, [this](QProcess::ProcessError error) {
    if (error == QProcess::FailedToStart) Ended(-1, QProcess::CrashExit);
  });
  // Sizes are made even and the colors halved, as players want them.
  process_->start(
      Program(), {"-y", "-loglevel", "error", "-framerate", QString::number(kFramesPerSecond), "-i",
                  Pattern(folder), "-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2", "-pix_fmt", "yuv420p",
                  "-movflags", "+faststart", Text(part_)});
}

void VideoMaker::Ended(int code, QProcess::ExitStatus status) {
  const QString said = QString::fromLocal8Bit(process_->readAll()).trimmed();
  std::exchange(process_, nullptr)->deleteLater();
  std::error_code error;
  if (status == QProcess::NormalExit && code == 0) {
    std::filesystem::rename(part_, video_, error);
    if (!error) return Q_EMIT finished(Text(video_));
  }
  std::filesystem::remove(part_, error);
  Q_EMIT failed(tr("%1: ffmpeg could not make the video: %2")
                    .arg(Text(video_), said.isEmpty() ? tr("it ended early") : said));
}

}  // namespace retint
