// SPDX-License-Identifier: BSD-3-Clause
// The selection canvas's tools that find the outline, with mouse and keys, held against the truth:
// a disc of one color before a wall of two.
#include <algorithm>
#include <cmath>

#include <QAbstractButton>
#include <QLabel>
#include <QSignalSpy>
#include <QTest>

#include "base/files.h"
#include "tests/support/data.h"
#include "tests/viewer/canvas_fixture.h"
#include "viewer/selection/selection_bar.h"

namespace retint {

constexpr int kWidth = 120, kHeight = 90, kZoom = 4;
constexpr int kX = 50, kY = 45, kRadius = 25;  // of the disc
constexpr int kWait = 60000;                   // ms

class SelectionToolsTest : public CanvasFixture {
  Q_OBJECT

 private:
  static bool OnDisc(int x, int y) { return std::hypot(x + 0.5 - kX, y + 0.5 - kY) < kRadius; }

  // Of the mask with the disc.
  double Iou() const {
    double both = 0, either = 0;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const bool inside = Mask(x, y) >= 128;
        both += inside && OnDisc(x, y);
        either += inside || OnDisc(x, y);
      }
    }
    return either > 0 ? both / either : 0;
  }

  bool Settled() {
    return QTest::qWaitFor([this] { return !canvas_->IsFinding(); }, kWait);
  }

 private Q_SLOTS:
  void init() {
    QImage image(kWidth, kHeight, QImage::Format_RGB32);
    DepthMap depth(kWidth, kHeight, 4);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        // Some grain, so that a mixture of colors has samples to learn from.
        const int grain = (x * 7 + y * 13) % 9;
        image.setPixel(x, y, x < 90 ? qRgb(70 + grain, 80, 90) : qRgb(30, 120 + grain, 60));
        if (!OnDisc(x, y)) continue;
        image.setPixel(x, y, qRgb(200 + grain, 90, 40));
        depth(x, y) = 2;
      }
    }
    Show(image, depth, kZoom);
  }

  void AScribbleFindsTheObject() {
    Key(Qt::Key_S);
    QCOMPARE(Tool(), QString("scribble"));
    Drag({At(40, 40), At(60, 50)});
    QVERIFY(Settled());
    // The border's pixels are all that may be missed: 2 pi 25 of pi 25^2, an eighth, half of them.
    QVERIFY2(Iou() > 0.94, qPrintable(QString::number(Iou())));
    const auto first = canvas_->editor().mask().data;

    // The green wall joins by a second stroke inside, and goes by one outside.
    Drag({At(100, 20), At(100, 70)});
    QVERIFY(Settled());
    QVERIFY(Mask(105, 45) >= 128 && Mask(kX, kY) >= 128);
    const auto second = canvas_->editor().mask().data;
    Drag({At(100, 30), At(100, 60)}, Qt::ControlModifier);
    QVERIFY(Settled());
    QVERIFY(Mask(100, 45) < 128 && Mask(kX, kY) >= 128);
    // Whatever else looks less like that stroke than like the object: it takes away alone.
    for (size_t p = 0; p < second.size(); ++p) {
      QVERIFY(canvas_->editor().mask().data[p] <= second[p]);
    }

    Key(Qt::Key_Z, Qt::ControlModifier);
    QVERIFY(canvas_->editor().mask().data == second);
    Key(Qt::Key_Z, Qt::ControlModifier);
    QVERIFY(canvas_->editor().mask().data == first);
    Key(Qt::Key_Y, Qt::ControlModifier);
    QVERIFY(canvas_->editor().mask().data == second);
    for (int i = 0; i < 2; ++i) Key(Qt::Key_Z, Qt::ControlModifier);
    QCOMPARE(Inside(), size_t{0});
    QVERIFY(!canvas_->CanUndo());
  }

  void AStrokeBesideTheObjectAloneFindsNothingYet() {
    ActionStrip actions(canvas_.get());
    actions.SetPaintable(true);
    Key(Qt::Key_S);
    Drag({At(100, 20), At(100, 70)}, Qt::ControlModifier);
    QVERIFY(!canvas_->IsFinding());
    QCOMPARE(Inside(), size_t{0});
    // It can be undone all the same.
    auto* undo = actions.findChild<QAbstractButton*>("actionUndo");
    QVERIFY(undo->isEnabled());
    QTest::mouseClick(undo, Qt::LeftButton);
    QVERIFY(!undo->isEnabled());
    Key(Qt::Key_Y, Qt::ControlModifier);
    Drag({At(40, 40), At(60, 50)});
    QVERIFY(Settled());
    QVERIFY(Iou() > 0.94);
  }

  void AScribbleWithShiftAddsToWhatIsSelected() {
    Key(Qt::Key_R);
    Drag({At(95, 5), At(115, 20)});
    Key(Qt::Key_S);
    Drag({At(40, 40), At(60, 50)}, Qt::ShiftModifier);
    QVERIFY(Settled());
    QCOMPARE(Mask(105, 10), 255);
    QVERIFY(Mask(kX, kY) >= 128);
    QVERIFY(Mask(105, 60) < 128);
  }

  void AClickAsksTheNetworkOfThePreferences() {
    QSignalSpy missed(canvas_.get(), &SelectionCanvas::notFound);
    Key(Qt::Key_N);
    QCOMPARE(Tool(), QString("object"));
    Click(At(kX, kY));
    QCOMPARE(missed.count(), 1);
    QVERIFY2(missed[0][0].toString().contains("Preferences"), qPrintable(missed[0][0].toString()));
    QVERIFY(!canvas_->CanUndo());

    // One that knows the disc, a pixel to the right.
    const TempFolder folder;
    std::string pixels;
    for (int y = kHeight - 1; y >= 0; --y) {
      for (int x = 0; x < kWidth; ++x) {
        const float inside = OnDisc(x - 1, y) ? 1 : 0;
        pixels.append(reinterpret_cast<const char*>(&inside), sizeof inside);
      }
    }
    WriteFile(folder / "answer.pfm", "Pf\n120 90\n-1\n" + pixels);
    WriteFile(folder / "network.sh", "cd " + folder.path().string() +
                                         "\nwhile read line; do set -- $line\ncp $2 prompt.png\n"
                                         "cp answer.pfm $3.pfm; echo ok; done\n");
    canvas_->SetNetwork("exec:exec sh " + (folder / "network.sh").string());
    Click(At(kX, kY));
    QVERIFY(canvas_->IsFinding());  // not on this thread
    QVERIFY(Settled());
    QVERIFY2(Iou() > 0.94, qPrintable(QString::number(Iou())));
    const std::string network = "exec:exec sh " + (folder / "network.sh").string();
    QCOMPARE(canvas_->outlined_by(), network);
    QVERIFY(canvas_->undecided());  // so that the scene is asked, as of scribbles
    const QString prompt = QString::fromStdString((folder / "prompt.png").string());
    QCOMPARE(QImage(prompt).pixelColor(kX, kY), QColor(0, 255, 0));

    Click(At(100, 45), Qt::ControlModifier);
    QVERIFY(Settled());
    QCOMPARE(QImage(prompt).pixelColor(100, 45), QColor(255, 0, 0));
    Drag({At(20, 15), At(80, 75)});
    QVERIFY(Settled());
    QCOMPARE(QImage(prompt).pixelColor(20, 40), QColor(0, 0, 255));
    QVERIFY(Iou() > 0.94);
    // A scribble corrects it.
    Key(Qt::Key_S);
    Drag({At(100, 20), At(100, 70)});
    QVERIFY(Settled());
    QCOMPARE(QImage(prompt).pixelColor(100, 60), QColor(0, 255, 0));
    QVERIFY(Mask(100, 45) >= 128 && Mask(kX, kY) >= 128);
    QCOMPARE(canvas_->outlined_by(), network);
    for (int i = 0; i < 4; ++i) Key(Qt::Key_Z, Qt::ControlModifier);
    QCOMPARE(Inside(), size_t{0});
    QCOMPARE(canvas_->outlined_by(), std::string());

    canvas_->SetNetwork("exec:echo no weights >&2; exit 3");
    Key(Qt::Key_N);
    Click(At(kX, kY));
    QVERIFY(Settled());
    QCOMPARE(missed.count(), 2);
    QVERIFY2(missed[1][0].toString().contains("no weights"), qPrintable(missed[1][0].toString()));
    QVERIFY(!canvas_->CanUndo());
  }

  void TheWandStopsAtColorsAndAtSteps() {
    Key(Qt::Key_W);
    QCOMPARE(Tool(), QString("wand"));
    Click(At(kX, kY));
    QVERIFY(Settled());
    QVERIFY2(Iou() > 0.97, qPrintable(QString::number(Iou())));
    Click(At(105, 45), Qt::ShiftModifier);
    QVERIFY(Settled());
    QVERIFY(Mask(105, 45) == 255 && Mask(kX, kY) == 255 && Mask(5, 5) == 0);
    Click(At(kX, kY), Qt::ControlModifier);
    QVERIFY(Settled());
    QVERIFY(Mask(105, 45) == 255 && Mask(kX, kY) == 0);
    // A click beside the picture is none.
    canvas_->ActualSize();
    Click({2, 2});
    QVERIFY(Settled());
    QVERIFY(Mask(105, 45) == 255);
  }

  void DraggingTheWandChangesItsToleranceInOneStep() {
    Key(Qt::Key_O);
    const double tolerance = canvas_->outline().wand.color;
    const QPoint at = At(10, 10);
    QTest::mousePress(canvas_.get(), Qt::LeftButton, {}, at);
    QVERIFY(Settled());
    const size_t wall = Inside();
    QVERIFY(wall > 0 && Mask(105, 45) == 0);
    Move(at + QPoint(300, 0), Qt::LeftButton);  // the green of the wall is less far than this
    QVERIFY(Settled());
    QVERIFY(canvas_->outline().wand.color > tolerance + 0.3);
    QVERIFY(Mask(105, 45) == 255 && Mask(kX, kY) == 0);  // the disc lies before it
    Move(at + QPoint(40, 0), Qt::LeftButton);
    QTest::mouseRelease(canvas_.get(), Qt::LeftButton, {}, at + QPoint(40, 0));
    QVERIFY(Settled());
    QCOMPARE(Mask(105, 45), 0);
    QCOMPARE(canvas_->outline().wand.color, tolerance + 0.05);
    Key(Qt::Key_Z, Qt::ControlModifier);
    QCOMPARE(Inside(), size_t{0});
    QVERIFY(!canvas_->CanUndo());
    QTest::mousePress(canvas_.get(), Qt::LeftButton, {}, at);
    Move(at + QPoint(40, 0), Qt::LeftButton);
    Key(Qt::Key_Escape);
    QTest::mouseRelease(canvas_.get(), Qt::LeftButton, {}, at);
    QVERIFY(Settled());
    QCOMPARE(Inside(), size_t{0});
    QCOMPARE(canvas_->outline().wand.color, tolerance + 0.05);
  }

  void ClicksAreAnsweredInTheirOrder() {
    Key(Qt::Key_W);
    Click(At(kX, kY));
    Click(At(105, 45), Qt::ShiftModifier);
    Click(At(5, 5), Qt::ShiftModifier);
    QVERIFY(Settled());
    for (const QPoint at : {QPoint(kX, kY), QPoint(105, 45), QPoint(5, 5)}) {
      QCOMPARE(Mask(at.x(), at.y()), 255);
    }
    Key(Qt::Key_Z, Qt::ControlModifier);
    QVERIFY(Mask(5, 5) == 0 && Mask(105, 45) == 255);
  }

  void TheScissorsFollowTheEdge() {
    Key(Qt::Key_I);
    QCOMPARE(Tool(), QString("scissors"));
    QSignalSpy accepted(canvas_.get(), &SelectionCanvas::acceptRequested);
    // On the disc's border; the square between them is two thirds of it.
    const QPoint corners[] = {At(kX - 24, kY), At(kX, kY - 24), At(kX + 24, kY), At(kX, kY + 24)};
    for (const QPoint& at : corners) Click(at);
    QVERIFY(Settled());
    QVERIFY2(Iou() > 0.9, qPrintable(QString::number(Iou())));
    for (int i = 0; i < 2; ++i) Key(Qt::Key_Backspace);  // two points are no outline
    QVERIFY(Settled());
    QCOMPARE(Inside(), size_t{0});
    Click(corners[2]), Click(corners[3]);
    QVERIFY(canvas_->Hint().contains("Enter closes"));
    Key(Qt::Key_Return);
    QCOMPARE(accepted.count(), 0);
    QVERIFY(Settled());
    QVERIFY(Iou() > 0.9);
    QVERIFY(canvas_->Hint().startsWith("Enter accepts"));  // as the next one would
    Key(Qt::Key_Z, Qt::ControlModifier);                   // one step
    QCOMPARE(Inside(), size_t{0});
    QVERIFY(!canvas_->CanUndo());

    // Escape takes back the shown result.
    QSignalSpy failed(canvas_.get(), &SelectionCanvas::notFound);
    Click(At(30, 30)), Click(At(60, 30));
    Key(Qt::Key_Return);
    QCOMPARE(failed.count(), 1);
    Click(At(30, 30)), Click(At(60, 30)), Click(At(60, 60));
    QVERIFY(Settled());
    QVERIFY(Inside() > 0);
    Key(Qt::Key_Escape);
    QCOMPARE(Inside(), size_t{0});
    QCOMPARE(Tool(), QString("scissors"));
  }

  void TheSphereReachesAsFarAsOneDrags() {
    Key(Qt::Key_H);
    QCOMPARE(Tool(), QString("sphere"));
    // 20 pixels at depth 2: the wall at depth 4 is out of reach.
    Drag({At(kX, kY), At(kX + 10, kY), At(kX + 20, kY)});
    QVERIFY(Settled());
    QCOMPARE(Mask(kX + 18, kY), 255);
    QCOMPARE(Mask(kX + 22, kY), 0);
    QCOMPARE(Mask(kX, kY + 18), 255);
    QCOMPARE(Mask(kX, kY + 28), 0);
    Key(Qt::Key_Z, Qt::ControlModifier);  // one step however often the mouse moved
    QCOMPARE(Inside(), size_t{0});
    QVERIFY(!canvas_->CanUndo());

    QImage image(kWidth, kHeight, QImage::Format_RGB32);
    image.fill(Qt::gray);
    canvas_->SetView(image, LayersOf(image, {}), retint::Mask(kWidth, kHeight));
    QSignalSpy failed(canvas_.get(), &SelectionCanvas::notFound);
    Drag({At(kX, kY), At(kX + 20, kY)});
    QCOMPARE(failed.count(), 1);  // there is no surface
    QCOMPARE(Inside(), size_t{0});
  }

  void TheBoxHoldsWhatOneDragsOver() {
    Key(Qt::Key_X);
    QCOMPARE(Tool(), QString("box"));
    OutlineOptions options = canvas_->outline();
    options.box_margin = 0;
    canvas_->SetOutline(options);
    Drag({At(40, 35), At(60, 55)});
    QVERIFY(Settled());
    QVERIFY(Mask(50, 45) == 255 && Mask(42, 53) == 255);
    QVERIFY(Mask(36, 45) == 0 && Mask(50, 60) == 0 && Mask(5, 5) == 0);
    options.box_margin = 0.5;
    canvas_->SetOutline(options);
    Drag({At(40, 35), At(60, 55)});
    QVERIFY(Settled());
    QVERIFY(Mask(36, 45) == 255 && Mask(50, 60) == 255);
    QVERIFY(Mask(5, 5) == 0);  // the wall lies behind it
  }

  // Of a camera that is turned by 45 degrees, the box about a level line is a diamond.
  void TheBoxSelectsNoMoreThanTheDragsRectangle() {
    Key(Qt::Key_X);
    QImage image(kWidth, kHeight, QImage::Format_RGB32);
    image.fill(Qt::gray);
    ViewLayers layers = LayersOf(image, DepthMap(kWidth, kHeight, 2));
    layers.camera.cam_from_world.rotation = Eigen::AngleAxisd(M_PI / 4, Eigen::Vector3d::UnitZ());
    canvas_->SetView(image, layers, retint::Mask(kWidth, kHeight));
    OutlineOptions options = canvas_->outline();
    options.box_margin = 0;
    canvas_->SetOutline(options);
    Drag({At(40, 45), At(60, 45)});
    QVERIFY(Settled());
    QCOMPARE(Mask(50, 45), 255);
    QVERIFY(Mask(50, 40) == 0 && Mask(50, 50) == 0);
    options.box_margin = 0.5;
    canvas_->SetOutline(options);
    Drag({At(40, 45), At(60, 45)});
    QVERIFY(Settled());
    QVERIFY(Mask(50, 40) == 255 && Mask(50, 50) == 255);
    QVERIFY(Mask(50, 33) == 0 && Mask(50, 57) == 0);
  }

  void LikeThisColorKeepsOfWhatIsSelected() {
    Key(Qt::Key_K);
    QCOMPARE(Tool(), QString("like"));
    Click(At(105, 45));  // nothing is selected: of the whole view
    QVERIFY(Settled());
    QVERIFY(Mask(95, 5) == 255 && Mask(kX, kY) == 0 && Mask(5, 5) == 0);
    Key(Qt::Key_A, Qt::ControlModifier);
    Click(At(kX, kY));
    QVERIFY(Settled());
    QVERIFY2(Iou() > 0.97, qPrintable(QString::number(Iou())));
    Click(At(105, 45), Qt::ShiftModifier);
    QVERIFY(Settled());
    QVERIFY(Mask(95, 5) == 255 && Mask(kX, kY) == 255);
  }

  void TheBorderMovesToTheEdgesUnderTheBrush() {
    // A rough square about the disc, from inside it to beyond it.
    Key(Qt::Key_R);
    Drag({At(kX - 22, kY - 22), At(kX + 22, kY + 22)});
    const double rough = Iou();
    Key(Qt::Key_F);
    QCOMPARE(Tool(), QString("refine"));
    canvas_->SetBrush({9, 1});
    Drag({At(kX + 22, kY - 24), At(kX + 22, kY + 24)});
    QVERIFY(Settled());
    QVERIFY2(Iou() > rough, qPrintable(QString("%1 %2").arg(Iou()).arg(rough)));
    QCOMPARE(Mask(kX - 21, kY - 21), 255);  // the other side is as it was
    QVERIFY(Mask(kX + 21, kY - 21) < 128);
    Key(Qt::Key_F, Qt::ShiftModifier);
    QVERIFY(Settled());
    QVERIFY2(Iou() > 0.94, qPrintable(QString::number(Iou())));
    Key(Qt::Key_Z, Qt::ControlModifier);
    QCOMPARE(Mask(kX - 21, kY - 21), 255);
    Key(Qt::Key_A, Qt::ControlModifier | Qt::ShiftModifier);
    QSignalSpy failed(canvas_.get(), &SelectionCanvas::notFound);
    Key(Qt::Key_F, Qt::ShiftModifier);
    QCOMPARE(failed.count(), 1);
  }

  void TheStatusTellsWhatToDoNext() {
    ActionStrip actions(canvas_.get());
    actions.resize(1600, actions.sizeHint().height());
    actions.SetPaintable(true);
    actions.show();
    auto* hint = actions.findChild<QLabel*>("selectionHint");
    // A short place leaves the rest of the row to the hint.
    actions.SetTargets({"New region"}, 0, "0001.jpg");
    QTest::qWait(0);
    QVERIFY2(hint->width() > 600, qPrintable(QString::number(hint->width())));
    Key(Qt::Key_S);
    QVERIFY(hint->text().contains("stroke on the object"));
    Drag({At(40, 40), At(60, 50)});
    QVERIFY(Settled());
    QVERIFY2(hint->text().contains("Draw there with Ctrl"), qPrintable(hint->text()));
    Key(Qt::Key_I);
    QVERIFY2(hint->text().contains("Enter accepts what is selected"), qPrintable(hint->text()));
    Key(Qt::Key_A, Qt::ControlModifier | Qt::ShiftModifier);
    QVERIFY2(hint->text().contains("Click on the outline"), qPrintable(hint->text()));
    Click(At(30, 30));
    QVERIFY2(hint->text().contains("three points"), qPrintable(hint->text()));
    Key(Qt::Key_Return);
    QCOMPARE(actions.message(), QString("An outline needs three points at least"));
  }

  void LeavingTheToolKeepsWhatItFound() {
    Key(Qt::Key_W);
    Click(At(kX, kY));
    Key(Qt::Key_B);  // before or after it was found
    QVERIFY(Settled());
    QVERIFY(Iou() > 0.97);
    Key(Qt::Key_S);
    Drag({At(100, 20), At(100, 70)}, Qt::ShiftModifier);
    QVERIFY(Settled());
    Key(Qt::Key_B);
    QVERIFY(Mask(kX, kY) == 255 && Mask(100, 45) >= 128);
    // The next scribble starts anew.
    Key(Qt::Key_S);
    Drag({At(40, 40), At(60, 50)});
    QVERIFY(Settled());
    QVERIFY(Mask(100, 45) < 128 && Mask(kX, kY) >= 128);
  }
};

}  // namespace retint

using retint::SelectionToolsTest;
QTEST_MAIN(SelectionToolsTest)
#include "selection_tools_test.moc"
