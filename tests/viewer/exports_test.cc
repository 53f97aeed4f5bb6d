// SPDX-License-Identifier: BSD-3-Clause
// All outputs of the Export menu, and failures to write them.
#include <cstring>

#include <QCheckBox>
#include <QComboBox>
#include <QLabel>
#include <QLocale>
#include <QProgressBar>
#include <QPushButton>
#include <QSpinBox>
#include <QStandardPaths>
#include <QToolButton>
#include <nlohmann/json.hpp>

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "splat_io/splat_io.h"
#include "tests/support/file_size_limit.h"
#include "tests/viewer/files_fixture.h"
#include "viewer/panels/splat_formats.h"
#include "viewer/scene/video_maker.h"

namespace retint {

class ExportsTest : public FilesFixture {
  Q_OBJECT

 private Q_SLOTS:
  void initTestCase() { MakeScene(); }
  void cleanupTestCase() { scene_.reset(); }
  void init() { QVERIFY(ShowScene()); }
  void cleanup() { EndCase(); }

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
    QSignalSpy written(&controller().results(), &SceneResults::written);
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
      QTRY_VERIFY(!window_->dialogs().box());
      QVERIFY(Settle(controller()));
      QCOMPARE(ReadFile(file), std::string("precious"));
      ExportTo(entry, file.parent_path());
      QVERIFY(ClickRole(*window_, QMessageBox::DestructiveRole));
      QTRY_COMPARE_WITH_TIMEOUT(written.count(), 2, kWaitMs);
      QVERIFY(ReadFile(file) != "precious");
      QTRY_VERIFY(!window_->dialogs().box());
    }
    QCOMPARE(proposed(1).parent_path(), folder);
    // Frames of a longer turn before would be in the film.
    fs::create_directories(folder / "turn");
    WriteFile(folder / "turn" / "0777.png", "old");
    ExportTo(4, folder / "turn");
    QVERIFY(WaitDialog(*window_));
    QVERIFY(ClickRole(*window_, QMessageBox::RejectRole));
    QTRY_VERIFY(!window_->dialogs().box());
    QVERIFY(Settle(controller()));
    QVERIFY(!fs::exists(folder / "turn" / "0000.png"));
  }

  // Also where the name was typed without its ending.
  void AFileIsNotReplacedWithoutAsking() {
    QVERIFY(AddRegion("pot"));
    const fs::path folder = Fresh();
    QSignalSpy written(&controller().results(), &SceneResults::written);
    const std::pair<int, const char*> cases[] = {{0, ".ply"}, {3, ".html"}, {5, ".png"}};
    for (const auto& [entry, ending] : cases) {
      const fs::path file = folder / (std::string("out") + ending);
      WriteFile(file, "precious");
      for (const fs::path& typed : {folder / "out", file}) {
        AnswerFileDialog(typed);
        Export(entry);
        const QMessageBox* box = WaitDialog(*window_);
        QVERIFY2(box && box->informativeText().contains(file.filename().c_str()), ending);
        QVERIFY(ClickRole(*window_, QMessageBox::RejectRole));
        QTRY_VERIFY(!window_->dialogs().box());
        QVERIFY(Settle(controller()));
        QCOMPARE(ReadFile(file), std::string("precious"));
      }
      written.clear();
      AnswerFileDialog(folder / "out");
      Export(entry);
      QVERIFY(ClickRole(*window_, QMessageBox::DestructiveRole));
      QTRY_COMPARE_WITH_TIMEOUT(written.count(), 1, kWaitMs);
      QVERIFY(ReadFile(file) != "precious");
      QTRY_VERIFY(!window_->dialogs().box());
    }
  }

  void BeforeAndAfterAreOnePicture() {
    QVERIFY(AddRegion("pot"));
    QTRY_VERIFY_WITH_TIMEOUT(!controller().colors().ShowsOriginal(), kWaitMs);
    QVERIFY(canvas().GoTo(scene_->MostVisible().first));
    const PosedCamera camera = canvas().navigation().Rendered();
    QSignalSpy written(&controller().results(), &SceneResults::written);
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
    renderer.SetSh(*controller().colors().sh());
    const QImage after = ToQImage(renderer.Render(camera).rgb);
    QVERIFY(ChangedPixels(before, after) > 100);
    QCOMPARE(ChangedPixels(both.copy(0, 0, width, height), before), int64_t{0});
    QCOMPARE(ChangedPixels(both.copy(both.width() - width, 0, width, height), after), int64_t{0});
  }

  // Solo is a way of looking, not an edit: outputs have every region.
  void SoloLeavesNothingOutOfAnExport() {
    const RegionId jug = AddTintedRegion();
    QVERIFY(jug != 0);
    QSignalSpy added(&controller(), &SceneController::regionAdded);
    AddRegionFromMasks(controller(), "other", scene_->Masks(scene_->scene().still_life.back()),
                       ColorEdit::Tint({0.9F, 0.1F, 0.1F}));
    QTRY_COMPARE_WITH_TIMEOUT(added.count(), 1, kWaitMs);
    const auto colors = std::make_shared<FloatArray>();
    controller().Run(
        {}, [=](EditSession& session, Monitor&) { *colors = session.refits().CurrentSh(); });
    QVERIFY(Settle(controller()));
    controller().SetSolo(jug);
    QTRY_VERIFY_WITH_TIMEOUT(*controller().colors().sh() != *colors, kWaitMs);
    const std::string name = scene_->MostVisible().first;
    const auto facts = controller().facts();
    const PosedCamera camera = facts->Posed(*facts->workspace->reconstruction.FindView(name));
    Renderer renderer(facts->backend, *facts->original);
    renderer.SetSh(*colors);
    const QImage both = ToQImage(renderer.Render(camera).rgb);
    renderer.SetSh(*controller().colors().sh());
    QVERIFY(ChangedPixels(both, ToQImage(renderer.Render(camera).rgb)) > 100);
    const fs::path folder = Fresh();
    QSignalSpy written(&controller().results(), &SceneResults::written);
    controller().results().WriteViews(folder / "views", {name});
    controller().results().WriteFrames(folder / "turn", {camera});
    controller().results().WriteComparison(folder / "both.png", camera);
    QTRY_COMPARE_WITH_TIMEOUT(written.count(), 3, kWaitMs);
    const auto read = [](const fs::path& path) { return ToQImage(ReadImage8(path)); };
    QCOMPARE(ChangedPixels(read(folder / "views" / (name + ".png")), both), int64_t{0});
    QCOMPARE(ChangedPixels(read(folder / "turn" / "0000.png"), both), int64_t{0});
    const QImage pair = read(folder / "both.png");
    const QImage right = pair.copy(pair.width() - both.width(), 0, both.width(), both.height());
    QCOMPARE(ChangedPixels(right, both), int64_t{0});
  }

  // By a program named ffmpeg, which only writes down its arguments here.
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
      dialog->findChild<QComboBox*>("export_size")->setCurrentIndex(1);
      dialog->findChild<QDoubleSpinBox*>("export_seconds")->setValue(0.2);
      dialog->findChild<QSpinBox*>("export_rate")->setValue(15);
      QCOMPARE(dialog->findChild<QLabel*>("export_count")->text(), QString("3 pictures"));
      Keep(*dialog, "turntable");
      dialog->findChild<QLineEdit*>("export_folder")->setText(QString::fromStdString(to.string()));
      QTest::mouseClick(dialog->findChild<QPushButton*>("export_write"), Qt::LeftButton);
    };
    const fs::path first = folder / "50 % turn";
    turn(first);
    QTRY_VERIFY_WITH_TIMEOUT(fs::exists(first / "turntable.mp4"), kWaitMs);
    const std::string asked = ReadFile(first / "turntable.mp4");
    QVERIFY2(asked.find("50 %% turn/%04d.png") != std::string::npos, asked.c_str());
    QVERIFY2(asked.find("-pix_fmt yuv420p") != std::string::npos, asked.c_str());
    QVERIFY2(asked.find("-framerate 15") != std::string::npos, asked.c_str());
    QVERIFY(fs::exists(first / "0002.png") && !fs::exists(first / "0003.png"));
    QCOMPARE(ReadImage8(first / "0001.png").width, 1280);
    QCOMPARE(ReadImage8(first / "0001.png").height, 720);
    // Its error is shown, and no partial file stays.
    install("for last; do :; done; echo half > \"$last\"; echo no such encoder; exit 1\n");
    turn(folder / "second");
    const QString error = ReadError(*window_);
    QVERIFY2(error.contains("no such encoder"), qPrintable(error));
    QVERIFY(fs::exists(folder / "second" / "0002.png"));
    for (const auto& entry : fs::directory_iterator(folder / "second")) {
      QVERIFY2(entry.path().extension() == ".png", entry.path().c_str());
    }
    // One that is being made is not given up unasked.
    const fs::path may_end = programs / "may_end";
    install(("while [ ! -e '" + may_end.string() +
             "' ]; do /bin/sleep 0.1; done; for last; do :; done; echo film > \"$last\"\n")
                .c_str());
    turn(folder / "long");
    QTRY_VERIFY_WITH_TIMEOUT(window_->findChild<VideoMaker*>()->IsBusy(), kWaitMs);
    PressKey(*window_, Qt::Key_Q, Qt::ControlModifier);
    const QMessageBox* box = WaitDialog(*window_);
    QVERIFY(box && box->informativeText().contains("video"));
    QVERIFY(ClickRole(*window_, QMessageBox::RejectRole));
    QTRY_VERIFY(!window_->dialogs().box());
    QVERIFY(window_->isVisible());
    // Nor are its frames replaced.
    turn(folder / "long");
    const QString refused = ReadError(*window_);
    QVERIFY2(refused.contains("long is still being made"), qPrintable(refused));
    // The next one is made after it.
    const fs::path third = folder / "third";
    turn(third);
    auto* message = window_->findChild<QLabel*>("message");
    QTRY_VERIFY_WITH_TIMEOUT(message->text().contains("after the video before"), kWaitMs);
    QVERIFY(!fs::exists(third / "turntable.mp4"));
    WriteFile(may_end, "");
    QTRY_VERIFY_WITH_TIMEOUT(fs::exists(third / "turntable.mp4"), kWaitMs);
    QCOMPARE(ReadFile(folder / "long" / "turntable.mp4"), std::string("film\n"));
    QVERIFY(fs::exists(folder / "long" / "0002.png"));
    // Without the program there are only the frames, and the dialog names the missing one.
    fs::remove(programs / "ffmpeg");
    qputenv("PATH", QByteArray::fromStdString(programs.string()));
    QDialog* dialog = ExportDialogOf(4);
    const auto* video = dialog->findChild<QCheckBox*>("export_video");
    QVERIFY(!video->isEnabled() && video->toolTip().contains("ffmpeg"));
    dialog->reject();
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
    QTRY_VERIFY_WITH_TIMEOUT(!controller().colors().ShowsOriginal(), kWaitMs);
    QSignalSpy written(&controller().results(), &SceneResults::written);
    const fs::path out = Fresh() / "edited";
    AnswerFileDialog(out);
    PressKey(*window_, Qt::Key_E, Qt::ControlModifier);
    QTRY_COMPARE_WITH_TIMEOUT(written.count(), 1, kWaitMs);
    const GaussianModel edited = ReadSplat(out.string() + ".ply");
    QVERIFY(edited.means == controller().facts()->original->means);
    QVERIFY(edited.sh == *controller().colors().sh());
  }

  // A name of another format is neither written as it is nor given a second ending.
  void AnEndingOfNoFormatIsRefused() {
    const fs::path folder = Fresh();
    AnswerFileDialog(folder / "out.xyz");
    PressKey(*window_, Qt::Key_E, Qt::ControlModifier);
    const QString error = ReadError(*window_);
    QVERIFY2(error.contains("cannot be written as .xyz") && error.contains(".ply"),
             qPrintable(error));
    QVERIFY(fs::is_empty(folder));
  }

  void FormatsHaveSizes() {
    const auto formats = ExportFormats(*controller().facts()->original);
    QVERIFY(formats.size() > 4);
    for (const ExportFormat& format : formats) {
      QVERIFY2(format.filter.contains(", about "), qPrintable(format.filter));
      qInfo("%s", qPrintable(format.filter));
      QString problem;
      QCOMPARE(NamedForExport("/a/b.2", format.filter, formats, &problem),
               "/a/b.2" + format.extension);
    }
    // The size of one is told beforehand as it comes out: a PLY file's is all rows.
    const fs::path out = Fresh() / "out.ply";
    WriteSplat(out, *controller().facts()->original);
    const QString size =
        QLocale().formattedDataSize(qint64(fs::file_size(out)), 1, QLocale::DataSizeSIFormat);
    const auto ply = std::ranges::find(formats, QString(".ply"), &ExportFormat::extension);
    QVERIFY(ply != formats.end());
    QVERIFY2(ply->filter.contains(", about " + size), qPrintable(ply->filter + " " + size));
  }

  void AnExportCanBeCancelled() {
    const fs::path folder = Fresh();
    QSignalSpy progress(&controller(), &SceneController::progress);
    QSignalSpy cancelled(&controller(), &SceneController::cancelled);
    Export(4);
    auto* dialog = window_->findChild<QDialog*>("export_dialog");
    QVERIFY(dialog && dialog->isVisible());
    dialog->findChild<QDoubleSpinBox*>("export_seconds")
        ->setValue(3000);  // more than anyone waits for
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

  // Existing files stay, partial ones do not, and work continues.
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
    controller().Do(SetEdit{Regions().front().id, ColorEdit::Tint({0.9F, 0.1F, 0.1F})});
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
      QVERIFY(ClickRole(*window_, QMessageBox::DestructiveRole));
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

  void MasksAndReportAreExportedFromTheMenu() {
    const fs::path folder = Fresh();
    Export(1);  // no region yet
    QVERIFY(ReadError(*window_).contains("Choose a region"));
    QVERIFY(AddRegion("pot"));
    QSignalSpy written(&controller().results(), &SceneResults::written);
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
    // A name without an extension means the dialog's first format, the page.
    AnswerFileDialog(folder / "page");
    Export(3);
    QTRY_COMPARE_WITH_TIMEOUT(written.count(), 3, kWaitMs);
    const std::string page = ReadFile(folder / "page.html");
    QVERIFY(page.find("<html") != std::string::npos && page.find("pot") != std::string::npos);
  }
};

}  // namespace retint

QTEST_MAIN(retint::ExportsTest)
#include "exports_test.moc"
