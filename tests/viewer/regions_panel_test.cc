// SPDX-License-Identifier: BSD-3-Clause
// The regions panel in the real window, with mouse and keys, checked by the session's state.
#include <algorithm>
#include <array>
#include <cmath>

#include <QAction>
#include <QCheckBox>
#include <QContextMenuEvent>
#include <QDialog>
#include <QLineEdit>
#include <QMenu>
#include <QMetaProperty>
#include <QSlider>
#include <QToolButton>

#include "editing/color_preview.h"
#include "kernels/common/sh.h"
#include "tests/viewer/panels_fixture.h"
#include "viewer/canvas/contrast.h"

namespace retint {

class RegionsPanelTest : public PanelsFixture {
  Q_OBJECT

 private Q_SLOTS:
  void initTestCase() { MakeTheme(); }
  void init() { QVERIFY(ShowScene()); }
  void cleanup() { Close(); }

  void TheListShowsTheRegions() {
    QVERIFY(AddRegions());
    QCOMPARE(List()->topLevelItemCount(), 2);
    QCOMPARE(List()->topLevelItem(0)->text(RegionsPanel::kName), QString("left"));
    QCOMPARE(List()->topLevelItem(0)->text(RegionsPanel::kColor), QString("#3366ff"));
    QCOMPARE(List()->topLevelItem(1)->text(RegionsPanel::kStrength), QString("100 %"));
    QCOMPARE(window_->current_region(), Regions()[1].id);
    Select(0);
    QCOMPARE(window_->current_region(), Regions()[0].id);
  }

  // Without an edit, and so for the picker before there is one: its main color and no mixture.
  void ARegionHasItsMainColor() {
    GaussianModel model;
    for (int g = 0; g < 10; ++g) {
      const bool red = g < 7;
      for (const float value : {red ? 0.8F : 0.1F, 0.1F, red ? 0.1F : 0.8F}) {
        model.sh.push_back((value - 0.5F) / kShC0);
      }
      model.opacity_logits.push_back(3);
    }
    auto selection = std::make_shared<RegionSelection>();
    selection->id = 1;
    selection->shares.assign(10, 1.0F);
    Region region;
    region.selection = selection;
    const QColor color = RegionColors().Before(region, model);
    QVERIFY2(std::abs(color.redF() - 0.8) < 0.05 && color.blueF() < 0.15, qPrintable(color.name()));
  }

  // A step that changes nothing leaves the color in the list as it was.
  void TheListShowsWhatSeveralStepsMakeOfTheColorThatIsReplaced() {
    QVERIFY(AddRegions());
    ColorOperation recolor = ColorOperation::Make(ColorOperationKind::kRecolor, {0.2F, 0.4F, 1.0F});
    std::ranges::copy(std::array{0.4F, 0.1F, 0.1F}, recolor.Get("from").begin());
    Controller().Do(SetEdit{Regions()[0].id,
                            {{recolor, ColorOperation::Make(ColorOperationKind::kAdjust)}, 1}});
    const auto* item = List()->topLevelItem(0);
    QTRY_COMPARE(item->text(RegionsPanel::kColor), QString("2 steps"));
    const QColor shown = item->data(RegionsPanel::kColor, Qt::UserRole).value<QColor>();
    QVERIFY2(Apart(shown.rgb(), QColor(51, 102, 255).rgb()) <= 2, qPrintable(shown.name()));
  }

  void ACheckBoxHidesAndSpaceShowsAgain() {
    QVERIFY(AddRegions());
    QTest::mouseClick(List()->viewport(), Qt::LeftButton, {}, CheckBoxOf(0, RegionsPanel::kName));
    QVERIFY(!SessionRegions().regions[0].visible);
    QVERIFY(SessionRegions().regions[1].visible);
    Select(0);
    List()->setFocus();
    QTest::keyClick(List(), Qt::Key_Space);
    QVERIFY(SessionRegions().regions[0].visible);
  }

  void SoloShowsOneRegionAlone() {
    QVERIFY(AddRegions());
    QVERIFY(Settle(Controller()));
    // Reckoned here: the window may still show the first region without the second.
    ColorPreview preview(Controller().facts()->original, Controller().facts()->backend);
    const FloatArray both =
        *preview.Compose(Controller().regions(), Controller().colors().refit_job()).sh;
    QTRY_VERIFY(*Controller().colors().sh() == both);
    QTest::mouseClick(List()->viewport(), Qt::LeftButton, {}, CheckBoxOf(1, RegionsPanel::kSolo));
    QCOMPARE(Controller().solo(), Regions()[1].id);
    QTRY_VERIFY(*Controller().colors().sh() != both);
    const FloatArray alone = *Controller().colors().sh();
    QVERIFY(SessionRegions().regions[0].visible);  // not an edit
    QTest::mouseClick(List()->viewport(), Qt::LeftButton, {}, CheckBoxOf(1, RegionsPanel::kSolo));
    QCOMPARE(Controller().solo(), RegionId(0));
    QTRY_VERIFY(*Controller().colors().sh() == both);
    // It shows the rest when the other one is hidden.
    QVERIFY(alone != both);
    Controller().Do(SetVisible{Regions()[0].id, false});
    QTRY_VERIFY(*Controller().colors().sh() == alone);
  }

  void DraggingThePickerIsLiveAndOneStep() {
    QVERIFY(AddRegions());
    Select(0);
    QVERIFY(Settle(Controller()));
    const ColorEdit before = Regions()[0].edit;
    auto* square = Find<ColorSquare>("color_square");
    QSignalSpy shown(&Controller().colors(), &SceneColors::shChanged);
    DragHeld(square, {{10, 10}, {40, 30}, {80, 60}, {120, 80}});
    // Of its current size: a message about the color may take room from it later.
    const double s = 120.0 / (square->width() - 1), v = 1 - 80.0 / (square->height() - 1);
    QVERIFY(Regions()[0].edit.Affine().gain != before.Affine().gain);
    QTRY_VERIFY_WITH_TIMEOUT(shown.count() > 0, kWaitMs);  // the button is still down
    QTest::mouseRelease(square, Qt::LeftButton, {}, {120, 80});
    QVERIFY(std::abs(square->place().across - s) < 0.02 && std::abs(square->place().up - v) < 0.02);
    const QColor color = Find<ColorPicker>("color_picker")->color();
    QVERIFY(SessionRegions().regions[0].edit.Affine().gain(2, 2) == color.blueF());
    window_->action("edit.undo")->trigger();
    QVERIFY(SessionRegions().regions[0].edit.Affine().gain == before.Affine().gain);
    QTRY_COMPARE(Find<ColorPicker>("color_picker")->color().name(), QString("#3366ff"));
    // Another drag is another step.
    DragAlong(square, {{20, 20}, {30, 20}});
    DragAlong(square, {{20, 60}, {30, 60}});
    QVERIFY(Settle(Controller()));
    QCOMPARE(Controller().history().undo_label, std::string("Tint in left"));
    window_->action("edit.undo")->trigger();
    QVERIFY(SessionRegions().regions[0].edit.Affine().gain != before.Affine().gain);
    window_->action("edit.undo")->trigger();
    QVERIFY(SessionRegions().regions[0].edit.Affine().gain == before.Affine().gain);
  }

  void TheKeyboardPicksColors() {
    QVERIFY(AddRegions());
    Select(0);
    auto* square = Find<ColorSquare>("color_square");
    square->setFocus();
    const double value = square->place().up;
    QTest::keyClick(square, Qt::Key_Down, Qt::ShiftModifier);
    QVERIFY(std::abs(square->place().up - (value - 0.1)) < 0.01);
    QVERIFY(window_->canvas().navigation().view());  // arrows did not step through the views
    auto* text = Find<QLineEdit>("color_text");
    text->setFocus();
    text->selectAll();
    QTest::keyClicks(text, "#00ff80");
    QTest::keyClick(text, Qt::Key_Return);
    QCOMPARE(SessionRegions().regions[0].edit.Affine().gain(0, 0), 0.0F);
    QCOMPARE(SessionRegions().regions[0].edit.Affine().gain(1, 1), 1.0F);
    QVERIFY(!window_->IsSelecting());  // Return was the field's
    auto* red = Find<QSpinBox>("channel0");
    red->setFocus();
    QTest::keyClick(red, Qt::Key_Up);
    QCOMPARE(SessionRegions().regions[0].edit.Affine().gain(0, 0),
             float(QColor(1, 255, 128).redF()));
  }

  void ColorsHaveNames() {
    QVERIFY(AddRegions());
    Select(0);
    auto* text = Find<QLineEdit>("color_text");
    const auto type = [&](const char* color) {
      text->setFocus();
      text->selectAll();
      QTest::keyClicks(text, color);
      QTest::keyClick(text, Qt::Key_Return);
      return Find<ColorPicker>("color_picker")->color().name();
    };
    QCOMPARE(type("tomato"), QString("#ff6347"));
    QCOMPARE(type("Steel Blue"), QString("#4682b4"));
    QCOMPARE(type("00ff80"), QString("#00ff80"));
    QCOMPARE(type("no color"), QString("#00ff80"));
    QCOMPARE(text->text(), QString("#00ff80"));
    QCOMPARE(type("white"), QString("#ffffff"));
    QVERIFY(ChangesNothing(SessionRegions().regions[0].edit));
  }

  // White multiplies by one: there is nothing to fit, and nothing that looks like white paint.
  void ARegionWithoutAColorIsLeftAlone() {
    Controller().colors().SetAutomaticRefit(true);
    QSignalSpy optimizer(&Controller().colors(), &SceneColors::optimizerChanged);
    QSignalSpy added(&Controller(), &SceneController::regionAdded);
    AddRegionFromMasks(Controller(), "new", MasksOf(scene_), ColorEdit());
    QTRY_COMPARE_WITH_TIMEOUT(added.count(), 1, kWaitMs);
    QTest::qWait(1000);  // longer than the quiet after which a fit begins
    QCOMPARE(optimizer.count(), 0);
    QCOMPARE(List()->topLevelItem(0)->text(RegionsPanel::kColor), QString("none yet"));
    QVERIFY(List()->topLevelItem(0)->icon(RegionsPanel::kColor).isNull());
    const auto says = [&](const QString& part) {
      for (auto* label : Find<RegionsPanel>("regions_panel")->findChildren<QLabel*>()) {
        if (label->isVisible() && label->text().contains(part)) return true;
      }
      return false;
    };
    QVERIFY(says("Now choose a color for new"));
    DragAlong(Find<ColorSquare>("color_square"), {{30, 30}, {60, 40}});
    QVERIFY(says("Edit of new") && !says("Now choose"));
    QVERIFY(!List()->topLevelItem(0)->icon(RegionsPanel::kColor).isNull());
    QTRY_VERIFY_WITH_TIMEOUT(optimizer.count() > 0, kWaitMs);
    Controller().colors().CancelRefit();
  }

  void ThePointsDoNotHideTheColorThatIsPicked() {
    QVERIFY(AddRegions());
    Select(0);
    QVERIFY(window_->canvas().cloud_shown());
    auto* square = Find<ColorSquare>("color_square");
    DragAlong(square, {{30, 30}, {60, 40}});
    QVERIFY(!window_->canvas().cloud_shown());
    // And come back by their key, wherever the focus is but in a field of text.
    square->setFocus();
    QTest::keyClick(square, Qt::Key_M);
    QVERIFY(window_->canvas().cloud_shown());
    QVERIFY(square->hasFocus());
    List()->setFocus();
    QTest::keyClick(List(), Qt::Key_M);
    QVERIFY(!window_->canvas().cloud_shown());
    auto* text = Find<QLineEdit>("color_text");
    text->setFocus();
    text->selectAll();
    QTest::keyClicks(text, "magenta");
    QVERIFY(!window_->canvas().cloud_shown());
    QCOMPARE(text->text(), QString("magenta"));
  }

  void TheStrengthFollowsTheSlider() {
    QVERIFY(AddRegions());
    Select(0);
    auto* slider = Find<QSlider>("strength");
    slider->setFocus();
    QTest::keyClick(slider, Qt::Key_PageDown);
    QTest::keyClick(slider, Qt::Key_Left);
    QCOMPARE(SessionRegions().regions[0].strength, 0.89F);
    QCOMPARE(List()->topLevelItem(0)->text(RegionsPanel::kStrength), QString("89 %"));
  }

  // Typed text is one step, and so is a drag.
  void AStrengthIsOneStep() {
    QVERIFY(AddRegions());
    Select(0);
    const RegionId left = Regions()[0].id;
    auto* slider = Find<QSlider>("strength");
    auto* percent = Find<QSpinBox>("strength_percent");
    const auto strength = [&] { return SessionRegions().Find(left)->strength; };
    const auto type = [&](const char* text) {
      percent->setFocus();
      percent->selectAll();
      QTest::keyClicks(percent, text);
      QTest::keyClick(percent, Qt::Key_Return);
    };
    type("50");
    QCOMPARE(strength(), 0.5F);
    type("25");
    QCOMPARE(strength(), 0.25F);
    QVERIFY(Settle(Controller()));
    QCOMPARE(Controller().history().undo_label, std::string("Change the strength of left"));
    slider->setSliderDown(true);
    for (const int at : {30, 40, 60}) slider->setSliderPosition(at);
    slider->setSliderDown(false);
    QCOMPARE(strength(), 0.6F);
    slider->setFocus();
    QTest::keyClick(slider, Qt::Key_Right);
    QCOMPARE(strength(), 0.61F);
    for (const float before : {0.6F, 0.25F, 0.5F, 1.0F}) {
      window_->action("edit.undo")->trigger();
      QCOMPARE(strength(), before);
    }
  }

  // Unless one works with that very control.
  void TheWheelScrollsThePanels() {
    QVERIFY(AddRegions());
    Select(0);
    const auto turn = [](QWidget* control) {
      const QPoint at = control->rect().center();
      QWheelEvent wheel(at, control->mapToGlobal(at), {}, {0, -120}, Qt::NoButton, Qt::NoModifier,
                        Qt::NoScrollPhase, false);
      QCoreApplication::sendEvent(control, &wheel);
    };
    const auto value = [](QWidget* control) {
      return control->metaObject()->userProperty().read(control);
    };
    int controls = 0;
    for (auto* dock : window_->findChildren<QDockWidget*>()) {
      dock->raise();
      QTest::qWait(20);
      for (auto* control : dock->findChildren<QWidget*>()) {
        const bool turns = qobject_cast<QAbstractSpinBox*>(control) ||
                           qobject_cast<QSlider*>(control) || qobject_cast<QComboBox*>(control);
        if (!turns || !control->isVisible() || !control->isEnabled()) continue;
        ++controls;
        window_->canvas().setFocus();
        // Before the wheel turns a control, Qt gives it the focus if it accepts that.
        QVERIFY2(control->focusPolicy() != Qt::WheelFocus, qPrintable(control->objectName()));
        const QVariant before = value(control);
        turn(control);
        QVERIFY2(value(control) == before, qPrintable(control->objectName()));
      }
    }
    QVERIFY2(controls > 20, qPrintable(QString::number(controls)));
    Find<QDockWidget>("regions")->raise();
    auto* slider = Find<QSlider>("strength");
    slider->setFocus();
    turn(slider);
    QVERIFY(slider->value() < 100);
  }

  void WhatCannotBeDoneWhilePaintingIsDisabled() {
    QVERIFY(AddRegions());
    Select(0);
    const auto enabled = [&](const char* name) { return Find<QToolButton>(name)->isEnabled(); };
    const char* const names[] = {"region_new", "region_extend", "color_pipette"};
    for (const char* name : names) QVERIFY2(enabled(name), name);
    QTest::mouseClick(Find<QToolButton>("color_pipette"), Qt::LeftButton);
    QVERIFY(window_->canvas().picking());
    window_->EnterSelection();
    QVERIFY(WaitPainting(*window_));
    for (const char* name : names) QVERIFY2(!enabled(name), name);
    for (const char* mode : {"mode_adjust", "mode_grade", "mode_recolor"}) {
      Find<QAction>(mode)->trigger();
      for (const char* pick : {"adjust_pick", "white_balance_pick", "recolor_pick_from"}) {
        QVERIFY2(!enabled(pick) || !Find<QToolButton>(pick)->isVisible(), pick);
      }
    }
    window_->selection().Leave();
    QVERIFY(!window_->IsSelecting());
    for (const char* name : names) QVERIFY2(enabled(name), name);
    QVERIFY(!window_->canvas().picking());  // a click would recolor
  }

  void ANeighborIsCurrentAfterDeletingAndWhatComesBackAfterThat() {
    QVERIFY(AddRegions());
    const RegionId left = Regions()[0].id, right = Regions()[1].id;
    QCOMPARE(window_->current_region(), right);
    List()->setFocus();
    QTest::keyClick(List(), Qt::Key_Delete);
    QTRY_COMPARE(window_->current_region(), left);
    QVERIFY(Settle(Controller()));
    window_->action("edit.undo")->trigger();
    QTRY_COMPARE_WITH_TIMEOUT(window_->current_region(), right, kWaitMs);
    Select(0);
    QTest::keyClick(List(), Qt::Key_Delete);
    QTRY_COMPARE(window_->current_region(), right);
    QTest::keyClick(List(), Qt::Key_Delete);
    QTRY_COMPARE(window_->current_region(), RegionId(0));
    QVERIFY(Settle(Controller()));
    window_->action("edit.undo")->trigger();
    QTRY_COMPARE_WITH_TIMEOUT(window_->current_region(), right, kWaitMs);
  }

  void RowsAreDraggedAndMovedByKeys() {
    QVERIFY(AddRegions());
    const RegionId left = Regions()[0].id;
    const QPoint from = CellCenter(0, RegionsPanel::kColor);
    const QPoint below(from.x(), CellCenter(1, RegionsPanel::kColor).y() + 8);
    DragAlong(List()->viewport(), {from, from + QPoint(0, 12), below});
    QCOMPARE(SessionRegions().regions[1].id, left);
    QCOMPARE(List()->topLevelItem(1)->text(RegionsPanel::kName), QString("left"));
    Select(1);
    List()->setFocus();
    QTest::keyClick(List(), Qt::Key_Up, Qt::AltModifier);
    QCOMPARE(SessionRegions().regions[0].id, left);
    QTest::keyClick(List(), Qt::Key_Down, Qt::AltModifier);
    QCOMPARE(SessionRegions().regions[1].id, left);
  }

  void RenameDuplicateAndDelete() {
    QVERIFY(AddRegions());
    Select(0);
    List()->setFocus();
    QTest::keyClick(List(), Qt::Key_F2);
    auto* editor = List()->viewport()->findChild<QLineEdit*>();
    QVERIFY(editor);
    QTest::keyClicks(editor, "petals");
    QTest::keyClick(editor, Qt::Key_Return);
    QTRY_COMPARE(SessionRegions().regions[0].name, std::string("petals"));
    List()->setFocus();
    QSignalSpy added(&Controller(), &SceneController::regionAdded);
    QTest::keyClick(List(), Qt::Key_D, Qt::ControlModifier);
    QTRY_COMPARE_WITH_TIMEOUT(added.count(), 1, kWaitMs);
    const RegionSet three = SessionRegions();
    QCOMPARE(three.regions.size(), size_t(3));
    QCOMPARE(three.regions[1].name, std::string("petals copy"));
    QCOMPARE(three.regions[1].selection, three.regions[0].selection);
    QCOMPARE(window_->current_region(), three.regions[1].id);
    QTest::keyClick(List(), Qt::Key_Delete);
    QCOMPARE(SessionRegions().regions.size(), size_t(2));
    QTRY_COMPARE(List()->topLevelItemCount(), 2);
  }

  void ALayerHasAMenu() {
    QVERIFY(AddRegions());
    Select(0);
    const auto choose = [&](const char* name) {
      const QPoint at = CellCenter(0, RegionsPanel::kColor);
      QContextMenuEvent event(QContextMenuEvent::Mouse, at, List()->viewport()->mapToGlobal(at));
      QCoreApplication::sendEvent(List()->viewport(), &event);
      auto* menu = Find<QMenu>("region_menu");
      QVERIFY(menu->isVisible());
      auto* action = menu->findChild<QAction*>(name);
      QVERIFY2(action, name);
      menu->close();  // as a click does first
      action->trigger();
      QTRY_VERIFY(!window_->findChild<QMenu*>("region_menu"));
    };
    QSignalSpy added(&Controller(), &SceneController::regionAdded);
    choose("menu_duplicate");
    QTRY_COMPARE_WITH_TIMEOUT(added.count(), 1, kWaitMs);
    QCOMPARE(SessionRegions().regions[1].name, std::string("left copy"));
    QSignalSpy masks(Find<RegionsPanel>("regions_panel"), &RegionsPanel::masksWanted);
    choose("menu_masks");
    QCOMPARE(masks.count(), 1);
    auto* dialog = Find<QDialog>("export_dialog");
    QVERIFY(dialog->isVisible());
    dialog->reject();
    choose("menu_rename");
    auto* editor = List()->viewport()->findChild<QLineEdit*>();
    QVERIFY(editor);
    QTest::keyClick(editor, Qt::Key_Escape);
    choose("menu_delete");
    QTRY_COMPARE(List()->topLevelItemCount(), 2);
  }
};

}  // namespace retint

QTEST_MAIN(retint::RegionsPanelTest)
#include "regions_panel_test.moc"
