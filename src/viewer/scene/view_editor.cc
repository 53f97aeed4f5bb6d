// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/scene/view_editor.h"

#include <algorithm>
#include <memory>
#include <utility>

#include <QDesktopServices>
#include <QDir>
#include <QImage>
#include <QUrl>

#include "base/error.h"
#include "base/files.h"
#include "colmap_io/image_io.h"

namespace retint {
namespace {

constexpr int kRestMs = 400;

std::string BytesOf(const std::string& path) {
  try {
    return ReadFile(path);
  } catch (const Error&) {
    return {};  // being replaced
  }
}

// One step holds the pictures of several views; a view's newest picture counts. `views` show what
// is in this one.
void AddPicture(ColorEdit& edit, const EditedPicture& picture,
                const std::vector<std::string>& views) {
  for (ColorOperation& op : edit.operations) {
    if (!op.picture) continue;
    std::vector<EditedPicture> all = op.picture->pictures;
    std::erase_if(all, [&](const EditedPicture& other) {
      return std::ranges::find(views, other.view) != views.end();
    });
    // Pictures are compared together, so the others are read again.
    if (!std::ranges::all_of(all, [](const EditedPicture& one) { return IsFile(one.file); })) {
      continue;
    }
    all.push_back(picture);
    const float strength = op.strength;
    op = ColorOperation::Picture(std::move(all));
    op.strength = strength;
    return;
  }
  edit.operations.push_back(ColorOperation::Picture({picture}));
}

}  // namespace

ViewEditor::ViewEditor(SceneController* controller, QObject* parent)
    : QObject(parent), controller_(controller) {
  opener_ = [](const QString& path) {
    return QDesktopServices::openUrl(QUrl::fromLocalFile(path));
  };
  rest_.setSingleShot(true);
  rest_.setInterval(kRestMs);
  connect(&rest_, &QTimer::timeout, this, &ViewEditor::Look);
  // Most programs replace a file, which is then news of its folder.
  connect(&watcher_, &QFileSystemWatcher::fileChanged, this, [this] { rest_.start(); });
  connect(&watcher_, &QFileSystemWatcher::directoryChanged, this, [this] { rest_.start(); });
  const auto forget = [this] {
    pictures_.clear();
    const QStringList watched = watcher_.files() + watcher_.directories();
    if (!watched.isEmpty()) watcher_.removePaths(watched);
  };
  connect(controller_, &SceneController::opened, this, forget);
  connect(controller_, &SceneController::closed, this, forget);
}

void ViewEditor::Start(RegionId region, const std::string& name, TargetKind of) {
  if (!controller_->regions().Find(region)) return;
  const QString folder = folder_.filePath(QString::number(++written_));
  if (!folder_.isValid() || !QDir().mkpath(folder)) {
    Q_EMIT failed(tr("%1 cannot be written").arg(folder_.path()));
    return;
  }
  const UserPicture* shown = controller_->facts()->FindPicture(name);
  if (!shown) return;
  Picture picture{region, shown->name, {}, {}, {}};
  for (const View* face : shown->faces) picture.shown.push_back(face->name);
  const std::string stem = std::filesystem::path(picture.view).stem().string();
  const QString path = folder + "/" + QString::fromStdString(stem) + ".png";
  controller_->Run(
      tr("Writing the view"),
      [=](EditSession& session, Monitor&) {
        session.CollectFits();
        const Pictures pictures = session.pictures();
        WritePng(path.toStdString(),
                 pictures.Compose(pictures.RequireOne(picture.view), [&](const View& face) {
                   return session.refits().EditedTarget(face, of);
                 }));
      },
      [=, this]() mutable {
        picture.bytes = BytesOf(path.toStdString());
        Watch(path, picture);
        if (opener_(path)) {
          Q_EMIT opened(path);
        } else {
          Q_EMIT failed(tr("The desktop has no program for pictures. Open %1 in one; what you save "
                           "there is taken over")
                            .arg(path));
        }
      });
}

void ViewEditor::Watch(const QString& path, const Picture& picture) {
  pictures_[path.toStdString()] = picture;
  watcher_.addPaths({path, QFileInfo(path).absolutePath()});
}

void ViewEditor::Look() {
  bool later = false;
  for (auto& [path, picture] : pictures_) {
    const QString watched = QString::fromStdString(path);
    if (QFile::exists(watched)) watcher_.addPath(watched);  // one that was replaced is dropped
    std::string bytes = BytesOf(path);
    if (bytes.empty() || bytes == picture.bytes) continue;
    // Cut off: it is still being written.
    if (QImage::fromData(QByteArray::fromStdString(bytes)).isNull()) {
      later |= bytes != picture.cut;
      picture.cut = std::move(bytes);
      continue;
    }
    picture.bytes = std::move(bytes);
    if (Take(path, picture)) Q_EMIT taken(watched);
  }
  if (later) rest_.start();
}

bool ViewEditor::Take(const std::string& path, Picture& picture) {
  const Region* region = controller_->regions().Find(picture.region);
  if (!region) return false;  // deleted meanwhile
  ColorEdit edit = region->edit;
  AddPicture(edit, {picture.view, path, {}}, picture.shown);
  controller_->SetEdit(picture.region, edit, region->strength);
  return true;
}

}  // namespace retint
