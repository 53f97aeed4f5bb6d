// SPDX-License-Identifier: BSD-3-Clause
// The window's actions and menus, and their work apart from files.
#include <QAction>
#include <QApplication>
#include <QClipboard>
#include <QCryptographicHash>
#include <QDateTime>
#include <QDesktopServices>
#include <QDir>
#include <QDockWidget>
#include <QFileInfo>
#include <QMenu>
#include <QMenuBar>
#include <QMessageBox>
#include <QSettings>
#include <QStackedWidget>
#include <QStandardPaths>
#include <QToolBar>
#include <QToolButton>
#include <QUrl>

#include "base/run_clock.h"
#include "viewer/canvas/canvas_overlays.h"
#include "viewer/canvas/overlay_color.h"
#include "viewer/canvas/uncertainty.h"
#include "viewer/panels/quality_panel.h"
#include "viewer/panels/views_panel.h"
#include "viewer/selection/selection_mode.h"
#include "viewer/selection/stroke_preview.h"
#include "viewer/widgets/icon.h"
#include "viewer/window/color_matching.h"
#include "viewer/window/exports.h"
#include "viewer/window/flat_style.h"
#include "viewer/window/keys_dialog.h"
#include "viewer/window/main_window.h"
#include "viewer/window/preferences_dialog.h"

namespace retint {
namespace {

// The editor's page in the documents of packages; empty if there is none.
QString GuideFile() {
  const QDir program(QCoreApplication::applicationDirPath());
  for (const char* package : {"retint", "retint-cuda"}) {
    const QString page = program.filePath(QString("../share/doc/%1/docs/viewer.md").arg(package));
    if (QFileInfo::exists(page)) return page;
  }
  return {};
}

}  // namespace

QAction* MainWindow::MakeAction(const char* command, const QString& text, std::function<void()> act,
                                bool checkable) {
  QAction* action =
      AddCommand(command, text, tr(FindCommand(command)->title), KeysOf(command), std::move(act));
  action->setCheckable(checkable);
  return action;
}

QAction* MainWindow::AddCommand(const std::string& id, const QString& text, const QString& title,
                                const QList<QKeySequence>& keys, std::function<void()> act) {
  auto* action = new QAction(text, this);
  action->setObjectName(QString::fromStdString(id));
  action->setShortcuts(keys);
  action->setToolTip(title + (keys.isEmpty() ? "" : " (" + KeyText(keys) + ")"));
  connect(action, &QAction::triggered, this, [act = std::move(act)] { act(); });
  addAction(action);
  actions_.emplace(id, action);
  return action;
}

QAction* MainWindow::action(std::string_view command) const {
  const auto found = actions_.find(command);
  return found == actions_.end() ? nullptr : found->second;
}

void MainWindow::BuildActions() {
  MakeAction("file.open", tr("&Open…"), [this] { files_->AskAndOpen({}); });
  MakeAction("file.open_session", tr("Open se&ssion…"), [this] { files_->OpenSession({}); });
  MakeAction("file.save", tr("&Save session"), [this] { files_->Save(false); });
  MakeAction("file.save_as", tr("Save session &as…"), [this] { files_->Save(true); });
  MakeAction("file.export_splat", tr("&Splat…"), [this] { exports_->Splat(); });
  MakeAction("file.close", tr("&Close the scene"), [this] {
    files_->ConfirmThen(tr("Close the scene?"), [this] { controller_->Close(); });
  });
  MakeAction("file.quit", tr("&Quit"), [this] { close(); });
  MakeAction("edit.undo", tr("&Undo"), [this] { controller_->Undo(); });
  MakeAction("edit.redo", tr("&Redo"), [this] { controller_->Redo(); });
  MakeAction("edit.cancel", tr("Back out"), [this] { BackOut(); });
  MakeAction("selection.enter", tr("&Paint"), [this] {
    EnterSelection(views_->IsToPaintNext() ? current_->id() : 0);
  })->setToolTip(tr("Paint on this view to select a part of the scene"));
  MakeAction("view.next", tr("&Next view"), [this] { canvas_->StepView(1); });
  MakeAction("view.previous", tr("&Previous view"), [this] { canvas_->StepView(-1); });
  MakeAction("camera.frame", tr("&Frame"), [this] { canvas_->FrameSelection(); });
  MakeAction("camera.reset", tr("&Reset the camera"), [this] { canvas_->ResetCamera(); });
  MakeAction(
      "camera.fly_mode", tr("Fl&y"), [this] { canvas_->SetFlyMode(!canvas_->fly_mode()); }, true);
  MakeAction(
      "show.frusta", tr("&Cameras"), [this] { canvas_->SetFrusta(!canvas_->frusta()); }, true);
  MakeAction(
      "show.depth", tr("&Depth"), [this] { canvas_->SetDepth(!canvas_->depth()); }, true);
  MakeAction(
      "show.split", tr("&Before and after"), [this] { canvas_->SetSplit(!canvas_->split()); },
      true);
  MakeAction(
      "show.cloud", tr("&Points of the paint"),
      [this] { canvas_->SetCloudShown(!canvas_->cloud_shown()); }, true)
      ->setToolTip(
          tr("The painted pixels in space, by the depth that was found; what the selection adds "
             "beyond the paint shows with the mask"));
  MakeAction(
      "show.mask", tr("&Mask of the region"),
      [this] { quality_->SetMaskShown(!quality_->mask_shown()); }, true);
  MakeAction(
      "show.uncertain", tr("&Uncertain surfaces"),
      [this] {
        canvas_->SetHatching(!canvas_->hatching());
        if (canvas_->hatching()) uncertainty_->Find();
      },
      true);
  MakeAction(
      "show.look_ahead", tr("&Look ahead while painting"),
      [this] {
        preview_->SetEnabled(!preview_->enabled());
        QSettings().setValue("look_ahead", preview_->enabled());
        UpdateActions();
      },
      true);
  MakeAction("window.panels", tr("&Hide the panels"), [this] { SetPanelsShown(!panels_shown_); });
  MakeAction("window.screenshot", tr("Save a &screenshot"), [this] { SaveScreenshot(); });
  MakeAction("window.copy_picture", tr("&Copy the picture"), [this] { CopyPicture(); });
  MakeAction("window.full_screen", tr("&Full screen"),
             [this] { setWindowState(windowState() ^ Qt::WindowFullScreen); });
  MakeAction("help.keys", tr("&Keys"), [this] { ShowKeys(); });
}

void MainWindow::BuildMenus() {
  const auto add = [this](QMenu* menu, std::initializer_list<const char*> commands) {
    for (const char* command : commands) {
      if (*command) {
        menu->addAction(action(command));
      } else {
        menu->addSeparator();
      }
    }
  };
  QMenu* file = menuBar()->addMenu(tr("&File"));
  add(file, {"file.open", "file.open_session"});
  recent_ = file->addMenu(tr("Open &recent"));
  recent_->setToolTipsVisible(true);  // of paths that are cut short
  connect(recent_, &QMenu::aboutToShow, this, [this] { files_->FillRecent(recent_); });
  add(file, {"", "file.save", "file.save_as"});
  QMenu* output = file->addMenu(tr("&Export"));
  output->setObjectName("export");
  add(output, {"file.export_splat"});
  output->addAction(tr("&Masks of the current region…"), exports_, &Exports::Masks);
  output->addAction(tr("Edited &views…"), exports_, &Exports::Views);
  output->addAction(tr("&Report…"), exports_, &Exports::Report);
  output->addAction(tr("&Turntable…"), exports_, &Exports::Turntable);
  output->addAction(tr("&Before and after…"), exports_, &Exports::Comparison);
  add(file, {"", "file.close", "file.quit"});
  QMenu* edit = menuBar()->addMenu(tr("&Edit"));
  add(edit, {"edit.undo", "edit.redo"});
  history_ = edit->addMenu(tr("&History"));
  history_->setObjectName("history");
  connect(history_, &QMenu::aboutToShow, this, &MainWindow::FillHistory);
  add(edit, {"", "selection.enter"});
  edit->addAction(tr("&Match colors…"), matching_, &ColorMatching::Start)->setObjectName("match");
  add(edit, {"", "window.copy_picture", ""});
  edit->addAction(tr("&Preferences…"), this, &MainWindow::ShowPreferences);
  QMenu* view = menuBar()->addMenu(tr("&View"));
  add(view, {"view.next", "view.previous", "", "camera.frame", "camera.reset", "camera.fly_mode",
             "", "show.frusta", "show.depth", "show.cloud", "show.mask", "show.split", ""});
  bookmarks_ = view->addMenu(tr("&Kept cameras"));
  bookmarks_->setObjectName("bookmarks");
  connect(bookmarks_, &QMenu::aboutToShow, this, &MainWindow::FillBookmarks);
  add(view->addMenu(tr("&Advanced")), {"show.uncertain", "show.look_ahead"});
  QMenu* window = menuBar()->addMenu(tr("&Window"));
  panels_menu_ = window->addMenu(tr("&Panels"));
  add(window, {"window.panels", "window.full_screen", "window.screenshot"});
  QMenu* help = menuBar()->addMenu(tr("&Help"));
  add(help, {"help.keys"});
  if (const QString guide = GuideFile(); !guide.isEmpty()) {
    help->addAction(tr("&Guide"), this,
                    [guide] { QDesktopServices::openUrl(QUrl::fromLocalFile(guide)); });
  }
  help->addAction(tr("Open the &sample"), this, [this] { files_->OpenSample(); });
  help->addAction(tr("&About Retint"), this, [this] {
    const QString version = QString::fromUtf8(Version().data(), qsizetype(Version().size()));
    auto* box = new QMessageBox(QMessageBox::NoIcon, tr("About Retint"),
                                tr("Retint %1").arg(version), QMessageBox::Close, this);
    box->setInformativeText(
        tr("Recolors regions of 3D Gaussian Splatting scenes from COLMAP workspaces.\n"
           "BSD-3-Clause. Uses Qt %1 (LGPL).")
            .arg(qVersion()));
    dialogs_->Show(box);
  });

  BuildToolBar();
}

// Paint is the one button that is filled.
void MainWindow::BuildToolBar() {
  QToolBar* bar = addToolBar(tr("Tools"));
  bar->setObjectName("tools");
  bar->setMovable(false);
  bar->setContextMenuPolicy(Qt::PreventContextMenu);
  bar->setToolButtonStyle(Qt::ToolButtonIconOnly);
  for (const char* command : {"selection.enter", "", "edit.undo", "edit.redo", "", "view.previous",
                              "view.next", "camera.frame", "camera.fly_mode"}) {
    if (*command) {
      bar->addAction(action(command));
    } else {
      bar->addSeparator();
    }
  }
  auto* paint = qobject_cast<QToolButton*>(bar->widgetForAction(action("selection.enter")));
  paint->setProperty(kPrimary, true);
  paint->setToolButtonStyle(Qt::ToolButtonTextBesideIcon);
  BuildOverlays();
  DrawIcons();
}

void MainWindow::BuildOverlays() {
  std::vector<QAction*> actions;
  for (const char* command :
       {"show.frusta", "show.depth", "show.cloud", "show.mask", "show.split"}) {
    actions.push_back(action(command));
  }
  switch_ = new ViewSwitch(actions, canvas_);
  switch_->setObjectName("view_switch");
  gizmo_ = new OrientationGizmo(canvas_);
  canvas_->installEventFilter(this);
  connect(canvas_, &Canvas::menuWanted, this, [this](const QPoint& at) {
    ShowMenu("canvas_menu", at,
             {"selection.enter", "", "camera.frame", "camera.reset", "", "show.frusta",
              "show.depth", "show.cloud", "show.mask", "show.split", "", "window.copy_picture",
              "window.screenshot", "window.panels"});
  });
}

// In the corner at the top right.
void MainWindow::PlaceOverlays() {
  constexpr int kMargin = 10, kGap = 8;
  switch_->adjustSize();
  for (QWidget* over : {switch_, gizmo_}) over->raise();  // over the mask
  switch_->move(canvas_->width() - kMargin - switch_->width(), kMargin);
  gizmo_->move(canvas_->width() - kMargin - gizmo_->width(), switch_->geometry().bottom() + kGap);
}

bool MainWindow::eventFilter(QObject* object, QEvent* event) {
  if (object == canvas_ && event->type() == QEvent::Resize) PlaceOverlays();
  return QMainWindow::eventFilter(object, event);
}

void MainWindow::ShowMenu(const char* name, const QPoint& at,
                          std::initializer_list<const char*> commands) {
  auto* menu = new QMenu(this);
  menu->setObjectName(name);
  menu->setAttribute(Qt::WA_DeleteOnClose);
  for (const char* command : commands) {
    if (*command) {
      menu->addAction(action(command));
    } else {
      menu->addSeparator();
    }
  }
  menu->popup(at);
}

QPixmap MainWindow::Picture() const {
  for (QWidget* over : {switch_, gizmo_}) over->hide();
  QPixmap picture = pages_->currentWidget()->grab();
  for (QWidget* over : {switch_, gizmo_}) over->show();
  return picture;
}

void MainWindow::DrawIcons() {
  static const std::pair<const char*, const char*> kIcons[] = {
      {"edit.undo", "undo"},      {"edit.redo", "redo"},     {"view.previous", "previous"},
      {"view.next", "next"},      {"camera.frame", "frame"}, {"camera.fly_mode", "fly"},
      {"show.frusta", "cameras"}, {"show.depth", "depth"},   {"show.split", "split"},
      {"show.mask", "mask"},      {"show.cloud", "points"},  {"selection.enter", "brush"}};
  for (const auto& [command, icon] : kIcons) {
    QPalette colors = palette();
    if (action(command) == action("selection.enter")) {
      colors.setColor(QPalette::Active, QPalette::ButtonText,
                      colors.color(QPalette::Active, QPalette::HighlightedText));
    }
    action(command)->setIcon(MakeIcon(icon, colors));
    action(command)->setIconVisibleInMenu(false);
  }
}

void MainWindow::changeEvent(QEvent* event) {
  if (event->type() == QEvent::PaletteChange && !actions_.empty()) DrawIcons();
  QMainWindow::changeEvent(event);
}

// Cameras that are kept with the scene's name, for this and later visits.
void MainWindow::FillBookmarks() {
  bookmarks_->clear();
  if (!controller_->IsOpen()) return;
  const QString key =
      "bookmarks/" + QString::fromLatin1(QCryptographicHash::hash(
                                             QByteArray::fromStdString(
                                                 controller_->facts()->request.place().string()),
                                             QCryptographicHash::Sha1)
                                             .toHex());
  bookmarks_->addAction(tr("&Keep this camera"), this, [this, key] {
    QStringList kept = QSettings().value(key).toStringList();
    kept << QString::fromStdString(canvas_->CameraState());
    QSettings().setValue(key, kept);
    Say(tr("Kept as camera %1, under View > Kept cameras").arg(kept.size()));
  });
  const QStringList kept = QSettings().value(key).toStringList();
  if (kept.isEmpty()) return;
  bookmarks_->addSeparator();
  for (const QString& state : kept) {
    bookmarks_->addAction(tr("Camera &%1").arg(bookmarks_->actions().size() - 1), this,
                          [this, state] { canvas_->RestoreCamera(state.toStdString()); });
  }
  bookmarks_->addSeparator();
  bookmarks_->addAction(tr("&Forget them"), this, [key] { QSettings().remove(key); });
}

void MainWindow::UpdateActions() {
  const bool open = controller_->IsOpen(), selecting = IsSelecting();
  const bool exploring = open && !selecting;
  for (const Command& command : Commands()) {
    QAction* one = action(command.id);
    // The selection mode has keys of its own.
    if (one && command.context == KeyContext::kExplore) one->setEnabled(exploring);
  }
  for (const char* command : {"file.save", "file.save_as", "file.export_splat", "file.close"}) {
    action(command)->setEnabled(open);
  }
  const HistoryState& history = controller_->history();
  const auto label = [](const QString& verb, const std::string& what) {
    return what.empty() ? verb : verb + " " + QString::fromStdString(what);
  };
  action("edit.undo")->setEnabled(exploring && history.can_undo);
  action("edit.redo")->setEnabled(exploring && history.can_redo);
  findChild<QAction*>("match")->setEnabled(exploring);
  history_->setEnabled(exploring && !history.labels.empty());
  action("edit.undo")->setText(label(tr("&Undo"), history.undo_label));
  action("edit.redo")->setText(label(tr("&Redo"), history.redo_label));
  action("edit.undo")->setIconText(tr("Undo"));
  action("edit.redo")->setIconText(tr("Redo"));
  action("edit.cancel")->setEnabled(!selecting);
  action("window.panels")->setText(panels_shown_ ? tr("&Hide the panels") : tr("S&how the panels"));
  action("camera.fly_mode")->setChecked(canvas_->fly_mode());
  action("show.frusta")->setChecked(canvas_->frusta());
  action("show.depth")->setChecked(canvas_->depth());
  action("show.split")->setChecked(canvas_->split());
  action("show.cloud")->setChecked(canvas_->cloud_shown());
  action("show.mask")->setChecked(quality_->mask_shown());
  ShowCloudNote();
  action("show.uncertain")->setChecked(canvas_->hatching());
  action("show.look_ahead")->setChecked(preview_->enabled());
  for (QMenu* menu : findChildren<QMenu*>("export")) menu->setEnabled(open);
}

// Esc: out of the innermost thing, never out of the program.
void MainWindow::BackOut() {
  if (canvas_->picking()) {
    canvas_->SetPicking(false);
  } else if (controller_->IsBusy()) {
    controller_->Cancel();
  } else if (isFullScreen()) {
    setWindowState(windowState() & ~Qt::WindowFullScreen);
  } else if (canvas_->fly_mode()) {
    canvas_->SetFlyMode(false);
  } else if (canvas_->split()) {
    canvas_->SetSplit(false);
  } else if (canvas_->depth()) {
    canvas_->SetDepth(false);
  } else if (!panels_shown_) {
    SetPanelsShown(true);
  }
  if (controller_->IsOpen()) canvas_->setFocus();
}

void MainWindow::SaveScreenshot() {
  QString folder = QStandardPaths::writableLocation(QStandardPaths::PicturesLocation);
  if (folder.isEmpty()) folder = QDir::homePath();
  QDir().mkpath(folder);
  const QString path = QDir(folder).filePath(
      "retint-" + QDateTime::currentDateTime().toString("yyyyMMdd-HHmmss-zzz") + ".png");
  // The picture, not the window around it.
  const QPixmap picture = Picture();
  if (!picture.save(path)) {
    dialogs_->ShowError(tr("The screenshot cannot be saved"), tr("%1 cannot be written").arg(path));
    return;
  }
  Say(tr("Wrote %1").arg(path));
}

void MainWindow::CopyPicture() {
  QApplication::clipboard()->setPixmap(Picture());
  Say(tr("The picture is in the clipboard"));
}

void MainWindow::ShowKeys() {
  if (!keys_dialog_) {
    keys_dialog_ = new KeysDialog(this);
    keys_dialog_->setAttribute(Qt::WA_DeleteOnClose);
    dialogs_->SetFront(keys_dialog_);
  }
  keys_dialog_->show();
  keys_dialog_->raise();
}

// ---- Preferences

void MainWindow::ShowPreferences() {
  Preferences now = Preferences::Load();
  now.theme = theme_->choice();
  auto* dialog = new PreferencesDialog(now, this);
  connect(dialog, &PreferencesDialog::changed, this, [this](const Preferences& chosen) {
    chosen.Save();
    theme_->Choose(chosen.theme);
    Prefer(chosen);
  });
  dialog->open();
}

namespace {

// src/network reads the environment; without a choice, the user's own variable holds.
void PreferOnnxRuntime(const QString& path) {
  constexpr const char* kVariable = "RETINT_ONNX_RUNTIME";
  static const QByteArray given = qgetenv(kVariable);
  const QByteArray now = path.isEmpty() ? given : path.toLocal8Bit();
  if (now == qgetenv(kVariable)) return;
  now.isEmpty() ? qunsetenv(kVariable) : qputenv(kVariable, now);
}

}  // namespace

// The theme is the program's: the command line may have chosen another.
void MainWindow::Prefer(const Preferences& preferences) {
  controller_->colors().SetAutomaticRefit(preferences.automatic_refit);
  renderer_->SetFrameBudget(preferences.frame_ms);
  PreferOverlayColor(preferences.overlay);
  PreferOnnxRuntime(preferences.onnx_runtime);
  selection_->canvas().SetNetwork(preferences.NetworkName().toStdString());
  ShowCloudOfCurrent();
}

// Every edit that is kept, the newest on top; a click goes to the state after it.
void MainWindow::FillHistory() {
  history_->clear();
  const HistoryState& history = controller_->history();
  for (size_t step = history.labels.size() + 1; step-- > 0;) {
    const QString label =
        step == 0 ? tr("Before these edits") : QString::fromStdString(history.labels[step - 1]);
    QAction* one = history_->addAction(QString(label).replace("&", "&&"), this,
                                       [this, step] { controller_->GoToStep(step); });
    one->setCheckable(true);
    one->setChecked(step == history.done);
  }
}

}  // namespace retint
