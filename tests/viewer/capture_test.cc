// SPDX-License-Identifier: BSD-3-Clause
// The whole workflow on real captures, in the real window, with mouse and keys: open, step to a
// view, paint, accept, tint while the preview follows, refit in the background, measure, export,
// save, undo, and restore.
#include <cstdlib>

#include <QPushButton>

#include "colmap_io/image_io.h"
#include "splat_io/splat_io.h"
#include "tests/viewer/viewer_scene.h"
#include "viewer/panels/color_picker.h"
#include "viewer/scene/session_store.h"
#include "viewer/selection/selection_mode.h"

namespace retint {

namespace fs = std::filesystem;

class CaptureTest : public QObject {
  Q_OBJECT

 private:
  QTemporaryDir folder_;

  // As tests/support/data.h, which is GoogleTest's.
  static fs::path Data() {
    const char* root = std::getenv("RETINT_DATA");
    return root ? fs::path(root) : fs::path(RETINT_SOURCE_DIR) / ".." / "shared" / "data";
  }

 private Q_SLOTS:
  void initTestCase() {
    qRegisterMetaType<RegionId>("retint::RegionId");
    UseOwnFolders(folder_.path());
  }

  void IsRecolored_data() {
    QTest::addColumn<QString>("view");
    QTest::newRow("fox") << "0025.jpg";
    QTest::newRow("flower") << "012.jpg";
  }
  void IsRecolored() {
    QFETCH(const QString, view);
    const fs::path workspace = Data() / QTest::currentDataTag();
    if (!fs::exists(workspace / "splat.ply")) QSKIP("needs shared/data");
    Theme theme;
    MainWindow window(&theme);
    SceneController& controller = window.controller();
    window.resize(1300, 900);
    window.show();
    StartOptions start;
    start.scene.workspace = workspace;
    start.scene.options.backend = BackendName();
    start.scene.options.holdout = 8;
    window.files().Start(start);
    QVERIFY(QTest::qWaitFor([&] { return window.canvas().IsSharp(); }, kWaitMs));
    const auto facts = controller.facts();
    QVERIFY(facts->warnings.empty());
    QCOMPARE(std::string(facts->backend->Name()), BackendName());
    const auto at = [&] { return window.canvas().navigation().view()->name == view.toStdString(); };
    for (size_t i = 0; i < facts->views.size() && !at(); ++i) PressKey(window, Qt::Key_Right);
    QVERIFY(at());

    // Painted with a fine brush.
    PressKey(window, Qt::Key_B);
    SelectionMode& selection = window.selection();
    QVERIFY(WaitPainting(window));
    SelectionCanvas& paper = selection.canvas();
    const Mask& mask = paper.editor().mask();
    const Mask wanted =
        ReadMask(ViewFile(workspace / "masks", view.toStdString()), mask.width, mask.height);
    PaintFinely(paper, wanted);
    QVERIFY2(IouOf(mask, wanted) > 0.9, qPrintable(QString::number(IouOf(mask, wanted))));
    QTest::keyClick(&paper, Qt::Key_Return);
    QVERIFY(QTest::qWaitFor([&] { return !window.IsSelecting(); }, 4 * kWaitMs));
    const RegionId id = window.current_region();
    QVERIFY2(id != 0, qPrintable(selection.message()));
    const auto region = [&]() -> const Region& { return *controller.regions().Find(id); };
    QCOMPARE(region().selection->masks.size(), facts->views.size());

    // The closed form answers while the color is dragged; one drag is one step of the history.
    const ShPointer original = controller.colors().original_sh();
    auto* square = window.findChild<ColorSquare*>("color_square");
    QTest::mousePress(square, Qt::LeftButton, {}, {20, 20});
    for (const QPoint to : {QPoint(60, 30), QPoint(100, 30), QPoint(square->width() - 30, 20)}) {
      const ShPointer before = controller.colors().sh();
      QMouseEvent move(QEvent::MouseMove, to, square->mapToGlobal(to), Qt::NoButton, Qt::LeftButton,
                       Qt::NoModifier);
      QCoreApplication::sendEvent(square, &move);
      QVERIFY(QTest::qWaitFor([&] { return controller.colors().sh() != before; }, kWaitMs));
    }
    QTest::mouseRelease(square, Qt::LeftButton, {}, {square->width() - 30, 20});
    QVERIFY(*controller.colors().sh() != *original);
    QVERIFY(QTest::qWaitFor(
        [&] {
          return controller.colors().optimizer().state == BackgroundOptimizer::State::kFinished;
        },
        4 * kWaitMs));
    QVERIFY(QTest::qWaitFor([&] { return region().fit != nullptr; }, kWaitMs));
    QVERIFY(QTest::qWaitFor([&] { return window.canvas().IsSharp(); }, kWaitMs));

    QSignalSpy ready(&controller.results(), &SceneResults::qualityReady);
    QTest::mouseClick(window.findChild<QPushButton*>("quality_measure"), Qt::LeftButton);
    QVERIFY(QTest::qWaitFor([&] { return ready.count() > 0; }, 4 * kWaitMs));
    const auto report = ready.at(0).at(1).value<QualityReport>();
    QVERIFY(report.train.psnr_inside_after > report.train.psnr_inside_before + 5);
    QVERIFY(report.heldout.psnr_inside_after > report.heldout.psnr_inside_before + 5);
    QVERIFY(report.train.bleed < 0.01);

    const fs::path out = folder_.filePath(QTest::currentDataTag()).toStdString();
    const ShPointer fitted = controller.colors().sh();
    QSignalSpy written(&controller.results(), &SceneResults::written);
    AnswerFileDialog(out.string() + ".ply");
    PressKey(window, Qt::Key_E, Qt::ControlModifier);
    QVERIFY(QTest::qWaitFor([&] { return written.count() > 0; }, kWaitMs));
    const GaussianModel exported = ReadSplat(out.string() + ".ply");
    QVERIFY(exported.means == facts->original->means);
    QVERIFY(exported.sh == *fitted);
    QSignalSpy saved(&window.sessions(), &SessionStore::saved);
    AnswerFileDialog(out.string() + ".retint");
    PressKey(window, Qt::Key_S, Qt::ControlModifier);
    QVERIFY(QTest::qWaitFor([&] { return saved.count() > 0; }, kWaitMs));
    const Region kept = region();

    // Undone to the beginning, every bit is the original's.
    for (int guard = 0; controller.history().can_undo && guard < 10; ++guard) {
      PressKey(window, Qt::Key_Z, Qt::ControlModifier);
      QVERIFY(Settle(controller));
    }
    QVERIFY(controller.regions().regions.empty());
    QVERIFY(QTest::qWaitFor([&] { return controller.colors().ShowsOriginal(); }, kWaitMs));

    // Restored, everything is as it was saved.
    QSignalSpy opened(&controller, &SceneController::opened);
    AnswerFileDialog(out.string() + ".retint");
    PressKey(window, Qt::Key_O, Qt::ControlModifier | Qt::ShiftModifier);
    QVERIFY(ClickRole(window, QMessageBox::DestructiveRole));  // the undone state was not saved
    QVERIFY(QTest::qWaitFor([&] { return opened.count() > 0; }, kWaitMs));
    QCOMPARE(controller.regions().regions.size(), size_t{1});
    const Region& restored = controller.regions().regions.front();
    QCOMPARE(restored.name, kept.name);
    QVERIFY(restored.edit == kept.edit && restored.strength == kept.strength);
    QVERIFY(restored.selection->shares == kept.selection->shares);
    for (const auto& [name, one] : kept.selection->masks) {
      QVERIFY2(restored.selection->masks.at(name).data == one.data, name.c_str());
    }
    QVERIFY(QTest::qWaitFor(
        [&] { return window.canvas().IsSharp() && *controller.colors().sh() == *fitted; },
        kWaitMs));
    QCOMPARE(window.canvas().navigation().view()->name, view.toStdString());
    if (const char* folder = std::getenv("RETINT_SCREENSHOTS")) {
      window.grab().save(QString(folder) + "/" + QTest::currentDataTag() + ".png");
    }
  }
};

}  // namespace retint

QTEST_MAIN(retint::CaptureTest)
#include "capture_test.moc"
