// SPDX-License-Identifier: BSD-3-Clause
// Shared by the tests of panels: the tiny scene of the session's tests on disk, open in a window of
// 1600 x 1000, and the way to its list of regions.
#pragma once

#include <memory>

#include <QComboBox>
#include <QDockWidget>
#include <QLabel>
#include <QPushButton>
#include <QSpinBox>

#include "colmap_io/image_io.h"
#include "tests/saving/saved_scene.h"
#include "tests/viewer/viewer_scene.h"
#include "viewer/panels/color_picker.h"
#include "viewer/panels/regions_panel.h"
#include "viewer/panels/row_tree.h"

namespace retint {

class PanelsFixture : public QObject {
 protected:
  const TinyScene scene_{41};
  std::unique_ptr<TempFolder> folder_;
  std::unique_ptr<Theme> theme_;
  std::unique_ptr<MainWindow> window_;

  SceneController& Controller() { return window_->controller(); }
  const std::vector<Region>& Regions() { return Controller().regions().regions; }
  template <typename T>
  T* Find(const char* name) {
    T* found = window_->findChild<T*>(name);
    if (!found) qFatal("there is no %s", name);
    return found;
  }
  RowTree* List() { return Find<RowTree>("region_list"); }

  // The session's own state, not the window's.
  RegionSet SessionRegions() {
    const auto regions = std::make_shared<RegionSet>();
    bool done = false;
    Controller().Run(
        {}, [regions](EditSession& session, Monitor&) { *regions = session.store().regions(); },
        [&] { done = true; });
    if (!QTest::qWaitFor([&] { return done; }, kWaitMs)) qFatal("the worker does not answer");
    return *regions;
  }
  bool AddRegions() {
    QSignalSpy added(&Controller(), &SceneController::regionAdded);
    AddRegionFromMasks(Controller(), "left", MasksOf(scene_), ColorEdit::Tint({0.2F, 0.4F, 1.0F}));
    if (!QTest::qWaitFor([&] { return added.count() == 1; }, kWaitMs)) return false;
    AddRegionFromMasks(Controller(), "right", OtherMasksOf(scene_),
                       ColorEdit::Tint({1.0F, 0.2F, 0.2F}));
    return QTest::qWaitFor([&] { return added.count() == 2; }, kWaitMs);
  }
  QPoint CellCenter(int row, int column) {
    const int y = List()->visualItemRect(List()->topLevelItem(row)).center().y();
    return {List()->columnViewportPosition(column) + List()->columnWidth(column) / 2, y};
  }
  QPoint CheckBoxOf(int row, int column) {
    const QRect rect = List()->visualItemRect(List()->topLevelItem(row));
    return {List()->columnViewportPosition(column) + 10, rect.center().y()};
  }
  void Select(int row) {
    QTest::mouseClick(List()->viewport(), Qt::LeftButton, {},
                      CellCenter(row, RegionsPanel::kColor));
  }
  void Show(const char* dock) {
    auto* panel = Find<QDockWidget>(dock);
    panel->show();
    panel->raise();
    QTest::qWait(50);
  }

  void MakeTheme() {
    theme_ = std::make_unique<Theme>();
    theme_->Choose(ThemeChoice::kLight);
  }

  // A fresh scene in a fresh window, with settings of its own.
  bool ShowScene(bool drawers = true) {
    folder_ = std::make_unique<TempFolder>();
    UseOwnFolders(QString::fromStdString(folder_->path().string()));
    WriteTinyScene(scene_, folder_->path());
    Renderer renderer = scene_.MakeRenderer();
    for (size_t v = 0; v < scene_.cameras.size(); ++v) {
      WritePng(*folder_ / "ws" / "images" / ViewName(v), renderer.Render(scene_.cameras[v]).rgb);
    }
    window_ = std::make_unique<MainWindow>(theme_.get());
    window_->resize(1600, 1000);
    window_->show();
    if (!Activate(*window_)) return false;
    if (drawers) OpenDrawers(*window_);
    QSignalSpy opened(&Controller(), &SceneController::opened);
    OpenRequest request;
    request.workspace = *folder_ / "ws";
    request.splat = *folder_ / "ws" / "splat.ply";
    request.options.backend = "cpu";
    Controller().colors().SetAutomaticRefit(false);
    window_->files().OpenScene(request);
    if (!QTest::qWaitFor([&] { return opened.count() == 1; }, kWaitMs)) return false;
    for (const auto side : {Qt::LeftDockWidgetArea, Qt::RightDockWidgetArea}) {
      window_->SetSideShown(side, true);  // a first window folds one
    }
    return true;
  }

  void Close() {
    window_.reset();
    folder_.reset();
  }
};

}  // namespace retint
