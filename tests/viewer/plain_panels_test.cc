// SPDX-License-Identifier: BSD-3-Clause
// Expectations for any panel: numbers follow the mouse, controls stay in place, nothing is cut, and
// rare settings are out of sight.
#include <cmath>

#include <QDialog>
#include <QMenu>
#include <QProgressBar>
#include <QSettings>
#include <QSlider>
#include <QTextBlock>
#include <QTextBrowser>
#include <QToolButton>
#include <QTreeWidget>

#include "tests/viewer/edit_panel_fixture.h"
#include "viewer/panels/guide.h"
#include "viewer/panels/swatch_row.h"

namespace retint {

class PlainPanelsTest : public EditPanelFixture {
  Q_OBJECT

 private Q_SLOTS:
  void initTestCase() { MakeTheme(); }
  void init() { QVERIFY(ShowScene()); }
  void cleanup() { Close(); }

  // A press beside the handle, a drag from there, and a drag on the label: one step each.
  void ASliderGoesWhereItIsPressed() {
    QVERIFY(AddRegions());
    Select(0);
    QVERIFY(Settle(Controller()));
    const ColorEdit before = Edit();
    Click("mode_grade");
    auto* slider = Find<QSlider>("saturation.factor_slider");
    const auto share = [&](int x) { return double(x) / slider->width(); };
    const auto is_at = [&](int x) {  // of 0 to 3; the handle is a tenth of a short slider
      return std::abs(Edit().operations.back().values[0] / 3 - share(x)) < 0.1;
    };
    const int y = slider->height() / 2, far = slider->width() * 7 / 8;
    QTest::mousePress(slider, Qt::LeftButton, {}, {far, y});
    QVERIFY(slider->isSliderDown());
    QTest::mouseRelease(slider, Qt::LeftButton, {}, {far, y});
    QCOMPARE(Edit().operations.size(), size_t{2});
    QVERIFY2(is_at(far), qPrintable(QString::number(double(Edit().operations[1].values[0]))));
    window_->action("edit.undo")->trigger();
    QTRY_VERIFY(Edit() == before);
    const int near = slider->width() / 4;
    DragAlong(slider, {{far, 1}, {slider->width() / 2, 1}, {near, 1}});
    QVERIFY2(is_at(near), qPrintable(QString::number(double(Edit().operations[1].values[0]))));
    window_->action("edit.undo")->trigger();
    QTRY_VERIFY(Edit() == before);
  }

  void ANumberFollowsADragOnItsLabel() {
    QVERIFY(AddRegions());
    Select(0);
    QVERIFY(Settle(Controller()));
    const ColorEdit before = Edit();
    Click("mode_grade");
    QLabel* label = nullptr;
    for (auto* one : Find<QWidget>("edit_panel")->findChildren<QLabel*>()) {
      if (one->text() == "Saturation") label = one;
    }
    QVERIFY(label);
    QTest::mouseClick(label, Qt::LeftButton);
    QVERIFY(Edit() == before);
    // A slider of 400 steps from 0 to 3, one a pixel.
    DragAlong(label, {{5, 5}, {25, 5}, {45, 5}});
    QCOMPARE(Edit().operations.size(), size_t{2});
    QVERIFY(std::abs(Edit().operations[1].values[0] - (1 + 40 * 3.0F / 400)) < 0.01F);
    window_->action("edit.undo")->trigger();
    QTRY_VERIFY(Edit() == before);
  }

  // Regions, steps and recent colors come and go above and beside it.
  void TheColorFieldStaysWhereItIs() {
    const auto place = [&] {
      QTest::qWait(50);
      auto* field = Find<QLineEdit>("color_text");
      return field->mapTo(window_.get(), QPoint());
    };
    QVERIFY(AddPlain());
    Select(0);
    const QPoint before = place();
    QVERIFY(Find<SwatchRow>("recent_colors")->colors().empty());
    const int below = Find<QWidget>("swatches")->mapTo(window_.get(), QPoint()).y();
    TypeColor("#2040ff");
    QVERIFY(Measured());
    QTRY_VERIFY_WITH_TIMEOUT(!Find<SwatchRow>("recent_colors")->colors().empty(), kWaitMs);
    QCOMPARE(place(), before);
    QCOMPARE(Find<QWidget>("swatches")->mapTo(window_.get(), QPoint()).y(), below);
    QVERIFY(AddRegions());
    Select(0);
    QCOMPARE(place(), before);
    Click("mode_grade");
    Type("exposure.stops", "0.5");
    Type("contrast.factor", "1.2");
    Click("mode_recolor");
    QCOMPARE(place(), before);
    Keep(*window_, "layers");
    QSettings().remove("recent_colors");  // the next test's window has none
  }

  // In a window of one who never asked for more.
  void FiguresAndMethodsLieInDrawers() {
    Close();
    for (const char* name : {"optimizer_advanced", "selection_advanced"}) QSettings().remove(name);
    QVERIFY(ShowScene(/*drawers=*/false));
    QVERIFY(AddRegions());
    const std::pair<const char*, std::vector<const char*>> panels[] = {
        {"optimizer", {"loss_plot", "optimizer_speed", "psnr_inside", "refit_options"}},
        {"selection", {"selection_preset", "selection_options"}}};
    for (const auto& [panel, inner] : panels) {
      Show(panel);
      for (const char* name : inner) QVERIFY2(!Find<QWidget>(name)->isVisible(), name);
      auto* drawer = Find<QToolButton>((panel + std::string("_advanced")).c_str());
      QTest::mouseClick(drawer, Qt::LeftButton);
      for (const char* name : inner) QVERIFY2(Find<QWidget>(name)->isVisible(), name);
      QTest::keyClick(drawer, Qt::Key_Space);
      for (const char* name : inner) QVERIFY2(!Find<QWidget>(name)->isVisible(), name);
    }
  }

  void TheStateSaysHowFarItIs() {
    QVERIFY(AddRegions());
    Show("optimizer");
    RefitJob job = Controller().colors().refit_job();
    job.options.solver = Solver::kAdam;
    job.options.adam.iterations = 1500;
    Controller().colors().SetRefitJob(job);
    auto* bar = Find<QProgressBar>("optimizer_progress");
    auto* state = Find<QLabel>("optimizer_state");
    QVERIFY(!bar->isVisible());
    QStringList texts;
    int most = 0;
    connect(&Controller().colors(), &SceneColors::optimizerChanged, state, [&] {
      if (bar->isVisible()) most = std::max(most, bar->value());
      texts << state->text();
    });
    QTest::mouseClick(Find<QToolButton>("optimizer_toggle"), Qt::LeftButton);
    QTRY_VERIFY_WITH_TIMEOUT(state->text().contains("Refined"), kWaitMs);
    QVERIFY2(most > 0 && most < 100, qPrintable(QString::number(most)));
    QVERIFY2(texts.join("\n").contains(QString("… %1 %").arg(most)), qPrintable(texts.join("\n")));
    QVERIFY(!bar->isVisible());
  }

  void EveryPanelOpensTheGuide() {
    const std::pair<const char*, const char*> panels[] = {
        {"regions", "Edit colors"},
        {"optimizer", "Recolor an object"},
        {"selection", "Tools that find the outline"},
        {"quality", "Recolor an object"},
        {"views", "Recolor an object"},
        {"scene", "Open a scene"}};
    for (const auto& [panel, section] : panels) {
      Show(panel);
      QVERIFY2(GuideSections().contains(section), section);
      auto* button = Find<QDockWidget>(panel)->findChild<QToolButton*>("guide_button");
      QVERIFY2(button && button->isVisible(), panel);
      QTest::mouseClick(button, Qt::LeftButton);
      auto* page = window_->findChild<QTextBrowser*>("guide_page");
      QVERIFY2(page && page->isVisible(), panel);
      QCOMPARE(page->textCursor().block().text(), QString(section));
      QVERIFY(page->viewport()->rect().contains(page->cursorRect().center()));
      QVERIFY(!page->toHtml().contains("href"));  // the other pages are not here
      page->window()->close();
      QTRY_VERIFY(!window_->findChild<QDialog*>("guide"));
    }
  }

  // A path needs several lines in a panel so narrow.
  void ValuesOfTheSceneAreWhole() {
    Show("scene");
    auto* facts = Find<QTreeWidget>("scene_facts");
    const int line = facts->fontMetrics().height();
    int wrapped = 0;
    for (int row = 0; row < facts->topLevelItemCount(); ++row) {
      const QTreeWidgetItem* item = facts->topLevelItem(row);
      const int width = facts->fontMetrics().horizontalAdvance(item->text(1));
      const int lines = (width + facts->columnWidth(1) - 1) / facts->columnWidth(1);
      const int height = facts->visualItemRect(item).height();
      QVERIFY2(height >= lines * line, qPrintable(item->text(1)));
      wrapped += lines > 1;
    }
    QVERIFY(wrapped > 0);
    Keep(*window_, "scene-values");
  }
};

}  // namespace retint

QTEST_MAIN(retint::PlainPanelsTest)
#include "plain_panels_test.moc"
