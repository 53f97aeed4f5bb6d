// SPDX-License-Identifier: BSD-3-Clause
// The whole way on a real capture, in the real window: opened, a painted view accepted, tinted
// while the preview follows, refitted in the background, measured, exported and undone.
#include <cstdlib>

#include <QAction>

#include "colmap_io/image_io.h"
#include "splat_io/splat_io.h"
#include "tests/viewer/viewer_scene.h"
#include "viewer/selection/selection_mode.h"

namespace retint {

class FoxTest : public QObject {
  Q_OBJECT

 private:
  QTemporaryDir folder_;

  // As tests/support/data.h, which is GoogleTest's.
  static std::filesystem::path Data() {
    const char* root = std::getenv("RETINT_DATA");
    return (root ? std::filesystem::path(root)
                 : std::filesystem::path(RETINT_SOURCE_DIR) / ".." / "shared" / "data") /
           "fox";
  }

 private Q_SLOTS:
  void initTestCase() {
    qRegisterMetaType<RegionId>("retint::RegionId");
    UseOwnFolders(folder_.path());
  }

  void RecolorsTheFox() {
    if (!std::filesystem::exists(Data() / "splat.ply")) QSKIP("needs shared/data/fox");
    Theme theme;
    MainWindow window(&theme);
    SceneController& controller = window.controller();
    window.resize(900, 700);
    window.show();
    OpenRequest request;
    request.workspace = Data();
    request.splat = Data() / "splat.ply";
    request.options.backend = "cpu";
    request.options.holdout = 8;
    window.OpenScene(request);
    QVERIFY(QTest::qWaitFor([&] { return window.canvas().IsSharp(); }, kWaitMs));
    QVERIFY(controller.facts()->warnings.empty());
    QVERIFY(window.canvas().GoTo("0025.jpg"));

    QTest::keyClick(&window.canvas(), Qt::Key_B);
    SelectionMode& selection = window.selection();
    QVERIFY(QTest::qWaitFor([&] { return selection.state() == SelectionMode::State::kPainting; },
                            kWaitMs));
    const Mask& now = selection.canvas().editor().mask();
    const Mask painted = ReadMask(Data() / "masks" / "0025.jpg.png", now.width, now.height);
    selection.canvas().Edited(selection.canvas().editor().SetMask(painted));
    QTest::keyClick(&selection.canvas(), Qt::Key_Return);
    QVERIFY(QTest::qWaitFor([&] { return window.current_region() != 0; }, 4 * kWaitMs));
    QVERIFY(!window.IsSelecting());
    const RegionId id = window.current_region();
    const auto& masks = controller.regions().Find(id)->selection->masks;
    QCOMPARE(masks.size(), controller.facts()->views.size());

    // The closed form answers each change; one drag is one step of the history.
    const ShPointer original = controller.original_sh();
    for (const float green : {0.9F, 0.8F, 0.7F}) {
      const ShPointer before = controller.sh();
      controller.SetEdit(id, ColorEdit::Tint({0.3F, green, 1.0F}), 1, "drag");
      QVERIFY(QTest::qWaitFor([&] { return controller.sh() != before; }, kWaitMs));
    }
    QVERIFY(*controller.sh() != *original);
    QVERIFY(QTest::qWaitFor(
        [&] { return controller.optimizer().state == BackgroundOptimizer::State::kFinished; },
        4 * kWaitMs));
    QVERIFY(
        QTest::qWaitFor([&] { return controller.regions().Find(id)->fit != nullptr; }, kWaitMs));

    QSignalSpy ready(&controller, &SceneController::qualityReady);
    controller.Evaluate(id);
    QVERIFY(ready.count() > 0 || ready.wait(4 * kWaitMs));
    const auto report = ready.at(0).at(1).value<QualityReport>();
    QVERIFY(report.train.psnr_inside_after > report.train.psnr_inside_before + 5);
    QVERIFY(report.heldout.psnr_inside_after > report.heldout.psnr_inside_before + 5);
    QVERIFY(report.train.bleed < 0.01);

    const auto out = std::filesystem::path(folder_.path().toStdString()) / "fox.ply";
    QSignalSpy written(&controller, &SceneController::written);
    controller.WriteSplat(out);
    QVERIFY(written.count() > 0 || written.wait(kWaitMs));
    const GaussianModel saved = ReadSplat(out);
    QVERIFY(saved.means == controller.facts()->original->means);
    QVERIFY(saved.sh != controller.facts()->original->sh);

    // Undone to the beginning, every bit is the original's.
    for (int guard = 0; controller.history().can_undo && guard < 10; ++guard) {
      const std::string label = controller.history().undo_label;
      window.canvas().setFocus();
      window.action("edit.undo")->trigger();
      QVERIFY(QTest::qWaitFor([&] { return controller.history().undo_label != label; }, kWaitMs));
    }
    QVERIFY(controller.regions().regions.empty());
    QVERIFY(QTest::qWaitFor([&] { return controller.ShowsOriginal(); }, kWaitMs));
  }
};

}  // namespace retint

QTEST_MAIN(retint::FoxTest)
#include "fox_test.moc"
