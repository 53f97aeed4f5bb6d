// SPDX-License-Identifier: BSD-3-Clause
// Files by menu, key and drop: opening, recent files, sessions good and bad, recovery, exports.
#include <cstring>
#include <fstream>
#include <limits>

#include <QAction>
#include <QCheckBox>
#include <QDialogButtonBox>
#include <QDir>
#include <QLabel>
#include <QMenu>
#include <QProgressBar>
#include <QPushButton>
#include <QSpinBox>
#include <QStandardPaths>
#include <QToolButton>
#include <nlohmann/json.hpp>

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "session/autosave.h"
#include "splat_io/splat_io.h"
#include "tests/support/file_size_limit.h"
#include "tests/viewer/viewer_scene.h"
#include "viewer/session_store.h"

namespace retint {

namespace fs = std::filesystem;

class FilesTest : public ViewerTest {
  Q_OBJECT

 private:
  int folders_ = 0;

  const std::vector<Region>& Regions() { return controller().regions().regions; }
  fs::path Fresh() {
    const fs::path folder = scene_->folder() / ("case" + std::to_string(folders_++));
    fs::create_directories(folder);
    return folder;
  }

  bool AddRegion(const char* name) {
    QSignalSpy added(&controller(), &SceneController::regionAdded);
    controller().AddRegionFromMasks(name, scene_->Masks(scene_->MostVisible().object),
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

 private Q_SLOTS:
  void initTestCase() { MakeScene(); }
  void cleanupTestCase() { scene_.reset(); }
  void init() { QVERIFY(ShowScene()); }
  void cleanup() {
    window_.reset();
    QSettings().remove("recent");
  }

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
    QVERIFY(!window_->dialog());
    QCOMPARE(dialog->findChild<QLineEdit*>("workspace")->text(),
             QString::fromStdString(bad.string()));
    QVERIFY(dialog->findChild<QLabel*>("open_problem")->text().contains("splat.ply"));
    // What was wrong is put right, in the same form.
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
    // It begins with what is open.
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
    // One that is gone is a complaint, not a crash, and what is open stays.
    fs::remove_all(folder);
    for (QAction* entry : Recent()) {
      if (entry->text().endsWith("work.retint")) session = entry;
    }
    session->trigger();
    QVERIFY(ReadError(*window_).contains("work.retint"));
    QCOMPARE(Regions().size(), size_t{1});
  }

  void RecentScenesKeepTheirOptions() {
    const fs::path photos = Fresh() / "photos";
    fs::copy(scene_->workspace() / "images", photos);
    OpenRequest request = scene_->Request();
    request.options.image_folder = photos;
    request.options.holdout = 3;
    QSignalSpy opened(&controller(), &SceneController::opened);
    window_->OpenScene(request);
    QVERIFY(Opened(opened));
    const size_t heldout = controller().facts()->heldout.size();
    QVERIFY(heldout > 0);
    // Another scene comes between.
    const fs::path other = Fresh() / "other.ply";
    fs::copy_file(scene_->workspace() / "splat.ply", other);
    OpenRequest second = scene_->Request();
    second.splat = other;
    opened.clear();
    window_->OpenScene(second);
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
    window_->OpenScene(scene_->Request());
    QVERIFY(Opened(opened));
    int same = 0;
    for (QAction* entry : Recent()) same += entry->text().endsWith("workspace/splat.ply");
    QCOMPARE(same, 1);
  }

  void SessionsAndSplatsAreDropped() {
    QVERIFY(AddRegion("pot"));
    const fs::path folder = Fresh() / "dropped.retint";
    QVERIFY(Save(folder));
    QSignalSpy opened(&controller(), &SceneController::opened);
    QVERIFY(Drop(*window_, folder));
    QVERIFY(Opened(opened));
    QCOMPARE(Regions().size(), size_t{1});
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
    controller().Rename(Regions().front().id, "petals");
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

  void ClosingOffersToSave() {
    QVERIFY(AddRegion("pot"));
    const fs::path folder = Fresh() / "closing.retint";
    PressKey(*window_, Qt::Key_Q, Qt::ControlModifier);
    QVERIFY(WaitDialog(*window_));
    QVERIFY(window_->dialog()->informativeText().contains("not been saved"));
    QVERIFY(ClickRole(*window_, QMessageBox::RejectRole));
    QVERIFY(window_->isVisible());
    QTRY_VERIFY(!window_->dialog());
    PressKey(*window_, Qt::Key_Q, Qt::ControlModifier);
    AnswerFileDialog(folder);
    QVERIFY(ClickRole(*window_, QMessageBox::AcceptRole));
    QTRY_VERIFY_WITH_TIMEOUT(!window_->isVisible(), kWaitMs);
    QCOMPARE(ReadSessionInfo(folder).regions, size_t{1});
  }

  void BackingOutOfSavingStopsNothing() {
    QVERIFY(AddRegion("pot"));
    RefitJob job;
    job.options.solver = Solver::kAdam;
    job.options.adam.iterations = 1000000;
    controller().SetRefitJob(job);
    controller().StartRefit();
    QTRY_VERIFY_WITH_TIMEOUT(controller().optimizer().steps > 0, kWaitMs);
    PressKey(*window_, Qt::Key_Q, Qt::ControlModifier);
    QVERIFY(WaitDialog(*window_));
    int came = 0;
    CancelFileDialog(&came);
    QVERIFY(ClickRole(*window_, QMessageBox::AcceptRole));
    QTRY_COMPARE_WITH_TIMEOUT(came, 1, kWaitMs);
    QVERIFY(Settle(controller()));
    QVERIFY(window_->isVisible() && controller().optimizer().Active());
    const int steps = controller().optimizer().steps;
    QTRY_VERIFY_WITH_TIMEOUT(controller().optimizer().steps > steps, kWaitMs);
    controller().CancelRefit();
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
    window_->OpenSession(garbled);
    QVERIFY(ReadError(*window_).contains("garbled.retint"));
    const fs::path newer = copy("newer.retint");
    auto manifest = nlohmann::json::parse(ReadFile(newer / "session.json"));
    manifest["version"] = 99;
    std::ofstream(newer / "session.json") << manifest.dump();
    window_->OpenSession(newer);
    QVERIFY(ReadError(*window_).contains("99"));
    const fs::path torn = copy("torn.retint");
    for (const auto& entry : fs::recursive_directory_iterator(torn)) {
      if (entry.path().filename() == "shares.bin") fs::resize_file(entry.path(), 12);
    }
    window_->OpenSession(torn);
    QVERIFY(ReadError(*window_).contains("shares.bin"));
    // The splat that was edited is not the one that is there now.
    const fs::path moved = copy("moved.retint");
    manifest = nlohmann::json::parse(ReadFile(moved / "session.json"));
    const fs::path other = Fresh() / "other.ply";
    GaussianModel model = ReadSplat(scene_->workspace() / "splat.ply");
    model.sh[0] += 1;
    WriteSplat(other, model);
    manifest["splat"]["absolute"] = manifest["splat"]["relative"] = other.string();
    std::ofstream(moved / "session.json") << manifest.dump();
    window_->OpenSession(moved);
    QVERIFY(ReadError(*window_).contains("other.ply"));
    QCOMPARE(controller().facts(), facts);
    QCOMPARE(Regions().size(), size_t{1});
  }

  void BadScenesAreExplained_data() {
    QTest::addColumn<QString>("fault");
    QTest::addColumn<QString>("named");
    for (const auto& [fault, named] :
         {std::pair("cut cameras", "cameras.bin"), std::pair("cut images", "images.bin"),
          std::pair("cut points", "points3D.bin"), std::pair("cut splat", "splat.ply"),
          std::pair("NaN in the splat", "splat.ply"), std::pair("text as a splat", "splat.ply"),
          std::pair("distorted camera", "image_undistorter"),
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
    // SIMPLE_RADIAL has four parameters, as PINHOLE.
    if (fault == "distorted camera") overwrite(model / "cameras.bin", kCameraModel, int32_t{2});
    if (fault == "unknown camera model") {
      overwrite(model / "cameras.bin", kCameraModel, int32_t{77});
    }
    const auto facts = controller().facts();
    QVERIFY(Drop(*window_, bad));
    const QString error = ReadError(*window_);
    QVERIFY2(error.contains(named), qPrintable(error));
    // The window goes on with what was open, and opens what is good.
    QVERIFY(controller().facts() == facts && !controller().IsBusy());
    PressKey(*window_, Qt::Key_Right);
    QCOMPARE(canvas().navigation().view(), facts->views[1]);
    QVERIFY(WaitSharp(*window_));
    QSignalSpy opened(&controller(), &SceneController::opened);
    QVERIFY(Drop(*window_, scene_->workspace()));
    QVERIFY(Opened(opened));
  }

  // What a program that died left behind; process_test.cc has one die.
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
      window_->Start({});
      return WaitDialog(*window_) != nullptr;
    };
    const fs::path left = leave();
    QVERIFY(start());
    QVERIFY(window_->dialog()->text().contains("1 region"));
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
    window_->Start(options);
    QVERIFY(WaitDialog(*window_) && !controller().IsOpen());
    QVERIFY(ClickRole(*window_, QMessageBox::RejectRole));
    QTRY_VERIFY_WITH_TIMEOUT(controller().IsOpen(), kWaitMs);
    QVERIFY(Regions().empty());
    const fs::path other = Fresh() / "other.ply";
    fs::copy_file(scene_->workspace() / "splat.ply", other);
    options.scene.splat = other;
    window_ = std::make_unique<MainWindow>(theme_.get());
    window_->show();
    window_->Start(options);
    QTRY_VERIFY_WITH_TIMEOUT(controller().IsOpen(), kWaitMs);
    QVERIFY(!window_->dialog());
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
    window_->controller().SetAutomaticRefit(false);
    window_->Start({});
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
    QVERIFY(window_->dialog()->informativeText().contains("not been saved"));
    QVERIFY(ClickRole(*window_, QMessageBox::RejectRole));
    QTRY_VERIFY(!window_->dialog());
    // A further edit is in an autosave of its own, which then is the only one.
    controller().Rename(Regions().front().id, "petals");
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
    window_->OpenSession("work.retint");
    QVERIFY(Opened(opened));
    fs::current_path(elsewhere);
    controller().Rename(Regions().front().id, "petals");
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

  void NothingIsReplacedWithoutAsking() {
    QSettings().remove("output_folder");
    QVERIFY(AddRegion("pot"));
    // Proposed beside the workspace, not in it; later where one wrote last.
    const auto proposed = [&](int entry) {
      QDialog* dialog = ExportDialogOf(entry);
      const QString path = dialog->findChild<QLineEdit*>("export_folder")->text();
      dialog->reject();
      return fs::path(path.toStdString());
    };
    for (const int entry : {1, 2, 4}) {
      QCOMPARE(proposed(entry).parent_path(), scene_->workspace().parent_path());
      QVERIFY(!fs::exists(proposed(entry)));
    }
    const fs::path folder = Fresh();
    QSignalSpy written(&controller(), &SceneController::written);
    const std::string name = scene_->scene().views.front().name + ".png";
    const std::pair<int, fs::path> cases[] = {{1, folder / "masks" / name},
                                              {2, folder / "views" / name}};
    for (const auto& [entry, file] : cases) {
      written.clear();
      ExportTo(entry, file.parent_path());
      QTRY_COMPARE_WITH_TIMEOUT(written.count(), 1, kWaitMs);  // a new folder: nothing to ask
      WriteFile(file, "precious");
      ExportTo(entry, file.parent_path());
      const QMessageBox* box = WaitDialog(*window_);
      QVERIFY(box && box->informativeText().contains(QString::fromStdString(name)));
      QVERIFY(box->defaultButton() == box->button(QMessageBox::Cancel));
      QVERIFY(ClickRole(*window_, QMessageBox::RejectRole));
      QTRY_VERIFY(!window_->dialog());
      QVERIFY(Settle(controller()));
      QCOMPARE(ReadFile(file), std::string("precious"));
      ExportTo(entry, file.parent_path());
      QVERIFY(ClickRole(*window_, QMessageBox::DestructiveRole));
      QTRY_COMPARE_WITH_TIMEOUT(written.count(), 2, kWaitMs);
      QVERIFY(ReadFile(file) != "precious");
      QTRY_VERIFY(!window_->dialog());
    }
    QCOMPARE(proposed(1).parent_path(), folder);
    // Frames of a longer turn before would be in the film.
    fs::create_directories(folder / "turn");
    WriteFile(folder / "turn" / "0777.png", "old");
    ExportTo(4, folder / "turn");
    QVERIFY(WaitDialog(*window_));
    QVERIFY(ClickRole(*window_, QMessageBox::RejectRole));
    QTRY_VERIFY(!window_->dialog());
    QVERIFY(Settle(controller()));
    QVERIFY(!fs::exists(folder / "turn" / "0000.png"));
  }

  void BeforeAndAfterAreOnePicture() {
    QVERIFY(AddRegion("pot"));
    QTRY_VERIFY_WITH_TIMEOUT(!controller().ShowsOriginal(), kWaitMs);
    QVERIFY(canvas().GoTo(scene_->MostVisible().first));
    const PosedCamera camera = canvas().navigation().Rendered();
    QSignalSpy written(&controller(), &SceneController::written);
    const fs::path path = Fresh() / "both.png";
    AnswerFileDialog(path);
    Export(5);
    QTRY_COMPARE_WITH_TIMEOUT(written.count(), 1, kWaitMs);
    const QImage both = ToQImage(ReadImage8(path));
    const int width = camera.camera.width, height = camera.camera.height;
    QCOMPARE(both.height(), height);
    QVERIFY(both.width() >= 2 * width);
    const auto facts = controller().facts();
    Renderer renderer(facts->backend, *facts->original);
    const QImage before = ToQImage(renderer.Render(camera).rgb);
    renderer.SetSh(*controller().sh());
    const QImage after = ToQImage(renderer.Render(camera).rgb);
    QVERIFY(ChangedPixels(before, after) > 100);
    QCOMPARE(ChangedPixels(both.copy(0, 0, width, height), before), int64_t{0});
    QCOMPARE(ChangedPixels(both.copy(both.width() - width, 0, width, height), after), int64_t{0});
  }

  // By a program of the name ffmpeg, which here writes down what it was asked for.
  void ATurntableBecomesAVideoWhereFfmpegIs() {
    const fs::path folder = Fresh(), programs = Fresh();
    const auto install = [&](const char* script) {
      WriteFile(programs / "ffmpeg", std::string("#!/bin/sh\n") + script);
      fs::permissions(programs / "ffmpeg", fs::perms::owner_all);
    };
    const QByteArray path = qgetenv("PATH");
    qputenv("PATH", QByteArray::fromStdString(programs.string()) + ":/usr/bin:/bin");
    install("for last; do :; done; echo \"$@\" > \"$last\"; exit 0\n");
    const auto turn = [&](const fs::path& to) {
      QDialog* dialog = ExportDialogOf(4);
      auto* video = dialog->findChild<QCheckBox*>("export_video");
      QVERIFY(video->isEnabled() && !video->isChecked());
      video->click();
      dialog->findChild<QSpinBox*>("export_frames")->setValue(3);
      dialog->findChild<QLineEdit*>("export_folder")->setText(QString::fromStdString(to.string()));
      QTest::mouseClick(dialog->findChild<QPushButton*>("export_write"), Qt::LeftButton);
    };
    const fs::path first = folder / "50 % turn";
    turn(first);
    QTRY_VERIFY_WITH_TIMEOUT(fs::exists(first / "turntable.mp4"), kWaitMs);
    const std::string asked = ReadFile(first / "turntable.mp4");
    QVERIFY2(asked.find("50 %% turn/%04d.png") != std::string::npos, asked.c_str());
    QVERIFY2(asked.find("-pix_fmt yuv420p") != std::string::npos, asked.c_str());
    QVERIFY(fs::exists(first / "0002.png"));
    // What it complains of is shown, and nothing half-made stays.
    install("for last; do :; done; echo half > \"$last\"; echo no such encoder; exit 1\n");
    turn(folder / "second");
    const QString error = ReadError(*window_);
    QVERIFY2(error.contains("no such encoder"), qPrintable(error));
    QVERIFY(fs::exists(folder / "second" / "0002.png"));
    for (const auto& entry : fs::directory_iterator(folder / "second")) {
      QVERIFY2(entry.path().extension() == ".png", entry.path().c_str());
    }
    fs::remove(programs / "ffmpeg");
    if (QStandardPaths::findExecutable("ffmpeg").isEmpty()) {
      QDialog* dialog = ExportDialogOf(4);
      QVERIFY(!dialog->findChild<QCheckBox*>("export_video")->isEnabled());
      dialog->reject();
    }
    qputenv("PATH", path);
  }

  void ExportDialogsHaveKeysAndADefault() {
    QVERIFY(AddRegion("pot"));
    for (const int entry : {1, 2, 4}) {
      QDialog* dialog = ExportDialogOf(entry);
      QVERIFY(dialog && dialog->isVisible());
      QVERIFY(dialog->findChild<QPushButton*>("export_write")->isDefault());
      Keep(*dialog, qPrintable(QString("export%1").arg(entry)));
      // A label shows its key as a line below the letter where it knows the control.
      for (auto* label : dialog->findChildren<QLabel*>()) {
        QVERIFY2(!label->text().contains('&') || label->buddy(), qPrintable(label->text()));
      }
      dialog->reject();
    }
  }

  void TheSplatIsExportedByKey() {
    QVERIFY(AddRegion("pot"));
    QTRY_VERIFY_WITH_TIMEOUT(!controller().ShowsOriginal(), kWaitMs);
    QSignalSpy written(&controller(), &SceneController::written);
    const fs::path out = Fresh() / "edited";
    AnswerFileDialog(out);
    PressKey(*window_, Qt::Key_E, Qt::ControlModifier);
    QTRY_COMPARE_WITH_TIMEOUT(written.count(), 1, kWaitMs);
    const GaussianModel edited = ReadSplat(out.string() + ".ply");
    QVERIFY(edited.means == controller().facts()->original->means);
    QVERIFY(edited.sh == *controller().sh());
  }

  void AnExportCanBeCancelled() {
    const fs::path folder = Fresh();
    QSignalSpy progress(&controller(), &SceneController::progress);
    QSignalSpy cancelled(&controller(), &SceneController::cancelled);
    Export(4);
    auto* dialog = window_->findChild<QDialog*>("export_dialog");
    QVERIFY(dialog && dialog->isVisible());
    dialog->findChild<QSpinBox*>("export_frames")->setValue(100000);  // more than anyone waits for
    dialog->findChild<QLineEdit*>("export_folder")
        ->setText(QString::fromStdString((folder / "turn").string()));
    QTest::mouseClick(dialog->findChild<QPushButton*>("export_write"), Qt::LeftButton);
    QTRY_VERIFY_WITH_TIMEOUT(progress.count() > 3, kWaitMs);
    QVERIFY(window_->findChild<QProgressBar*>("progress")->isVisible());
    QVERIFY(window_->findChild<QLabel*>("message")->text().contains("Saving frames"));
    QTest::mouseClick(window_->findChild<QToolButton*>("cancel"), Qt::LeftButton);
    QTRY_COMPARE_WITH_TIMEOUT(cancelled.count(), 1, kWaitMs);
    QVERIFY(fs::is_empty(folder));
    QVERIFY(!controller().IsBusy());
  }

  // What is there already stays, nothing half-written does, and the work goes on.
  void AFullDiskIsExplainedAndLosesNothing() {
    QVERIFY(AddRegion("pot"));
    const fs::path folder = Fresh(), session = folder / "kept.retint", splat = folder / "kept.ply";
    QVERIFY(Save(session));
    WriteFile(splat, "precious");
    const auto listing = [&] {
      std::vector<std::pair<std::string, std::string>> files;
      for (const auto& entry : fs::recursive_directory_iterator(folder)) {
        files.emplace_back(entry.path().string(),
                           entry.is_regular_file() ? ReadFile(entry.path()) : "");
      }
      std::sort(files.begin(), files.end());
      return files;
    };
    controller().SetEdit(Regions().front().id, ColorEdit::Tint({0.9F, 0.1F, 0.1F}));
    // Its autosave is written while there is room: a complaint of another kind.
    QTRY_VERIFY_WITH_TIMEOUT(fs::exists(folder / "kept.autosave.retint" / "session.json"), kWaitMs);
    const auto before = listing();
    {
      const FileSizeLimit full(200);
      PressKey(*window_, Qt::Key_S, Qt::ControlModifier);
      QVERIFY(ReadError(*window_).contains("kept.retint"));
      QVERIFY(window_->isWindowModified());
      AnswerFileDialog(splat);
      PressKey(*window_, Qt::Key_E, Qt::ControlModifier);
      QVERIFY(ReadError(*window_).contains("kept.ply"));
      const auto names = [&](const fs::path& path) {
        const QString error = ReadError(*window_);
        return error.contains(QString::fromStdString(path.string()));
      };
      ExportTo(1, folder);
      QVERIFY(names(folder));
      AnswerFileDialog(folder / "report.json");
      Export(3);
      QVERIFY(names(folder / "report.json"));
    }
    QVERIFY(listing() == before);
    QSignalSpy saved(&window_->sessions(), &SessionStore::saved);
    PressKey(*window_, Qt::Key_S, Qt::ControlModifier);
    QTRY_COMPARE_WITH_TIMEOUT(saved.count(), 1, kWaitMs);
    QVERIFY(!window_->isWindowModified());
  }

  void AnAutosaveThatFailsIsSaidAndTriedAgain() {
    fs::remove_all(AutosaveDataFolder());
    {
      const FileSizeLimit full(200);
      QVERIFY(AddRegion("pot"));
      const QString error = ReadError(*window_);
      QVERIFY2(error.contains("autosave.retint"), qPrintable(error));
      controller().SetVisible(Regions().front().id, false);
      QTest::qWait(3000);
      // Said once.
      if (window_->dialog()) QFAIL(qPrintable(window_->dialog()->informativeText()));
    }
    QVERIFY(!HasAutosave());
    QTRY_VERIFY_WITH_TIMEOUT(HasAutosave(), kWaitMs);  // by itself
  }

  void MasksAndReportAreExportedFromTheMenu() {
    const fs::path folder = Fresh();
    Export(1);  // no region yet
    QVERIFY(ReadError(*window_).contains("Choose a region"));
    QVERIFY(AddRegion("pot"));
    QSignalSpy written(&controller(), &SceneController::written);
    ExportTo(1, folder / "masks");
    QTRY_COMPARE_WITH_TIMEOUT(written.count(), 1, kWaitMs);
    for (const auto& [name, mask] : scene_->Masks(scene_->MostVisible().object)) {
      QVERIFY(ReadMask(folder / "masks" / (name + ".png"), mask.width, mask.height).data ==
              mask.data);
    }
    AnswerFileDialog(folder / "report.json");
    Export(3);
    QTRY_COMPARE_WITH_TIMEOUT(written.count(), 2, kWaitMs);
    const auto report = nlohmann::json::parse(ReadFile(folder / "report.json"));
    QCOMPARE(report["views"].get<size_t>(), scene_->scene().views.size());
    QVERIFY(report.contains("quality") && report["regions"].size() == 1);
  }
};

}  // namespace retint

QTEST_MAIN(retint::FilesTest)
#include "files_test.moc"
