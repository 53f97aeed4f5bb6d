// SPDX-License-Identifier: BSD-3-Clause
// The window's work with files: opening, sessions, exports, and their questions. Questions do not
// block the program: each is a dialog with a later answer.
#include <algorithm>
#include <utility>

#include <QAction>
#include <QCloseEvent>
#include <QDragEnterEvent>
#include <QDropEvent>
#include <QFileDialog>
#include <QFileInfo>
#include <QLabel>
#include <QMenu>
#include <QMessageBox>
#include <QSettings>

#include "base/error.h"
#include "colmap_io/nerfstudio.h"
#include "viewer/scene/session_store.h"
#include "viewer/scene/video_maker.h"
#include "viewer/selection/selection_mode.h"
#include "viewer/widgets/long_text.h"
#include "viewer/widgets/path_edit.h"
#include "viewer/window/keys_dialog.h"
#include "viewer/window/main_window.h"
#include "viewer/window/recent_files.h"
#include "viewer/window/sample_scene.h"
#include "viewer/window/start_page.h"

namespace retint {
namespace {

constexpr int kRecentWidth = 600;  // of a menu line, pixels

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

// ---- Opening

void MainWindow::Start(const StartOptions& options) {
  if (!options.problem.isEmpty()) {
    return ShowError(tr("That cannot be opened"), options.problem);
  }
  OfferRecovery(options, [this, options] { OpenStart(options); });
}

void MainWindow::OpenStart(const StartOptions& options) {
  const OpenRequest& scene = options.scene;
  if (!options.session.empty()) return OpenSession(options.session, scene.options.backend);
  if (!scene.workspace.empty() || !scene.splat.empty()) {
    OpenRequest request = scene;
    if (request.splat.empty()) request.splat = Path(GuessSplat(Text(request.workspace)));
    if (request.splat.empty()) return AskAndOpen(request);
    return OpenScene(request);
  }
}

void MainWindow::OpenScene(const OpenRequest& request) { OpenRequested(request, false); }

void MainWindow::OpenRequested(const OpenRequest& request, bool from_form) {
  ConfirmThen(tr("Open another scene?"), [this, request, from_form] {
    opening_ = RecentEntry(request);
    form_ = from_form ? std::optional(request) : std::nullopt;
    controller_->Open(request);
  });
}

// A filled-in form comes back with the reason. Otherwise, only the reason is shown.
void MainWindow::OnOpenFailed(const QString& message) {
  ShowPage();
  if (!form_) return ShowError(tr("The scene cannot be opened"), message);
  const OpenRequest request = *std::exchange(form_, std::nullopt);
  AskAndOpen(request, message);
}

void MainWindow::OpenSample() {
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
    controller_->OpenWith(tr("the sample"), open);
  });
}

void MainWindow::OpenSession(const std::filesystem::path& folder, const std::string& backend) {
  QString path = Text(folder);
  if (path.isEmpty()) {
    path = QFileDialog::getExistingDirectory(this, tr("Open a session (a .retint folder)"));
    if (path.isEmpty()) return;
  }
  if (const QString session = SessionOf(path); !session.isEmpty()) path = session;
  ConfirmThen(tr("Open another session?"), [this, path, backend] {
    opening_ = QFileInfo(path).absoluteFilePath();
    form_.reset();
    SessionOptions options;
    options.backend = backend;
    sessions_->Open(Path(path), options);
  });
}

void MainWindow::SplitGaussians(RegionId region) {
  if (!controller_->regions().Find(region)) return;
  // The dialog sees the typed name, but an extension may be added to it.
  QString path = QFileDialog::getSaveFileName(
      this, tr("Write the finer splat"), Text(ProposedOutput("-finer.ply")),
      tr("3D Gaussian Splatting (*.ply)"), nullptr, QFileDialog::DontConfirmOverwrite);
  if (path.isEmpty()) return;
  if (!path.endsWith(".ply")) path += ".ply";
  std::error_code code;
  if (std::filesystem::equivalent(Path(path), controller_->facts()->request.splat, code)) {
    return ShowError(tr("Choose another name"),
                     tr("%1 is the splat that is open, and stays as it is.").arg(path));
  }
  ConfirmReplacing(Path(path), [this, region, path] {
    AskOfPaint(tr("Open the finer splat?"), [this, region, path] { SplitInto(region, path); });
  });
}

void MainWindow::SplitInto(RegionId region, const QString& path) {
  if (!controller_->IsOpen()) return;  // closed during the question
  OpenRequest request = controller_->facts()->request;
  request.splat = Path(path);
  opening_ = RecentEntry(request);
  form_.reset();
  const std::string camera = canvas_->CameraState();
  controller_->SplitGaussians(region, {}, request.splat, [=, this](const RefineSummary& summary) {
    if (summary.split == 0) {
      return Say(tr("No painted Gaussian is large: the scene stays as it is"));
    }
    SetCurrentRegion(region);
    canvas_->RestoreCamera(camera);
    UpdateTitle();
    Say(tr("%1 Gaussians became %2, in %3, which is open now. Save the session to keep the regions")
            .arg(summary.split)
            .arg(summary.parts)
            .arg(path));
  });
}

void MainWindow::OpenPaths(const QStringList& paths) {
  const DroppedPaths dropped = SortPaths(paths);
  if (!dropped.problem.isEmpty()) return ShowError(tr("That cannot be opened"), dropped.problem);
  if (!dropped.session.isEmpty()) return OpenSession(Path(dropped.session));
  OpenRequest request;
  request.workspace = Path(dropped.workspace);
  request.splat =
      Path(dropped.splat.isEmpty() && !dropped.workspace.isEmpty() ? GuessSplat(dropped.workspace)
                                                                   : dropped.splat);
  // A splat without a workspace goes with the open workspace.
  if (request.workspace.empty() && controller_->IsOpen()) {
    request.workspace = controller_->facts()->request.workspace;
    request.options = controller_->facts()->request.options;
  }
  if (request.splat.empty()) return AskAndOpen(request);
  OpenScene(request);
}

void MainWindow::AskAndOpen(OpenRequest start, const QString& failure) {
  if (start.workspace.empty() && start.splat.empty() && controller_->IsOpen()) {
    start = controller_->facts()->request;
  }
  auto* dialog = new OpenDialog(start, this);
  dialog->setObjectName("open_dialog");
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  if (!failure.isEmpty()) dialog->ShowFailure(failure);
  connect(dialog, &QDialog::accepted, this,
          [this, dialog] { OpenRequested(dialog->request(), true); });
  dialog->open();
}

void MainWindow::Forget(const QString& entry) {
  ForgetRecent(entry);
  ShowRecent();
}

void MainWindow::OpenRecent(const QString& entry) {
  if (const QString missing = MissingOf(entry); !missing.isEmpty()) {
    Forget(entry);
    return ShowError(tr("It cannot be opened again"),
                     tr("%1 is gone. It is off the list now.").arg(missing));
  }
  if (IsSessionEntry(entry)) return OpenSession(Path(entry));
  OpenScene(RecentRequest(entry));
}

void MainWindow::FillRecent() {
  recent_->clear();
  for (const QString& entry : RecentFiles()) {
    QAction* one = recent_->addAction(RecentLine(entry, recent_->fontMetrics()), this,
                                      [this, entry] { OpenRecent(entry); });
    one->setToolTip(RecentTitle(entry));
  }
  if (recent_->isEmpty()) {
    recent_->addAction(tr("nothing yet"))->setEnabled(false);
    return;
  }
  recent_->addSeparator();
  recent_->addAction(tr("&Clear this list"), this, [this] {
    ForgetRecentFiles();
    ShowRecent();
  });
}

void MainWindow::ShowRecent() { start_->Show(RecentFiles()); }

void MainWindow::KeepPicture() {
  if (controller_->IsOpen() && canvas_->frame()) {
    KeepRecentPicture(opening_, canvas_->frame()->image);
  }
}

void MainWindow::dragEnterEvent(QDragEnterEvent* event) {
  if (!LocalPaths(*event->mimeData()).isEmpty()) TakeCopy(event);
}

void MainWindow::dragMoveEvent(QDragMoveEvent* event) {
  if (!LocalPaths(*event->mimeData()).isEmpty()) TakeCopy(event);
}

void MainWindow::dropEvent(QDropEvent* event) {
  const QStringList paths = LocalPaths(*event->mimeData());
  if (paths.isEmpty()) return;
  TakeCopy(event);
  if (event->isAccepted()) OpenPaths(paths);
}

// ---- Sessions

void MainWindow::Save(bool as, std::function<void()> then) {
  if (!controller_->IsOpen()) return;
  auto folder = sessions_->folder();
  if (as || folder.empty()) {
    const auto start = folder.empty() ? ProposedOutput(".retint") : folder;
    QString path = QFileDialog::getSaveFileName(this, tr("Save the session"), Text(start),
                                                tr("Sessions (*.retint)"), nullptr,
                                                QFileDialog::DontConfirmOverwrite);
    if (path.isEmpty()) return;
    if (!path.endsWith(".retint")) path += ".retint";
    const auto chosen = Path(path);
    if (SamePath(chosen, folder)) return SaveAgain(std::move(then));
    return ConfirmReplacing(chosen, {chosen / "session.json"},
                            [this, chosen, then] { sessions_->Save(chosen, then); });
  }
  SaveAgain(std::move(then));
}

// Saves to the open session. Asks first if another program has saved it in the
// meantime.
void MainWindow::SaveAgain(std::function<void()> then) {
  const auto folder = sessions_->folder();
  if (!sessions_->IsSavedElsewhere()) return sessions_->Save(folder, std::move(then));
  const QString what = tr("Replace the session?");
  auto* box = new QMessageBox(QMessageBox::Warning, what, what, QMessageBox::Cancel, this);
  box->setInformativeText(
      tr("%1 was saved by another program since it was opened here. What was saved there is lost "
         "when you replace it.")
          .arg(Text(folder)));
  QPushButton* replace = box->addButton(tr("&Replace"), QMessageBox::DestructiveRole);
  QPushButton* as = box->addButton(tr("Save &as…"), QMessageBox::AcceptRole);
  box->setDefaultButton(as);
  connect(box, &QMessageBox::buttonClicked, this, [=, this](QAbstractButton* button) {
    if (button == replace) sessions_->Save(folder, then);
    if (button == as) Save(true, then);
  });
  ShowDialog(box);
}

// Offers the newest unsaved work of the requested files, or of any files if there is no request.
// Runs `otherwise` unless the user takes it.
void MainWindow::OfferRecovery(const StartOptions& options, std::function<void()> otherwise) {
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
                      QMessageBox::NoButton, this);
  QPushButton* recover = box->addButton(tr("Recover"), QMessageBox::AcceptRole);
  QPushButton* discard = box->addButton(tr("Throw away"), QMessageBox::DestructiveRole);
  box->addButton(tr("Later"), QMessageBox::RejectRole);
  box->setDefaultButton(recover);
  connect(box, &QMessageBox::buttonClicked, this, [=, this](QAbstractButton* button) {
    if (button == recover) {
      opening_.clear();
      SessionOptions session_options;
      session_options.backend = options.scene.options.backend;
      sessions_->Open(newest.folder, session_options);
      return;
    }
    if (button == discard) RemoveRecovery(newest);
    otherwise();
  });
  ShowDialog(box);
}

// ---- Questions

void MainWindow::ConfirmThen(const QString& what, std::function<void()> go, bool quits) {
  const bool running = controller_->colors().optimizer().Active();
  const bool busy = controller_->IsOpen() && controller_->IsBusy();
  const bool modified = controller_->IsOpen() && IsModified();
  const bool painted = selection_->HoldsPaint();
  const bool filming = quits && videos_->IsBusy();
  if (!running && !busy && !filming && !modified && !painted) return go();
  QStringList reasons;
  if (running) reasons << tr("The optimizer is still running. It will be stopped.");
  if (busy) reasons << tr("%1 is still under way. It will be stopped.").arg(controller_->task());
  if (filming) reasons << tr("The video is still being made. It will be stopped.");
  if (painted) reasons << LossOfPaint();
  if (modified) reasons << tr("There are edits that have not been saved.");
  auto* box = new QMessageBox(QMessageBox::Question, what, what, QMessageBox::Cancel, this);
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
    controller_->colors().CancelRefit();
    controller_->Cancel();
    go();
  };
  connect(box, &QMessageBox::buttonClicked, this, [=, this](QAbstractButton* button) {
    if (button == leave) {
      stop_and_go();
    } else if (save && button == save) {
      Save(false, stop_and_go);  // save before stopping: the question may end here
    }
  });
  ShowDialog(box);
}

// Names the view, because the strokes may be old.
QString MainWindow::LossOfPaint() const {
  const QString view = selection_->entry().view;
  return tr("What you painted %1 has not been accepted. It will be lost.")
      .arg(view.isEmpty() ? tr("in a free view") : tr("on %1").arg(view));
}

void MainWindow::AskOfPaint(const QString& what, std::function<void()> go) {
  if (!selection_->HoldsPaint()) return go();
  Ask(what, LossOfPaint(), tr("&Discard the paint"), std::move(go));
}

void MainWindow::Ask(const QString& what, const QString& reason, const QString& go_on,
                     std::function<void()> go) {
  auto* box = new QMessageBox(QMessageBox::Warning, what, what, QMessageBox::Cancel, this);
  box->setInformativeText(reason);
  QPushButton* agree = box->addButton(go_on, QMessageBox::DestructiveRole);
  box->setDefaultButton(QMessageBox::Cancel);
  connect(box, &QMessageBox::buttonClicked, this, [=](QAbstractButton* button) {
    if (button == agree) go();
  });
  ShowDialog(box);
}

void MainWindow::ShowDialog(QMessageBox* box) {
  constexpr int kLongWord = 60;  // characters; a dialog becomes this wide
  box->setTextFormat(Qt::PlainText);
  box->setText(Breakable(box->text(), kLongWord));
  box->setInformativeText(Breakable(box->informativeText(), kLongWord));
  box->setTextInteractionFlags(Qt::TextSelectableByMouse);
  // Otherwise, a dialog is only as wide as its title.
  if (auto* text = box->findChild<QLabel*>("qt_msgbox_informativelabel")) {
    const QFontMetrics font = text->fontMetrics();
    const int whole = font.boundingRect(QRect(), Qt::TextDontClip, text->text()).width();
    text->setMinimumWidth(std::max(text->minimumSizeHint().width(),
                                   std::min(whole, kLongWord * font.averageCharWidth())));
  }
  box->setAttribute(Qt::WA_DeleteOnClose);
  dialog_ = box;
  connect(box, &QDialog::finished, this, [this] {
    // After the dialog has closed, so that the next one stays open.
    QTimer::singleShot(0, this, &MainWindow::NextError);
  });
  box->open();
}

void MainWindow::ShowError(const QString& title, const QString& message) {
  errors_.emplace_back(title, message);
  if (!dialog_) NextError();
}

void MainWindow::NextError() {
  if (errors_.empty() || (dialog_ && dialog_->isVisible())) return;
  const auto [title, message] = errors_.front();
  errors_.pop_front();
  // Above the list of keys if it is open, which would keep the keyboard otherwise.
  QWidget* front = this;
  if (keys_dialog_ && keys_dialog_->isVisible()) front = keys_dialog_;
  auto* box = new QMessageBox(QMessageBox::Warning, title, title, QMessageBox::Ok, front);
  box->setInformativeText(message);
  ShowDialog(box);
}

void MainWindow::closeEvent(QCloseEvent* event) {
  if (!closing_) {
    event->ignore();
    if (dialog_ && dialog_->isVisible()) return;  // already asked
    const auto quit = [this] {
      closing_ = true;
      close();
    };
    ConfirmThen(tr("Quit Retint?"), quit, /*quits=*/true);
    if (!closing_) return;
  }
  QSettings settings;
  settings.setValue("geometry", saveGeometry());
  settings.setValue("layout", panels_shown_ && !on_start_page_ ? saveState() : layout_);
  sessions_->DropAutosave();
  controller_->Close();
  event->accept();
}

}  // namespace retint
