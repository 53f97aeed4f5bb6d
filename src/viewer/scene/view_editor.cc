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
#include "editing/compare_pictures.h"
#include "editing/finer_session.h"
#include "scene/contact_sheet.h"

namespace retint {
namespace {

constexpr int kRestMs = 400;
constexpr int kLooks = 5;  // number of looks at an incomplete file that does not grow

std::string BytesOf(const std::string& path) {
  try {
    return ReadFile(path);
  } catch (const Error&) {
    return {};  // another program is replacing it
  }
}

std::shared_ptr<const PictureEdit> PictureOf(const ColorEdit& edit) {
  for (const ColorOperation& op : edit.operations) {
    if (op.picture) return op.picture;
  }
  return nullptr;
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
  // Most programs replace a file, which changes its folder.
  connect(&watcher_, &QFileSystemWatcher::fileChanged, this, [this] { rest_.start(); });
  connect(&watcher_, &QFileSystemWatcher::directoryChanged, this, [this] { rest_.start(); });
  const auto forget = [this] {
    if (controller_->has_same_views()) return;
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
  const auto picture = std::make_shared<Picture>(Picture{region, shown->name, {}});
  for (const View* face : shown->faces) picture->shown.push_back(face->name);
  const std::string stem = std::filesystem::path(picture->view).stem().string();
  const QString path = folder + "/" + QString::fromStdString(stem) + ".png";
  controller_->Run(
      tr("Writing the view"),
      [=](EditSession& session, Monitor&) {
        session.refits().CollectFits();
        const Pictures pictures = session.scene().pictures();
        const UserPicture& one = pictures.RequireOne(picture->view);
        std::map<const View*, RefitService::PictureStep> steps;
        for (const View* face : one.faces) {
          steps[face] = session.refits().PictureStepOf(region, *face, of);
        }
        const auto compose = [&](Image RefitService::PictureStep::*part) {
          return ToImage8(
              pictures.Compose(one, [&](const View& face) { return steps.at(&face).*part; }));
        };
        picture->before = compose(&RefitService::PictureStep::before);
        picture->written = compose(&RefitService::PictureStep::with);
        WritePng(path.toStdString(), picture->written);
      },
      [=, this] {
        picture->bytes = BytesOf(path.toStdString());
        Watch(path, *picture);
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
    if (QFile::exists(watched)) watcher_.addPath(watched);  // a replaced file is no longer watched
    std::string bytes = BytesOf(path);
    if (bytes.empty() || bytes == picture.bytes) continue;
    if (!IsWhole(path, bytes, picture)) {
      later |= picture.looks < kLooks;
      continue;
    }
    picture.bytes = std::move(bytes);
    Take(path, picture);
  }
  if (later) rest_.start();
}

// Whether a file is a complete picture. An incomplete file is still being written, or is damaged.
bool ViewEditor::IsWhole(const std::string& path, const std::string& bytes, Picture& picture) {
  const bool whole = !QImage::fromData(QByteArray::fromStdString(bytes)).isNull();
  if (whole || bytes != picture.cut) picture.looks = 0;
  picture.cut = whole ? std::string() : bytes;
  if (!whole && ++picture.looks == kLooks) {
    Q_EMIT failed(tr("%1 is not a whole picture. Save it once more in the other program")
                      .arg(QString::fromStdString(path)));
  }
  return whole;
}

void ViewEditor::Take(const std::string& path, const Picture& picture) {
  if (!controller_->regions().Find(picture.region)) {
    Q_EMIT failed(tr("The region of %1 is not there any more. Undo its removal and save the "
                     "picture once more")
                      .arg(QString::fromStdString(path)));
    return;
  }
  EditedPicture edited{picture.view, path, {}};
  edited.before = picture.before;
  edited.written = picture.written;
  const RegionId region = picture.region;
  const auto found = std::make_shared<std::shared_ptr<const PictureEdit>>();
  const auto detail = std::make_shared<PaintDetail>();
  // The edit changes only after the picture was found to show its view.
  controller_->Run(
      tr("Comparing the picture"),
      [=, views = picture.shown](EditSession& session, Monitor&) {
        const Region* now = session.store().regions().Find(region);
        if (!now) throw InputError(path, "belongs to a region that is not there any more");
        ColorEdit edit = now->edit;
        AddPicture(edit, edited, views);
        session.store().Do(SetEdit{region, edit, now->strength});
        now = session.store().regions().Find(region);
        *found = PictureOf(now->edit);
        *detail = DetailOfPaint(*now, session.scene());
      },
      [=, this] {
        const Region* now = controller_->regions().Find(region);
        // A newer edit is waiting in the queue without the picture: add the picture to it.
        if (now && PictureOf(now->edit) != *found) return Take(path, picture);
        Q_EMIT taken(region, QString::fromStdString(path), *detail);
      });
}

}  // namespace retint
