// SPDX-License-Identifier: BSD-3-Clause
// Sessions saved, closed, damaged, recovered after a crash.
#include <cstring>
#include <fstream>

#include <QAction>
#include <QPushButton>
#include <QToolButton>
#include <nlohmann/json.hpp>

#include "base/files.h"
#include "splat_io/splat_io.h"
#include "tests/support/file_size_limit.h"
#include "tests/viewer/files_fixture.h"

namespace retint {

class SessionsTest : public FilesFixture {
  Q_OBJECT

 private Q_SLOTS:
  void initTestCase() { MakeScene(); }
  void cleanupTestCase() { scene_.reset(); }
  void init() { QVERIFY(ShowScene()); }
  void cleanup() { EndCase(); }

  void SavingAsksOnceAndGoesOnQuietly() {
    fs::remove_all(AutosaveDataFolder());
    QVERIFY(AddRegion("pot"));
    QVERIFY(window_->isWindowModified());
    QTRY_VERIFY_WITH_TIMEOUT(HasAutosave(), kWaitMs);
    const fs::path folder = Fresh() / "mine";  // the ending is added
    QVERIFY(Save(folder));
    const fs::path session = folder.string() + ".retint";
    QVERIFY(fs::exists(session / "session.json"));
    QVERIFY(!window_->isWindowModified());
    QVERIFY(!HasAutosave());  // there is nothing to recover
    controller().Do(RenameRegion{Regions().front().id, "petals"});
    QTRY_VERIFY_WITH_TIMEOUT(window_->isWindowModified(), kWaitMs);
    QSignalSpy saved(&window_->sessions(), &SessionStore::saved);
    PressKey(*window_, Qt::Key_S, Qt::ControlModifier);
    QTRY_COMPARE_WITH_TIMEOUT(saved.count(), 1, kWaitMs);
    const auto manifest = nlohmann::json::parse(ReadFile(session / "session.json"));
    QCOMPARE(manifest["regions"][0]["name"].get<std::string>(), std::string("petals"));
    // Elsewhere under another name.
    const fs::path copy = Fresh() / "copy.retint";
    AnswerFileDialog(copy);
    PressKey(*window_, Qt::Key_S, Qt::ControlModifier | Qt::ShiftModifier);
    QTRY_COMPARE_WITH_TIMEOUT(saved.count(), 2, kWaitMs);
    QCOMPARE(ReadSessionInfo(copy).regions, size_t{1});
  }

  void WhatAnotherProgramSavedIsNotLostUnasked() {
    QVERIFY(AddRegion("pot"));
    const fs::path folder = Fresh() / "work.retint";
    QVERIFY(Save(folder));
    QVERIFY(!window_->sessions().IsSavedElsewhere());
    const std::string theirs = ReadFile(folder / "session.json") + "\n";
    WriteFile(folder / "session.json", theirs);
    controller().Do(RenameRegion{Regions().front().id, "petals"});
    QTRY_VERIFY_WITH_TIMEOUT(window_->isWindowModified(), kWaitMs);
    QSignalSpy saved(&window_->sessions(), &SessionStore::saved);
    PressKey(*window_, Qt::Key_S, Qt::ControlModifier);
    QVERIFY(WaitDialog(*window_));
    QVERIFY(window_->dialogs().box()->informativeText().contains("another program"));
    QVERIFY(ClickRole(*window_, QMessageBox::RejectRole));
    QTRY_VERIFY(!window_->dialogs().box());
    QVERIFY(ReadFile(folder / "session.json") == theirs);
    PressKey(*window_, Qt::Key_S, Qt::ControlModifier);
    QVERIFY(ClickRole(*window_, QMessageBox::DestructiveRole));
    QTRY_COMPARE_WITH_TIMEOUT(saved.count(), 1, kWaitMs);
    const auto manifest = nlohmann::json::parse(ReadFile(folder / "session.json"));
    QCOMPARE(manifest["regions"][0]["name"].get<std::string>(), std::string("petals"));
    // From then on it is ours again.
    controller().Do(RenameRegion{Regions().front().id, "leaves"});
    PressKey(*window_, Qt::Key_S, Qt::ControlModifier);
    QTRY_COMPARE_WITH_TIMEOUT(saved.count(), 2, kWaitMs);
  }

  void ASavedEditIsNotHiddenByPoints() {
    QVERIFY(AddRegion("pot"));
    const fs::path folder = Fresh() / "work.retint";
    QVERIFY(Save(folder));
    QVERIFY(window_->canvas().cloud_shown());
    QSignalSpy opened(&controller(), &SceneController::opened);
    window_->files().OpenSession(folder);
    QVERIFY(Opened(opened));
    QVERIFY(!window_->canvas().cloud_shown());
    // In a scene without edits, points show the selection.
    opened.clear();
    window_->files().OpenScene(scene_->Request());
    QVERIFY(Opened(opened));
    QVERIFY(window_->canvas().cloud_shown());
  }

  void ClosingOffersToSave() {
    QVERIFY(AddRegion("pot"));
    const fs::path folder = Fresh() / "closing.retint";
    PressKey(*window_, Qt::Key_Q, Qt::ControlModifier);
    QVERIFY(WaitDialog(*window_));
    QVERIFY(window_->dialogs().box()->informativeText().contains("not been saved"));
    QVERIFY(ClickRole(*window_, QMessageBox::RejectRole));
    QVERIFY(window_->isVisible());
    QTRY_VERIFY(!window_->dialogs().box());
    PressKey(*window_, Qt::Key_Q, Qt::ControlModifier);
    AnswerFileDialog(folder);
    QVERIFY(ClickRole(*window_, QMessageBox::AcceptRole));
    QTRY_VERIFY_WITH_TIMEOUT(!window_->isVisible(), kWaitMs);
    QCOMPARE(ReadSessionInfo(folder).regions, size_t{1});
  }

  void PaintThatWasNotAcceptedIsNotLostUnasked() {
    window_->EnterSelection();
    QVERIFY(WaitPainting(*window_));
    const auto close = [&] { window_->action("file.close")->trigger(); };
    SelectionCanvas& paper = window_->selection().canvas();
    const QPoint middle = paper.rect().center();
    DragAlong(&paper, {middle, middle + QPoint(40, 0)});
    close();
    const QMessageBox* box = WaitDialog(*window_);
    QVERIFY(box && box->informativeText().contains("not been accepted"));
    QVERIFY(box->defaultButton() == box->button(QMessageBox::Cancel));
    QVERIFY(ClickRole(*window_, QMessageBox::RejectRole));
    QTRY_VERIFY(!window_->dialogs().box());
    QVERIFY(window_->IsSelecting() && paper.editor().AnyInside());
    // Nor where the view was left, to which one may come back.
    QTest::keyClick(&paper, Qt::Key_Escape);
    QVERIFY(!window_->IsSelecting());
    const QString view = window_->selection().entry().view;
    PressKey(*window_, Qt::Key_Right);
    QVERIFY(WaitSharp(*window_));
    PressKey(*window_, Qt::Key_Q, Qt::ControlModifier);
    box = WaitDialog(*window_);
    QVERIFY(box && box->informativeText().contains("painted on " + view + " has not been"));
    Keep(*window_->dialogs().box(), "paint_left");
    QVERIFY(ClickRole(*window_, QMessageBox::RejectRole));
    QTRY_VERIFY(!window_->dialogs().box());
    // Nor for painting elsewhere.
    PressKey(*window_, Qt::Key_B);
    box = WaitDialog(*window_);
    QVERIFY(box && box->informativeText().contains("painted on " + view + " has not been"));
    QVERIFY(ClickRole(*window_, QMessageBox::RejectRole));
    QTRY_VERIFY(!window_->dialogs().box());
    QVERIFY(!window_->IsSelecting());
    PressKey(*window_, Qt::Key_Left);
    PressKey(*window_, Qt::Key_B);
    QVERIFY(WaitPainting(*window_) && !window_->dialogs().box());
    QVERIFY(paper.editor().AnyInside());
    // Unless it was taken back.
    QTest::keyClick(&paper, Qt::Key_Z, Qt::ControlModifier);
    QVERIFY(!window_->selection().HoldsPaint());
    QTest::keyClick(&paper, Qt::Key_Y, Qt::ControlModifier);
    QTest::keyClick(&paper, Qt::Key_Escape);
    PressKey(*window_, Qt::Key_Right);
    PressKey(*window_, Qt::Key_B);
    QVERIFY(ClickRole(*window_, QMessageBox::DestructiveRole));
    QVERIFY(WaitPainting(*window_) && !paper.editor().AnyInside());
    DragAlong(&paper, {middle, middle + QPoint(40, 0)});
    close();
    QVERIFY(ClickRole(*window_, QMessageBox::DestructiveRole));
    QTRY_VERIFY_WITH_TIMEOUT(!controller().IsOpen(), kWaitMs);
    // Nothing was painted: there is nothing to ask.
    QTRY_VERIFY(!window_->dialogs().box());
    window_->files().OpenScene(scene_->Request());
    QVERIFY(WaitSharp(*window_));
    window_->EnterSelection();
    QVERIFY(WaitPainting(*window_));
    close();
    QTRY_VERIFY_WITH_TIMEOUT(!controller().IsOpen(), kWaitMs);
    QVERIFY(!window_->dialogs().box());
  }

  void BackingOutOfSavingStopsNothing() {
    QVERIFY(AddRegion("pot"));
    RefitJob job;
    job.options.solver = Solver::kAdam;
    job.options.adam.iterations = 1000000;
    controller().colors().SetRefitJob(job);
    controller().colors().StartRefit();
    QTRY_VERIFY_WITH_TIMEOUT(controller().colors().optimizer().steps > 0, kWaitMs);
    PressKey(*window_, Qt::Key_Q, Qt::ControlModifier);
    QVERIFY(WaitDialog(*window_));
    int came = 0;
    CancelFileDialog(&came);
    QVERIFY(ClickRole(*window_, QMessageBox::AcceptRole));
    QTRY_COMPARE_WITH_TIMEOUT(came, 1, kWaitMs);
    QVERIFY(Settle(controller()));
    QVERIFY(window_->isVisible() && controller().colors().optimizer().Active());
    const int steps = controller().colors().optimizer().steps;
    QTRY_VERIFY_WITH_TIMEOUT(controller().colors().optimizer().steps > steps, kWaitMs);
    controller().colors().CancelRefit();
  }

  void BadSessionsAreExplained() {
    QVERIFY(AddRegion("pot"));
    const fs::path good = Fresh() / "good.retint";
    QVERIFY(Save(good));
    const auto facts = controller().facts();
    const auto copy = [&](const char* name) {
      const fs::path folder = Fresh() / name;
      fs::copy(good, folder, fs::copy_options::recursive);
      return folder;
    };
    const fs::path garbled = copy("garbled.retint");
    std::ofstream(garbled / "session.json") << "{ not json";
    window_->files().OpenSession(garbled);
    QVERIFY(ReadError(*window_).contains("garbled.retint"));
    const fs::path newer = copy("newer.retint");
    auto manifest = nlohmann::json::parse(ReadFile(newer / "session.json"));
    manifest["version"] = 99;
    std::ofstream(newer / "session.json") << manifest.dump();
    window_->files().OpenSession(newer);
    QVERIFY(ReadError(*window_).contains("99"));
    const fs::path torn = copy("torn.retint");
    for (const auto& entry : fs::recursive_directory_iterator(torn)) {
      if (entry.path().extension() == ".png") fs::resize_file(entry.path(), 12);
    }
    window_->files().OpenSession(torn);
    QVERIFY(ReadError(*window_).contains(".png"));  // nobody painted these masks
    // The splat that was edited is not the one that is there now.
    const fs::path moved = copy("moved.retint");
    manifest = nlohmann::json::parse(ReadFile(moved / "session.json"));
    const fs::path other = Fresh() / "other.ply";
    GaussianModel model = ReadSplat(scene_->workspace() / "splat.ply");
    model.sh[0] += 1;
    WriteSplat(other, model);
    manifest["splat"]["absolute"] = manifest["splat"]["relative"] = other.string();
    std::ofstream(moved / "session.json") << manifest.dump();
    window_->files().OpenSession(moved);
    QVERIFY(ReadError(*window_).contains("other.ply"));
    QCOMPARE(controller().facts(), facts);
    QCOMPARE(Regions().size(), size_t{1});
  }

  void WhatFollowsFromOtherPartsMayBeDamaged() {
    QVERIFY(AddRegion("pot"));
    const fs::path folder = Fresh() / "torn.retint";
    QVERIFY(Save(folder));
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
      if (entry.path().filename() == "shares.bin") fs::resize_file(entry.path(), 12);
    }
    QSignalSpy opened(&controller(), &SceneController::opened);
    window_->files().OpenSession(folder);
    QVERIFY(Opened(opened));
    QCOMPARE(Regions().size(), size_t{1});
    const auto* badge = window_->findChild<QToolButton*>("warnings");
    QVERIFY(badge->isVisible());
    QVERIFY2(badge->toolTip().contains("shares.bin: truncated"), qPrintable(badge->toolTip()));
    // Whole again once it is saved.
    QVERIFY(Save(folder));
    opened.clear();
    window_->files().OpenSession(folder);
    QVERIFY(Opened(opened));
    QVERIFY(!badge->toolTip().contains("shares.bin"));
  }

  // Files of a program that crashed; process_test.cc makes one crash.
  void RecoveryIsOfferedOnce() {
    fs::remove_all(AutosaveDataFolder());
    QVERIFY(AddRegion("pot"));
    const fs::path saved = Fresh() / "saved.retint";
    QVERIFY(Save(saved));
    window_.reset();
    const auto leave = [&] {
      const fs::path left = AutosaveDataFolder() / "unsaved.autosave.retint";
      fs::create_directories(left.parent_path());
      fs::copy(saved, left, fs::copy_options::recursive);
      return left;
    };
    const auto start = [&] {
      window_ = std::make_unique<MainWindow>(theme_.get());
      window_->show();
      window_->files().Start({});
      return WaitDialog(*window_) != nullptr;
    };
    const fs::path left = leave();
    QVERIFY(start());
    QVERIFY(window_->dialogs().box()->text().contains("1 region"));
    QVERIFY(ClickRole(*window_, QMessageBox::RejectRole));  // later
    QVERIFY(fs::exists(left) && !controller().IsOpen());
    QVERIFY(start());
    QVERIFY(ClickRole(*window_, QMessageBox::DestructiveRole));  // thrown away
    QTRY_VERIFY(!fs::exists(left));
    QVERIFY(!controller().IsOpen());
    leave();
    // Asked for the scene that it belongs to, it is offered; for another one it is not.
    StartOptions options;
    options.scene = scene_->Request();
    window_ = std::make_unique<MainWindow>(theme_.get());
    window_->show();
    window_->files().Start(options);
    QVERIFY(WaitDialog(*window_) && !controller().IsOpen());
    QVERIFY(ClickRole(*window_, QMessageBox::RejectRole));
    QTRY_VERIFY_WITH_TIMEOUT(controller().IsOpen(), kWaitMs);
    QVERIFY(Regions().empty());
    const fs::path other = Fresh() / "other.ply";
    fs::copy_file(scene_->workspace() / "splat.ply", other);
    options.scene.splat = other;
    window_ = std::make_unique<MainWindow>(theme_.get());
    window_->show();
    window_->files().Start(options);
    QTRY_VERIFY_WITH_TIMEOUT(controller().IsOpen(), kWaitMs);
    QVERIFY(!window_->dialogs().box());
    QVERIFY(start());
    QSignalSpy opened(&controller(), &SceneController::opened);
    QVERIFY(ClickRole(*window_, QMessageBox::AcceptRole));
    QVERIFY(Opened(opened));
    QCOMPARE(Regions().size(), size_t{1});
    QVERIFY(window_->IsModified());  // it was never saved
    // Once it is, nothing is left to recover.
    QVERIFY(Save(Fresh() / "recovered.retint"));
    QTRY_VERIFY(!fs::exists(left));
  }

  // An autosave that was recovered is not a document, whatever number its name has.
  void WorkIsStillUnsavedAfterASecondRecovery() {
    fs::remove_all(AutosaveDataFolder());
    QVERIFY(AddRegion("pot"));
    const fs::path saved = Fresh() / "saved.retint";
    QVERIFY(Save(saved));
    window_.reset();
    const fs::path left = AutosaveDataFolder() / "untitled.autosave-2.retint";
    fs::create_directories(left.parent_path());
    fs::copy(saved, left, fs::copy_options::recursive);
    window_ = std::make_unique<MainWindow>(theme_.get());
    window_->show();
    window_->controller().colors().SetAutomaticRefit(false);
    window_->files().Start({});
    QSignalSpy opened(&controller(), &SceneController::opened);
    QVERIFY(ClickRole(*window_, QMessageBox::AcceptRole));
    QVERIFY(Opened(opened));
    QCOMPARE(Regions().size(), size_t{1});
    QVERIFY(window_->IsModified());
    QVERIFY2(!window_->windowTitle().contains("autosave"), qPrintable(window_->windowTitle()));
    for (QAction* entry : Recent()) QVERIFY(!entry->text().contains("autosave"));
    // Ctrl+S asks where, Ctrl+Q whether.
    int came = 0;
    CancelFileDialog(&came);
    PressKey(*window_, Qt::Key_S, Qt::ControlModifier);
    QTRY_COMPARE_WITH_TIMEOUT(came, 1, kWaitMs);
    PressKey(*window_, Qt::Key_Q, Qt::ControlModifier);
    QVERIFY(WaitDialog(*window_));
    QVERIFY(window_->dialogs().box()->informativeText().contains("not been saved"));
    QVERIFY(ClickRole(*window_, QMessageBox::RejectRole));
    QTRY_VERIFY(!window_->dialogs().box());
    // A further edit is in an autosave of its own, which then is the only one.
    controller().Do(RenameRegion{Regions().front().id, "petals"});
    QTRY_VERIFY_WITH_TIMEOUT(!fs::exists(left), kWaitMs);
    const auto folder = window_->sessions().autosave()->folder();
    QVERIFY(fs::exists(folder / "session.json"));
    QVERIFY(Save(Fresh() / "recovered.retint"));
    QTRY_VERIFY(!HasAutosave());
  }

  void ARelativeSessionIsKeptWhole() {
    QVERIFY(AddRegion("pot"));
    const fs::path folder = Fresh(), elsewhere = Fresh();
    QVERIFY(Save(folder / "work.retint"));
    const fs::path before = fs::current_path();
    fs::current_path(folder);
    QSignalSpy opened(&controller(), &SceneController::opened);
    window_->files().OpenSession("work.retint");
    QVERIFY(Opened(opened));
    fs::current_path(elsewhere);
    controller().Do(RenameRegion{Regions().front().id, "petals"});
    QSignalSpy saved(&window_->sessions(), &SessionStore::saved);
    PressKey(*window_, Qt::Key_S, Qt::ControlModifier);
    QTRY_COMPARE_WITH_TIMEOUT(saved.count(), 1, kWaitMs);
    QVERIFY(fs::is_empty(elsewhere));
    const auto manifest = nlohmann::json::parse(ReadFile(folder / "work.retint" / "session.json"));
    QCOMPARE(manifest["regions"][0]["name"].get<std::string>(), std::string("petals"));
    // And opens again from anywhere.
    opened.clear();
    QVERIFY(Recent().front()->text().contains("work.retint"));
    Recent().front()->trigger();
    QVERIFY(Opened(opened));
    fs::current_path(before);
  }

  void AnAutosaveThatFailsIsSaidAndTriedAgain() {
    fs::remove_all(AutosaveDataFolder());
    {
      const FileSizeLimit full(200);
      QVERIFY(AddRegion("pot"));
      const QString error = ReadError(*window_);
      QVERIFY2(error.contains("autosave.retint"), qPrintable(error));
      controller().Do(SetVisible{Regions().front().id, false});
      QTest::qWait(3000);
      // Said once.
      if (window_->dialogs().box()) QFAIL(qPrintable(window_->dialogs().box()->informativeText()));
    }
    QVERIFY(!HasAutosave());
    QTRY_VERIFY_WITH_TIMEOUT(HasAutosave(), kWaitMs);  // by itself
  }
};

}  // namespace retint

QTEST_MAIN(retint::SessionsTest)
#include "sessions_test.moc"
