// SPDX-License-Identifier: BSD-3-Clause
// Shared by the tests of files: a window on a scene, separate folders, and the way through menus
// and dialogs.
#pragma once

#include <filesystem>

#include <QAction>
#include <QDialog>
#include <QMenu>

#include "saving/autosave.h"
#include "tests/viewer/viewer_scene.h"
#include "viewer/scene/session_store.h"

namespace retint {

namespace fs = std::filesystem;

class FilesFixture : public ViewerTest {
 protected:
  int folders_ = 0;

  const std::vector<Region>& Regions() { return controller().regions().regions; }
  fs::path Fresh() {
    const fs::path folder = scene_->folder() / ("case" + std::to_string(folders_++));
    fs::create_directories(folder);
    return folder;
  }

  bool AddRegion(const char* name) {
    QSignalSpy added(&controller(), &SceneController::regionAdded);
    AddRegionFromMasks(controller(), name, scene_->Masks(scene_->MostVisible().object),
                       ColorEdit::Tint({0.2F, 0.9F, 0.3F}));
    return QTest::qWaitFor([&] { return added.count() == 1; }, kWaitMs);
  }
  bool Save(const fs::path& folder) {
    QSignalSpy saved(&window_->sessions(), &SessionStore::saved);
    AnswerFileDialog(folder);
    PressKey(*window_, Qt::Key_S, Qt::ControlModifier);
    return QTest::qWaitFor([&] { return saved.count() == 1; }, kWaitMs);
  }
  // Of a session that was never saved.
  static bool HasAutosave() {
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(AutosaveDataFolder(), none)) {
      if (fs::exists(entry.path() / "session.json")) return true;
    }
    return false;
  }
  // The entries of File > Open recent, as the menu shows them when it opens.
  QList<QAction*> Recent() {
    for (QMenu* menu : window_->findChildren<QMenu*>()) {
      if (!QString(menu->title()).remove('&').startsWith("Open recent")) continue;
      Q_EMIT menu->aboutToShow();
      return menu->actions();
    }
    return {};
  }
  void Export(int entry) { window_->findChild<QMenu*>("export")->actions()[entry]->trigger(); }
  // The dialog of an entry that writes a folder; null when it does not come.
  QDialog* ExportDialogOf(int entry) {
    if (!QTest::qWaitFor([&] { return !window_->findChild<QDialog*>("export_dialog"); }, kWaitMs)) {
      return nullptr;
    }
    Export(entry);
    return window_->findChild<QDialog*>("export_dialog");
  }
  void ExportTo(int entry, const fs::path& folder) {
    QDialog* dialog = ExportDialogOf(entry);
    QVERIFY(dialog && dialog->isVisible());
    auto* edit = dialog->findChild<QLineEdit*>("export_folder");
    edit->setText(QString::fromStdString(folder.string()));
    QTest::keyClick(edit, Qt::Key_Return);  // the default button exports
    QVERIFY(!dialog->isVisible());
  }
  void Type(QDialog* dialog, const char* field, const fs::path& path) {
    auto* edit = dialog->findChild<QLineEdit*>(field);
    edit->setFocus();
    edit->selectAll();
    QTest::keyClick(edit, Qt::Key_Delete);
    QTest::keyClicks(edit, QString::fromStdString(path.string()));
  }
  bool Opened(QSignalSpy& opened) {
    return QTest::qWaitFor([&] { return opened.count() > 0; }, kWaitMs) && WaitSharp(*window_);
  }

  void EndCase() {
    window_.reset();
    QSettings().remove("recent");
  }
};

}  // namespace retint
