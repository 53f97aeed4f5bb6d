// SPDX-License-Identifier: BSD-3-Clause
// The window: combines canvas, selection mode and panels, and owns menus, status bar and dialogs.
// SceneController has the scene and its work.
#pragma once

#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include <QMainWindow>
#include <QPointer>
#include <QTimer>

#include "viewer/canvas/canvas.h"
#include "viewer/canvas/contrast.h"
#include "viewer/canvas/photo_loader.h"
#include "viewer/canvas/render_thread.h"
#include "viewer/scene/current_region.h"
#include "viewer/scene/scene_controller.h"
#include "viewer/window/dialogs.h"
#include "viewer/window/first_steps.h"
#include "viewer/window/keys_dialog.h"
#include "viewer/window/scene_files.h"
#include "viewer/window/theme.h"

class QAction;
class QDockWidget;
class QHBoxLayout;
class QLabel;
class QMenu;
class QProgressBar;
class QStackedWidget;
class QToolButton;

namespace retint {

class Banner;
class ColorMatching;
class Exports;
class PaintVerdict;
class QualityPanel;
class RegionsPanel;
class SelectionMode;
class SessionStore;
class SideStrip;
class StartPage;
class StrokePreview;
class Uncertainty;
class VideoMaker;
class ViewsPanel;
struct Preferences;
struct WindowParts;

class MainWindow : public QMainWindow {
  Q_OBJECT

 public:
  explicit MainWindow(Theme* theme, QWidget* parent = nullptr);
  ~MainWindow() override;

  // Makes the sample in the background, and leads a new user. After files().Start().
  void Welcome();

  SceneController& controller() { return *controller_; }
  Canvas& canvas() { return *canvas_; }
  Banner& banner() { return *banner_; }
  SelectionMode& selection() { return *selection_; }
  PhotoLoader& photos() { return *photos_; }
  StrokePreview& stroke_preview() { return *preview_; }
  Uncertainty& uncertainty() { return *uncertainty_; }
  SessionStore& sessions() { return *sessions_; }
  SceneFiles& files() { return *files_; }
  Dialogs& dialogs() { return *dialogs_; }
  // Of a command, see Commands(); null for held ones.
  QAction* action(std::string_view command) const;

  // The region that tools and shortcuts mean; 0: none.
  RegionId current_region() const { return current_->id(); }
  void SetCurrentRegion(RegionId id);
  // Paints on the view that shows, for a new region (0) or another round of one.
  void EnterSelection(RegionId region = 0);
  bool IsSelecting() const;

  // A dock with an entry in the Panels menu. `id` names it in the saved layout.
  QDockWidget* AddPanel(const QString& id, const QString& title, QWidget* panel,
                        Qt::DockWidgetArea area);
  void SetPanelsShown(bool shown);
  bool panels_shown() const { return panels_shown_; }
  // Folds the panels of a side to a strip, or shows those that it folded. In a narrow window only
  // one side shows at a time.
  void SetSideShown(Qt::DockWidgetArea side, bool shown);
  bool IsSideShown(Qt::DockWidgetArea side) const;

  // A line in the status bar, for a few seconds.
  void Say(const QString& text);
  // The same until something else is to be said.
  void Warn(const QString& text);
  // Whether the regions differ from those last saved or opened.
  bool IsModified() const { return isWindowModified(); }
  // The size of a first window on a screen with so much room.
  static QSize FirstSize(const QSize& room);

 protected:
  void changeEvent(QEvent* event) override;
  void closeEvent(QCloseEvent* event) override;
  void dragEnterEvent(QDragEnterEvent* event) override;
  void dragMoveEvent(QDragMoveEvent* event) override;
  void dropEvent(QDropEvent* event) override;
  bool eventFilter(QObject* object, QEvent* event) override;
  bool focusNextPrevChild(bool next) override;
  void keyPressEvent(QKeyEvent* event) override;
  void keyReleaseEvent(QKeyEvent* event) override;

 private:
  // main_window.cc
  void BuildCenter();
  void BuildStatusBar();
  void ConnectScene();
  void ConnectView();
  void ConnectSelection();
  void ConnectFiles();
  void Complain(const QString& label, const QString& message);  // a task failed
  void ShowPage();
  void SetOnStartPage(bool on);
  void ArrangePanels(bool shown);
  void ShowWarnings(const std::vector<std::string>& warnings);
  void UpdateTitle();
  void UpdateStatus();
  void UpdateActions();
  void OnRegions();
  void ShowCloudOfCurrent();
  void ShowCloudNote();
  // main_window_actions.cc
  void BuildActions();
  QAction* MakeAction(const char* command, const QString& text, std::function<void()> act,
                      bool checkable = false);
  QAction* AddCommand(const std::string& id, const QString& text, const QString& title,
                      const QList<QKeySequence>& keys, std::function<void()> act);
  void BuildMenus();
  void BuildToolBar();
  void BuildOverlays();  // of the canvas
  void PlaceOverlays();
  void DrawIcons();  // in the palette's colors
  void ShowMenu(const char* name, const QPoint& at, std::initializer_list<const char*> commands);
  QPixmap Picture() const;  // without overlays
  void FillBookmarks();
  void BackOut();
  void SaveScreenshot();
  void CopyPicture();
  void FillHistory();
  void ShowPreferences();
  void Prefer(const Preferences& preferences);
  void ShowKeys();
  // main_window_panels.cc
  void AddPanels(const WindowParts& parts);
  void ConnectPanels();
  void AddStrip(Qt::DockWidgetArea side);
  void ShowStrips();
  void UnfoldSides();  // of a first window, if the picture keeps the most of it
  std::vector<QDockWidget*> DocksAt(Qt::DockWidgetArea side) const;
  void OfferSplitting(RegionId region, const PaintDetail& detail);
  // The control that colors the current region has the keyboard, in a panel that shows, and the
  // first color that is dragged there shows at once.
  void GoToColor();

  Theme* theme_;
  SceneController* controller_;
  CurrentRegion* current_;
  RenderThread* renderer_;
  PhotoLoader* photos_;
  SessionStore* sessions_;
  VideoMaker* videos_;
  Dialogs* dialogs_;
  Exports* exports_;
  ColorMatching* matching_;
  SceneFiles* files_;
  Uncertainty* uncertainty_;
  StrokePreview* preview_;
  RegionsPanel* regions_panel_;
  QualityPanel* quality_;
  ViewsPanel* views_;
  Canvas* canvas_;
  Banner* banner_;  // over the canvas
  PaintVerdict* verdict_;
  SelectionMode* selection_;
  QStackedWidget* pages_;
  StartPage* start_;
  QPointer<FirstSteps> first_steps_;  // null: not wanted
  QLabel *backend_, *gaussians_, *speed_, *memory_, *message_;
  QToolButton* warnings_;
  QProgressBar* progress_;
  QToolButton* cancel_;
  QTimer message_timer_, status_timer_;
  std::map<std::string, QAction*, std::less<>> actions_;
  QMenu *recent_ = nullptr, *panels_menu_ = nullptr, *history_ = nullptr, *bookmarks_ = nullptr;
  std::vector<QDockWidget*> docks_;
  struct Side {
    SideStrip* strip;
    std::vector<QDockWidget*> folded, front;  // those whose tabs were in front
    int width = 0;                            // before that, pixels
  };
  std::map<Qt::DockWidgetArea, Side> sides_;
  bool panels_shown_ = true, on_start_page_ = false, is_laid_out_ = false;
  QByteArray layout_;  // of the panels that are hidden
  QPointer<KeysDialog> keys_dialog_;
  QWidget *switch_ = nullptr, *gizmo_ = nullptr;     // over the canvas
  std::shared_ptr<const RegionSelection> cloud_of_;  // whose points the canvas shows
  QColor cloud_color_;
  RegionColors colors_;
  bool closing_ = false;
  bool unchecked_ = false;       // CheckScene() is still to come
  bool shows_accepted_ = false;  // the mask shows until its region has a color
};

}  // namespace retint
