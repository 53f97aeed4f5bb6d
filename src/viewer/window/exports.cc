// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/exports.h"

#include <algorithm>

#include <QDir>
#include <QFileDialog>
#include <QRegularExpression>
#include <QSettings>

#include "base/error.h"
#include "colmap_io/image_io.h"
#include "reporting/export.h"
#include "viewer/canvas/canvas.h"
#include "viewer/panels/export_dialog.h"
#include "viewer/panels/splat_formats.h"
#include "viewer/scene/current_region.h"
#include "viewer/scene/session_store.h"
#include "viewer/scene/video_maker.h"
#include "viewer/window/dialogs.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPlace = "output_folder";
constexpr size_t kNamedFiles = 3;  // of those that would be replaced
// The dialog sees the typed name, but an extension may be added to it.
constexpr auto kAskHere = QFileDialog::DontConfirmOverwrite;

fs::path Path(const QString& text) { return text.toStdString(); }
QString Text(const fs::path& path) { return QString::fromStdString(path.string()); }

fs::path WithoutSlash(const fs::path& path) {
  return path.has_filename() ? path : path.parent_path();
}

// Leftover frames of an earlier, longer turntable; they would end up in the video.
std::vector<fs::path> NumberedPictures(const fs::path& folder) {
  static const QRegularExpression kNumbered("^\\d{4,}\\.png$");
  std::vector<fs::path> found;
  for (const QString& name : QDir(Text(folder)).entryList(QDir::Files, QDir::Name)) {
    if (kNumbered.match(name).hasMatch()) found.push_back(folder / name.toStdString());
  }
  return found;
}

// Those of `views` below a folder; a name that would leave it is refused when it is written.
std::vector<fs::path> ViewFiles(const fs::path& folder, const std::vector<std::string>& views) {
  std::vector<fs::path> files;
  for (const std::string& view : views) {
    try {
      files.push_back(ViewFile(folder, view));
    } catch (const InputError&) {
    }
  }
  return files;
}

// The name of pictures that show `views`.
std::vector<std::string> PictureNames(const SceneFacts& facts,
                                      const std::vector<const View*>& views) {
  std::vector<std::string> names;
  for (const UserPicture* one : facts.pictures->Showing(views)) names.push_back(one->name);
  return names;
}

bool IsWithin(const fs::path& path, const fs::path& folder) {
  std::error_code ignored;
  const fs::path relative =
      fs::weakly_canonical(path, ignored).lexically_relative(fs::weakly_canonical(folder, ignored));
  return !relative.empty() && *relative.begin() != "..";
}

}  // namespace

Exports::Exports(const WindowParts& parts, QWidget* window)
    : QObject(window), window_(window), parts_(parts) {
  const auto wrote = [this](const QString& path) {
    RememberOutput(path.toStdString());
    Q_EMIT written();
  };
  connect(&parts_.controller->results(), &SceneResults::written, this,
          [this, wrote](const QString& path) {
            wrote(path);
            Q_EMIT said(tr("Wrote %1").arg(path));
          });
  connect(parts_.sessions, &SessionStore::saved, this, [this, wrote](const QString& path) {
    wrote(path);
    Q_EMIT said(tr("Saved %1").arg(path));
  });
  connect(parts_.videos, &VideoMaker::finished, this,
          [this](const QString& path) { Q_EMIT said(tr("Wrote %1").arg(path)); });
  connect(parts_.videos, &VideoMaker::failed, this, [this](const QString& message) {
    parts_.dialogs->ShowError(tr("The video cannot be made"), message);
  });
}

fs::path Exports::ProposedOutput(const QString& ending) const {
  const fs::path workspace = WithoutSlash(parts_.controller->facts()->request.place());
  const fs::path& session = parts_.sessions->folder();
  const fs::path of = session.empty() ? workspace : session;
  const QString last = QSettings().value(kPlace).toString();
  const fs::path place = !last.isEmpty() && QDir(last).exists() ? Path(last) : of.parent_path();
  return place / (of.stem().string() + ending.toStdString());
}

void Exports::RememberOutput(const fs::path& path) {
  QSettings().setValue(kPlace, Text(WithoutSlash(path).parent_path()));
}

void Exports::ConfirmReplacing(const fs::path& folder, const std::vector<fs::path>& files,
                               std::function<void()> go) {
  QStringList there;
  for (const fs::path& file : files) {
    std::error_code ignored;
    if (fs::exists(file, ignored)) there << Text(file.filename());
  }
  if (there.isEmpty()) return go();
  const auto more = there.size() - qsizetype(kNamedFiles);
  QString names = there.mid(0, qsizetype(kNamedFiles)).join(", ");
  if (more > 0) names += tr(" and %1 more").arg(more);
  const QString what =
      there.size() == 1 ? tr("Replace a file?") : tr("Replace %1 files?").arg(there.size());
  QString reason = tr("%1 already holds %2.").arg(Text(folder), names);
  const auto facts = parts_.controller->facts();
  if (facts && !facts->request.workspace.empty() && IsWithin(folder, facts->request.workspace)) {
    reason += tr("\nThis is in the workspace itself: they may be its own files.");
  }
  parts_.dialogs->Ask(what, reason, tr("&Replace"), std::move(go));
}

void Exports::ConfirmReplacing(const fs::path& file, std::function<void()> go) {
  ConfirmReplacing(fs::absolute(file).parent_path(), {file}, std::move(go));
}

void Exports::Splat() {
  if (!parts_.controller->IsOpen()) return;
  const fs::path source = parts_.controller->facts()->request.splat;
  const std::vector<ExportFormat> formats = ExportFormats(*parts_.controller->facts()->original);
  // That of the scene's own splat comes first.
  ExportFormat own = formats.front();
  QStringList filters;
  for (const ExportFormat& format : formats) {
    filters << format.filter;
    if (Text(source).endsWith(format.extension, Qt::CaseInsensitive)) own = format;
  }
  QString chosen = own.filter, problem;
  const QString path = QFileDialog::getSaveFileName(window_, tr("Export the splat"),
                                                    Text(ProposedOutput("-edited" + own.extension)),
                                                    filters.join(";;"), &chosen, kAskHere);
  if (path.isEmpty()) return;
  const QString named = NamedForExport(path, chosen, formats, &problem);
  if (named.isEmpty()) return parts_.dialogs->ShowError(tr("Choose another ending"), problem);
  ConfirmReplacing(Path(named),
                   [this, named] { parts_.controller->results().WriteSplat(Path(named)); });
}

void Exports::Report() {
  if (!parts_.controller->IsOpen()) return;
  const QString page = tr("Page to look at (*.html)"),
                figures = tr("Figures for programs (*.json)");
  QString kind = page;
  QString path = QFileDialog::getSaveFileName(window_, tr("Export the report"),
                                              Text(ProposedOutput("-report.html")),
                                              page + ";;" + figures, &kind, kAskHere);
  if (path.isEmpty()) return;
  const QString ending = kind == figures ? ".json" : ".html";
  if (!path.endsWith(".json") && !path.endsWith(".html")) path += ending;
  ConfirmReplacing(Path(path),
                   [this, path] { parts_.controller->results().WriteReport(Path(path)); });
}

void Exports::Masks() {
  const Region* region = parts_.controller->regions().Find(parts_.current->id());
  if (!region) {
    return parts_.dialogs->ShowError(tr("Export masks"),
                                     tr("Choose a region first. Masks belong to a region."));
  }
  auto* dialog = new ExportDialog(ExportDialog::Kind::kMasks, QString::fromStdString(region->name),
                                  Text(ProposedOutput("-masks")), window_);
  connect(dialog, &QDialog::accepted, this, [this, dialog, id = region->id] {
    const Region* one = parts_.controller->regions().Find(id);
    if (!one) return;
    const fs::path folder = dialog->folder();
    std::vector<const View*> views;
    for (const auto& [name, mask] : one->selection->masks) {
      views.push_back(parts_.controller->facts()->workspace->reconstruction.FindView(name));
    }
    ConfirmReplacing(folder, ViewFiles(folder, PictureNames(*parts_.controller->facts(), views)),
                     [this, folder, id] { parts_.controller->results().WriteMasks(folder, id); });
  });
  dialog->open();
}

void Exports::Views() {
  if (!parts_.controller->IsOpen()) return;
  const UserPicture* picture = parts_.canvas->picture();
  const std::string shown = picture ? picture->name : std::string();
  auto* dialog = new ExportDialog(ExportDialog::Kind::kViews, QString::fromStdString(shown),
                                  Text(ProposedOutput("-views")), window_);
  connect(dialog, &QDialog::accepted, this, [=, this] {
    const auto facts = parts_.controller->facts();
    if (!facts) return;
    const fs::path folder = dialog->folder();
    std::vector<const View*> views = facts->views;
    if (dialog->choice() == ExportDialog::kShownView) {
      const UserPicture* one = facts->FindPicture(shown);
      if (!one) return;
      views = one->faces;
    }
    std::vector<std::string> names;
    for (const View* one : views) names.push_back(one->name);
    ConfirmReplacing(folder, ViewFiles(folder, PictureNames(*facts, views)), [this, folder, names] {
      parts_.controller->results().WriteViews(folder, names);
    });
  });
  dialog->open();
}

void Exports::Turntable() {
  if (!parts_.controller->IsOpen()) return;
  auto* dialog = new ExportDialog(ExportDialog::Kind::kTurntable, {},
                                  Text(ProposedOutput("-turntable")), window_);
  connect(dialog, &QDialog::accepted, this, [this, dialog] {
    const auto facts = parts_.controller->facts();
    if (!facts) return;
    const PosedCamera shown = parts_.canvas->navigation().Rendered();
    // Even sizes: video encoders want them.
    const QSize asked = dialog->frame_size();
    const QSize size = asked.isEmpty() ? QSize(shown.camera.width, shown.camera.height) : asked;
    const auto cameras =
        dialog->choice() == ExportDialog::kThroughViews
            ? ViewPath(facts->workspace->reconstruction, facts->Standpoints(), dialog->frames())
            : parts_.canvas->navigation().Turntable(dialog->frames(), size.width() & ~1,
                                                    size.height() & ~1);
    const fs::path folder = dialog->folder();
    if (parts_.videos->Needs(folder)) {
      return parts_.dialogs->ShowError(
          tr("Choose another folder"),
          tr("A video of the frames in %1 is still being made.").arg(Text(folder)));
    }
    const fs::path video = folder / "turntable.mp4";
    const std::vector<fs::path> frames = NumberedPictures(folder);
    std::vector<fs::path> files = frames;
    if (dialog->video()) files.push_back(video);
    const auto then = [this, folder, video, wanted = dialog->video(),
                       rate = dialog->frames_per_second()] {
      if (wanted) MakeVideo(folder, video, rate);
    };
    ConfirmReplacing(folder, files, [this, folder, cameras, then, frames] {
      parts_.controller->results().WriteFrames(folder, cameras, then, frames);
    });
  });
  dialog->open();
}

void Exports::MakeVideo(const fs::path& folder, const fs::path& video, int rate) {
  Q_EMIT said(parts_.videos->IsBusy() ? tr("%1 is made after the video before it").arg(Text(video))
                                      : tr("Making %1").arg(Text(video)));
  parts_.videos->Make(folder, video, rate);
}

void Exports::Comparison() {
  if (!parts_.controller->IsOpen()) return;
  QString path = QFileDialog::getSaveFileName(window_, tr("Export before and after"),
                                              Text(ProposedOutput("-before-after.png")),
                                              tr("Pictures (*.png)"), nullptr, kAskHere);
  if (path.isEmpty()) return;
  if (!path.endsWith(".png")) path += ".png";
  const PosedCamera camera = parts_.canvas->navigation().Rendered();
  ConfirmReplacing(Path(path), [this, path, camera, lens = parts_.canvas->Lens()] {
    parts_.controller->results().WriteComparison(Path(path), camera, lens);
  });
}

}  // namespace retint
