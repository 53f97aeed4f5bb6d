// SPDX-License-Identifier: BSD-3-Clause
// The method in the real window, by mouse and keys alone: paint on a view, accept, look at it from
// another view, paint on, make it blue, take everything back.
#include <QComboBox>
#include <QLabel>
#include <QProgressBar>
#include <QPushButton>
#include <QToolButton>

#include "tests/viewer/viewer_scene.h"
#include "viewer/panels/color_picker.h"
#include "viewer/panels/edit_panel.h"
#include "viewer/panels/operation_views.h"
#include "viewer/selection/selection_mode.h"

namespace retint {

class WorkflowTest : public ViewerTest {
  Q_OBJECT

 private:
  ViewerScene::Subject subject_;

  SelectionMode& selection() { return window_->selection(); }
  Mask Truth(const std::string& view) { return scene_->Masks(subject_.object).at(view); }
  std::shared_ptr<const RegionSelection> Selection() {
    const Region* region = controller().regions().Find(window_->current_region());
    return region ? region->selection : nullptr;
  }

  static Mask LeftHalf(Mask mask) {
    int low = mask.width, high = 0;
    for (int y = 0; y < mask.height; ++y) {
      for (int x = 0; x < mask.width; ++x) {
        if (mask(x, y) == 0) continue;
        low = std::min(low, x), high = std::max(high, x);
      }
    }
    for (int y = 0; y < mask.height; ++y) {
      for (int x = (low + high) / 2; x < mask.width; ++x) mask(x, y) = 0;
    }
    return mask;
  }

  double MeanIou() { return retint::MeanIou(Selection()->masks, scene_->Masks(subject_.object)); }

  bool Painting() { return WaitPainting(*window_); }
  void Paint(const Mask& mask, Qt::KeyboardModifiers modifiers = Qt::NoModifier) {
    PaintFinely(selection().canvas(), mask, modifiers);
  }

  // Enter, until the scene shows again with the region.
  bool Accept() {
    QTest::keyClick(&selection().canvas(), Qt::Key_Return);
    return QTest::qWaitFor([&] { return !window_->IsSelecting(); }, kWaitMs) &&
           window_->current_region() != 0 && WaitSharp(*window_);
  }

  // Share of the pixels inside and outside a mask of the view that differ between two pictures.
  static std::pair<double, double> Changed(const QImage& a, const QImage& b, const Mask& mask) {
    double inside = 0, all_inside = 0, outside = 0, all_outside = 0;
    for (int y = 0; y < a.height(); ++y) {
      for (int x = 0; x < a.width(); ++x) {
        const int mx = x * mask.width / a.width(), my = y * mask.height / a.height();
        const bool differs = a.pixel(x, y) != b.pixel(x, y);
        (mask(mx, my) ? inside : outside) += differs;
        (mask(mx, my) ? all_inside : all_outside) += 1;
      }
    }
    return {inside / all_inside, outside / all_outside};
  }

 private Q_SLOTS:
  void initTestCase() {
    MakeScene(200, 150, 8);
    subject_ = scene_->MostVisible();
    QVERIFY(subject_.object != 0);
  }
  void cleanupTestCase() { scene_.reset(); }

  void init() {
    QVERIFY(ShowScene());
    SelectOptions select;
    select.depth_method = "gaussian";  // quick; stereo has tests of its own
    selection().SetSelectOptions(select);
    QVERIFY(canvas().GoTo(subject_.first));
    QVERIFY(WaitSharp(*window_));
  }
  void cleanup() { window_.reset(); }

  // The mask and the points take turns; the note of the points tells how to get the mask.
  void TheNoteOfThePointsNamesTheMask() {
    PressKey(*window_, Qt::Key_Return);
    QVERIFY(Painting());
    Paint(Truth(subject_.first));
    QVERIFY(Accept());
    const QString note = "Points of the paint · Shift+M shows the mask";
    QCOMPARE(canvas().CloudNote(), QString());
    QVERIFY(window_->action("show.mask")->isChecked());
    PressKey(*window_, Qt::Key_M);
    QCOMPARE(canvas().CloudNote(), note);
    QVERIFY(!window_->action("show.mask")->isChecked());
    PressKey(*window_, Qt::Key_M, Qt::ShiftModifier);
    QCOMPARE(canvas().CloudNote(), QString());
    PressKey(*window_, Qt::Key_M);
    QCOMPARE(canvas().CloudNote(), note);
    window_->SetCurrentRegion(0);
    QCOMPARE(canvas().CloudNote(), QString());
  }

  // The object changes while the mouse is still down in the color field, even if all panels were
  // hidden.
  void TheColorFieldHasTheKeyboardAfterAccept() {
    window_->SetPanelsShown(false);
    PressKey(*window_, Qt::Key_Return);
    QVERIFY(Painting());
    Paint(Truth(subject_.first));
    QVERIFY(Accept());
    auto* square = window_->findChild<ColorSquare*>("color_square");
    QVERIFY(square->isVisible());
    QVERIFY(square->hasFocus());
    QVERIFY(Settle(controller()));  // the main color is known
    const QImage plain = canvas().frame()->image;
    const QPoint corner(square->width() - 5, 5);
    DragHeld(square, {{20, 20}, corner});
    const ColorEdit& edit = window_->findChild<EditPanel*>()->edit();
    QTRY_VERIFY_WITH_TIMEOUT(canvas().IsSharp() && canvas().frame()->image != plain, kWaitMs);
    QVERIFY(!edit.NeedsMainColor());
    QTest::mouseRelease(square, Qt::LeftButton, {}, corner);
    // An arrow goes on, and the accepted mask no longer hides the color.
    const QColor dragged = NamedColor(edit);
    QTest::keyClick(square, Qt::Key_Left);
    QVERIFY(NamedColor(edit) != dragged);
    QTRY_VERIFY(!window_->action("show.mask")->isChecked());
    controller().colors().CancelRefit();
  }

  void PaintAcceptRecolorAndTakeBack() {
    const QImage before = canvas().frame()->image;
    PressKey(*window_, Qt::Key_Return);
    QVERIFY(window_->IsSelecting());
    QVERIFY(Painting());
    Paint(Truth(subject_.first));
    QVERIFY(Accept());
    QVERIFY(IouOf(Selection()->masks.at(subject_.first), Truth(subject_.first)) > 0.6);
    QVERIFY2(MeanIou() > 0.5, qPrintable(QString::number(MeanIou())));

    // Its points appear only on the object, with a note that the selection has more. M shows them
    // instead of the mask, and hides them.
    PressKey(*window_, Qt::Key_M, Qt::ShiftModifier);
    PressKey(*window_, Qt::Key_M);
    QVERIFY(WaitSharp(*window_));
    const QImage with_points = canvas().frame()->image;
    QCOMPARE(canvas().CloudNote(), QString("Points of the paint · Shift+M shows the mask"));
    Keep(*window_, "points_note");
    PressKey(*window_, Qt::Key_M);
    QVERIFY(WaitSharp(*window_));
    QCOMPARE(canvas().CloudNote(), QString());
    const QImage plain = canvas().frame()->image;
    const auto points = Changed(with_points, plain, Truth(subject_.first));
    QVERIFY2(points.first > 0.05 && points.second < 0.01,
             qPrintable(QString("%1 %2").arg(points.first).arg(points.second)));

    // Made blue by the keyboard.
    QTest::keyClick(window_.get(), Qt::Key_1, Qt::AltModifier);
    auto* text = window_->findChild<QLineEdit*>("color_text");
    text->setFocus();
    text->selectAll();
    QTest::keyClicks(text, "#2040ff");
    QTest::keyClick(text, Qt::Key_Return);
    QTRY_VERIFY_WITH_TIMEOUT(canvas().IsSharp() && canvas().frame()->image != plain, kWaitMs);
    const auto blue = Changed(canvas().frame()->image, plain, Truth(subject_.first));
    QVERIFY2(blue.first > 0.7 && blue.second < 0.2,
             qPrintable(QString("%1 %2").arg(blue.first).arg(blue.second)));

    // All of it undone by keys, to the bit; and redone.
    canvas().setFocus();
    while (controller().history().can_undo) {
      const std::string label = controller().history().undo_label;
      PressKey(*window_, Qt::Key_Z, Qt::ControlModifier);
      QVERIFY(Settle(controller()));
    }
    QVERIFY(controller().regions().regions.empty());
    QTRY_VERIFY_WITH_TIMEOUT(controller().colors().ShowsOriginal() && canvas().IsSharp(), kWaitMs);
    QCOMPARE(canvas().frame()->image, before);
    PressKey(*window_, Qt::Key_Y, Qt::ControlModifier);
    PressKey(*window_, Qt::Key_Y, Qt::ControlModifier);
    QVERIFY(Settle(controller()));
    QCOMPARE(controller().regions().regions.size(), size_t{1});
    const ColorEdit redone = controller().regions().regions.front().edit;
    QCOMPARE(redone.operations.size(), size_t{1});
    QVERIFY(redone.operations[0].kind == ColorOperationKind::kRecolor);
    QCOMPARE(NamedColor(redone).name(), QString("#2040ff"));
    QVERIFY(!redone.NeedsMainColor());  // the measured color is part of the edit
  }

  void ASecondRoundFromAnotherViewExtendsAndItsUndoShows() {
    PressKey(*window_, Qt::Key_B);
    QVERIFY(Painting());
    Paint(LeftHalf(Truth(subject_.first)));
    QVERIFY(Accept());
    const auto half = Selection();
    canvas().SetCloudShown(true);
    QVERIFY(WaitSharp(*window_));
    const QImage half_points = canvas().frame()->image;
    QVERIFY(canvas().GoTo(subject_.second));
    QTest::mouseClick(window_->findChild<QToolButton*>("region_extend"), Qt::LeftButton);
    QVERIFY(window_->IsSelecting());
    QVERIFY(Painting());
    QCOMPARE(window_->findChild<QComboBox*>("selectionTarget")->currentIndex(), 1);
    Paint(Truth(subject_.second));
    QVERIFY(Accept());
    const auto whole = Selection();
    QVERIFY(IouOf(whole->masks.at(subject_.first), Truth(subject_.first)) >
            IouOf(half->masks.at(subject_.first), Truth(subject_.first)) + 0.1);
    QVERIFY(canvas().GoTo(subject_.first));
    canvas().SetCloudShown(true);
    QVERIFY(WaitSharp(*window_));
    QVERIFY(canvas().frame()->image != half_points);
    // Taken back, the canvas shows the points of the first round again.
    PressKey(*window_, Qt::Key_Z, Qt::ControlModifier);
    QTRY_VERIFY_WITH_TIMEOUT(Selection() == half, kWaitMs);
    QTRY_VERIFY_WITH_TIMEOUT(canvas().IsSharp() && canvas().frame()->image == half_points, kWaitMs);
  }

  void EscapeLeavesTheModeAndNothingIsChanged() {
    PressKey(*window_, Qt::Key_B);
    QVERIFY(Painting());
    QTest::keyClick(&selection().canvas(), Qt::Key_L);
    QTest::keyClick(&selection().canvas(), Qt::Key_Escape);  // the tool
    QVERIFY(window_->IsSelecting());
    QTest::keyClick(&selection().canvas(), Qt::Key_Escape);  // the mode
    QVERIFY(!window_->IsSelecting());
    QVERIFY(controller().regions().regions.empty());
    for (int i = 0; i < 5; ++i) PressKey(*window_, Qt::Key_Escape);
    QVERIFY(window_->isVisible());
  }

  void EscapeStopsASelectionThatIsComputed() {
    selection().SetSelectOptions({});  // stereo, which takes its time
    PressKey(*window_, Qt::Key_B);
    QVERIFY(Painting());
    Paint(Truth(subject_.first));
    const Mask painted = selection().canvas().editor().mask();
    QSignalSpy progress(&controller(), &SceneController::progress);
    QTest::keyClick(&selection().canvas(), Qt::Key_Return);
    QTRY_VERIFY_WITH_TIMEOUT(progress.count() > 0, kWaitMs);
    QVERIFY(window_->findChild<QPushButton*>("selectionStop")->isVisible());
    QTest::keyClick(&selection().canvas(), Qt::Key_Escape);
    QVERIFY(Painting());
    QVERIFY(controller().regions().regions.empty() && !controller().history().can_undo);
    QVERIFY(selection().canvas().editor().mask().data == painted.data);
    QVERIFY(Accept());  // nothing is lost
    QCOMPARE(controller().regions().regions.size(), size_t{1});
  }

  void WhatFailsMeanwhileIsSaid() {
    PressKey(*window_, Qt::Key_B);
    QVERIFY(Painting());
    controller().results().WriteSplat("/proc/retint/out.ply");
    const QString error = ReadError(*window_);
    QVERIFY2(error.contains("/proc/retint"), qPrintable(error));
    QVERIFY(window_->IsSelecting());
    // Of its own work the mode speaks itself.
    Paint(Truth(controller().facts()->views.front()->name));
    SelectOptions select;
    select.depth_method = "no such method";
    selection().SetSelectOptions(select);
    QTest::keyClick(&selection().canvas(), Qt::Key_Return);
    QTRY_VERIFY_WITH_TIMEOUT(selection().message().contains("method must be"), kWaitMs);
    QVERIFY(Painting() && !window_->dialogs().box());
  }

  void TheStatusBarsCancelStopsWhatRuns() {
    auto* cancel = window_->findChild<QToolButton*>("cancel");
    auto* progress = window_->findChild<QProgressBar*>("progress");
    QVERIFY(cancel && progress && !cancel->isVisible());
    QSignalSpy cancelled(&controller(), &SceneController::cancelled);
    controller().Run("Counting sheep", [](EditSession&, Monitor& monitor) {
      for (int i = 0;; ++i) {
        monitor.Step("sheep", std::min(i, 40), 100);
        QTest::qSleep(2);
      }
    });
    QTRY_VERIFY_WITH_TIMEOUT(progress->isVisible() && progress->value() > 300, kWaitMs);
    QVERIFY(window_->findChild<QLabel*>("message")->text().contains("Counting sheep"));
    // The window answers meanwhile.
    PressKey(*window_, Qt::Key_Right);
    QVERIFY(WaitSharp(*window_));
    QTest::mouseClick(cancel, Qt::LeftButton);
    QTRY_COMPARE_WITH_TIMEOUT(cancelled.count(), 1, kWaitMs);
    QTRY_VERIFY_WITH_TIMEOUT(!progress->isVisible() && !cancel->isVisible(), kWaitMs);
    QVERIFY(!window_->dialogs().box());
  }
};

}  // namespace retint

QTEST_MAIN(retint::WorkflowTest)
#include "workflow_test.moc"
