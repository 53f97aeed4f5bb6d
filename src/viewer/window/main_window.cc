// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/main_window.h"

#include <unistd.h>
#include <algorithm>
#include <cstdio>
#include <utility>

#include <QAction>
#include <QApplication>
#include <QCloseEvent>
#include <QDockWidget>
#include <QDragEnterEvent>
#include <QDropEvent>
#include <QKeyEvent>
#include <QLabel>
#include <QLayout>
#include <QMenu>
#include <QProgressBar>
#include <QScreen>
#include <QSettings>
#include <QStackedWidget>
#include <QStatusBar>
#include <QToolBar>
#include <QToolButton>

#include "base/run_clock.h"
#include "viewer/canvas/contrast.h"
#include "viewer/canvas/uncertainty.h"
#include "viewer/panels/quality_panel.h"
#include "viewer/scene/session_store.h"
#include "viewer/scene/video_maker.h"
#include "viewer/selection/paint_verdict.h"
#include "viewer/selection/selection_mode.h"
#include "viewer/selection/stroke_preview.h"
#include "viewer/widgets/banner.h"
#include "viewer/widgets/long_text.h"
#include "viewer/widgets/path_edit.h"
#include "viewer/window/color_matching.h"
#include "viewer/window/exports.h"
#include "viewer/window/first_steps.h"
#include "viewer/window/preferences_dialog.h"
#include "viewer/window/recent_files.h"
#include "viewer/window/start_page.h"

namespace retint {
namespace {

constexpr int kMessageMs = 6000;
constexpr int kStatusMs = 1000;

double ResidentMb() {
  std::FILE* file = std::fopen("/proc/self/statm", "r");
  if (!file) return PeakRssMb();
  long total = 0, resident = 0;
  const int read = std::fscanf(file, "%ld %ld", &total, &resident);
  std::fclose(file);
  return read == 2 ? double(resident) * double(sysconf(_SC_PAGESIZE)) / (1 << 20) : PeakRssMb();
}

}  // namespace

MainWindow::MainWindow(Theme* theme, QWidget* parent) : QMainWindow(parent), theme_(theme) {
  setObjectName("retint");
  setAcceptDrops(true);
  setDockOptions(AllowTabbedDocks | AllowNestedDocks | AnimatedDocks);
  setCorner(Qt::BottomLeftCorner, Qt::LeftDockWidgetArea);
  setCorner(Qt::BottomRightCorner, Qt::RightDockWidgetArea);
  setTabPosition(Qt::AllDockWidgetAreas, QTabWidget::North);
  resize(FirstSize(screen()->availableSize()));
  layout()->setSizeConstraint(QLayout::SetNoConstraint);  // panels that are to hide widen nothing
  CopyUnbroken(this);
  controller_ = new SceneController(this);
  current_ = new CurrentRegion(controller_, this);
  renderer_ = new RenderThread(this);
  photos_ = new PhotoLoader(this);
  sessions_ = new SessionStore(controller_, this);
  videos_ = new VideoMaker(this);
  sessions_->SetViewState([this] { return canvas_->CameraState(); });
  dialogs_ = new Dialogs(this);
  BuildCenter();
  uncertainty_ = new Uncertainty(controller_, current_, this);
  preview_ = new StrokePreview(controller_, selection_, this);
  const WindowParts parts{controller_, sessions_,    current_, selection_, canvas_,
                          photos_,     uncertainty_, preview_, videos_,    dialogs_};
  exports_ = new Exports(parts, this);
  matching_ = new ColorMatching(parts, photos_, this);
  files_ = new SceneFiles(parts, exports_, this);
  BuildStatusBar();
  BuildActions();
  BuildMenus();
  AddPanels(parts);
  ConnectPanels();
  ConnectScene();
  ConnectView();
  ConnectSelection();
  ConnectFiles();
  const QSettings settings;
  Prefer(Preferences::Load());
  preview_->SetEnabled(settings.value("look_ahead", true).toBool());
  restoreGeometry(settings.value("geometry").toByteArray());
  is_laid_out_ = restoreState(settings.value("layout").toByteArray());
  ShowPage();
  layout()->setSizeConstraint(QLayout::SetDefaultConstraint);
  UpdateTitle();
  UpdateActions();
  UpdateStatus();
}

// Hidden while all of it is there: a field that loses the focus so may have something to say.
MainWindow::~MainWindow() { hide(); }

void MainWindow::BuildCenter() {
  pages_ = new QStackedWidget;
  start_ = new StartPage;
  connect(start_, &StartPage::openRequested, this, [this] { files_->AskAndOpen({}); });
  connect(start_, &StartPage::sampleRequested, this, [this] { files_->OpenSample(); });
  connect(start_, &StartPage::recentRequested, this,
          [this](const QString& entry) { files_->OpenRecent(entry); });
  connect(start_, &StartPage::forgetRequested, this,
          [this](const QString& entry) { files_->Forget(entry); });
  canvas_ = new Canvas(controller_, renderer_, photos_);
  banner_ = new Banner(canvas_);
  selection_ = new SelectionMode(controller_);
  pages_->addWidget(start_);
  pages_->addWidget(canvas_);
  pages_->addWidget(selection_);
  setCentralWidget(pages_);
}

void MainWindow::BuildStatusBar() {
  message_ = new ElidedLabel;
  progress_ = new QProgressBar;
  progress_->setFixedWidth(180);
  progress_->setRange(0, 1000);
  progress_->setTextVisible(false);
  cancel_ = new QToolButton;
  cancel_->setText(tr("Cancel"));
  cancel_->setToolTip(tr("Stop the current task (Esc)"));
  connect(cancel_, &QToolButton::clicked, controller_, &SceneController::Cancel);
  backend_ = new QLabel;
  gaussians_ = new QLabel;
  speed_ = new QLabel;
  memory_ = new QLabel;
  speed_->setToolTip(tr("Frames a second while the camera moves"));
  memory_->setToolTip(tr("Memory that this program holds"));
  statusBar()->addWidget(message_, 1);
  statusBar()->addPermanentWidget(progress_);
  statusBar()->addPermanentWidget(cancel_);
  warnings_ = new QToolButton;
  warnings_->setAutoRaise(true);
  connect(warnings_, &QToolButton::clicked, this, [this] { action("panel.scene")->trigger(); });
  statusBar()->addPermanentWidget(warnings_);
  for (QLabel* label : {backend_, gaussians_, speed_, memory_}) {
    label->setContentsMargins(6, 0, 6, 0);
    statusBar()->addPermanentWidget(label);
  }
  for (QWidget* widget : std::initializer_list<QWidget*>{progress_, cancel_, warnings_}) {
    widget->hide();
  }
  for (const auto& [widget, name] :
       std::initializer_list<std::pair<QWidget*, const char*>>{{message_, "message"},
                                                               {progress_, "progress"},
                                                               {cancel_, "cancel"},
                                                               {warnings_, "warnings"},
                                                               {backend_, "backend"},
                                                               {gaussians_, "gaussians"},
                                                               {speed_, "speed"},
                                                               {memory_, "memory"}}) {
    widget->setObjectName(name);
  }
  message_timer_.setSingleShot(true);
  message_timer_.setInterval(kMessageMs);
  connect(&message_timer_, &QTimer::timeout, this,
          [this] { message_->setText(controller_->task()); });
  status_timer_.setInterval(kStatusMs);
  connect(&status_timer_, &QTimer::timeout, this, &MainWindow::UpdateStatus);
  status_timer_.start();
}

// A frame and a task bar take a part of the room that is said to be there.
QSize MainWindow::FirstSize(const QSize& room) {
  constexpr QSize kWanted(1400, 900), kAround(24, 48);
  return kWanted.boundedTo(room - kAround);
}

void MainWindow::Say(const QString& text) {
  message_->setText(text);
  message_timer_.start();
}

void MainWindow::Warn(const QString& text) {
  Say(QStringLiteral("⚠ ") + text);
  message_timer_.stop();
}

void MainWindow::ConnectScene() {
  connect(controller_, &SceneController::opened, this, [this] {
    unchecked_ = true;
    colors_.Clear();
    ShowWarnings(controller_->facts()->warnings);
    SetCurrentRegion(0);
    // Points would hide the edits of a session.
    canvas_->SetCloudShown(
        std::ranges::all_of(controller_->regions().regions,
                            [](const Region& region) { return ChangesNothing(region.edit); }));
    ShowPage();
    UpdateTitle();
    UpdateActions();
    UpdateStatus();
    canvas_->setFocus();
  });
  connect(controller_, &SceneController::closed, this, [this] {
    banner_->Close();
    ShowWarnings({});
    SetCurrentRegion(0);
    ShowPage();
    UpdateTitle();
    UpdateActions();
    UpdateStatus();
  });
  connect(controller_, &SceneController::openFailed, this, &MainWindow::ShowPage);
  connect(controller_, &SceneController::openCancelled, this, &MainWindow::ShowPage);
  connect(controller_, &SceneController::regionsChanged, this, &MainWindow::OnRegions);
  connect(controller_, &SceneController::regionAdded, this, &MainWindow::SetCurrentRegion);
  connect(controller_, &SceneController::regionAdded, this, [this] {
    if (!first_steps_) return;
    first_steps_->SetDone(FirstSteps::kPaint);
    first_steps_->SetDone(FirstSteps::kAccept);
  });
  connect(controller_, &SceneController::taskChanged, this, [this](const QString& label) {
    message_->setText(label);
    message_timer_.stop();
    const bool busy = !label.isEmpty();
    progress_->setVisible(busy);
    progress_->setRange(0, 0);  // busy, until something is reported
    cancel_->setVisible(busy);
    if (!controller_->IsOpen()) ShowPage();
    UpdateActions();
  });
  connect(controller_, &SceneController::progress, this, [this](const QString& stage, double done) {
    progress_->setRange(0, 1000);
    progress_->setValue(int(done * 1000));
    progress_->setToolTip(stage);
    if (controller_->IsBusy()) message_->setText(controller_->task() + ": " + stage);
  });
  connect(controller_, &SceneController::failed, this,
          [this](const QString& label, const QString& message, quint64 task) {
            // The selection mode says what became of its own work itself.
            if (!IsSelecting() && !matching_->Explain(task, message)) Complain(label, message);
          });
  connect(matching_, &ColorMatching::matched, this, &MainWindow::SetCurrentRegion);
  connect(controller_, &SceneController::cancelled, this,
          [this](const QString& label) { Say(tr("%1: cancelled").arg(label)); });
  connect(&controller_->results(), &SceneResults::sceneChecked, this,
          [this](const std::vector<std::string>& found) {
            std::vector<std::string> all = controller_->facts()->warnings;
            all.insert(all.end(), found.begin(), found.end());
            ShowWarnings(all);
          });
}

void MainWindow::ConnectView() {
  connect(renderer_, &RenderThread::failed, this,
          [this](const QString& message) { dialogs_->ShowError(tr("Rendering failed"), message); });
  connect(canvas_, &Canvas::hint, this, &MainWindow::Say);
  connect(canvas_, &Canvas::frameShown, this, [this] {
    if (canvas_->frames_per_second() > 0) {
      speed_->setText(tr("%1 fps").arg(canvas_->frames_per_second(), 0, 'f', 0));
    }
    // Once the scene is to be seen: the check renders too.
    if (unchecked_ && canvas_->IsSharp()) {
      unchecked_ = false;
      controller_->results().Check();
    }
  });
  connect(canvas_, &Canvas::stateChanged, this, &MainWindow::UpdateActions);
  connect(uncertainty_, &Uncertainty::changed, this, [this] {
    const auto found = uncertainty_->found();
    canvas_->SetUncertain(found ? found->undecided : nullptr);
    // Of another selection, unless that is none: there is nothing to say of it.
    if (!found && canvas_->hatching() && current_->region()) uncertainty_->Find();
  });
  connect(uncertainty_, &Uncertainty::refused, this, &MainWindow::Say);
}

void MainWindow::ConnectSelection() {
  verdict_ = new PaintVerdict(controller_, banner_, this);
  connect(verdict_, &PaintVerdict::paintWanted, this, &MainWindow::EnterSelection);
  connect(controller_, &SceneController::selectedAgain, verdict_, &PaintVerdict::Show);
  connect(selection_, &SelectionMode::otherFailed, this, &MainWindow::Complain);
  connect(selection_, &SelectionMode::accepted, this, [this](RegionId id) {
    SetCurrentRegion(id);
    quality_->SetMaskShown(shows_accepted_ = true);
    ShowPage();
    GoToColor();
    verdict_->Show(id);
    Say(tr("Drag in the color field. %1 hides the selection").arg(KeyText("show.mask")));
  });
  connect(selection_, &SelectionMode::left, this, [this] {
    ShowPage();
    canvas_->setFocus();
  });
}

void MainWindow::ConnectFiles() {
  connect(files_, &SceneFiles::said, this, &MainWindow::Say);
  connect(files_, &SceneFiles::recentChanged, this, [this] { start_->Show(RecentFiles()); });
  connect(exports_, &Exports::said, this, &MainWindow::Say);
  connect(exports_, &Exports::written, this, [this] {
    if (first_steps_) first_steps_->SetDone(FirstSteps::kExport);
  });
  connect(sessions_, &SessionStore::saved, this, [this] {
    OnRegions();
    UpdateTitle();
  });
  connect(sessions_, &SessionStore::restored, this, [this](const std::string& view) {
    OnRegions();
    const auto& regions = controller_->regions().regions;
    if (!regions.empty()) SetCurrentRegion(regions.back().id);
    if (!view.empty()) canvas_->RestoreCamera(view);
    UpdateTitle();
  });
  connect(sessions_, &SessionStore::autosaveFailed, this, [this](const QString& message) {
    dialogs_->ShowError(tr("The work cannot be saved automatically; Retint keeps trying"), message);
  });
}

void MainWindow::Complain(const QString& label, const QString& message) {
  dialogs_->ShowError(label.isEmpty() ? tr("That did not work") : tr("%1 failed").arg(label),
                      message);
}

// They stay while the scene is open, because a mismatch is easily mistaken for a bad edit.
void MainWindow::ShowWarnings(const std::vector<std::string>& warnings) {
  QStringList lines;
  for (const std::string& warning : warnings) lines << QString::fromStdString(warning);
  warnings_->setText(lines.size() == 1 ? tr("⚠ 1 warning") : tr("⚠ %1 warnings").arg(lines.size()));
  warnings_->setToolTip(lines.join("\n"));
  warnings_->setVisible(!lines.isEmpty());
  if (!lines.isEmpty()) Warn(lines.back());
}

void MainWindow::Welcome() {
  files_->PrepareSample();
  if (!FirstSteps::IsWanted()) return;
  first_steps_ = new FirstSteps(pages_);
  ShowPage();
}

bool MainWindow::IsSelecting() const { return pages_->currentWidget() == selection_; }

void MainWindow::ShowPage() {
  QWidget* page = start_;
  if (controller_->IsOpen()) {
    page = selection_->state() == SelectionMode::State::kIdle ? static_cast<QWidget*>(canvas_)
                                                              : selection_;
  }
  pages_->setCurrentWidget(page);
  SetOnStartPage(page == start_);
  start_->SetTask(controller_->task());
  if (page == start_) start_->Show(RecentFiles());
  if (first_steps_) {
    const bool selecting = page == selection_;
    first_steps_->ShowOver(page == start_ ? nullptr : selecting ? &selection_->canvas() : page);
    if (page != start_) first_steps_->SetDone(FirstSteps::kOpen);
  }
  UpdateActions();
}

void MainWindow::EnterSelection(RegionId region) {
  if (!controller_->IsOpen() || IsSelecting()) return;
  SelectionEntry entry;
  if (const UserPicture* picture = canvas_->picture()) {
    entry.view = QString::fromStdString(picture->name);
  }
  entry.camera = canvas_->navigation().Exact();
  entry.region = region;
  if (const auto frame = canvas_->frame()) entry.picture = frame->image;
  const auto enter = [this, entry] {
    if (!selection_->Enter(entry)) return;
    ShowPage();
    selection_->setFocus();
  };
  if (selection_->Resumes(entry)) return enter();
  files_->AskOfPaint(tr("Paint elsewhere?"), enter);
}

void MainWindow::SetCurrentRegion(RegionId id) {
  current_->Set(id);
  ShowCloudOfCurrent();
}

void MainWindow::ShowCloudOfCurrent() {
  ShowCloudNote();
  const Region* region = current_->region();
  const auto selection = region ? region->selection : nullptr;
  const auto facts = controller_->facts();
  // In a color that stands out from the edited region.
  QColor color;
  if (region && facts)
    color = ContrastingColor(colors_.After(*region, *facts->original), cloud_color_);
  if (selection == cloud_of_ && color == cloud_color_) return;
  cloud_of_ = selection;
  cloud_color_ = color;
  auto cloud = selection ? MakeOverlayCloud(*selection) : nullptr;
  if (cloud) {
    cloud->color = {uint8_t(color.red()), uint8_t(color.green()), uint8_t(color.blue())};
  }
  canvas_->SetCloud(cloud);
}

// As long as the points show: they are less than the selection.
void MainWindow::ShowCloudNote() {
  const Region* region = current_->region();
  const QString key = KeyText("show.mask");
  QString note;
  if (region && region->selection && !region->selection->masks.empty()) {
    note = tr("Points of the paint");
    if (!key.isEmpty()) note += tr(" · %1 shows the mask").arg(key);
  }
  canvas_->SetCloudNote(note);
}

void MainWindow::OnRegions() {
  setWindowModified(sessions_->IsModified());
  ShowCloudOfCurrent();  // undo may have given it another selection
  const auto is_colored = [](const Region& region) { return !ChangesNothing(region.edit); };
  const Region* current = current_->region();
  if (shows_accepted_ && current && is_colored(*current)) {
    quality_->SetMaskShown(shows_accepted_ = false);  // it would hide the color
  }
  if (first_steps_ && std::ranges::any_of(controller_->regions().regions, is_colored)) {
    first_steps_->SetDone(FirstSteps::kColor);
  }
  UpdateActions();
}

void MainWindow::UpdateTitle() {
  const auto facts = controller_->facts();
  QString name;
  if (facts) {
    auto path = sessions_->folder().empty() ? facts->request.place() : sessions_->folder();
    if (path.filename().empty()) path = path.parent_path();
    name = QString::fromStdString(path.filename().string()) + "[*] — ";
  }
  setWindowTitle(name + "Retint");
}

void MainWindow::UpdateStatus() {
  memory_->setText(tr("%1 MB").arg(ResidentMb(), 0, 'f', 0));
  if (first_steps_ && selection_->HoldsPaint()) first_steps_->SetDone(FirstSteps::kPaint);
  const auto facts = controller_->facts();
  for (QLabel* label : {backend_, gaussians_, speed_}) label->setVisible(facts != nullptr);
  if (!facts) return;
  backend_->setText(
      QString::fromUtf8(facts->backend->Name().data(), qsizetype(facts->backend->Name().size()))
          .toUpper());
  backend_->setToolTip(QString::fromStdString(facts->backend->Description()));
  gaussians_->setText(tr("%L1 Gaussians").arg(facts->original->NumGaussians()));
}

// Panels that are shown one by one would not come back as they were: their tabs and sizes.
void MainWindow::SetPanelsShown(bool shown) {
  if (shown == panels_shown_ || on_start_page_) return;
  panels_shown_ = shown;
  ArrangePanels(shown);
  UpdateActions();
}

// There, nothing but the page shows.
void MainWindow::SetOnStartPage(bool on) {
  if (on == on_start_page_) return;
  on_start_page_ = on;
  if (panels_shown_) ArrangePanels(!on);
  for (QToolBar* bar : findChildren<QToolBar*>(Qt::FindDirectChildrenOnly)) bar->setVisible(!on);
}

void MainWindow::ArrangePanels(bool shown) {
  if (shown && !std::exchange(is_laid_out_, true)) {
    UnfoldSides();
  } else if (shown) {
    restoreState(layout_);
  } else {
    layout_ = saveState();
    for (QDockWidget* dock : docks_) dock->hide();
  }
}

// A panel behind the tab of another is not hidden, but lies beside the window: nobody would see
// where the focus is.
bool MainWindow::focusNextPrevChild(bool next) {
  const auto is_seen = [this] {
    const QWidget* part = QApplication::focusWidget();
    while (part && part->parentWidget() != this) part = part->parentWidget();
    return part && !part->visibleRegion().isEmpty();
  };
  constexpr int kMost = 1000;  // limit if nothing is visible
  for (int i = 0; i < kMost; ++i) {
    if (!QMainWindow::focusNextPrevChild(next)) return false;
    if (is_seen()) return true;
  }
  return false;
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
  if (event->isAccepted()) files_->OpenPaths(paths);
}

void MainWindow::closeEvent(QCloseEvent* event) {
  if (!closing_) {
    event->ignore();
    if (dialogs_->IsOpen()) return;  // already asked
    const auto quit = [this] {
      closing_ = true;
      close();
    };
    files_->ConfirmThen(tr("Quit Retint?"), quit, /*quits=*/true);
    if (!closing_) return;
  }
  QSettings settings;
  settings.setValue("geometry", saveGeometry());
  settings.setValue("layout", panels_shown_ && !on_start_page_ ? saveState() : layout_);
  sessions_->DropAutosave();
  controller_->Close();
  event->accept();
}

// Keys that no widget wanted: flying works wherever the focus is.
void MainWindow::keyPressEvent(QKeyEvent* event) {
  const Command* command = HeldCommand(event->key(), event->modifiers());
  if (command && controller_->IsOpen() && !IsSelecting() && !canvas_->hasFocus()) {
    canvas_->setFocus();
    if (!event->isAutoRepeat()) canvas_->SetHeld(*command, true);
    return;
  }
  QMainWindow::keyPressEvent(event);
}

void MainWindow::keyReleaseEvent(QKeyEvent* event) { QMainWindow::keyReleaseEvent(event); }

}  // namespace retint
