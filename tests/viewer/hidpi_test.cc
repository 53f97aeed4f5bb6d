// SPDX-License-Identifier: BSD-3-Clause
// A screen whose pixels are twice as fine: pictures have its pixels, and strokes and clicks land
// where they are seen.
#include <QCheckBox>
#include <QStyle>

#include "tests/viewer/viewer_scene.h"
#include "viewer/selection/selection_mode.h"

namespace retint {

const bool kFine = qputenv("QT_SCALE_FACTOR", "2");  // read when the application begins

class HidpiTest : public ViewerTest {
  Q_OBJECT

 private Q_SLOTS:
  void initTestCase() { MakeScene(); }
  void cleanupTestCase() { scene_.reset(); }
  void init() {
    QVERIFY(ShowScene());
    QCOMPARE(window_->devicePixelRatioF(), 2.0);
  }
  void cleanup() { window_.reset(); }

  void ThePictureHasThePixelsOfTheScreen() {
    Canvas& canvas = window_->canvas();
    const PosedCamera shown = canvas.navigation().Rendered();
    QCOMPARE(canvas.frame()->image.width(), shown.camera.width);
    const bool fills = std::abs(shown.camera.width - 2 * canvas.width()) <= 2 ||
                       std::abs(shown.camera.height - 2 * canvas.height()) <= 2;
    QVERIFY(fills);
    // One to one on the screen.
    const QImage grabbed = canvas.grab().toImage();
    const QRectF rect = canvas.ImageRect(shown);
    const QPoint corner = (rect.topLeft() * 2).toPoint();
    const QPoint inside(shown.camera.width / 2, shown.camera.height * 3 / 4);
    QCOMPARE(grabbed.pixel(corner + inside), canvas.frame()->image.pixel(inside));
  }

  // Of a box that is not checked: none of its frame lies beside it.
  void BoxesAreFramedOnAllSides() {
    QCheckBox box("Depth");
    box.show();
    const QImage image = box.grab().toImage();
    const int side = 2 * box.style()->pixelMetric(QStyle::PM_IndicatorWidth, nullptr, &box);
    const int y = image.height() / 2, inside = side / 2;
    const QRgb frame = image.pixel(0, y);
    QVERIFY(Apart(frame, image.pixel(inside, y)) > 50);
    for (const int x : {1, side - 2, side - 1}) QVERIFY(Apart(frame, image.pixel(x, y)) < 16);
  }

  void StrokesLandOnThePixelsUnderTheCursor() {
    QTest::keyClick(&window_->canvas(), Qt::Key_B);
    SelectionMode& mode = window_->selection();
    QVERIFY(
        QTest::qWaitFor([&] { return mode.state() == SelectionMode::State::kPainting; }, kWaitMs));
    SelectionCanvas& paper = mode.canvas();
    const Mask& mask = paper.editor().mask();
    // Fitted and centerd, reckoned anew here.
    const double scale =
        std::min(double(paper.width()) / mask.width, double(paper.height()) / mask.height);
    const auto at = [&](double x, double y) {
      return QPointF((paper.width() - scale * mask.width) / 2 + scale * x,
                     (paper.height() - scale * mask.height) / 2 + scale * y)
          .toPoint();
    };
    const QImage bare = paper.grab().toImage();
    for (int i = 0; i < 40; ++i) QTest::keyClick(&paper, Qt::Key_BracketLeft);
    for (int i = 0; i < 3; ++i) QTest::keyClick(&paper, Qt::Key_BracketRight);
    DragAlong(&paper, {at(40.5, 30.5), at(60.5, 30.5), at(60.5, 80.5)});
    for (int x = 40; x <= 60; ++x) QCOMPARE(mask(x, 30), 255);
    for (int y = 30; y <= 80; ++y) QCOMPARE(mask(60, y), 255);
    for (const auto& [x, y] :
         {std::pair{40, 34}, {50, 26}, {64, 60}, {56, 60}, {34, 30}, {60, 86}}) {
      QCOMPARE(mask(x, y), 0);
    }
    // And shows there: twice the widget's pixel.
    const QImage painted = paper.grab().toImage();
    QCOMPARE(painted.devicePixelRatio(), 2.0);
    QVERIFY(painted.pixel(at(60.5, 60.5) * 2) != bare.pixel(at(60.5, 60.5) * 2));
    QVERIFY(painted.pixel(at(50.5, 60.5) * 2) == bare.pixel(at(50.5, 60.5) * 2));
    // Zoomed at the cursor, the pixel under it stays under it.
    const QPoint cursor = at(100.5, 60.5);
    QWheelEvent wheel(cursor, paper.mapToGlobal(cursor), {}, {0, 480}, Qt::NoButton, Qt::NoModifier,
                      Qt::NoScrollPhase, false);
    QCoreApplication::sendEvent(&paper, &wheel);
    QTest::mouseClick(&paper, Qt::LeftButton, {}, cursor);
    QCOMPARE(mask(100, 60), 255);
    QCOMPARE(mask(100, 66), 0);
  }

  void ADoubleClickFindsTheSurfaceUnderTheCursor() {
    Canvas& canvas = window_->canvas();
    const SyntheticView& view = scene_->scene().views.front();
    const QRectF rect = canvas.ImageRect(canvas.navigation().Rendered());
    const int x = view.depth.width / 3, y = view.depth.height * 2 / 3;
    const QPointF at(rect.left() + (x + 0.5) / view.depth.width * rect.width(),
                     rect.top() + (y + 0.5) / view.depth.height * rect.height());
    QTest::mouseDClick(&canvas, Qt::LeftButton, {}, at.toPoint());
    QTRY_VERIFY_WITH_TIMEOUT(!canvas.navigation().view(), kWaitMs);
    const auto facts = window_->controller().facts();
    const Eigen::Vector3d truth =
        facts->Posed(*facts->views.front()).Unproject({x + 0.5, y + 0.5}, view.depth(x, y));
    QVERIFY((canvas.navigation().focus() - truth).norm() < 0.1 * view.depth(x, y));
  }
};

}  // namespace retint

QTEST_MAIN(retint::HidpiTest)
#include "hidpi_test.moc"
