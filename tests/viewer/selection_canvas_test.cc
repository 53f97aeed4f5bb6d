// SPDX-License-Identifier: BSD-3-Clause
// The selection canvas with mouse and keys, checked by the pixels of the mask.
#include "viewer/selection/selection_canvas.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include <QAbstractButton>
#include <QAction>
#include <QKeyEvent>
#include <QMenu>
#include <QMouseEvent>
#include <QSignalSpy>
#include <QSlider>
#include <QSpinBox>
#include <QTest>
#include <QToolButton>
#include <QWheelEvent>

#include "tests/viewer/canvas_fixture.h"
#include "viewer/selection/accept_button.h"
#include "viewer/selection/selection_bar.h"

namespace retint {

constexpr int kWidth = 80, kHeight = 60;  // of the picture
constexpr int kZoom = 5;                  // the widget shows it five times as large

class SelectionCanvasTest : public CanvasFixture {
  Q_OBJECT

 private Q_SLOTS:
  void init() {
    QImage image(kWidth, kHeight, QImage::Format_RGB32);
    DepthMap depth(kWidth, kHeight, 2);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        image.setPixel(x, y, x < 40 ? qRgb(90, 90, 90) : qRgb(20, 60, 160));
        if (y >= 30) depth(x, y) = 3;  // the lower half lies behind a step
      }
    }
    Show(image, depth, kZoom);
  }

  void TheBrushPaintsWhereTheMouseIs() {
    QSignalSpy edited(canvas_.get(), &SelectionCanvas::edited);
    Drag({At(20, 15), At(50, 15)});
    QVERIFY(edited.count() > 0);
    for (int x = 17; x <= 53; ++x) QCOMPARE(Mask(x, 15), 255);
    QCOMPARE(Mask(14, 15), 0);
    QCOMPARE(Mask(57, 15), 0);
    QCOMPARE(Mask(35, 20), 0);
    QCOMPARE(Mask(35, 12), 255);
    QCOMPARE(Mask(35, 10), 0);
  }

  void AFastStrokeHasNoGaps() {
    QTest::mousePress(canvas_.get(), Qt::LeftButton, {}, At(5, 5));
    Move(At(70, 50), Qt::LeftButton);
    QTest::mouseRelease(canvas_.get(), Qt::LeftButton, {}, At(70, 50));
    for (int i = 0; i <= 65; ++i) QCOMPARE(Mask(5 + i, 5 + (i * 45) / 65), 255);
  }

  void ModifiersOfTheBrush() {
    Drag({At(20, 15), At(50, 15)});
    const size_t stroke = Inside();
    Drag({At(20, 30), At(50, 30)}, Qt::ShiftModifier);
    QVERIFY(Inside() > stroke);
    QCOMPARE(Mask(35, 15), 255);
    Drag({At(35, 15), At(50, 15)}, Qt::ControlModifier);
    QCOMPARE(Mask(40, 15), 0);
    QCOMPARE(Mask(22, 15), 255);
    Drag({At(20, 30), At(30, 30)}, Qt::ControlModifier | Qt::ShiftModifier);
    QCOMPARE(Mask(25, 30), 255);
    QCOMPARE(Mask(45, 30), 0);
    QCOMPARE(Mask(22, 15), 0);
  }

  void TheEraserErases() {
    Drag({At(20, 15), At(50, 15)});
    Key(Qt::Key_E);
    QCOMPARE(Tool(), QString("eraser"));
    Drag({At(35, 5), At(35, 25)});
    QCOMPARE(Mask(35, 15), 0);
    QCOMPARE(Mask(22, 15), 255);
  }

  void TheRectangleAndItsModifiers() {
    Key(Qt::Key_R);
    QCOMPARE(Tool(), QString("rectangle"));
    Drag({At(10, 10), At(30, 30)});
    const size_t first = Inside();
    QVERIFY(first >= 19 * 19 && first <= 21 * 21);
    QCOMPARE(Mask(12, 12), 255);
    Drag({At(60, 40), At(40, 20)});  // replaces; drawn backwards
    QCOMPARE(Mask(12, 12), 0);
    QCOMPARE(Mask(50, 30), 255);
    Drag({At(10, 10), At(30, 30)}, Qt::ShiftModifier);
    QCOMPARE(Mask(12, 12), 255);
    QCOMPARE(Mask(50, 30), 255);
    Drag({At(5, 5), At(20, 50)}, Qt::ControlModifier);
    QCOMPARE(Mask(12, 12), 0);
    QCOMPARE(Mask(25, 25), 255);
    Drag({At(22, 22), At(50, 28)}, Qt::ShiftModifier | Qt::ControlModifier);
    QCOMPARE(Mask(25, 25), 255);
    QCOMPARE(Mask(25, 12), 0);
    QCOMPARE(Mask(55, 30), 0);
  }

  void TheLassoFollowsTheMouse() {
    Key(Qt::Key_L);
    Drag({At(10, 10), At(40, 10), At(40, 40), At(10, 40)});
    QCOMPARE(Mask(25, 25), 255);
    QCOMPARE(Mask(5, 25), 0);
    QCOMPARE(Mask(45, 25), 0);
    // A figure of eight is inside in both loops and even-odd where they overlap.
    Drag({At(10, 10), At(60, 50), At(60, 10), At(10, 50)});
    QCOMPARE(Mask(14, 30), 255);
    QCOMPARE(Mask(56, 30), 255);
    QCOMPARE(Mask(35, 12), 0);
  }

  void ThePolygonClosesByEnterDoubleClickAndItsFirstCorner() {
    Key(Qt::Key_P);
    QSignalSpy accepted(canvas_.get(), &SelectionCanvas::acceptRequested);
    for (const QPoint& at : {At(10, 10), At(40, 10), At(40, 40)}) Click(at);
    QCOMPARE(Inside(), size_t{0});
    Key(Qt::Key_Return);
    QCOMPARE(accepted.count(), 0);
    QCOMPARE(Mask(35, 15), 255);
    QCOMPARE(Mask(15, 35), 0);

    Click(At(10, 10)), Click(At(70, 10)), Click(At(70, 50));
    Click(At(10, 50));
    QTest::mouseDClick(canvas_.get(), Qt::LeftButton, {}, At(10, 50));
    QCOMPARE(Mask(15, 45), 255);

    Click(At(10, 10)), Click(At(20, 10)), Click(At(20, 20)), Click(At(70, 55));
    Key(Qt::Key_Backspace);
    Click(At(10, 10));
    QCOMPARE(Mask(18, 12), 255);
    QCOMPARE(Mask(60, 45), 0);
    QCOMPARE(Mask(60, 20), 0);
  }

  // A key that is held closes the outline, and does not go on to accept it.
  void AHeldEnterDoesNotAccept() {
    Key(Qt::Key_P);
    QSignalSpy accepted(canvas_.get(), &SelectionCanvas::acceptRequested);
    for (const QPoint& at : {At(10, 10), At(40, 10), At(40, 40)}) Click(at);
    Key(Qt::Key_Return);
    QVERIFY(Inside() > 0);
    QKeyEvent held(QEvent::KeyPress, Qt::Key_Return, Qt::NoModifier, QString(), /*autorep=*/true);
    QCoreApplication::sendEvent(canvas_.get(), &held);
    QCOMPARE(accepted.count(), 0);
    Key(Qt::Key_Return);
    QCOMPARE(accepted.count(), 1);
  }

  void AStrokeThatIsNotTakenIsAnswered() {
    canvas_->SetPaintable(false);
    QSignalSpy told(canvas_.get(), &SelectionCanvas::notFound);
    Drag({At(10, 10), At(30, 30)});
    QCOMPARE(Inside(), size_t{0});
    QCOMPARE(told.count(), 1);
  }

  void AcceptIsOfferedBesideTheStroke() {
    AcceptButton accept(canvas_.get());
    accept.SetPaintable(true);
    QSignalSpy clicked(&accept, &QPushButton::clicked);
    Drag({At(10, 10), At(30, 20)});
    QTRY_VERIFY(accept.isVisible());
    QVERIFY((accept.geometry().topLeft() - At(30, 20)).manhattanLength() < 80);
    QVERIFY(!accept.geometry().contains(At(30, 20)));  // the next stroke may begin there
    QCOMPARE(accept.focusPolicy(), Qt::NoFocus);       // the keyboard stays the canvas's
    QTest::mouseClick(&accept, Qt::LeftButton);
    QCOMPARE(clicked.count(), 1);
    Drag({At(70, 50), At(kWidth - 1, kHeight - 1)});  // in the corner
    QTRY_VERIFY(accept.isVisible());
    QVERIFY(canvas_->rect().contains(accept.geometry()));
    canvas_->SelectNone();
    QVERIFY(!accept.isVisible());
    Drag({At(10, 10), At(30, 20)});
    QTRY_VERIFY(accept.isVisible());
    accept.SetPaintable(false);
    QVERIFY(!accept.isVisible());
  }

  void TheStripWidensTheWindowNoMoreThanItMust() {
    ToolStrip strip(canvas_.get());
    strip.show();
    QTest::qWait(20);
    int widest = strip.width(), least = strip.minimumSizeHint().width();
    for (const Qt::Key key : {Qt::Key_W, Qt::Key_B, Qt::Key_L, Qt::Key_O, Qt::Key_S, Qt::Key_E}) {
      Key(key);
      QTest::qWait(5);
      least = std::max(least, strip.minimumSizeHint().width());
      widest = std::max(widest, least);
      QVERIFY2(strip.width() <= widest, qPrintable(QString::number(strip.width())));
    }
    // Its least width: rows wrap, as they must in half of a window of 1024 pixels.
    QVERIFY2(least <= 512, qPrintable(QString::number(least)));
  }

  void KeysOfTheWholeMask() {
    Key(Qt::Key_R);
    Drag({At(20, 20), At(40, 40)});
    const size_t square = Inside();
    Key(Qt::Key_G);
    QVERIFY(Inside() > square);
    Key(Qt::Key_G, Qt::ShiftModifier);
    QCOMPARE(Inside(), square);
    Key(Qt::Key_I, Qt::ControlModifier);
    QCOMPARE(Inside(), size_t{kWidth * kHeight} - square);
    Key(Qt::Key_A, Qt::ControlModifier);
    QCOMPARE(Inside(), size_t{kWidth * kHeight});
    Key(Qt::Key_A, Qt::ControlModifier | Qt::ShiftModifier);
    QCOMPARE(Inside(), size_t{0});
    for (int i = 0; i < 5; ++i) Key(Qt::Key_Z, Qt::ControlModifier);
    QCOMPARE(Inside(), square);
    Key(Qt::Key_Z, Qt::ControlModifier);
    QCOMPARE(Inside(), size_t{0});
  }

  void UndoAndRedoGoStrokeByStroke() {
    Drag({At(10, 10), At(30, 10)});
    const auto one = canvas_->editor().mask().data;
    Drag({At(10, 30), At(30, 30), At(50, 30)});
    const auto two = canvas_->editor().mask().data;
    Key(Qt::Key_Z, Qt::ControlModifier);
    QVERIFY(canvas_->editor().mask().data == one);
    Key(Qt::Key_Z, Qt::ControlModifier | Qt::ShiftModifier);
    QVERIFY(canvas_->editor().mask().data == two);
    Key(Qt::Key_Z, Qt::ControlModifier);
    Key(Qt::Key_Z, Qt::ControlModifier);
    QCOMPARE(Inside(), size_t{0});
    Key(Qt::Key_Y, Qt::ControlModifier);
    Key(Qt::Key_Y, Qt::ControlModifier);
    QVERIFY(canvas_->editor().mask().data == two);
    Key(Qt::Key_Y, Qt::ControlModifier);
    QVERIFY(canvas_->editor().mask().data == two);
  }

  void EscapeBacksOutOfWhatIsDrawnThenTheToolThenTheMode() {
    QSignalSpy left(canvas_.get(), &SelectionCanvas::leaveRequested);
    Key(Qt::Key_L);
    QTest::mousePress(canvas_.get(), Qt::LeftButton, {}, At(10, 10));
    Move(At(40, 10), Qt::LeftButton);
    Move(At(40, 40), Qt::LeftButton);
    Key(Qt::Key_Escape);
    QTest::mouseRelease(canvas_.get(), Qt::LeftButton, {}, At(40, 40));
    QCOMPARE(Inside(), size_t{0});
    QCOMPARE(Tool(), QString("lasso"));
    Key(Qt::Key_Escape);
    QCOMPARE(Tool(), QString("brush"));
    QCOMPARE(left.count(), 0);

    QTest::mousePress(canvas_.get(), Qt::LeftButton, {}, At(10, 10));
    Move(At(40, 10), Qt::LeftButton);
    QVERIFY(Inside() > 0);
    Key(Qt::Key_Escape);
    QTest::mouseRelease(canvas_.get(), Qt::LeftButton, {}, At(40, 10));
    QCOMPARE(Inside(), size_t{0});
    QVERIFY(!canvas_->editor().CanUndo());
    Key(Qt::Key_Escape);
    QCOMPARE(left.count(), 1);
  }

  void TheWheelZoomsAtTheCursor() {
    const QPoint at = At(60, 20);
    const Eigen::Vector2d before = canvas_->transform().ToImage({at.x() + 0.0, at.y() + 0.0});
    for (int i = 0; i < 4; ++i) Wheel(at, {0, 120});
    const Eigen::Vector2d after = canvas_->transform().ToImage({at.x() + 0.0, at.y() + 0.0});
    QVERIFY((before - after).norm() < 1e-9);
    QVERIFY(std::abs(canvas_->transform().scale - kZoom * std::pow(1.2, 4)) < 1e-9);
    // Painting follows the zoom.
    Drag({at, at});
    QCOMPARE(Mask(60, 20), 255);
    QCOMPARE(Mask(60, 30), 0);
    // Neither far out nor far in loses the picture.
    for (int i = 0; i < 100; ++i) Wheel({0, 0}, {0, -120});
    QVERIFY(canvas_->transform().scale >= 0.04);
    for (int i = 0; i < 200; ++i) Wheel({0, 0}, {0, 120});
    QVERIFY(canvas_->transform().scale <= 65);
    Key(Qt::Key_0);
    QCOMPARE(canvas_->transform().scale, double(kZoom));
  }

  void RightMiddleAndSpaceDragsPan() {
    Wheel(At(40, 30), {0, 360});
    for (const Qt::MouseButton button : {Qt::RightButton, Qt::MiddleButton, Qt::LeftButton}) {
      const Eigen::Vector2d offset = canvas_->transform().offset;
      const bool with_space = button == Qt::LeftButton;
      if (with_space) QTest::keyPress(canvas_.get(), Qt::Key_Space);
      Drag({{100, 100}, {130, 90}}, {}, button);
      if (with_space) QTest::keyRelease(canvas_.get(), Qt::Key_Space);
      QCOMPARE(canvas_->transform().offset, Eigen::Vector2d(offset + Eigen::Vector2d(30, -10)));
    }
    QCOMPARE(Inside(), size_t{0});
    Drag({At(40, 30), At(40, 30)});
    QCOMPARE(Mask(40, 30), 255);
    // However far it is dragged, some of the picture stays.
    for (int i = 0; i < 20; ++i) Drag({{0, 0}, {390, 290}}, {}, Qt::RightButton);
    const Eigen::Vector2d corner = canvas_->transform().offset;
    QVERIFY(corner.x() < canvas_->width() && corner.y() < canvas_->height());
  }

  void SizeByKeysAndAltWheel() {
    const double radius = canvas_->brush().radius;
    Key(Qt::Key_BracketRight);
    QVERIFY(canvas_->brush().radius > radius);
    Key(Qt::Key_BracketLeft);
    Key(Qt::Key_BracketLeft);
    QVERIFY(canvas_->brush().radius < radius);
    const double scale = canvas_->transform().scale, small = canvas_->brush().radius;
    Wheel(At(10, 10), {120, 0}, Qt::AltModifier);  // as Qt gives it
    QVERIFY(canvas_->brush().radius > small);
    QCOMPARE(canvas_->transform().scale, scale);
    for (int i = 0; i < 200; ++i) Key(Qt::Key_BracketLeft);
    QVERIFY(canvas_->brush().radius >= 0.5);
    for (int i = 0; i < 200; ++i) Key(Qt::Key_BracketRight);
    QVERIFY(canvas_->brush().radius <= 500);
  }

  void KeysShowTheWholeViewOrItsPixels() {
    Key(Qt::Key_1);
    QCOMPARE(canvas_->transform().scale, 1 / canvas_->devicePixelRatioF());
    Drag({At(40, 30), At(40, 30)});
    QCOMPARE(Mask(40, 30), 255);
    QCOMPARE(Mask(46, 30), 0);
    Key(Qt::Key_0);
    QCOMPARE(canvas_->transform().scale, double(kZoom));
  }

  void ASoftBrushHasAnEdge() {
    canvas_->SetBrush({12, 0});
    Drag({At(40, 30), At(40, 30)});
    QCOMPARE(Mask(40, 30), 255);
    QVERIFY(Mask(46, 30) > 0 && Mask(46, 30) < 255);
    QCOMPARE(Mask(54, 30), 0);
  }

  void TheOverlayShowsTintAndOutline() {
    const QRgb bare = Shot().pixel(At(20, 20));
    Key(Qt::Key_R);
    Drag({At(10, 10), At(30, 30)});
    Move({1, 1});
    const QImage shot = Shot();
    const QRgb tinted = shot.pixel(At(20, 20));
    QVERIFY(qRed(tinted) > qRed(bare) + 20);
    QVERIFY(qBlue(tinted) < qBlue(bare));
    QCOMPARE(shot.pixel(At(5, 5)), bare);
    // From outside to inside over the left edge: black, then white.
    const int y = At(20, 20).y();
    bool found = false;
    for (int x = At(8, 20).x(); x < At(13, 20).x(); ++x) {
      found |= shot.pixel(x, y) == qRgb(0, 0, 0) && shot.pixel(x + 1, y) == qRgb(255, 255, 255);
    }
    QVERIFY(found);
    Key(Qt::Key_Comma);
    const QRgb fainter = Shot().pixel(At(20, 20));
    QVERIFY(qRed(fainter) < qRed(tinted) && qRed(fainter) > qRed(bare));
    Key(Qt::Key_Period);
    QCOMPARE(Shot().pixel(At(20, 20)), tinted);
    for (int i = 0; i < 12; ++i) Key(Qt::Key_Comma);
    QCOMPARE(Shot().pixel(At(20, 20)), bare);
    for (int i = 0; i < 5; ++i) Key(Qt::Key_Period);
    QTest::keyPress(canvas_.get(), Qt::Key_Backslash);
    QCOMPARE(Shot().pixel(At(20, 20)), bare);
    QTest::keyRelease(canvas_.get(), Qt::Key_Backslash);
    QVERIFY(Shot().pixel(At(20, 20)) != bare);
  }

  void TheVeilLiesBesideThePaint() {
    const QRgb bare = Shot().pixel(At(7, 20));
    Key(Qt::Key_R);
    Drag({At(10, 10), At(30, 30)});
    Move({1, 1});
    const QImage plain = Shot();
    retint::Mask veil(kWidth, kHeight);
    for (int y = 5; y < 35; ++y) {
      for (int x = 5; x < 35; ++x) veil(x, y) = 255;
    }
    canvas_->veil().Show(veil);
    const QImage veiled = Shot();
    for (int y = 0; y < plain.height(); ++y) {
      for (int x = 0; x < plain.width(); ++x) {
        if (veiled.pixel(x, y) == plain.pixel(x, y)) continue;
        QVERIFY(veil(x / kZoom, y / kZoom) > 0 && Mask(x / kZoom, y / kZoom) < 128);
      }
    }
    // Fainter than the paint, with a line along its border.
    const QRgb beside = veiled.pixel(At(7, 20));
    QVERIFY(qRed(beside) > qRed(bare) + 10);
    QVERIFY(qRed(beside) < qRed(plain.pixel(At(20, 20))) - 10);
    QCOMPARE(veiled.pixel(5 * kZoom, At(7, 20).y()), canvas_->overlay_color().rgb());
    QTest::keyPress(canvas_.get(), Qt::Key_Backslash);
    QCOMPARE(Shot().pixel(At(7, 20)), bare);
    QTest::keyRelease(canvas_.get(), Qt::Key_Backslash);
    QCOMPARE(Shot(), veiled);
    canvas_->veil().Fade();
    QTRY_VERIFY(canvas_->veil().mask().Empty());
    QCOMPARE(Shot(), plain);
    canvas_->veil().Show(veil);
    canvas_->ShowPicture(QImage(10, 10, QImage::Format_RGB32));
    QVERIFY(canvas_->veil().mask().Empty());
  }

  // A move repaints its changes: a partial update leaves the same screen as a full one. An orange
  // overlay on a fox is invisible.
  void TheOverlayStandsOutFromWhatIsSelected() {
    const QColor fur(225, 130, 40), sky(30, 140, 230);
    QImage image(kWidth, kHeight, QImage::Format_RGB32);
    image.fill(fur);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 40; x < kWidth; ++x) image.setPixel(x, y, sky.rgb());
    }
    canvas_->SetView(image, LayersOf(image, {}), retint::Mask(kWidth, kHeight));
    const QRgb fur_bare = Shot().pixel(At(20, 30)), sky_bare = Shot().pixel(At(60, 30));
    const auto apart = [](QRgb a, QRgb b) {
      return std::abs(qRed(a) - qRed(b)) + std::abs(qGreen(a) - qGreen(b)) +
             std::abs(qBlue(a) - qBlue(b));
    };
    // At 45 %, a third of the whole range is a seventh of the possible difference.
    constexpr int kSeen = 100;
    Drag({At(10, 30), At(30, 30)});
    QVERIFY(apart(Shot().pixel(At(20, 30)), fur_bare) > kSeen);
    Key(Qt::Key_Z, Qt::ControlModifier);
    Drag({At(50, 30), At(70, 30)});
    QVERIFY(apart(Shot().pixel(At(60, 30)), sky_bare) > kSeen);
  }

  void PartialUpdatesLeaveNothingBehind() {
    canvas_->SetBrush({3, 1});
    for (int i = 0; i < 3; ++i) Wheel({200, 150}, {0, 120});
    Drag({At(30, 20), At(40, 35), At(45, 25)});
    Drag({At(30, 20), At(40, 35)}, Qt::ControlModifier);
    QTest::qWait(30);
    const QImage partial = Shot();
    canvas_->repaint();
    QCOMPARE(Shot(), partial);
  }

  void NothingIsPaintedWhereNothingMayBe() {
    canvas_->SetPaintable(false);
    Drag({At(20, 15), At(50, 15)});
    Key(Qt::Key_A, Qt::ControlModifier);
    QCOMPARE(Inside(), size_t{0});
    canvas_->SetPaintable(true);
    canvas_->ShowPicture(QImage(10, 10, QImage::Format_RGB32));
    Drag({{20, 15}, {50, 15}});
    Key(Qt::Key_A, Qt::ControlModifier);
    Key(Qt::Key_Z, Qt::ControlModifier);
    QVERIFY(!canvas_->HasView());
    Shot();
    SelectionCanvas empty;
    empty.resize(100, 100);
    empty.grab();
  }

  void TheStripsFollowTheCanvasAndLead() {
    ToolStrip strip(canvas_.get());
    ActionStrip actions(canvas_.get());
    actions.SetPaintable(true);
    auto* lasso = strip.findChild<QAbstractButton*>("toolLasso");
    QVERIFY(lasso);
    QTest::mouseClick(lasso, Qt::LeftButton);
    QCOMPARE(Tool(), QString("lasso"));
    Key(Qt::Key_B);
    QVERIFY(strip.findChild<QAbstractButton*>("toolBrush")->isChecked());
    auto* undo = actions.findChild<QAbstractButton*>("actionUndo");
    QVERIFY(!undo->isEnabled());
    Drag({At(20, 15), At(50, 15)});
    QVERIFY(undo->isEnabled());
    QTest::mouseClick(undo, Qt::LeftButton);
    QCOMPARE(Inside(), size_t{0});
    QVERIFY(!undo->isEnabled());
    QTest::mouseClick(actions.findChild<QAbstractButton*>("actionSelectall"), Qt::LeftButton);
    QCOMPARE(Inside(), size_t{kWidth * kHeight});
    QSignalSpy accept(&actions, &ActionStrip::accept);
    QTest::mouseClick(actions.findChild<QAbstractButton*>("selectionAccept"), Qt::LeftButton);
    QCOMPARE(accept.count(), 1);
    // The sliders, by mouse and keyboard.
    const auto slider = [&](const char* name) {
      for (auto* one : strip.findChildren<QSlider*>()) {
        if (one->accessibleName() == name) return one;
      }
      return static_cast<QSlider*>(nullptr);
    };
    strip.resize(1400, strip.sizeHint().height());  // with room for all options of a tool
    strip.show();
    const double radius = canvas_->brush().radius, hardness = canvas_->brush().hardness;
    QTest::keyClick(slider("Size"), Qt::Key_PageUp);
    QVERIFY(canvas_->brush().radius > radius);
    QTest::keyClick(slider("Hardness"), Qt::Key_Home);
    QVERIFY(hardness > 0 && canvas_->brush().hardness == 0);
    QTest::keyClick(slider("Overlay"), Qt::Key_End);
    QCOMPARE(canvas_->overlay_opacity(), 1.0);
    Key(Qt::Key_W);  // whose options take the place of the brush's
    QVERIFY(!slider("Size")->isVisible() && slider("Color")->isVisible());
    QTest::keyClick(slider("Color"), Qt::Key_End);
    QCOMPARE(canvas_->outline().wand.color, 0.5);
    QTest::keyClick(slider("Depth step"), Qt::Key_End);
    QCOMPARE(canvas_->outline().wand.depth, 0.1);
    QTest::keyClick(slider("Turn"), Qt::Key_End);
    QCOMPARE(canvas_->outline().wand.normal, 180.0);
    auto* box = slider("Color")->parentWidget()->findChild<QSpinBox*>();
    box->setFocus();
    box->selectAll();
    QTest::keyClicks(box, "12");
    QTest::keyClick(box, Qt::Key_Return);
    QCOMPARE(canvas_->outline().wand.color, 0.012);
    Key(Qt::Key_K);  // has a tolerance of its own
    QVERIFY(slider("Color")->isVisible() && !slider("Turn")->isVisible());
    QTest::keyClick(slider("Color"), Qt::Key_Home);
    QCOMPARE(canvas_->outline().like, 0.0);
    QCOMPARE(canvas_->outline().wand.color, 0.012);
    Key(Qt::Key_X);
    QTest::keyClick(slider("Margin"), Qt::Key_End);
    QCOMPARE(canvas_->outline().box_margin, 1.0);
    for (const auto* button : strip.findChildren<QAbstractButton*>()) {
      QVERIFY2(!button->toolTip().isEmpty() && !button->accessibleName().isEmpty(),
               qPrintable(button->objectName()));
    }
  }

  // Nothing is cut: operations without room are in a menu at the end of their row.
  void OperationsOfANarrowStripAreInAMenu() {
    ActionStrip strip(canvas_.get());
    strip.SetPaintable(true);
    strip.SetTargets({"New region"}, 0, "in IMG_5881.jpg");
    strip.resize(strip.minimumSizeHint());
    strip.show();
    QVERIFY(QTest::qWaitForWindowExposed(&strip));
    for (const char* name :
         {"actionUndo", "selectionTarget", "selectionCancel", "selectionAccept"}) {
      const auto* part = strip.findChild<QWidget*>(name);
      QVERIFY2(part->visibleRegion().boundingRect().size() == part->size(), name);
    }
    QVERIFY(!strip.findChild<QWidget*>("actionSelectall")->isVisible());
    auto* more = strip.findChild<QToolButton*>("qt_toolbar_ext_button");
    QVERIFY(more->isVisible() && more->menu());
    for (QAction* action : more->menu()->actions()) {
      if (action->text() == "Select all") action->trigger();
    }
    QCOMPARE(Inside(), size_t{kWidth * kHeight});
    // In a wide one they are in the row.
    strip.resize(1000, strip.height());
    QTRY_VERIFY(strip.findChild<QWidget*>("actionSelectall")->isVisible());
    QVERIFY(!more->isVisible());
  }
};

}  // namespace retint

using retint::SelectionCanvasTest;
QTEST_MAIN(SelectionCanvasTest)
#include "selection_canvas_test.moc"
