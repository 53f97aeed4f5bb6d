// SPDX-License-Identifier: BSD-3-Clause
// The Selection panel in the real window: a region that was painted is selected again when an
// option changes.
#include <cmath>

#include <QCheckBox>
#include <QComboBox>
#include <QDialog>
#include <QDockWidget>
#include <QDoubleSpinBox>
#include <QLabel>
#include <QPushButton>
#include <QToolButton>
#include <QTreeWidget>

#include "editing/edit_options.h"
#include "tests/viewer/viewer_scene.h"
#include "viewer/panels/color_picker.h"
#include "viewer/widgets/banner.h"

namespace retint {

class SelectionPanelTest : public ViewerTest {
  Q_OBJECT

 private:
  ViewerScene::Subject subject_;

  template <typename T>
  T* Find(const char* name) {
    T* found = window_->findChild<T*>(name);
    if (!found) qFatal("there is no %s", name);
    return found;
  }
  const Region& Current() { return *controller().regions().Find(window_->current_region()); }
  void Choose(const char* box, const char* text) {
    auto* combo = Find<QComboBox>(box);
    combo->setFocus();
    const int from = combo->currentIndex(), to = combo->findText(text);
    QVERIFY2(to >= 0, text);
    for (int i = from; i < to; ++i) QTest::keyClick(combo, Qt::Key_Down);
    for (int i = to; i < from; ++i) QTest::keyClick(combo, Qt::Key_Up);
    QCOMPARE(combo->currentText(), QString(text));
  }
  // A region that was painted on one view, with the splat's own depth, which is quick.
  bool Paint() {
    SelectOptions select;
    select.depth_method = "gaussian";
    QSignalSpy added(&controller(), &SceneController::regionAdded);
    SceneController::Round round;
    const View* view = controller().facts()->workspace->reconstruction.FindView(subject_.first);
    round.paint.view = {subject_.first, controller().facts()->Posed(*view),
                        scene_->Masks(subject_.object).at(subject_.first)};
    round.name = "jug";
    round.select = select;
    window_->selection().SetSelectOptions(select);
    controller().SelectRound(round);
    return QTest::qWaitFor([&] { return added.count() == 1; }, kWaitMs);
  }
  bool Again(QSignalSpy& again) {
    return QTest::qWaitFor([&] { return again.count() > 0; }, kWaitMs);
  }

 private Q_SLOTS:
  void initTestCase() {
    MakeScene();
    subject_ = scene_->MostVisible();
    QVERIFY(subject_.object != 0);
  }
  void cleanupTestCase() { scene_.reset(); }
  void init() {
    QVERIFY(ShowScene());
    OpenDrawers(*window_);
  }
  void cleanup() { window_.reset(); }

  void AnOptionSelectsTheRegionAgain() {
    QVERIFY(Paint());
    QTest::keyClick(window_.get(), Qt::Key_6, Qt::AltModifier);
    QVERIFY(!Find<QDockWidget>("selection")->visibleRegion().isEmpty());
    const auto before = Current().selection;
    const size_t points = before->source.cloud.points.size();
    QVERIFY(Find<QLabel>("selection_details")->text().contains(QString::number(points)));
    canvas().SetCloudShown(false);
    QSignalSpy again(&controller(), &SceneController::selectedAgain);
    auto* share = Find<QDoubleSpinBox>("sample_fraction");
    share->setFocus();
    share->selectAll();
    QTest::keyClicks(share, "0.3");
    QTest::keyClick(share, Qt::Key_Return);
    QVERIFY(Again(again));
    const auto fewer = Current().selection;
    QVERIFY(fewer != before);
    QVERIFY(fewer->source.painted.size() == 1 && fewer->masks.size() == before->masks.size());
    // About 0.3 of the pixels instead of the default share; outliers are removed from both.
    const double share_before = CloudOptions().sample_fraction;
    QVERIFY2(std::abs(double(fewer->source.cloud.points.size()) / double(points) -
                      0.3 / share_before) < 0.1,
             qPrintable(QString::number(fewer->source.cloud.points.size())));
    QVERIFY(canvas().cloud_shown());
    QCOMPARE(window_->selection().select_options().cloud.sample_fraction, 0.3);
    QCOMPARE(Find<QComboBox>("selection_preset")->currentText(), QString("Own settings"));
    // A step of the history like any other.
    PressKey(*window_, Qt::Key_Z, Qt::ControlModifier);
    QTRY_VERIFY_WITH_TIMEOUT(Current().selection == before, kWaitMs);
    // With the options that it was made with.
    QCOMPARE(window_->selection().select_options().cloud.sample_fraction, share_before);
    QCOMPARE(share->value(), share_before);
    PressKey(*window_, Qt::Key_Y, Qt::ControlModifier);
    QTRY_VERIFY_WITH_TIMEOUT(Current().selection == fewer, kWaitMs);
    QCOMPARE(share->value(), 0.3);
  }

  void WhatBecameOfThePaintIsSaidAndShown() {
    QVERIFY(canvas().GoTo(subject_.first));
    QVERIFY(WaitSharp(*window_));
    SelectOptions select;
    select.depth_method = "gaussian";
    window_->selection().SetSelectOptions(select);
    window_->EnterSelection();
    QVERIFY(WaitPainting(*window_));
    SelectionCanvas& paper = window_->selection().canvas();
    PaintFinely(paper, scene_->Masks(subject_.object).at(subject_.first));
    QTest::keyClick(&paper, Qt::Key_Return);
    QTRY_VERIFY_WITH_TIMEOUT(!window_->IsSelecting(), kWaitMs);
    Banner& banner = window_->banner();
    QVERIFY2(banner.text().startsWith("All of your paint is in"), qPrintable(banner.text()));
    QVERIFY(Find<ColorSquare>("color_square")->hasFocus());  // and not the banner
    auto* small = banner.findChild<QToolButton*>("banner_picture");
    QTRY_VERIFY_WITH_TIMEOUT(small->isVisible(), kWaitMs);
    Keep(*window_, "verdict");
    const auto dialog = [&] { return window_->findChild<QDialog*>("paint_pictures"); };
    QTest::mouseClick(small, Qt::LeftButton);
    QVERIFY(dialog() && dialog()->isVisible());
    bool named = false;
    for (auto* label : dialog()->findChildren<QLabel*>()) {
      named |= label->text().startsWith(QString::fromStdString(subject_.first));
    }
    QVERIFY(named);
    Keep(*dialog(), "verdict-large");
    QTest::mouseClick(dialog()->findChild<QPushButton*>(), Qt::LeftButton);
    QTRY_VERIFY(!dialog());
    // It is over when one goes on with the region.
    QVERIFY(banner.IsShown());
    controller().Do(SetEdit{window_->current_region(), ColorEdit::Tint({0.2F, 0.9F, 0.3F})});
    QTRY_VERIFY(!banner.IsShown());
  }

  void EachRegionComesBackWithItsOwnOptions() {
    const double first_share = CloudOptions().sample_fraction;
    QVERIFY(Paint());
    const RegionId first = window_->current_region();
    QVERIFY(Paint());
    Find<QDockWidget>("selection")->raise();
    auto* share = Find<QDoubleSpinBox>("sample_fraction");
    const auto select_with = [&](const char* value) {
      QSignalSpy again(&controller(), &SceneController::selectedAgain);
      share->setFocus();
      share->selectAll();
      QTest::keyClicks(share, value);
      QTest::keyClick(share, Qt::Key_Return);
      QVERIFY(Again(again));
    };
    select_with("0.3");
    auto* list = Find<QTreeWidget>("region_list");
    for (int i = 0; i < list->topLevelItemCount() && window_->current_region() != first; ++i) {
      list->setCurrentItem(list->topLevelItem(i));
    }
    QCOMPARE(window_->current_region(), first);
    const auto before = Current().selection;
    select_with("0.2");
    PressKey(*window_, Qt::Key_Z, Qt::ControlModifier);
    QTRY_VERIFY_WITH_TIMEOUT(Current().selection == before, kWaitMs);
    QCOMPARE(share->value(), first_share);  // not those of the other region

    // A change belongs to the region that was current then.
    share->setFocus();
    share->selectAll();
    QTest::keyClicks(share, "0.25");
    QSignalSpy again(&controller(), &SceneController::selectedAgain);
    QTest::keyClick(share, Qt::Key_Return);
    for (int i = 0; i < list->topLevelItemCount() && window_->current_region() == first; ++i) {
      list->setCurrentItem(list->topLevelItem(i));
    }
    QVERIFY(Again(again));
    QCOMPARE(again.front().front().value<RegionId>(), first);
  }

  // Words for users who do not know the command line's name.
  void OptionsHavePlainLabelsAndHelp() {
    for (const char* form : {"selection_options", "refit_options"}) {
      for (auto* label : Find<QWidget>(form)->findChildren<QLabel*>()) {
        QVERIFY2(!label->toolTip().isEmpty(), qPrintable(label->text()));
        for (const char* jargon :
             {"Ridge", "dssim", "Arbitrate", "Surfel", "stddev", "footprint"}) {
          QVERIFY2(!label->text().contains(jargon), qPrintable(label->text()));
        }
      }
    }
  }

  void OffItWaitsForTheButton() {
    QVERIFY(Paint());
    Find<QDockWidget>("selection")->raise();
    auto* live = Find<QCheckBox>("selection_live");
    if (live->isChecked()) live->click();
    const auto before = Current().selection;
    QSignalSpy again(&controller(), &SceneController::selectedAgain);
    Choose("selection_reach", "Exactly what I painted");
    QTest::qWait(1000);  // longer than the rest after which a live change is computed
    QVERIFY(Settle(controller()));
    QCOMPARE(again.count(), 0);
    QVERIFY(Current().selection == before);
    QTest::mouseClick(Find<QPushButton>("selection_again"), Qt::LeftButton);
    QVERIFY(Again(again));
    QVERIFY(Current().selection->shares != before->shares);
    QVERIFY(ReachOf(window_->selection().projector_options()) == PaintReach::kExact);
    live->click();
  }

  void PresetsAreOfTheWholeMethod() {
    Find<QDockWidget>("selection")->raise();
    Choose("selection_preset", "Paper");
    const EditOptions paper = PresetOptions("paper");
    QVERIFY(OptionKey(Described(window_->selection().select_options())) ==
            OptionKey(Described(paper.select)));
    QVERIFY(window_->selection().projector_options().kind == ProjectorKind::kQuads);
    QCOMPARE(Find<QComboBox>("selection_reach")->currentIndex(), -1);  // none of the three
    QVERIFY(OptionKey(Described(controller().colors().refit_job())) ==
            OptionKey(Described(paper.refit)));
    QCOMPARE(Find<QComboBox>("solver")->currentText(), QString("adam"));
    QVERIFY(!Find<QCheckBox>("stereo-hv.arbitrate")->isChecked());
    Choose("selection_preset", "Retint");
    QVERIFY(OptionKey(Described(window_->selection().select_options())) ==
            OptionKey(Described(SelectOptions())));
    QVERIFY(Find<QCheckBox>("stereo-hv.arbitrate")->isChecked());
  }

  void MasksFromElsewhereHaveNoPaint() {
    QVERIFY(AddTintedRegion() != 0);
    Find<QDockWidget>("selection")->raise();
    QVERIFY(!Find<QPushButton>("selection_again")->isEnabled());
    QVERIFY(Find<QLabel>("selection_result")->text().contains("not painted here"));
  }
};

}  // namespace retint

QTEST_MAIN(retint::SelectionPanelTest)
#include "selection_panel_test.moc"
