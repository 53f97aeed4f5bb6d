// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/recent_files.h"

#include <QCryptographicHash>
#include <QDir>
#include <QFileInfo>
#include <QObject>
#include <QSettings>
#include <QStandardPaths>

#include "base/error.h"
#include "base/files.h"
#include "colmap_io/nerfstudio.h"

namespace retint {
namespace {

constexpr qsizetype kKept = 8;
constexpr QSize kPicture(480, 270);  // pixels
constexpr QChar kBetween(0x1f);      // separates the parts of a scene; not allowed in paths

std::filesystem::path Path(const QString& text) { return text.toStdString(); }
QString Text(const std::filesystem::path& path) { return QString::fromStdString(path.string()); }
QString Absolute(const std::filesystem::path& path) {
  return path.empty() ? QString() : QFileInfo(Text(path)).absoluteFilePath();
}

QStringList FilesOf(const QString& entry) { return entry.split(kBetween).mid(0, 2); }

QString PictureFile(const QString& entry) {
  const QByteArray name =
      QCryptographicHash::hash(FilesOf(entry).join(kBetween).toUtf8(), QCryptographicHash::Sha1)
          .toHex();
  return QStandardPaths::writableLocation(QStandardPaths::CacheLocation) + "/scenes/" +
         QString::fromLatin1(name) + ".png";
}

}  // namespace

// Workspace, splat, photos, held-out views, backend, model, frame, placed views, render model,
// color space and its config. Older entries have fewer parts: only the first two are required.
QString RecentEntry(const OpenRequest& request) {
  const SessionOptions& options = request.options;
  return QStringList{Absolute(request.workspace),
                     Absolute(request.splat),
                     Absolute(options.image_folder),
                     QString::number(options.holdout),
                     QString::fromStdString(options.backend),
                     QString::fromStdString(options.model),
                     QString::fromStdString(IsIdentity(options.world_from_splat)
                                                ? ""
                                                : WorldFromSplatToText(options.world_from_splat)),
                     QString::number(options.views),
                     QString::fromStdString(
                         options.render_model ? std::string(NameOf(*options.render_model)) : ""),
                     QString::fromStdString(options.space.name),
                     IsFile(options.space.config) ? Absolute(options.space.config)
                                                  : QString::fromStdString(options.space.config)}
      .join(kBetween);
}

OpenRequest RecentRequest(const QString& entry) {
  const QStringList parts = entry.split(kBetween);
  OpenRequest request;
  request.workspace = Path(parts.value(0));
  request.splat = Path(parts.value(1));
  request.options.image_folder = Path(parts.value(2));
  request.options.holdout = parts.value(3).toInt();
  if (!parts.value(4).isEmpty()) request.options.backend = parts.value(4).toStdString();
  request.options.model = parts.value(5).toStdString();
  try {
    const std::string frame = parts.value(6).toStdString();
    if (!frame.empty()) request.options.world_from_splat = ParseWorldFromSplat(frame);
  } catch (const OptionError&) {
    request.options.world_from_splat = {};  // settings that someone edited by hand
  }
  request.options.render_model = ChosenRenderModel(parts.value(8).toStdString());
  request.options.space = {parts.value(10).toStdString(), parts.value(9).toStdString()};
  if (const int views = parts.value(7).toInt(); views >= 2) request.options.views = views;
  return request;
}

// The name of a recent file.
QString RecentTitle(const QString& entry) {
  QStringList files = entry.split(kBetween).mid(0, 2);
  files.removeAll(QString());  // a single splat has no workspace
  return files.join(QObject::tr(" with "));
}

QString RecentName(const QString& entry) {
  const QStringList files = FilesOf(entry);
  return QFileInfo(files.front().isEmpty() ? files.value(1) : files.front()).fileName();
}

bool IsSessionEntry(const QString& entry) { return !entry.contains(kBetween); }

QString MissingOf(const QString& entry) {
  if (IsSessionEntry(entry)) return QFileInfo::exists(entry + "/session.json") ? "" : entry;
  for (const QString& path : FilesOf(entry)) {
    if (!path.isEmpty() && !QFileInfo::exists(path)) return path;
  }
  return {};
}

QStringList RecentFiles() { return QSettings().value("recent").toStringList(); }

void RememberRecent(const QString& entry) {
  QStringList recent = RecentFiles();
  recent.removeIf([&](const QString& other) { return FilesOf(other) == FilesOf(entry); });
  recent.prepend(entry);
  QSettings().setValue("recent", recent.mid(0, kKept));
}

void ForgetRecent(const QString& entry) {
  QStringList recent = RecentFiles();
  recent.removeAll(entry);
  QSettings().setValue("recent", recent);
  QFile::remove(PictureFile(entry));
}

void ForgetRecentFiles() {
  for (const QString& entry : RecentFiles()) QFile::remove(PictureFile(entry));
  QSettings().remove("recent");
}

QImage RecentPicture(const QString& entry) { return QImage(PictureFile(entry)); }

QDateTime RecentTime(const QString& entry) { return QFileInfo(PictureFile(entry)).lastModified(); }

void KeepRecentPicture(const QString& entry, const QImage& picture) {
  if (picture.isNull() || !RecentFiles().contains(entry)) return;
  const QString file = PictureFile(entry);
  QDir().mkpath(QFileInfo(file).path());
  const QImage large =
      picture.scaled(kPicture, Qt::KeepAspectRatioByExpanding, Qt::SmoothTransformation);
  const QRect middle(
      QPoint((large.width() - kPicture.width()) / 2, (large.height() - kPicture.height()) / 2),
      kPicture);
  large.copy(middle).save(file);  // a card may lack a picture
}

}  // namespace retint
