// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/scene_files.h"

#include <algorithm>
#include <utility>

#include <QAction>
#include <QFileDialog>
#include <QFileInfo>
#include <QMenu>
#include <QMessageBox>
#include <QPushButton>
#include <QStandardPaths>
#include <QTimer>

#include "base/error.h"
#include "viewer/canvas/canvas.h"
#include "viewer/scene/current_region.h"
#include "viewer/scene/session_store.h"
#include "viewer/scene/video_maker.h"
#include "viewer/selection/selection_mode.h"
#include "viewer/widgets/path_edit.h"
#include "viewer/window/dialogs.h"
#include "viewer/window/exports.h"
#include "viewer/window/open_dialog.h"
#include "viewer/window/recent_files.h"
#include "viewer/window/sample_scene.h"

namespace retint {
namespace {

constexpr int kRecentWidth = 600;  // of a menu line, pixels
constexpr int kPictureMs = 1500;   // until a scene that was opened is drawn

std::filesystem::path Path(const QString& text) { return text.toStdString(); }
bool SamePath(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::error_code ignored;
  return std::filesystem::equivalent(a, b, ignored);
}
QString Text(const std::filesystem::path& path) { return QString::fromStdString(path.string()); }

// Shortened for the menu, because paths may be wider than the screen.
QString RecentLine(const QString& entry, const QFontMetrics& metrics) {
  return metrics.elidedText(RecentTitle(entry), Qt::ElideMiddle, kRecentWidth).replace("&", "&&");
}

}  // namespace

SceneFiles::SceneFiles(const WindowParts& parts, Exports* exports, QWidget* window)
    : QObject(window),
      window_(window),
      parts_(parts),
      exports_(exports),
      sample_(std::make_shared<SampleScene>(
          QStandardPaths::writableLocation(QStandardPaths::AppDataLocation).toStdString() +
          "/sample")) {
  connect(parts_.controller, &SceneController::opened, this, [this] {
    if (!opening_.isEmpty()) RememberRecent(opening_);
    QTimer::singleShot(kPictureMs, this, &SceneFiles::KeepPicture);
    form_.reset();
  });
  connect(parts_.controller, &SceneController::openFailed, this, &SceneFiles::OnOpenFailed);
  connect(parts_.controller, &SceneController::openCancelled, this, [this] { form_.reset(); });
  connect(parts_.sessions, &SessionStore::saved, this, [this](const QString& path) {
    RememberRecent(path);
    opening_ = path;
    KeepPicture();
  });
}

// ---- Opening

void SceneFiles::Start(const StartOptions& options) {
  if (!options.problem.isEmpty()) {
    return parts_.dialogs->ShowError(tr("That cannot be opened"), options.problem);
  }
  OfferRecovery(options, [this, options] { OpenStart(options); });
}

void SceneFiles::OpenStart(const StartOptions& options) {
  const OpenRequest& scene = options.scene;
  if (!options.session.empty()) return OpenSession(options.session, scene.options.backend);
  if (!scene.workspace.empty() || !scene.splat.empty()) {
    OpenRequest request = scene;
    if (request.splat.empty()) request.splat = Path(GuessSplat(Text(request.workspace)));
    if (request.splat.empty()) return AskAndOpen(request);
    return OpenScene(request);
  }
}

void SceneFiles::OpenRequested(const OpenRequest& request, bool from_form) {
  ConfirmThen(tr("Open another scene?"), [this, request, from_form] {
    opening_ = RecentEntry(request);
    form_ = from_form ? std::optional(request) : std::nullopt;
    parts_.controller->Open(request);
  });
}

// A filled-in form comes back with the reason. Otherwise, only the reason is shown.
void SceneFiles::OnOpenFailed(const QString& message) {
  if (!form_) return parts_.dialogs->ShowError(tr("The scene cannot be opened"), message);
  const OpenRequest request = *std::exchange(form_, std::nullopt);
  AskAndOpen(request, message);
}

void SceneFiles::PrepareSample() {
  if (!parts_.controller->IsOpen() && !parts_.controller->IsBusy()) sample_->Prepare();
}

void SceneFiles::OpenSample() {
  OpenRequest request;
  request.workspace = sample_->folder();
  request.splat = sample_->folder() / "splat.ply";
  const auto open = [request, sample = sample_](Monitor& monitor) {
    sample->Make(monitor);
    return EditSession::Open(request.workspace, request.splat, request.options, monitor);
  };
  ConfirmThen(tr("Open the sample?"), [this, request, open] {
    opening_ = RecentEntry(request);
    form_.reset();
    parts_.controller->OpenWith(tr("the sample"), open);
  });
}

void SceneFiles::OpenSession(const std::filesystem::path& folder, const std::string& backend) {
  QString path = Text(folder);
  if (path.isEmpty()) {
    path = QFileDialog::getExistingDirectory(window_, tr("Open a session (a .retint folder)"));
    if (path.isEmpty()) return;
  }
  if (const QString session = SessionOf(path); !session.isEmpty()) path = session;
  ConfirmThen(tr("Open another session?"), [this, path, backend] {
    opening_ = QFileInfo(path).absoluteFilePath();
    form_.reset();
    SessionOptions options;
    options.backend = backend;
    parts_.sessions->Open(Path(path), options);
  });
}

void SceneFiles::SplitGaussians(RegionId region) {
  if (!parts_.controller->regions().Find(region)) return;
  // The dialog sees the typed name, but an extension may be added to it.
  QString path = QFileDialog::getSaveFileName(
      window_, tr("Write the finer splat"), Text(exports_->ProposedOutput("-finer.ply")),
      tr("3D Gaussian Splatting (*.ply)"), nullptr, QFileDialog::DontConfirmOverwrite);
  if (path.isEmpty()) return;
  if (!path.endsWith(".ply")) path += ".ply";
  std::error_code code;
  if (std::filesystem::equivalent(Path(path), parts_.controller->facts()->request.splat, code)) {
    return parts_.dialogs->ShowError(
        tr("Choose another name"),
        tr("%1 is the splat that is open, and stays as it is.").arg(path));
  }
  exports_->ConfirmReplacing(Path(path), [this, region, path] {
    AskOfPaint(tr("Open the finer splat?"), [this, region, path] { SplitInto(region, path); });
  });
}

void SceneFiles::SplitInto(RegionId region, const QString& path) {
  if (!parts_.controller->IsOpen()) return;  // closed during the question
  OpenRequest request = parts_.controller->facts()->request;
  request.splat = Path(path);
  opening_ = RecentEntry(request);
  form_.reset();
  const std::string camera = parts_.canvas->CameraState();
  parts_.controller->SplitGaussians(
      region, {}, request.splat, [=, this](const RefineSummary& summary) {
        if (summary.split == 0) {
          return Q_EMIT said(tr("No painted Gaussian is large: the scene stays as it is"));
        }
        parts_.current->Set(region);
        parts_.canvas->RestoreCamera(camera);
        Q_EMIT said(tr("%1 Gaussians became %2, in %3, which is open now. Save the session to keep "
                       "the regions")
                        .arg(summary.split)
                        .arg(summary.parts)
                        .arg(path));
      });
}

void SceneFiles::OpenPaths(const QStringList& paths) {
  const DroppedPaths dropped = SortPaths(paths);
  if (!dropped.problem.isEmpty())
    return parts_.dialogs->ShowError(tr("That cannot be opened"), dropped.problem);
  if (!dropped.session.isEmpty()) return OpenSession(Path(dropped.session));
  OpenRequest request;
  request.workspace = Path(dropped.workspace);
  request.splat =
      Path(dropped.splat.isEmpty() && !dropped.workspace.isEmpty() ? GuessSplat(dropped.workspace)
                                                                   : dropped.splat);
  // A splat without a workspace goes with the open workspace.
  if (request.workspace.empty() && parts_.controller->IsOpen()) {
    request.workspace = parts_.controller->facts()->request.workspace;
    request.options = parts_.controller->facts()->request.options;
  }
  if (request.splat.empty()) return AskAndOpen(request);
  OpenScene(request);
}

void SceneFiles::AskAndOpen(OpenRequest start, const QString& failure) {
  if (start.workspace.empty() && start.splat.empty() && parts_.controller->IsOpen()) {
    start = parts_.controller->facts()->request;
  }
  auto* dialog = new OpenDialog(start, window_);
  dialog->setObjectName("open_dialog");
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  if (!failure.isEmpty()) dialog->ShowFailure(failure);
  connect(dialog, &QDialog::accepted, this,
          [this, dialog] { OpenRequested(dialog->request(), true); });
  dialog->open();
}

void SceneFiles::Forget(const QString& entry) {
  ForgetRecent(entry);
  Q_EMIT recentChanged();
}

void SceneFiles::OpenRecent(const QString& entry) {
  if (const QString missing = MissingOf(entry); !missing.isEmpty()) {
    Forget(entry);
    return parts_.dialogs->ShowError(tr("It cannot be opened again"),
                                     tr("%1 is gone. It is off the list now.").arg(missing));
  }
  if (IsSessionEntry(entry)) return OpenSession(Path(entry));
  OpenScene(RecentRequest(entry));
}

void SceneFiles::FillRecent(QMenu* menu) {
  menu->clear();
  for (const QString& entry : RecentFiles()) {
    QAction* one = menu->addAction(RecentLine(entry, menu->fontMetrics()), this,
                                   [this, entry] { OpenRecent(entry); });
    one->setToolTip(RecentTitle(entry));
  }
  if (menu->isEmpty()) {
    menu->addAction(tr("nothing yet"))->setEnabled(false);
    return;
  }
  menu->addSeparator();
  menu->addAction(tr("&Clear this list"), this, [this] {
    ForgetRecentFiles();
    Q_EMIT recentChanged();
  });
}

void SceneFiles::KeepPicture() {
  if (parts_.controller->IsOpen() && parts_.canvas->frame()) {
    KeepRecentPicture(opening_, parts_.canvas->frame()->image);
  }
}

// ---- Sessions

void SceneFiles::Save(bool as, std::function<void()> then) {
  if (!parts_.controller->IsOpen()) return;
  auto folder = parts_.sessions->folder();
  if (as || folder.empty()) {
    const auto start = folder.empty() ? exports_->ProposedOutput(".retint") : folder;
    QString path = QFileDialog::getSaveFileName(window_, tr("Save the session"), Text(start),
                                                tr("Sessions (*.retint)"), nullptr,
                                                QFileDialog::DontConfirmOverwrite);
    if (path.isEmpty()) return;
    if (!path.endsWith(".retint")) path += ".retint";
    const auto chosen = Path(path);
    if (SamePath(chosen, folder)) return SaveAgain(std::move(then));
    return exports_->ConfirmReplacing(chosen, {chosen / "session.json"}, [this, chosen, then] {
      parts_.sessions->Save(chosen, then);
    });
  }
  SaveAgain(std::move(then));
}

// Saves to the open session. Asks first if another program has saved it in the
// meantime.
void SceneFiles::SaveAgain(std::function<void()> then) {
  const auto folder = parts_.sessions->folder();
  if (!parts_.sessions->IsSavedElsewhere()) return parts_.sessions->Save(folder, std::move(then));
  const QString what = tr("Replace the session?");
  auto* box = new QMessageBox(QMessageBox::Warning, what, what, QMessageBox::Cancel, window_);
  box->setInformativeText(
      tr("%1 was saved by another program since it was opened here. What was saved there is lost "
         "when you replace it.")
          .arg(Text(folder)));
  QPushButton* replace = box->addButton(tr("&Replace"), QMessageBox::DestructiveRole);
  QPushButton* as = box->addButton(tr("Save &as…"), QMessageBox::AcceptRole);
  box->setDefaultButton(as);
  connect(box, &QMessageBox::buttonClicked, this, [=, this](QAbstractButton* button) {
    if (button == replace) parts_.sessions->Save(folder, then);
    if (button == as) Save(true, then);
  });
  parts_.dialogs->Show(box);
}

// Offers the newest unsaved work of the requested files, or of any files if there is no request.
// Runs `otherwise` unless the user takes it.
void SceneFiles::OfferRecovery(const StartOptions& options, std::function<void()> otherwise) {
  std::vector<std::filesystem::path> known;
  if (!options.session.empty()) known.push_back(options.session);
  for (const QString& entry : RecentFiles()) {
    if (IsSessionEntry(entry)) known.push_back(Path(entry));
  }
  const auto left = FindRecoverable(known);
  const auto found = std::find_if(left.begin(), left.end(), [&](const Recovery& one) {
    const OpenRequest& scene = options.scene;
    if (!options.session.empty()) return SamePath(one.session, options.session);
    return (scene.workspace.empty() || SamePath(one.info.workspace, scene.workspace)) &&
           (scene.splat.empty() || SamePath(one.info.splat, scene.splat));
  });
  if (found == left.end()) return otherwise();
  const Recovery newest = *found;
  const QString of = !newest.session.empty()         ? Text(newest.session)
                     : newest.info.workspace.empty() ? Text(newest.info.splat)
                                                     : Text(newest.info.workspace);
  auto* box =
      new QMessageBox(QMessageBox::Question, tr("Recover unsaved work?"),
                      tr("Retint ended without saving %1 of %2.")
                          .arg(newest.info.regions == 1 ? tr("1 region")
                                                        : tr("%1 regions").arg(newest.info.regions),
                               of),
                      QMessageBox::NoButton, window_);
  QPushButton* recover = box->addButton(tr("Recover"), QMessageBox::AcceptRole);
  QPushButton* discard = box->addButton(tr("Throw away"), QMessageBox::DestructiveRole);
  box->addButton(tr("Later"), QMessageBox::RejectRole);
  box->setDefaultButton(recover);
  connect(box, &QMessageBox::buttonClicked, this, [=, this](QAbstractButton* button) {
    if (button == recover) {
      opening_.clear();
      SessionOptions session_options;
      session_options.backend = options.scene.options.backend;
      parts_.sessions->Open(newest.folder, session_options);
      return;
    }
    if (button == discard) RemoveRecovery(newest);
    otherwise();
  });
  parts_.dialogs->Show(box);
}

// ---- Questions

void SceneFiles::ConfirmThen(const QString& what, std::function<void()> go, bool quits) {
  const bool running = parts_.controller->colors().optimizer().Active();
  const bool busy = parts_.controller->IsOpen() && parts_.controller->IsBusy();
  const bool modified = parts_.controller->IsOpen() && parts_.sessions->IsModified();
  const bool painted = parts_.selection->HoldsPaint();
  const bool filming = quits && parts_.videos->IsBusy();
  if (!running && !busy && !filming && !modified && !painted) return go();
  QStringList reasons;
  if (running) reasons << tr("The optimizer is still running. It will be stopped.");
  if (busy)
    reasons << tr("%1 is still under way. It will be stopped.").arg(parts_.controller->task());
  if (filming) reasons << tr("The video is still being made. It will be stopped.");
  if (painted) reasons << LossOfPaint();
  if (modified) reasons << tr("There are edits that have not been saved.");
  auto* box = new QMessageBox(QMessageBox::Question, what, what, QMessageBox::Cancel, window_);
  box->setInformativeText(reasons.join("\n"));
  QPushButton* save = nullptr;
  if (modified) save = box->addButton(tr("&Save"), QMessageBox::AcceptRole);
  const bool stops = running || busy || filming;
  const QString go_on = modified ? tr("&Don't save")
                        : stops  ? tr("&Stop and go on")
                                 : tr("&Discard the paint");
  QPushButton* leave = box->addButton(go_on, QMessageBox::DestructiveRole);
  if (!painted) box->setDefaultButton(save ? save : leave);
  if (painted) box->setDefaultButton(QMessageBox::Cancel);
  const auto stop_and_go = [this, go = std::move(go)] {
    parts_.controller->colors().CancelRefit();
    parts_.controller->Cancel();
    go();
  };
  connect(box, &QMessageBox::buttonClicked, this, [=, this](QAbstractButton* button) {
    if (button == leave) {
      stop_and_go();
    } else if (save && button == save) {
      Save(false, stop_and_go);  // save before stopping: the question may end here
    }
  });
  parts_.dialogs->Show(box);
}

// Names the view, because the strokes may be old.
QString SceneFiles::LossOfPaint() const {
  const QString view = parts_.selection->entry().view;
  return tr("What you painted %1 has not been accepted. It will be lost.")
      .arg(view.isEmpty() ? tr("in a free view") : tr("on %1").arg(view));
}

void SceneFiles::AskOfPaint(const QString& what, std::function<void()> go) {
  if (!parts_.selection->HoldsPaint()) return go();
  parts_.dialogs->Ask(what, LossOfPaint(), tr("&Discard the paint"), std::move(go));
}

}  // namespace retint
