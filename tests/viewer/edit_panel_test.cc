// SPDX-License-Identifier: BSD-3-Clause
// The modes in which a region's edit is made, in the real window, with mouse and keys, checked by
// the session's state.
#include <cmath>

#include <QAction>
#include <QClipboard>
#include <QLabel>
#include <QMenu>
#include <QSlider>
#include <QToolButton>

#include "base/files.h"
#include "kernels/common/color_spaces.h"
#include "tests/viewer/edit_panel_fixture.h"
#include "viewer/panels/edit_panel.h"
#include "viewer/panels/swatch_row.h"
#include "viewer/scene/view_editor.h"

namespace retint {

namespace fs = std::filesystem;

class EditPanelTest : public EditPanelFixture {
  Q_OBJECT

 private Q_SLOTS:
  void initTestCase() { MakeTheme(); }
  void init() { QVERIFY(ShowScene()); }
  void cleanup() { Close(); }

  void AColorThatIsPickedBecomesTheRegions() {
    QVERIFY(AddPlain());
    QVERIFY(Find<QAction>("mode_recolor")->isChecked());
    auto* square = Find<ColorSquare>("color_square");
    QSignalSpy shown(&Controller().colors(), &SceneColors::shChanged);
    // Faster than the main color is measured, and on after it was.
    DragHeld(square, {{10, 10}, {40, 30}, {80, 60}});
    QVERIFY(Measured());
    QTRY_VERIFY_WITH_TIMEOUT(shown.count() > 0, kWaitMs);
    DragHeld(square, {{90, 60}, {120, 40}});
    QTest::mouseRelease(square, Qt::LeftButton, {}, {120, 40});
    QVERIFY(Measured());
    const ColorEdit edit = Edit();
    QCOMPARE(edit.operations.size(), size_t{1});
    QVERIFY(edit.operations[0].kind == Kind::kRecolor);
    QVERIFY(edit.operations[0].IsSet("from") && edit.operations[0].IsSet("brightest"));
    QCOMPARE(NamedColor(edit).name(), Find<ColorPicker>("color_picker")->color().name());
    QCOMPARE(List()->topLevelItem(0)->text(RegionsPanel::kColor), NamedColor(edit).name());
    // A second color replaces the first, whatever was measured stays.
    TypeColor("#2040ff");
    const ColorEdit blue = Edit();
    QCOMPARE(blue.operations.size(), size_t{1});
    QCOMPARE(NamedColor(blue).name(), QString("#2040ff"));
    QVERIFY(std::ranges::equal(blue.operations[0].Get("from"), edit.operations[0].Get("from")));
    // The color that is replaced can be named, and measured again.
    Type("recolor.keep_lightness", "0.5");
    QCOMPARE(Edit().operations[0].Get("keep_lightness")[0], 0.5F);
    Click("recolor.keep_lightness_reset");
    QCOMPARE(Edit().operations[0].Get("keep_lightness")[0], 0.0F);
    Click("recolor_measure");
    QVERIFY(Measured());
    QVERIFY(Edit() == blue);
  }

  void ModesAddStepsToOneList() {
    QVERIFY(AddPlain());
    TypeColor("#2040ff");
    QVERIFY(Measured());
    Click("mode_tint");
    Type("tint.color0", "0.5");
    Click("mode_adjust");
    Type("adjust.hue", "30");
    Type("adjust.chroma", "1.5");
    Click("mode_grade");
    Type("exposure.stops", "0.5");
    Type("white_balance.temperature", "20");
    Click("invert.on");
    Click("soft_clip.on");
    Type("gamma.gamma", "1.2");  // before the clip, which stays the last
    QVERIFY(Kinds() ==
            (std::vector{Kind::kRecolor, Kind::kTint, Kind::kAdjust, Kind::kExposure,
                         Kind::kWhiteBalance, Kind::kInvert, Kind::kGamma, Kind::kSoftClip}));
    const ColorEdit edit = Edit();
    QCOMPARE(edit.operations[1].values[0], 0.5F);
    QCOMPARE(edit.operations[2].Get("hue")[0], 30.0F);
    QCOMPARE(edit.operations[2].Get("chroma")[0], 1.5F);
    QCOMPARE(edit.operations[3].values[0], 0.5F);
    QCOMPARE(Steps()->topLevelItemCount(), 8);
    QCOMPARE(Steps()->topLevelItem(3)->text(0), QString("Exposure +0.5"));
    // A step whose parameters are all reset leaves the list.
    Click("exposure.stops_reset");
    Click("invert.on");
    QVERIFY(Kinds() == (std::vector{Kind::kRecolor, Kind::kTint, Kind::kAdjust, Kind::kWhiteBalance,
                                    Kind::kGamma, Kind::kSoftClip}));
    Click("mode_adjust");
    Click("adjust.hue_reset");
    QCOMPARE(Edit().operations[2].Get("chroma")[0], 1.5F);
    QCOMPARE(Edit().operations[2].Get("hue")[0], 0.0F);
    // Every one of these was a step of the history. The page stays, and no other step is at hand.
    Click("adjust.chroma_reset");
    QCOMPARE(Kinds().size(), size_t{5});
    QVERIFY(Find<QAction>("mode_adjust")->isChecked());
    QVERIFY(!Steps()->currentItem());
    QVERIFY(!Find<QToolButton>("operation_remove")->isEnabled());
    window_->action("edit.undo")->trigger();
    QCOMPARE(Kinds().size(), size_t{6});
    // The step that came back to the page is the current one.
    QTRY_VERIFY(Steps()->currentItem() == Steps()->topLevelItem(2));
    QVERIFY(Find<QToolButton>("operation_remove")->isEnabled());
  }

  void ASliderIsLiveAndOneStep() {
    QVERIFY(AddRegions());
    Select(0);
    QVERIFY(Settle(Controller()));
    const ColorEdit before = Edit();
    Click("mode_grade");
    auto* slider = Find<QSlider>("saturation.factor_slider");
    QSignalSpy shown(&Controller().colors(), &SceneColors::shChanged);
    slider->setSliderDown(true);
    for (const int at : {150, 120, 90, 60}) slider->setValue(at);
    QTRY_VERIFY_WITH_TIMEOUT(shown.count() > 0, kWaitMs);  // still held
    slider->setSliderDown(false);
    QCOMPARE(Edit().operations.size(), size_t{2});
    // A slider of 400 steps from 0 to 3.
    QVERIFY(std::abs(Edit().operations[1].values[0] - 60 * 3.0F / 400) < 0.006F);  // two decimals
    window_->action("edit.undo")->trigger();
    QVERIFY(Edit() == before);
  }

  void ARangeOfColors() {
    QVERIFY(AddRegions());
    Select(0);
    Click("mode_adjust");
    Type("adjust.hue", "40");
    QVERIFY(!Find<QDoubleSpinBox>("adjust.hues0")->isVisible());
    Click("adjust_ranged");
    QVERIFY(Find<QDoubleSpinBox>("adjust.hues0")->isVisibleTo(window_.get()));
    Type("adjust.hues0", "200");
    Type("adjust.hues1", "300");
    QCOMPARE(Edit().operations[1].Get("hues")[0], 200.0F);
    // Ends that nobody set are those of the colors that there are, and leave none out.
    auto* most = Find<QDoubleSpinBox>("adjust.lightnesses1");
    QCOMPARE(most->value(), 1.0);
    QCOMPARE(Find<QDoubleSpinBox>("adjust.chromas1")->value(), 0.4);
    Type("adjust.lightnesses1", "0.8");
    QCOMPARE(Edit().operations[1].Get("lightnesses")[1], 0.8F);
    Click("adjust.lightnesses1_reset");
    QCOMPARE(most->value(), 1.0);
    QCOMPARE(Edit().operations[1].Get("lightnesses")[1], 10.0F);
    // An empty range is explained and not taken.
    Type("adjust.hues1", "200");
    QVERIFY2(Problem().contains("range of hues is empty"), qPrintable(Problem()));
    QCOMPARE(Edit().operations[1].Get("hues")[1], 300.0F);
    Type("adjust.hues1", "250");
    QCOMPARE(Problem(), QString());
    Click("adjust_ranged");
    QCOMPARE(Edit().operations[1].Get("hues")[0], 0.0F);
    QCOMPARE(Edit().operations[1].Get("hues")[1], 360.0F);
    QCOMPARE(Edit().operations[1].Get("hue")[0], 40.0F);
    // The box says what the edit that shows is like.
    Click("adjust_ranged");
    Type("adjust.hues0", "200");
    Select(1);
    Click("mode_adjust");
    QVERIFY(!Find<QCheckBox>("adjust_ranged")->isChecked());
    QVERIFY(!Find<QDoubleSpinBox>("adjust.hues0")->isVisible());
    Select(0);
    Click("mode_adjust");
    QVERIFY(Find<QCheckBox>("adjust_ranged")->isChecked());
    QCOMPARE(Edit().operations[1].Get("hues")[0], 200.0F);
  }

  void ThereIsNothingToResetInAnEditOfNoSteps() {
    QVERIFY(AddPlain());
    for (const char* mode : {"mode_recolor", "mode_tint", "mode_adjust", "mode_grade"}) {
      Click(mode);
      for (auto* button : Find<EditPanel>("edit_panel")->findChildren<QToolButton*>()) {
        const QString name = button->objectName();
        if (!name.endsWith("_reset") || !button->isVisible()) continue;
        QVERIFY2(!button->isEnabled(), qPrintable(name));
      }
    }
  }

  // Common operations first, the others one step further.
  void TheMenuBeginsWithWhatPeopleKnow() {
    QVERIFY(AddPlain());
    const QMenu* menu = Find<QToolButton>("operation_add")->menu();
    QStringList first;
    for (const QAction* action : menu->actions()) {
      if (action->isVisible()) first << action->text();
    }
    QCOMPARE(first.mid(0, 9), QStringList({"Recolor", "Adjust", "Curves", "Levels", "Grade", "LUT",
                                           "Gradient", "Palette", "Picture"}));
    QCOMPARE(first.last(), QString("More"));
    QVERIFY(!first.contains("Matrix") && !first.contains("Soft clip"));
    Find<QAction>("mode_gradient")->trigger();
    QVERIFY(Find<QWidget>("gradient_add")->isVisible());
    QVERIFY(Edit().operations.empty());  // until something is changed
  }

  void WhatShouldBeGrayBecomesGray() {
    QVERIFY(AddRegions());
    Select(0);
    Click("mode_grade");
    Click("white_balance_pick");
    QVERIFY(window_->canvas().picking());
    window_->canvas().SetPicking(false);
    // A gray in warm light.
    const QColor warm(200, 180, 150);
    Find<EditPanel>("edit_panel")->TakePicked(warm);
    QVERIFY(Kinds() == (std::vector{Kind::kTint, Kind::kWhiteBalance}));
    const ColorOperation balance = Edit().operations[1];
    QVERIFY(balance.Get("temperature")[0] < 0);  // towards cooler light
    const Eigen::Vector3f gray =
        CompiledEdit({{balance}, 1}).Apply({warm.redF(), warm.greenF(), warm.blueF()});
    const OkLab lab = OkLabFromSrgb(gray.data());
    // The last steps are of half a mired, each about 0.0003 of chroma.
    QVERIFY2(std::hypot(lab.a, lab.b) < 0.002F, qPrintable(QString::number(double(lab.a))));
    const auto* note = Find<QLabel>("white_balance_note");
    QVERIFY(!note->isVisible());
    Find<EditPanel>("edit_panel")->TakePicked(QColor(255, 32, 32));
    QVERIFY(note->isVisible());
    QVERIFY2(note->text().contains("cannot make #ff2020 fully gray"), qPrintable(note->text()));
    Type("white_balance.temperature", "20");
    QVERIFY(!note->isVisible());
  }

  void StepsAreOrderedSwitchedAndRemoved() {
    QVERIFY(AddRegions());
    Select(0);
    Click("mode_grade");
    Type("exposure.stops", "1");
    Type("contrast.factor", "1.5");
    QVERIFY(Kinds() == (std::vector{Kind::kTint, Kind::kExposure, Kind::kContrast}));
    // The step at hand is the one that was made last.
    QCOMPARE(Steps()->indexOfTopLevelItem(Steps()->currentItem()), 2);
    Steps()->setFocus();
    QTest::keyClick(Steps(), Qt::Key_Up, Qt::AltModifier);
    QVERIFY(Kinds() == (std::vector{Kind::kTint, Kind::kContrast, Kind::kExposure}));
    QVERIFY(window_->canvas().navigation().view());  // the arrow did not go to another view
    Steps()->setFocus();
    for (const char* typed : {"half", "101", "40"}) {
      QTest::keyClick(Steps(), Qt::Key_F2);
      auto* field = Steps()->viewport()->findChild<QLineEdit*>();
      QVERIFY(field);
      field->selectAll();
      QTest::keyClicks(field, typed);
      QTest::keyClick(field, Qt::Key_Return);
      QTRY_COMPARE(Problem().contains("0 to 100"), QString(typed) != "40");
      QTRY_VERIFY(!Steps()->viewport()->findChild<QLineEdit*>());
    }
    QCOMPARE(Edit().operations[1].strength, 0.4F);
    // Off and on again, it has the strength that it had.
    Steps()->setFocus();
    QTest::keyClick(Steps(), Qt::Key_Space);
    QCOMPARE(Edit().operations[1].strength, 0.0F);
    QTest::keyClick(Steps(), Qt::Key_Space);
    QCOMPARE(Edit().operations[1].strength, 0.4F);
    QTest::keyClick(Steps(), Qt::Key_Delete);
    QVERIFY(Kinds() == (std::vector{Kind::kTint, Kind::kExposure}));
    // A second one of a kind, from the menu; the page is about the row that is current.
    for (QAction* action : Find<QMenu>("operation_more")->actions()) {
      if (action->objectName() == "exposure") action->trigger();
    }
    Type("exposure.stops", "-2");
    QCOMPARE(Edit().operations[1].values[0], 1.0F);
    QCOMPARE(Edit().operations[2].values[0], -2.0F);
    const QRect row = Steps()->visualItemRect(Steps()->topLevelItem(1));
    QTest::mouseClick(Steps()->viewport(), Qt::LeftButton, {}, row.center());
    QCOMPARE(Find<QDoubleSpinBox>("exposure.stops")->value(), 1.0);
    // No list is longer than the program's.
    auto* add = Find<QToolButton>("operation_add");
    for (int guard = 0; add->isEnabled() && guard < 40; ++guard) {
      for (QAction* action : Find<QMenu>("operation_more")->actions()) {
        if (action->objectName() == "gray") action->trigger();
      }
    }
    QCOMPARE(Edit().operations.size(), size_t(kMaxColorOps));
  }

  void AnEditIsCopiedToAnotherRegion() {
    QVERIFY(AddRegions());
    Select(0);
    TypeColor("#ff8000");
    Click("mode_recolor");
    TypeColor("#2040ff");
    QVERIFY(Measured());
    Click("edit_copy");
    const QString text = QApplication::clipboard()->text();
    QVERIFY2(text.contains("\"recolor\""), qPrintable(text));
    const ColorEdit copied = Edit(0);
    Select(1);
    Click("edit_paste");
    QTRY_VERIFY_WITH_TIMEOUT(
        Regions()[1].edit.operations.size() == 2 && !Regions()[1].edit.NeedsMainColor(), kWaitMs);
    const ColorEdit pasted = Edit(1);
    QVERIFY(pasted.operations[0] == copied.operations[0]);
    QCOMPARE(NamedColor(pasted).name(), QString("#2040ff"));
    // The other region's main color, not the first one's.
    QVERIFY(
        !std::ranges::equal(pasted.operations[1].Get("from"), copied.operations[1].Get("from")));
    QApplication::clipboard()->setText("no edit");
    Click("edit_paste");
    QVERIFY2(Problem().contains("is no edit"), qPrintable(Problem()));
    QVERIFY(Edit(1) == pasted);
  }

  void AColorIsTakenFromThePicture() {
    QVERIFY(AddPlain());
    QVERIFY(WaitSharp(*window_));
    Canvas& canvas = window_->canvas();
    Click("color_pipette");
    QVERIFY(canvas.picking());
    // Esc gives it up and nothing else.
    const auto* message = window_->findChild<QLabel*>("message");
    QVERIFY(message->text().contains("Esc"));
    QTest::keyClick(&canvas, Qt::Key_Escape);
    QVERIFY(!canvas.picking());
    QCOMPARE(message->text(), QString());  // there is nothing to click any more
    QVERIFY(Edit().operations.empty());
    Click("color_pipette");
    QVERIFY(WaitSharp(*window_));  // without the points of the selection
    const QImage image = canvas.frame()->image;
    const QRectF rect = canvas.ImageRect(canvas.frame()->camera);
    const QPoint at = rect.center().toPoint();
    const QPointF share((at.x() - rect.left()) / rect.width(),
                        (at.y() - rect.top()) / rect.height());
    const QRgb under = image.pixel(int(share.x() * image.width()), int(share.y() * image.height()));
    QTest::mouseClick(&canvas, Qt::LeftButton, {}, at);
    QVERIFY(!canvas.picking());
    QCOMPARE(Find<ColorPicker>("color_picker")->color().rgb(), under);
    QVERIFY(Measured());
    QCOMPARE(NamedColor(Edit()).rgb(), under);
    // The photo of the view, while its key is held.
    const QImage photo =
        ReadPicture(*folder_ / "ws" / "images" / canvas.navigation().view()->name, 0);
    QVERIFY(!photo.isNull());
    Click("color_pipette");
    QTest::keyPress(&canvas, Qt::Key_P);
    QTRY_VERIFY_WITH_TIMEOUT(canvas.showing_photo(), kWaitMs);
    const QPoint other = rect.center().toPoint() + QPoint(int(rect.width() / 8), 0);
    const QPointF there((other.x() - rect.left()) / rect.width(),
                        (other.y() - rect.top()) / rect.height());
    QTest::mouseClick(&canvas, Qt::LeftButton, {}, other);
    QTest::keyRelease(&canvas, Qt::Key_P);
    QCOMPARE(Find<ColorPicker>("color_picker")->color().rgb(),
             photo.pixel(int(there.x() * photo.width()), int(there.y() * photo.height())));
  }

  // By a program that here swaps red and blue, and saves by replacing the file.
  void AViewIsEditedElsewhere() {
    QVERIFY(AddPlain());
    QVERIFY(WaitSharp(*window_));
    auto* editor = window_->findChild<ViewEditor*>();
    QVERIFY(editor);
    QString opened;
    editor->SetOpener([&](const QString& path) {
      opened = path;
      return true;
    });
    const auto save = [&](const QImage& picture) {
      QVERIFY(picture.save(opened + ".new", "PNG"));
      fs::rename((opened + ".new").toStdString(), opened.toStdString());
    };
    Click("mode_picture");
    Click("picture_elsewhere");
    QTRY_VERIFY_WITH_TIMEOUT(!opened.isEmpty(), kWaitMs);
    const QImage written(opened);
    QVERIFY(!written.isNull());
    QVERIFY(Edit().operations.empty());  // opening it is no edit
    // Cut off, as while it is being written.
    WriteFile(opened.toStdString(), "\x89PNG");
    save(written.rgbSwapped());
    QTRY_VERIFY_WITH_TIMEOUT(!Regions()[0].edit.operations.empty(), kWaitMs);
    QVERIFY(Measured());
    QVERIFY(!window_->canvas().cloud_shown());  // it would hide the change
    const ColorEdit edit = Edit();
    QCOMPARE(edit.operations.size(), size_t{1});
    const ColorOperation& picture = edit.operations[0];
    QVERIFY(picture.kind == Kind::kPicture && picture.table);
    QCOMPARE(Steps()->currentItem(), Steps()->topLevelItem(0));
    QCOMPARE(picture.picture->pictures[0].view, window_->canvas().navigation().view()->name);
    QVERIFY(Find<QLabel>("picture_found")->text().contains("color map explains"));
    // Saved again as it was, the same step says that nothing was changed.
    save(written);
    QTRY_VERIFY_WITH_TIMEOUT(
        !Regions()[0].edit.NeedsMainColor() && !Regions()[0].edit.operations[0].table, kWaitMs);
    QCOMPARE(Edit().operations.size(), size_t{1});
    // The photo is another file.
    const QString first = opened;
    Click("picture_photo_elsewhere");
    QTRY_VERIFY_WITH_TIMEOUT(opened != first, kWaitMs);
    QVERIFY(QImage(opened).size() == written.size());
    // A render does not pass for a photo that is not there.
    const fs::path photo = *folder_ / "ws" / "images" / window_->canvas().navigation().view()->name;
    fs::rename(photo, photo.string() + ".away");
    const QString second = opened;
    Click("picture_photo_elsewhere");
    const auto* message = window_->findChild<QLabel*>("message");
    QTRY_VERIFY2(message->text().contains("has no photo"), qPrintable(message->text()));
    QVERIFY(Settle(Controller()));
    QCOMPARE(opened, second);
    fs::rename(photo.string() + ".away", photo);
  }

  void ColorsAreKept() {
    QVERIFY(AddPlain());
    TypeColor("#2040ff");
    Click("swatch_add");
    TypeColor("#ff8000");
    auto* swatches = Find<SwatchRow>("swatches");
    QCOMPARE(swatches->colors().size(), size_t{1});
    auto* recent = Find<SwatchRow>("recent_colors");
    QTRY_VERIFY_WITH_TIMEOUT(!recent->colors().empty(), kWaitMs);
    QCOMPARE(recent->colors().front().name(), QString("#ff8000"));
    QToolButton* blue = nullptr;
    for (auto* cell : swatches->findChildren<QToolButton*>()) {
      if (cell->accessibleName() == "#2040ff" && cell->isVisibleTo(swatches)) blue = cell;
    }
    QVERIFY(blue);
    QTest::mouseClick(blue, Qt::LeftButton);
    QVERIFY(Measured());
    QCOMPARE(NamedColor(Edit()).name(), QString("#2040ff"));
    // The next window has them too.
    const SwatchRow later("", "swatches", SwatchRow::Form::kKept, window_.get());
    QCOMPARE(later.colors().front().name(), QString("#2040ff"));
    QTest::mouseClick(blue, Qt::RightButton);
    QVERIFY(swatches->colors().empty());
  }

  // The keyboard stays at the plus that was pressed, and Tab goes from there to the next
  // control.
  void KeptColorsLeaveTheFocus() {
    QVERIFY(AddPlain());
    auto* plus = Find<QToolButton>("swatch_add");
    const std::pair<const char*, const char*> colors[] = {{"#204060", "#406080"},
                                                          {"#a04020", "#c06040"}};
    for (const auto& [kept, next] : colors) {
      TypeColor(kept);
      plus->setFocus();
      QTest::keyClick(plus, Qt::Key_Space);
      QVERIFY(plus->hasFocus());
      TypeColor(next);
    }
    auto* swatches = Find<SwatchRow>("swatches");
    QCOMPARE(swatches->colors().size(), size_t{2});
    plus->setFocus();
    for (const char* name : {"#a04020", "#204060"}) {
      QTest::keyClick(QApplication::focusWidget(), Qt::Key_Backtab, Qt::ShiftModifier);
      QCOMPARE(QApplication::focusWidget()->accessibleName(), QString(name));
    }
    // One that is taken away leaves it at the next.
    QTest::keyClick(QApplication::focusWidget(), Qt::Key_Delete);
    QCOMPARE(QApplication::focusWidget()->accessibleName(), QString("#a04020"));
    QTest::keyClick(QApplication::focusWidget(), Qt::Key_Delete);
    QVERIFY(swatches->colors().empty());
    // A color that was chosen anew becomes the first.
    auto* recent = Find<SwatchRow>("recent_colors");
    QTRY_VERIFY_WITH_TIMEOUT(!recent->colors().empty(), kWaitMs);
    auto* newest = recent->findChildren<QToolButton*>().front();
    newest->setFocus();
    const size_t before = recent->colors().size();
    TypeColor("#102030");
    newest->setFocus();
    QTRY_COMPARE_WITH_TIMEOUT(recent->colors().size(), before + 1, kWaitMs);
    QVERIFY(newest->hasFocus());
  }

  // A number that was set back has nothing more to set back.
  void ResettingByKeyStaysInItsRow() {
    QVERIFY(AddPlain());
    Click("mode_grade");
    Type("saturation.factor", "0.5");
    auto* reset = Find<QToolButton>("saturation.factor_reset");
    reset->setFocus();
    QTest::keyClick(reset, Qt::Key_Space);
    QCOMPARE(Find<QDoubleSpinBox>("saturation.factor")->value(), 1.0);
    QVERIFY(Find<QSlider>("saturation.factor_slider")->hasFocus());
  }

  // The scene's color, not that of overlays or of other pictures.
  void APickedColorIsTheScenes() {
    QVERIFY(AddPlain());
    Canvas& canvas = window_->canvas();
    canvas.SetCloudShown(false);
    QVERIFY(WaitSharp(*window_));
    const QImage scene = canvas.frame()->image;
    const auto facts = Controller().facts();
    canvas.SetUncertain(
        std::make_shared<const std::vector<float>>(facts->original->NumGaussians(), 1.0F));
    canvas.SetHatching(true);
    QVERIFY(WaitSharp(*window_));
    const QImage hatched = canvas.frame()->image;
    // A pixel that the hatching covers.
    QPoint pixel(-1, -1);
    for (int y = scene.height() / 4; y < scene.height() && pixel.x() < 0; ++y) {
      for (int x = scene.width() / 4; x < scene.width() && pixel.x() < 0; ++x) {
        if (hatched.pixel(x, y) != scene.pixel(x, y)) pixel = {x, y};
      }
    }
    QVERIFY(pixel.x() >= 0);
    const auto pick = [&] {
      Click("color_pipette");
      const QPoint at = (canvas.ImageRect(canvas.frame()->camera).topLeft() + pixel).toPoint();
      // At once: it waits for a picture of the scene alone.
      QTest::mouseClick(&canvas, Qt::LeftButton, {}, at);
      if (!canvas.picking()) return QColor();
      if (!WaitSharp(*window_)) return QColor();
      QTest::mouseClick(&canvas, Qt::LeftButton, {}, at);
      return canvas.picking() ? QColor() : Find<ColorPicker>("color_picker")->color();
    };
    QCOMPARE(pick().name(), QColor(scene.pixel(pixel)).name());
    QVERIFY(Measured());
    window_->action("edit.undo")->trigger();
    QVERIFY(Edit().operations.empty());
    QTRY_VERIFY_WITH_TIMEOUT(*Controller().colors().sh() == *Controller().colors().original_sh(),
                             kWaitMs);
    canvas.SetHatching(false);
    canvas.SetDepth(true);
    QVERIFY(WaitSharp(*window_));
    QCOMPARE(pick().name(), QColor(scene.pixel(pixel)).name());
    QVERIFY(WaitSharp(*window_));
    QVERIFY(canvas.depth() && canvas.frame()->what == RenderWhat::kDepth);  // as before
  }
};

}  // namespace retint

QTEST_MAIN(retint::EditPanelTest)
#include "edit_panel_test.moc"
