// SPDX-License-Identifier: BSD-3-Clause
// Which panels the window has, where they stand, and how the keyboard gets there.
#include <algorithm>

#include <QAbstractSpinBox>
#include <QAction>
#include <QApplication>
#include <QComboBox>
#include <QDockWidget>
#include <QDragEnterEvent>
#include <QKeyEvent>
#include <QLayout>
#include <QMenu>
#include <QScrollArea>
#include <QScrollBar>
#include <QSlider>
#include <QStackedWidget>
#include <QTabBar>
#include <QToolBar>

#include "viewer/panels/edit_panel.h"
#include "viewer/panels/quality_panel.h"
#include "viewer/panels/regions_panel.h"
#include "viewer/panels/views_panel.h"
#include "viewer/scene/view_editor.h"
#include "viewer/widgets/banner.h"
#include "viewer/widgets/path_edit.h"
#include "viewer/widgets/side_strip.h"
#include "viewer/window/exports.h"
#include "viewer/window/main_window.h"
#include "viewer/window/panel_table.h"

namespace retint {
namespace {

// Or in the tabs of panels that lie one behind the other.
bool InPanel(QWidget* widget) {
  if (qobject_cast<QTabBar*>(widget) && qobject_cast<QMainWindow*>(widget->parentWidget())) {
    return true;
  }
  for (; widget; widget = widget->parentWidget()) {
    if (qobject_cast<QDockWidget*>(widget)) return true;
  }
  return false;
}

// While the focus is in a panel, the keys of its controls are the panel's. Arrows move its
// sliders, Tab goes to the next control, and in a text field all plain keys are text. Other
// letters stay the window's, as do function keys, keys with Ctrl or Alt, and Esc, which
// leads back to the canvas. An open list of choices has all keys. Space chooses there, like
// Return.
class PanelKeys : public QObject {
 public:
  using QObject::QObject;

 protected:
  bool eventFilter(QObject* object, QEvent* event) override {
    if (event->type() != QEvent::ShortcutOverride) return false;
    auto* widget = qobject_cast<QWidget*>(object);
    if (!widget || !InPanel(widget)) return false;
    const auto* key = static_cast<QKeyEvent*>(event);
    if (widget->window()->windowType() == Qt::Popup) return ChooseFrom(widget, key->key(), event);
    const bool plain = !(key->modifiers() & (Qt::ControlModifier | Qt::AltModifier));
    if (!plain || !IsPanels(*widget, key->key())) return false;
    event->accept();
    return true;
  }

 private:
  // Qt chooses at Return, and leaves the key to whoever has it as a shortcut.
  bool ChooseFrom(QWidget* list, int key, QEvent* event) {
    const bool chooses = key == Qt::Key_Return || key == Qt::Key_Enter || key == Qt::Key_Space;
    if (choosing_ || !chooses || !qobject_cast<QComboBox*>(list->window()->parentWidget())) {
      return false;
    }
    choosing_ = true;
    QKeyEvent chosen(QEvent::ShortcutOverride, Qt::Key_Return, Qt::NoModifier);
    QCoreApplication::sendEvent(list, &chosen);
    choosing_ = false;
    event->accept();
    return true;
  }
  static bool IsPanels(const QWidget& widget, int key) {
    if (key == Qt::Key_Escape || (key >= Qt::Key_F1 && key <= Qt::Key_F35)) return false;
    const bool text = widget.inherits("QLineEdit") || widget.inherits("QAbstractSpinBox") ||
                      widget.inherits("QComboBox");
    return text || key == Qt::Key_Space || !IsPrinted(key);
  }
  static bool IsPrinted(int key) { return key < Qt::Key_Escape; }

  bool choosing_ = false;
};

// Files that are dropped on a field of text in a panel are the window's: they are opened.
class PanelDrops : public QObject {
 public:
  using QObject::QObject;

 protected:
  bool eventFilter(QObject* object, QEvent* event) override {
    if (event->type() != QEvent::DragEnter || !object->inherits("QLineEdit")) return false;
    auto* drag = static_cast<QDragEnterEvent*>(event);
    if (!InPanel(static_cast<QWidget*>(object)) || LocalPaths(*drag->mimeData()).isEmpty()) {
      return false;
    }
    drag->ignore();  // goes on to the parent of the field
    return true;
  }
};

// The wheel over a number, slider or choice scrolls the panel, unless one works with that very one.
class PanelWheel : public QObject {
 public:
  explicit PanelWheel(QWidget* panel) : QObject(panel) {
    for (auto* control : panel->findChildren<QWidget*>()) {
      const bool turns = qobject_cast<QAbstractSpinBox*>(control) ||
                         qobject_cast<QSlider*>(control) || qobject_cast<QComboBox*>(control);
      if (!turns) continue;
      if (control->focusPolicy() == Qt::WheelFocus) control->setFocusPolicy(Qt::StrongFocus);
      control->installEventFilter(this);
    }
  }

 protected:
  bool eventFilter(QObject* control, QEvent* event) override {
    if (event->type() != QEvent::Wheel || static_cast<QWidget*>(control)->hasFocus()) return false;
    event->ignore();
    return true;
  }
};

// Of a panel, pixels; the contents of panels need no more, so that their column stays as wide.
constexpr int kNarrowest = 300;

// As wide as its panel and the bar beside it need, so that a panel scrolls downwards alone.
class PanelArea : public QScrollArea {
 public:
  QSize minimumSizeHint() const override {
    const int bar = verticalScrollBar()->sizeHint().width();
    const int needed = widget() ? widget()->minimumSizeHint().width() + bar : 0;
    return {std::max(kNarrowest, needed), QScrollArea::minimumSizeHint().height()};
  }

 protected:
  bool eventFilter(QObject* of, QEvent* event) override {
    if (of == widget() && event->type() == QEvent::LayoutRequest) updateGeometry();
    return QScrollArea::eventFilter(of, event);
  }
};

// Scrolls where the window is too small for the panel.
QWidget* Scrolling(QWidget* panel) {
  auto* area = new PanelArea;
  area->setFrameShape(QFrame::NoFrame);
  area->setWidgetResizable(true);
  // One that comes and goes would change the number that fits in a row.
  area->setVerticalScrollBarPolicy(Qt::ScrollBarAlwaysOn);
  area->setFocusPolicy(Qt::NoFocus);
  area->setWidget(panel);
  return area;
}

// The first control of a panel for the keyboard: the one that the panel names, else its first.
QWidget* FirstControl(QWidget* panel) {
  const auto* area = qobject_cast<QScrollArea*>(panel);
  QWidget* wanted = (area ? area->widget() : panel)->focusProxy();
  if (wanted && wanted->isVisible() && wanted->isEnabled()) return wanted;
  QWidget* at = panel;
  for (int guard = 0; guard < 1000; ++guard) {
    at = at->nextInFocusChain();
    if (at == panel) break;
    if (panel->isAncestorOf(at) && at->isVisible() && at->isEnabled() &&
        (at->focusPolicy() & Qt::TabFocus)) {
      return at;
    }
  }
  return panel;
}

}  // namespace

QDockWidget* MainWindow::AddPanel(const QString& id, const QString& title, QWidget* panel,
                                  Qt::DockWidgetArea area) {
  auto* dock = new QDockWidget(title, this);
  dock->setObjectName(id);
  dock->setWidget(panel);
  new PanelWheel(panel);
  addDockWidget(area, dock);
  panels_menu_->addAction(dock->toggleViewAction());
  docks_.push_back(dock);
  connect(dock->toggleViewAction(), &QAction::toggled, this, &MainWindow::ShowStrips);
  connect(dock, &QDockWidget::dockLocationChanged, this, &MainWindow::ShowStrips);
  return dock;
}

std::vector<QDockWidget*> MainWindow::DocksAt(Qt::DockWidgetArea side) const {
  std::vector<QDockWidget*> docks;
  for (QDockWidget* dock : docks_) {
    if (!dock->isFloating() && dockWidgetArea(dock) == side) docks.push_back(dock);
  }
  return docks;
}

bool MainWindow::IsSideShown(Qt::DockWidgetArea side) const {
  return std::ranges::any_of(DocksAt(side),
                             [](const QDockWidget* one) { return !one->isHidden(); });
}

void MainWindow::SetSideShown(Qt::DockWidgetArea side, bool shown) {
  if (shown) SetPanelsShown(true);
  if (shown == IsSideShown(side)) return;
  Side& at = sides_.at(side);
  const std::vector<QDockWidget*> docks = DocksAt(side);
  if (!shown) {
    at.folded.clear();
    at.front.clear();
    for (QDockWidget* dock : docks) {
      if (dock->isHidden()) continue;
      at.folded.push_back(dock);
      if (dock->visibleRegion().isEmpty()) continue;
      at.front.push_back(dock);
      at.width = dock->width();
    }
    for (QDockWidget* dock : docks) dock->hide();
    return;
  }
  constexpr int kNarrow = 1200;  // pixels
  if (width() < kNarrow) {
    for (const auto& [other, strip] : sides_) {
      if (other != side) SetSideShown(other, false);
    }
  }
  if (at.folded.empty()) at.folded = docks;
  if (at.front.empty() && !docks.empty()) at.front = {docks.front()};
  for (QDockWidget* dock : at.folded) dock->show();
  for (QDockWidget* dock : at.front) dock->raise();
  if (at.width > 0) resizeDocks({at.front.front()}, {at.width}, Qt::Horizontal);
}

void MainWindow::UnfoldSides() {
  constexpr int kForViews = 1800, kForRegions = 1200;  // pixels
  if (width() >= kForRegions) SetSideShown(Qt::RightDockWidgetArea, true);
  if (width() >= kForViews) SetSideShown(Qt::LeftDockWidgetArea, true);
}

void MainWindow::AddStrip(Qt::DockWidgetArea side) {
  const bool left = side == Qt::LeftDockWidgetArea;
  auto* strip = new SideStrip(left ? Qt::LeftEdge : Qt::RightEdge);
  strip->setObjectName(left ? "left_strip" : "right_strip");
  auto* bar = new QToolBar(left ? tr("Left panels") : tr("Right panels"));
  bar->setObjectName(strip->objectName() + "_bar");
  bar->setMovable(false);
  bar->setContextMenuPolicy(Qt::PreventContextMenu);
  bar->layout()->setContentsMargins(0, 0, 0, 0);
  bar->addWidget(strip);
  addToolBar(left ? Qt::LeftToolBarArea : Qt::RightToolBarArea, bar);
  sides_[side].strip = strip;
  connect(strip, &SideStrip::clicked, this,
          [this, side] { SetSideShown(side, !IsSideShown(side)); });
}

void MainWindow::ShowStrips() {
  for (const auto& [side, at] : sides_) {
    QStringList names;
    for (const QDockWidget* dock : DocksAt(side)) names << dock->windowTitle();
    at.strip->SetFolded(!IsSideShown(side), names);
  }
}

void MainWindow::OfferSplitting(RegionId region, const PaintDetail& detail) {
  banner_->Show(
      {QString::fromStdString(detail.Problem() + ". After splitting, " + detail.Gain() + "."),
       {{tr("Split them"), tr("Write a splat whose painted Gaussians are small, and go on with it"),
         [this, region] { files_->SplitGaussians(region); }},
        {tr("Leave them")}}});
}

void MainWindow::GoToColor() {
  action("panel.regions")->trigger();  // shows it
  regions_panel_->edit().ColorControl()->setFocus(Qt::OtherFocusReason);
  regions_panel_->MeasureAhead();
}

void MainWindow::AddPanels(const WindowParts& parts) {
  AddStrip(Qt::LeftDockWidgetArea);
  AddStrip(Qt::RightDockWidgetArea);
  for (const WindowPanel& panel : WindowPanels()) {
    QWidget* made = panel.make(parts);
    const std::vector<QDockWidget*> before = DocksAt(panel.side);
    QDockWidget* dock =
        AddPanel(panel.id, tr(panel.title), panel.scrolls ? Scrolling(made) : made, panel.side);
    if (panel.is_tab) tabifyDockWidget(before.back(), dock);
    dock->toggleViewAction()->setToolTip(
        tr("%1 (go there: %2)").arg(tr(panel.title), KeyText(panel.Keys())));
  }
  regions_panel_ = findChild<RegionsPanel*>();
  quality_ = findChild<QualityPanel*>();
  views_ = findChild<ViewsPanel*>();
  const auto dock = [this](const char* id) { return findChild<QDockWidget*>(id); };
  for (const WindowPanel& panel : WindowPanels()) {
    if (!panel.is_tab) dock(panel.id)->raise();
  }
  QDockWidget* regions = dock("regions");
  // The contents of the right column need no more.
  resizeDocks({dock("views"), regions}, {std::min(220, width() / 5), 310}, Qt::Horizontal);
  // The pages of an edit have their steps in sight then; the optimizer's options scroll.
  resizeDocks({regions, dock("optimizer")}, {630, 230}, Qt::Vertical);
  constexpr int kLow = 800;  // pixels; there is no room for one above the other
  if (height() < kLow) {
    for (QDockWidget* one : DocksAt(Qt::RightDockWidgetArea)) {
      if (one != regions) tabifyDockWidget(regions, one);
    }
    regions->raise();
  }

  panels_menu_->addSeparator();
  for (const WindowPanel& panel : WindowPanels()) {
    const auto go = [this, at = dock(panel.id)] {
      SetSideShown(dockWidgetArea(at), true);
      at->show();
      at->raise();
      FirstControl(at->widget())->setFocus(Qt::ShortcutFocusReason);
    };
    panels_menu_->addAction(AddCommand(std::string("panel.") + panel.id,
                                       tr("Go to %1").arg(tr(panel.title)), panel.Aim(),
                                       panel.Keys(), go));
  }
  qApp->installEventFilter(new PanelKeys(this));
  qApp->installEventFilter(new PanelDrops(this));
}

void MainWindow::ConnectPanels() {
  connect(current_, &CurrentRegion::changed, this, &MainWindow::ShowCloudOfCurrent);
  connect(regions_panel_, &RegionsPanel::paintWanted, this, &MainWindow::EnterSelection);
  connect(pages_, &QStackedWidget::currentChanged, regions_panel_,
          [this] { regions_panel_->SetSelecting(IsSelecting()); });
  auto* elsewhere = new ViewEditor(controller_, this);
  connect(regions_panel_, &RegionsPanel::elsewhereWanted, this, [this, elsewhere](bool photo) {
    const UserPicture* picture = canvas_->picture();
    if (!picture) {
      return Say(tr("Only training views are edited elsewhere: %1 goes to the nearest")
                     .arg(KeyText("view.next")));
    }
    // A render in its place would not be the requested picture.
    if (photo && !controller_->facts()->workspace->HasPhoto(*picture->faces.front())) {
      return Say(
          tr("%1 has no photo that could be edited").arg(QString::fromStdString(picture->name)));
    }
    elsewhere->Start(current_->id(), picture->name,
                     photo ? TargetKind::kPhoto : TargetKind::kRender);
  });
  connect(regions_panel_, &RegionsPanel::splitWanted, this,
          [this] { files_->SplitGaussians(current_->id()); });
  connect(regions_panel_, &RegionsPanel::masksWanted, exports_, &Exports::Masks);
  connect(elsewhere, &ViewEditor::opened, this, [this](const QString& path) {
    Say(tr("%1 is open in another program. What you save there is taken over").arg(path));
  });
  connect(elsewhere, &ViewEditor::taken, this,
          [this](RegionId region, const QString& path, const PaintDetail& detail) {
            canvas_->SetCloudShown(false);  // it would hide changes made elsewhere
            Say(tr("Took over %1").arg(path));
            if (detail.IsTorn()) OfferSplitting(region, detail);
          });
  connect(elsewhere, &ViewEditor::failed, this, [this](const QString& message) {
    dialogs_->ShowError(tr("The view cannot be edited elsewhere"), message);
  });
  connect(quality_, &QualityPanel::maskShown, this, &MainWindow::UpdateActions);
  connect(views_, &ViewsPanel::menuWanted, this, [this](const QPoint& at) {
    ShowMenu("views_menu", at, {"selection.enter", "", "show.frusta", "show.mask", "show.split"});
  });
}

}  // namespace retint
