// SPDX-License-Identifier: BSD-3-Clause
// Scenes opened by menu, key and drop, recent ones, the start page, and faults.
#include <cstring>
#include <fstream>
#include <limits>

#include <QAction>
#include <QDialogButtonBox>
#include <QDockWidget>
#include <QLabel>
#include <QPointer>
#include <QPushButton>
#include <QToolBar>
#include <QToolButton>

#include "base/files.h"
#include "tests/viewer/files_fixture.h"
#include "viewer/window/first_steps.h"
#include "viewer/window/recent_files.h"

namespace retint {

class FilesTest : public FilesFixture {
  Q_OBJECT

 private Q_SLOTS:
  void initTestCase() { MakeScene(); }
  void cleanupTestCase() { scene_.reset(); }
  void init() { QVERIFY(ShowScene()); }
  void cleanup() { EndCase(); }

  void TheOpenDialogSaysWhatIsMissing() {
    MainWindow empty(theme_.get());
    empty.show();
    QTest::mouseClick(empty.findChild<QPushButton*>("welcome_open"), Qt::LeftButton);
    auto* dialog = empty.findChild<QDialog*>("open_dialog");
    QVERIFY(dialog && dialog->isVisible());
    auto* open = dialog->findChild<QDialogButtonBox*>()->button(QDialogButtonBox::Open);
    QVERIFY(!open->isEnabled());
    const auto type = [&](const char* field, const fs::path& path) {
      auto* edit = dialog->findChild<QLineEdit*>(field);
      edit->setFocus();
      edit->selectAll();
      QTest::keyClicks(edit, QString::fromStdString(path.string()));
    };
    const auto says = [&](const QString& part) {
      for (auto* label : dialog->findChildren<QLabel*>()) {
        if (label->text().contains(part)) return true;
      }
      return false;
    };
    type("workspace", "/no/such/folder");
    type("splat", scene_->workspace() / "splat.ply");
    QVERIFY(says("The workspace is not a folder"));
    type("workspace", scene_->folder());
    QVERIFY(says("no COLMAP model"));
    type("workspace", scene_->workspace());
    type("splat", scene_->workspace() / "nothing.ply");
    QVERIFY(says("The splat is not a file") && !open->isEnabled());
    type("splat", scene_->workspace() / "splat.ply");
    QVERIFY(open->isEnabled());
    QSignalSpy opened(&empty.controller(), &SceneController::opened);
    QTest::mouseClick(open, Qt::LeftButton);
    QVERIFY(QTest::qWaitFor([&] { return opened.count() == 1; }, kWaitMs));
  }

  // The splat of the scene before does not go with another workspace.
  void AnotherWorkspaceFindsItsOwnSplat() {
    const fs::path other = Fresh() / "other", bare = Fresh() / "bare";
    fs::copy(scene_->workspace(), other, fs::copy_options::recursive);
    fs::copy(scene_->workspace(), bare, fs::copy_options::recursive);
    fs::remove(bare / "splat.ply");
    PressKey(*window_, Qt::Key_O, Qt::ControlModifier);
    auto* dialog = window_->findChild<QDialog*>("open_dialog");
    QVERIFY(dialog && dialog->isVisible());
    auto* splat = dialog->findChild<QLineEdit*>("splat");
    auto* open = dialog->findChild<QDialogButtonBox*>()->button(QDialogButtonBox::Open);
    Type(dialog, "workspace", bare);
    QCOMPARE(splat->text(), QString());
    QVERIFY(!open->isEnabled());
    Type(dialog, "workspace", other);
    QCOMPARE(splat->text(), QString::fromStdString((other / "splat.ply").string()));
    // One that was chosen for this workspace stays; a field that is cleared is looked for again.
    Type(dialog, "splat", scene_->workspace() / "splat.ply");
    QVERIFY(open->isEnabled());
    Type(dialog, "splat", "");
    QVERIFY(open->isEnabled());
    QSignalSpy opened(&controller(), &SceneController::opened);
    QTest::mouseClick(open, Qt::LeftButton);
    QVERIFY(Opened(opened));
    QCOMPARE(controller().facts()->request.splat, other / "splat.ply");
  }

  void AFailedOpenBringsTheFormBack() {
    const fs::path bad = Fresh() / "bad";
    fs::copy(scene_->workspace(), bad, fs::copy_options::recursive);
    fs::resize_file(bad / "splat.ply", 100);
    PressKey(*window_, Qt::Key_O, Qt::ControlModifier);
    auto* dialog = window_->findChild<QDialog*>("open_dialog");
    QVERIFY(dialog);
    Type(dialog, "workspace", bad);
    const auto open = [](QDialog* of) {
      QTest::mouseClick(of->findChild<QDialogButtonBox*>()->button(QDialogButtonBox::Open),
                        Qt::LeftButton);
    };
    QPointer<QDialog> first = dialog;
    open(dialog);
    QTRY_VERIFY_WITH_TIMEOUT(!first, kWaitMs);
    QTRY_VERIFY_WITH_TIMEOUT(window_->findChild<QDialog*>("open_dialog"), kWaitMs);
    dialog = window_->findChild<QDialog*>("open_dialog");
    QVERIFY(!window_->dialogs().box());
    QCOMPARE(dialog->findChild<QLineEdit*>("workspace")->text(),
             QString::fromStdString(bad.string()));
    QVERIFY(dialog->findChild<QLabel*>("open_problem")->text().contains("splat.ply"));
    // The fault is corrected in the same form.
    Type(dialog, "splat", scene_->workspace() / "splat.ply");
    QSignalSpy opened(&controller(), &SceneController::opened);
    open(dialog);
    QVERIFY(Opened(opened));
    QVERIFY(fs::equivalent(controller().facts()->request.workspace, bad));
  }

  void TheStartPageHasRecentScenesAndASample() {
    controller().Close();
    QTRY_VERIFY_WITH_TIMEOUT(!controller().IsOpen(), kWaitMs);
    auto* list = window_->findChild<QWidget*>("welcome_recent");
    QVERIFY(list->isVisible());
    const auto buttons = [&] {
      QList<QPushButton*> shown = list->findChildren<QPushButton*>();
      shown.removeIf([](const QPushButton* one) { return !one->isVisible(); });
      return shown;
    };
    QTRY_VERIFY(!buttons().isEmpty());
    QVERIFY(buttons().front()->toolTip().contains("workspace with "));
    QSignalSpy opened(&controller(), &SceneController::opened);
    Keep(*window_, "start_page");
    QTest::mouseClick(buttons().front(), Qt::LeftButton);
    QVERIFY(Opened(opened));
    // Cleared from the menu, it is empty for good.
    Recent().back()->trigger();
    QCOMPARE(Recent().size(), 1);
    QVERIFY(!Recent().front()->isEnabled());
    controller().Close();
    QTRY_VERIFY_WITH_TIMEOUT(buttons().isEmpty(), kWaitMs);
    // The sample is made, and found the second time.
    auto* sample = window_->findChild<QPushButton*>("welcome_sample");
    opened.clear();
    QTest::mouseClick(sample, Qt::LeftButton);
    QTRY_COMPARE_WITH_TIMEOUT(opened.count(), 1, 5 * kWaitMs);
    const fs::path splat = controller().facts()->request.splat;
    const auto made = fs::last_write_time(splat);
    controller().Close();
    opened.clear();
    QTRY_VERIFY(sample->isVisible());
    QTest::mouseClick(sample, Qt::LeftButton);
    QTRY_COMPARE_WITH_TIMEOUT(opened.count(), 1, kWaitMs);
    QVERIFY(fs::last_write_time(splat) == made);
  }

  // Before that, nothing but the start page shows; afterwards panels are as they were.
  void PanelsShowOnceASceneIsOpen() {
    const auto shown = [&] {
      QStringList names;
      for (auto* dock : window_->findChildren<QDockWidget*>()) {
        if (dock->isVisible()) names << dock->objectName();
      }
      for (auto* bar : window_->findChildren<QToolBar*>(Qt::FindDirectChildrenOnly)) {
        if (bar->isVisible()) names << bar->objectName();
      }
      return names;
    };
    const QStringList before = shown();
    QVERIFY(!before.isEmpty());
    controller().Close();
    QTRY_VERIFY_WITH_TIMEOUT(shown().isEmpty(), kWaitMs);
    QSignalSpy opened(&controller(), &SceneController::opened);
    window_->files().OpenScene(scene_->Request());
    QVERIFY(Opened(opened));
    QCOMPARE(shown(), before);
  }

  void ACardShowsThePictureOfItsScene() {
    const QString entry = RecentFiles().value(0);
    QTRY_VERIFY_WITH_TIMEOUT(!RecentPicture(entry).isNull(), kWaitMs);
    const QImage picture = RecentPicture(entry);
    QCOMPARE(picture.size(), QSize(480, 270));
    QVERIFY(RecentTime(entry).secsTo(QDateTime::currentDateTime()) < 3600);
    ForgetRecent(entry);
    QVERIFY(RecentPicture(entry).isNull());
  }

  void FirstStepsTickThemselves() {
    QSettings().remove("first_steps_done");
    window_->Welcome();
    QPointer<FirstSteps> steps = window_->findChild<FirstSteps*>();
    QVERIFY(steps && steps->isVisible());
    QVERIFY(steps->IsDone(FirstSteps::kOpen));
    QVERIFY(!steps->IsDone(FirstSteps::kAccept));
    QVERIFY(AddTintedRegion() != 0);
    QTRY_VERIFY(steps->IsDone(FirstSteps::kAccept) && steps->IsDone(FirstSteps::kColor));
    QVERIFY(!steps->IsDone(FirstSteps::kExport));
    QTest::mouseClick(steps->findChild<QToolButton*>("first_steps_close"), Qt::LeftButton);
    QTRY_VERIFY(!steps);
    window_->Welcome();
    QVERIFY(!window_->findChild<FirstSteps*>());
  }

  void FilesAreOpenedAndClosedByKey() {
    QVERIFY(AddRegion("pot"));
    const fs::path folder = Fresh() / "by_key.retint";
    QVERIFY(Save(folder));
    PressKey(*window_, Qt::Key_W, Qt::ControlModifier);
    QTRY_VERIFY_WITH_TIMEOUT(!controller().IsOpen(), kWaitMs);
    QVERIFY(window_->findChild<QPushButton*>("welcome_open")->isVisible());
    QVERIFY(!window_->action("file.save")->isEnabled());
    QSignalSpy opened(&controller(), &SceneController::opened);
    AnswerFileDialog(folder);
    QTest::keyClick(window_.get(), Qt::Key_O, Qt::ControlModifier | Qt::ShiftModifier);
    QVERIFY(Opened(opened));
    QCOMPARE(Regions().size(), size_t{1});
    PressKey(*window_, Qt::Key_O, Qt::ControlModifier);
    auto* dialog = window_->findChild<QDialog*>("open_dialog");
    QVERIFY(dialog && dialog->isVisible());
    // It starts with the open scene.
    QCOMPARE(dialog->findChild<QLineEdit*>("workspace")->text(),
             QString::fromStdString(scene_->workspace().string()));
    opened.clear();
    QTest::mouseClick(dialog->findChild<QDialogButtonBox*>()->button(QDialogButtonBox::Open),
                      Qt::LeftButton);
    QVERIFY(Opened(opened));
    QVERIFY(Regions().empty());
  }

  void RecentScenesAndSessionsOpenFromTheMenu() {
    QVERIFY(AddRegion("pot"));
    const fs::path folder = Fresh() / "work.retint";
    QVERIFY(Save(folder));
    const QList<QAction*> entries = Recent();
    QVERIFY(entries.size() >= 2);
    QVERIFY(entries[0]->text().endsWith("work.retint"));
    QVERIFY(entries[1]->text().contains("workspace with "));
    QSignalSpy opened(&controller(), &SceneController::opened);
    entries[1]->trigger();
    QVERIFY(Opened(opened));
    QVERIFY(Regions().empty());
    opened.clear();
    QAction* session = nullptr;
    for (QAction* entry : Recent()) {
      if (entry->text().endsWith("work.retint")) session = entry;
    }
    QVERIFY(session);
    session->trigger();
    QVERIFY(Opened(opened));
    QCOMPARE(Regions().size(), size_t{1});
    QVERIFY(window_->windowTitle().contains("work.retint"));
    // A missing scene is reported and leaves the list; the open one stays.
    fs::remove_all(folder);
    for (QAction* entry : Recent()) {
      if (entry->text().endsWith("work.retint")) session = entry;
    }
    session->trigger();
    QVERIFY(ReadError(*window_).contains("work.retint is gone"));
    QCOMPARE(Regions().size(), size_t{1});
    for (QAction* entry : Recent()) QVERIFY(!entry->text().endsWith("work.retint"));
  }

  // In the menu and on the start page; the tool tip has the whole path as it is.
  void LongPathsOfRecentScenesAreCutShort() {
    const QString path = "/home/" + QString("pots & pans/").repeated(60) + "work.retint";
    QSettings().setValue("recent", QStringList{path});
    QAction* entry = Recent().value(0);
    QVERIFY(entry && entry->text().contains("…") && entry->text().contains("pots && pans"));
    QCOMPARE(entry->toolTip(), path);
    auto* menu = qobject_cast<QMenu*>(entry->parent());
    QVERIFY(menu && menu->toolTipsVisible() && menu->sizeHint().width() < 800);
    window_->action("file.close")->trigger();
    QTRY_VERIFY_WITH_TIMEOUT(!controller().IsOpen(), kWaitMs);
    auto* card = window_->findChild<QWidget*>("welcome_recent")->findChild<QPushButton*>();
    QVERIFY(card);
    QCOMPARE(card->text(), QString("work.retint"));
    QCOMPARE(card->toolTip(), path);
  }

  // Reported at once, not after a question about the open scene.
  void ARecentSceneThatIsGoneLeavesTheStartPage() {
    const fs::path other = Fresh() / "moved";
    fs::copy(scene_->workspace(), other, fs::copy_options::recursive);
    OpenRequest request = scene_->Request();
    request.workspace = other;
    request.splat = other / "splat.ply";
    QSignalSpy opened(&controller(), &SceneController::opened);
    window_->files().OpenScene(request);
    QVERIFY(Opened(opened));
    controller().Close();
    auto* list = window_->findChild<QWidget*>("welcome_recent");
    const auto buttons = [&] {
      QList<QPushButton*> shown = list->findChildren<QPushButton*>();
      shown.removeIf([](const QPushButton* one) { return !one->isVisible(); });
      return shown;
    };
    QTRY_COMPARE_WITH_TIMEOUT(buttons().size(), 2, kWaitMs);
    fs::remove(other / "splat.ply");
    QTest::mouseClick(buttons().front(), Qt::LeftButton);
    QVERIFY(WaitDialog(*window_));
    Keep(*window_->dialogs().box(), "recent_gone");
    QVERIFY(ReadError(*window_).contains("moved/splat.ply is gone"));
    QTRY_COMPARE(buttons().size(), 1);
    Keep(*window_, "recent_after_gone");
    QVERIFY(!buttons().front()->toolTip().contains("moved"));
    // The others open as ever.
    opened.clear();
    QTest::mouseClick(buttons().front(), Qt::LeftButton);
    QVERIFY(Opened(opened));
  }

  void RecentScenesKeepTheirOptions() {
    const fs::path photos = Fresh() / "photos";
    fs::copy(scene_->workspace() / "images", photos);
    OpenRequest request = scene_->Request();
    request.options.image_folder = photos;
    request.options.holdout = 3;
    QSignalSpy opened(&controller(), &SceneController::opened);
    window_->files().OpenScene(request);
    QVERIFY(Opened(opened));
    const size_t heldout = controller().facts()->heldout.size();
    QVERIFY(heldout > 0);
    // Another scene comes between.
    const fs::path other = Fresh() / "other.ply";
    fs::copy_file(scene_->workspace() / "splat.ply", other);
    OpenRequest second = scene_->Request();
    second.splat = other;
    opened.clear();
    window_->files().OpenScene(second);
    QVERIFY(Opened(opened));
    QVERIFY(controller().facts()->heldout.empty());
    const QList<QAction*> entries = Recent();
    QVERIFY(entries.size() >= 2 && entries[1]->text().endsWith("splat.ply"));
    opened.clear();
    entries[1]->trigger();
    QVERIFY(Opened(opened));
    const auto facts = controller().facts();
    QCOMPARE(facts->heldout.size(), heldout);
    QVERIFY(fs::equivalent(facts->workspace->image_folder, photos));
    QCOMPARE(facts->request.options.backend, BackendName());
    // The same files with other options are not a second entry.
    opened.clear();
    window_->files().OpenScene(scene_->Request());
    QVERIFY(Opened(opened));
    int same = 0;
    for (QAction* entry : Recent()) same += entry->text().endsWith("workspace/splat.ply");
    QCOMPARE(same, 1);
  }

  // Without a workspace views are placed around it, and the original serves as their photos.
  void ASplatAloneIsOpened() {
    controller().Close();
    QTRY_VERIFY_WITH_TIMEOUT(!controller().IsOpen(), kWaitMs);
    QSignalSpy opened(&controller(), &SceneController::opened);
    QVERIFY(Drop(*window_, scene_->workspace() / "splat.ply"));
    QVERIFY(Opened(opened));
    const auto facts = controller().facts();
    QVERIFY(facts->workspace->has_virtual_views);
    QCOMPARE(facts->views.size(), size_t(facts->request.options.views));
    QVERIFY(facts->request.workspace.empty());
    QVERIFY(window_->windowTitle().contains("splat.ply"));
    QVERIFY(!Recent().front()->text().contains(" with "));
    QVERIFY(Recent().front()->text().endsWith("splat.ply"));
    opened.clear();
    Recent().front()->trigger();
    QVERIFY(Opened(opened));
    QVERIFY(controller().facts()->workspace->has_virtual_views);
  }

  void SessionsAndSplatsAreDropped() {
    QVERIFY(AddRegion("pot"));
    const fs::path folder = Fresh() / "dropped.retint";
    QVERIFY(Save(folder));
    QSignalSpy opened(&controller(), &SceneController::opened);
    QVERIFY(Drop(*window_, folder));
    QVERIFY(Opened(opened));
    QCOMPARE(Regions().size(), size_t{1});
    // Its folder may have another name, and its contents identify it.
    const fs::path renamed = Fresh() / "renamed";
    fs::copy(folder, renamed, fs::copy_options::recursive);
    QStringList content;
    for (const auto& entry : fs::directory_iterator(renamed)) {
      content << QString::fromStdString(entry.path().string());
    }
    QVERIFY(content.size() > 1);
    for (const QStringList& dropped :
         {QStringList(QString::fromStdString(renamed.string())),
          QStringList(QString::fromStdString((renamed / "session.json").string())), content}) {
      opened.clear();
      window_->files().OpenPaths(dropped);
      QVERIFY(Opened(opened));
      QCOMPARE(Regions().size(), size_t{1});
      QCOMPARE(window_->sessions().folder(), renamed);
    }
    const QString splat = QString::fromStdString((scene_->workspace() / "splat.ply").string());
    window_->files().OpenPaths(content + QStringList(splat));
    QVERIFY(ReadError(*window_).contains("a session names its workspace and splat itself"));
    // A splat alone goes with the workspace that is open.
    const fs::path other = Fresh() / "other.ply";
    fs::copy_file(scene_->workspace() / "splat.ply", other);
    opened.clear();
    QVERIFY(Drop(*window_, other));
    QVERIFY(Opened(opened));
    QCOMPARE(controller().facts()->request.splat, other);
    QVERIFY(fs::equivalent(controller().facts()->request.workspace, scene_->workspace()));
    const fs::path text = Fresh() / "notes.txt";
    std::ofstream(text) << "not a splat\n";
    QVERIFY(Drop(*window_, text));
    QVERIFY(ReadError(*window_).contains("notes.txt"));
    QCOMPARE(controller().facts()->request.splat, other);
  }

  // Not moved: a program that is told so may delete it. Addresses of the web are not taken.
  void WhatIsDroppedIsACopyOfAFile() {
    QSignalSpy opened(&controller(), &SceneController::opened);
    const QString splat = QString::fromStdString((scene_->workspace() / "splat.ply").string());
    QCOMPARE(Drop(*window_, QUrl::fromLocalFile(splat), Qt::MoveAction), Qt::IgnoreAction);
    QCOMPARE(Drop(*window_, QUrl::fromLocalFile(splat)), Qt::CopyAction);
    QVERIFY(Opened(opened));
    QCOMPARE(Drop(*window_, QUrl("https://example.org/splat.ply")), Qt::IgnoreAction);
  }

  // A field of text in a panel does not become the name of the file.
  void FilesThatAreDroppedOnAPanelAreOpened() {
    QVERIFY(AddRegion("pot"));
    QVERIFY(Save(Fresh() / "panel.retint"));
    auto* field = window_->findChild<QLineEdit*>("color_text");
    QVERIFY(field && field->isVisible() && field->isEnabled());
    const QString color = field->text();
    QSignalSpy opened(&controller(), &SceneController::opened);
    QVERIFY(Drop(*field, scene_->workspace()));
    QCOMPARE(field->text(), color);
    QVERIFY(Opened(opened));
    QVERIFY(Regions().empty());
  }

  // A path that is dropped on a field takes the place of the one before.
  void FilesAreDroppedOnTheForms() {
    const fs::path other = Fresh() / "other";
    fs::copy(scene_->workspace(), other, fs::copy_options::recursive);
    PressKey(*window_, Qt::Key_O, Qt::ControlModifier);
    auto* dialog = window_->findChild<QDialog*>("open_dialog");
    QVERIFY(dialog && dialog->isVisible());
    auto* workspace = dialog->findChild<QLineEdit*>("workspace");
    QVERIFY(Drop(*workspace, other));
    QCOMPARE(workspace->text(), QString::fromStdString(other.string()));
    QCOMPARE(dialog->findChild<QLineEdit*>("splat")->text(),
             QString::fromStdString((other / "splat.ply").string()));
    dialog->reject();
    dialog = ExportDialogOf(2);
    QVERIFY(dialog);
    auto* folder = dialog->findChild<QLineEdit*>("export_folder");
    QVERIFY(Drop(*folder, other));
    QCOMPARE(folder->text(), QString::fromStdString(other.string()));
    dialog->reject();
  }

  void BadScenesAreExplained_data() {
    QTest::addColumn<QString>("fault");
    QTest::addColumn<QString>("named");
    for (const auto& [fault, named] :
         {std::pair("cut cameras", "cameras.bin"), std::pair("cut images", "images.bin"),
          std::pair("cut points", "points3D.bin"), std::pair("cut splat", "splat.ply"),
          std::pair("NaN in the splat", "splat.ply"), std::pair("text as a splat", "splat.ply"),
          std::pair("folding camera", "camera 1 (SIMPLE_RADIAL)"),
          std::pair("unknown camera model", "cameras.bin")}) {
      QTest::newRow(fault) << fault << named;
    }
  }
  void BadScenesAreExplained() {
    QFETCH(const QString, fault);
    QFETCH(const QString, named);
    const fs::path bad = Fresh() / "workspace";
    fs::copy(scene_->workspace(), bad, fs::copy_options::recursive);
    const fs::path model = bad / "sparse" / "0", splat = bad / "splat.ply";
    const auto cut = [](const fs::path& path, double share) {
      fs::resize_file(path, uintmax_t(share * double(fs::file_size(path))));
    };
    const auto overwrite = [](const fs::path& path, size_t at, auto value) {
      std::string bytes = ReadFile(path);
      std::memcpy(bytes.data() + at, &value, sizeof value);
      WriteFile(path, bytes);
    };
    constexpr size_t kCameraModel = 8 + 4;  // after the count and the first camera's id
    if (fault == "cut cameras") cut(model / "cameras.bin", 0.6);
    if (fault == "cut images") cut(model / "images.bin", 0.6);
    if (fault == "cut points") fs::resize_file(model / "points3D.bin", 5);
    if (fault == "cut splat") cut(splat, 0.7);
    if (fault == "NaN in the splat") {
      const size_t data = ReadFile(splat).find("end_header\n") + std::strlen("end_header\n");
      overwrite(splat, data, std::numeric_limits<float>::quiet_NaN());
    }
    if (fault == "text as a splat") WriteFile(splat, "not a splat at all\n");
    // SIMPLE_RADIAL has four parameters, as PINHOLE; this one folds its picture over itself.
    if (fault == "folding camera") {
      overwrite(model / "cameras.bin", kCameraModel, int32_t{2});
      overwrite(model / "cameras.bin", kCameraModel + 4 + 8 + 8 + 3 * 8, -60.0);
    }
    if (fault == "unknown camera model") {
      overwrite(model / "cameras.bin", kCameraModel, int32_t{77});
    }
    const auto facts = controller().facts();
    QVERIFY(Drop(*window_, bad));
    const QString error = ReadError(*window_);
    QVERIFY2(error.contains(named), qPrintable(error));
    // The window keeps the open scene, and opens a good one.
    QVERIFY(controller().facts() == facts && !controller().IsBusy());
    PressKey(*window_, Qt::Key_Right);
    QCOMPARE(canvas().navigation().view(), facts->views[1]);
    QVERIFY(WaitSharp(*window_));
    QSignalSpy opened(&controller(), &SceneController::opened);
    QVERIFY(Drop(*window_, scene_->workspace()));
    QVERIFY(Opened(opened));
  }
};

}  // namespace retint

QTEST_MAIN(retint::FilesTest)
#include "files_test.moc"
