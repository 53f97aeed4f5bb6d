// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/scene/video_maker.h"

#include <algorithm>
#include <utility>

#include <QStandardPaths>

namespace retint {
namespace {

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

VideoMaker::~VideoMaker() {
  if (!process_) return;
  process_->disconnect(this);
  process_->kill();
  process_->waitForFinished();
  std::error_code ignored;
  std::filesystem::remove(part_, ignored);
}

bool VideoMaker::Needs(const std::filesystem::path& folder) const {
  std::error_code ignored;
  return std::any_of(films_.begin(), films_.end(), [&](const Film& film) {
    return std::filesystem::equivalent(film.folder, folder, ignored);
  });
}

void VideoMaker::Make(const std::filesystem::path& folder, const std::filesystem::path& video,
                      int rate) {
  films_.push_back({folder, video, rate});
  if (films_.size() == 1) MakeFirst();
}

void VideoMaker::MakeFirst() {
  const Film& film = films_.front();
  part_ = film.video.parent_path() /
          std::string(".").append(film.video.stem().string()).append(".part.mp4");
  process_ = new QProcess(this);
  process_->setProcessChannelMode(QProcess::MergedChannels);
  connect(process_, &QProcess::finished, this, &VideoMaker::FfmpegEnded);
  connect(process_, &QProcess::errorOccurred, this, [this](QProcess::ProcessError error) {
    if (error == QProcess::FailedToStart) FfmpegEnded(-1, QProcess::CrashExit);
  });
  // Sizes are made even and the colors halved, as players want them.
  process_->start(Program(), {"-y", "-loglevel", "error", "-framerate", QString::number(film.rate),
                              "-i", Pattern(film.folder), "-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2",
                              "-pix_fmt", "yuv420p", "-movflags", "+faststart", Text(part_)});
}

void VideoMaker::End(const QString& error) {
  const QString video = Text(films_.front().video);
  films_.pop_front();
  if (error.isEmpty()) {
    Q_EMIT finished(video);
  } else {
    Q_EMIT failed(error);
  }
  if (!films_.empty()) MakeFirst();
}

void VideoMaker::FfmpegEnded(int code, QProcess::ExitStatus status) {
  const QString said = QString::fromLocal8Bit(process_->readAll()).trimmed();
  std::exchange(process_, nullptr)->deleteLater();
  const std::filesystem::path& video = films_.front().video;
  std::error_code error;
  if (status == QProcess::NormalExit && code == 0) {
    std::filesystem::rename(part_, video, error);
    if (!error) return End();
  }
  std::filesystem::remove(part_, error);
  End(tr("%1: ffmpeg could not make the video: %2")
          .arg(Text(video), said.isEmpty() ? tr("it ended early") : said));
}

}  // namespace retint
