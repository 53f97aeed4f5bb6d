// SPDX-License-Identifier: BSD-3-Clause
// The optimizer's panel in the real window.
#include <QCheckBox>
#include <QLabel>
#include <QToolButton>

#include "tests/viewer/panels_fixture.h"
#include "viewer/panels/loss_plot.h"

namespace retint {

class OptimizerPanelTest : public PanelsFixture {
  Q_OBJECT

 private Q_SLOTS:
  void initTestCase() { MakeTheme(); }
  void init() { QVERIFY(ShowScene()); }
  void cleanup() { Close(); }

  void TheOptimizerStartsAfterAnEditAndIsMeasured() {
    QVERIFY(AddRegions());
    Show("optimizer");
    Find<QCheckBox>("automatic")->click();
    QVERIFY(Controller().colors().automatic_refit());
    Select(0);
    DragAlong(Find<ColorSquare>("color_square"), {{30, 30}, {60, 40}});
    auto* state = Find<QLabel>("optimizer_state");
    QTRY_VERIFY_WITH_TIMEOUT(state->text().contains("Refined"), kWaitMs);
    auto* plot = Find<LossPlot>("loss_plot");
    QTRY_VERIFY(plot->losses().size() > 1);
    QVERIFY(plot->losses().back() < plot->losses().front());
    const QImage picture = plot->grab().toImage();
    const QRgb line = plot->palette().color(QPalette::Highlight).rgb();
    int drawn = 0;
    for (int y = 0; y < picture.height(); ++y) {
      for (int x = 0; x < picture.width(); ++x) drawn += picture.pixel(x, y) == line;
    }
    QVERIFY2(drawn > 50, "the curve is drawn");
    QTRY_VERIFY(SessionRegions().regions[1].fit != nullptr);
    // A few views by itself, all of them when asked.
    QTRY_VERIFY_WITH_TIMEOUT(Find<QLabel>("psnr_inside")->text().contains("dB"), kWaitMs);
    QVERIFY(Find<QLabel>("psnr_views")->text().contains("4 views"));
    QSignalSpy ready(&Controller().results(), &SceneResults::qualityReady);
    QTest::mouseClick(Find<QPushButton>("optimizer_measure"), Qt::LeftButton);
    QTRY_COMPARE_WITH_TIMEOUT(ready.count(), 1, kWaitMs);
    QVERIFY(Find<QLabel>("psnr_inside")->text().contains("dB"));
    QVERIFY(Find<QLabel>("psnr_outside")->text().contains("dB"));
    QVERIFY(Find<QLabel>("psnr_views")->text().contains("6 views"));
    // Reset: back to the closed form, then fitted anew.
    const auto fit = SessionRegions().regions[0].fit;
    QTest::mouseClick(Find<QPushButton>("optimizer_reset"), Qt::LeftButton);
    QTRY_VERIFY_WITH_TIMEOUT(state->text().contains("Refined"), kWaitMs);
    QTRY_VERIFY_WITH_TIMEOUT(
        SessionRegions().regions[0].fit && SessionRegions().regions[0].fit != fit, kWaitMs);
  }

  void PausesAndGoesOn() {
    QVERIFY(AddRegions());
    Show("optimizer");
    auto* solver = Find<QComboBox>("solver");
    solver->setFocus();
    QTest::keyClick(solver, Qt::Key_Down);
    QCOMPARE(Controller().colors().refit_job().options.solver, Solver::kAdam);
    // The other solver's options are hidden.
    auto* iterations = Find<QSpinBox>("adam.iterations");
    QVERIFY(!Find<QSpinBox>("mm.iterations")->isVisible());
    QVERIFY(Find<QDoubleSpinBox>("adam.learning_rate")->isVisibleTo(window_.get()));
    QCOMPARE(Find<QDoubleSpinBox>("adam.learning_rate")->text(), QString("0.00025"));
    iterations->setFocus();
    iterations->selectAll();
    QTest::keyClicks(iterations, "100000");
    QTest::keyClick(iterations, Qt::Key_Return);
    QCOMPARE(Controller().colors().refit_job().options.adam.iterations, 100000);
    auto* toggle = Find<QToolButton>("optimizer_toggle");
    auto* state = Find<QLabel>("optimizer_state");
    QTest::mouseClick(toggle, Qt::LeftButton);
    QTRY_VERIFY_WITH_TIMEOUT(Controller().colors().optimizer().Active(), kWaitMs);
    QVERIFY(state->text().contains("Preparing") || Controller().colors().optimizer().steps > 0);
    QTRY_VERIFY_WITH_TIMEOUT(state->text().contains("Refining left"), kWaitMs);
    QTRY_VERIFY_WITH_TIMEOUT(Find<QLabel>("optimizer_speed")->text().contains("a second"), kWaitMs);
    QTest::mouseClick(toggle, Qt::LeftButton);
    QTRY_VERIFY_WITH_TIMEOUT(state->text().contains("Paused"), kWaitMs);
    // The step in progress is finished first, however long it takes here.
    int steps = -1;
    const auto rests = [&] {
      const int before = std::exchange(steps, Controller().colors().optimizer().steps);
      QTest::qWait(500);
      return before == steps && steps == Controller().colors().optimizer().steps;
    };
    QTRY_VERIFY_WITH_TIMEOUT(rests(), kWaitMs);
    QTest::mouseClick(toggle, Qt::LeftButton);
    QTRY_VERIFY_WITH_TIMEOUT(Controller().colors().optimizer().steps > steps, kWaitMs);
    QTest::mouseClick(Find<QToolButton>("optimizer_stop"), Qt::LeftButton);
    QTRY_VERIFY_WITH_TIMEOUT(state->text().contains("stopped"), kWaitMs);
    QVERIFY(!Find<QToolButton>("optimizer_stop")->isVisible());
  }
};

}  // namespace retint

QTEST_MAIN(retint::OptimizerPanelTest)
#include "optimizer_panel_test.moc"
