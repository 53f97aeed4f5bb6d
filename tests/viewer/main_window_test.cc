// SPDX-License-Identifier: BSD-3-Clause
// The window on a synthetic workspace, explored with mouse and keys, and the outcome read off the
// camera and the picture; explore_test.cc goes on, editing_test.cc changes the scene.
#include "viewer/window/main_window.h"

#include <QAction>
#include <QApplication>
#include <QClipboard>
#include <QDir>
#include <QDockWidget>
#include <QHelpEvent>
#include <QLabel>
#include <QPushButton>
#include <QStandardPaths>
#include <QToolButton>
#include <QToolTip>

#include "depth/depth_picture.h"
#include "tests/viewer/viewer_scene.h"

namespace retint {

class MainWindowTest : public ViewerTest {
  Q_OBJECT

 private:
  Eigen::Vector3d Forward() {
    return canvas()
        .navigation()
        .Rendered()
        .cam_from_world.rotation.toRotationMatrix()
        .row(2)
        .transpose();
  }
  double FocusDistance() { return (Position() - canvas().navigation().focus()).norm(); }

 private Q_SLOTS:
  void initTestCase() { MakeScene(); }
  void cleanupTestCase() { scene_.reset(); }

  void init() { QVERIFY(ShowScene()); }
  void cleanup() { window_.reset(); }

  // A path that is one word, wider than the screen; copying gives the path.
  void LongWordsAreWholeInAMessage() {
    const QString path = "/home/" + QString(200, 'w') + ".ply";
    const QString message = path + " is <no> splat";
    window_->dialogs().ShowError("That cannot be opened", message);
    QMessageBox* box = WaitDialog(*window_);
    QVERIFY(box);
    Keep(*box, "long_word");
    QLabel* text = nullptr;
    for (auto* label : box->findChildren<QLabel*>()) {
      if (label->text().contains("www")) text = label;
    }
    QVERIFY(text);
    QVERIFY(text->width() >= text->minimumSizeHint().width());
    QVERIFY(text->height() >= text->heightForWidth(text->width()));
    QVERIFY(box->width() <= 1000);
    text->setSelection(0, int(text->text().size()));
    text->setFocus();
    QTest::keyClick(text, Qt::Key_C, Qt::ControlModifier);
    // Without a display nobody owns the clipboard.
    if (QGuiApplication::platformName() != "offscreen") {
      QTRY_COMPARE(QApplication::clipboard()->text(), message);
    }
    box->button(QMessageBox::Ok)->click();
    QTRY_VERIFY(!window_->dialogs().box());
    // Nor is a box as narrow as a short title.
    window_->dialogs().ShowError("No", QString("word ").repeated(40));
    box = WaitDialog(*window_);
    QVERIFY(box);
    QVERIFY2(box->width() > 40 * box->fontMetrics().averageCharWidth(),
             qPrintable(QString::number(box->width())));
    box->button(QMessageBox::Ok)->click();
  }

  void OpensEmptyAtOnceAndShowsTheScene() {
    MainWindow empty(theme_.get());
    empty.show();
    QVERIFY(!empty.controller().IsOpen());
    QVERIFY(empty.findChild<QPushButton*>("welcome_open")->isVisible());
    QVERIFY(!empty.action("camera.frame")->isEnabled());
    QVERIFY(empty.action("file.open")->isEnabled());
    // The scene of init(): its first view, rendered as the library renders it.
    QCOMPARE(canvas().navigation().view()->name, scene_->scene().views.front().name);
    const auto facts = controller().facts();
    Renderer renderer(facts->backend, *facts->original);
    const QImage expected = ToQImage(renderer.Render(canvas().navigation().Rendered()).rgb);
    QVERIFY(Difference(canvas().frame()->image, expected) < 0.01);
  }

  void StepsThroughTheTrainingViewsExactly() {
    const auto& views = controller().facts()->views;
    QTest::keyClick(&canvas(), Qt::Key_Right);
    QCOMPARE(canvas().navigation().view(), views[1]);
    QTest::keyClick(&canvas(), Qt::Key_Left);
    QTest::keyClick(&canvas(), Qt::Key_Left);
    QCOMPARE(canvas().navigation().view(), views.back());  // round and round
    const PosedCamera exact = canvas().navigation().Exact();
    const PosedCamera truth = controller().facts()->Posed(*views.back());
    QVERIFY(exact.camera == truth.camera);
    QVERIFY(exact.cam_from_world.translation == truth.cam_from_world.translation);
    // On the screen: the same pose, the aspect kept within a pixel, the center where it belongs.
    const PosedCamera shown = canvas().navigation().Rendered();
    const double scale = double(shown.camera.width) / truth.camera.width;
    QVERIFY(std::abs(shown.camera.height - scale * truth.camera.height) <= 1);
    QVERIFY(std::abs(shown.camera.fx() - scale * truth.camera.fx()) < 1e-9 * shown.camera.fx());
    QVERIFY(std::abs(shown.camera.cx() - scale * truth.camera.cx()) < 1e-6);
    QVERIFY(WaitSharp(*window_));
    QCOMPARE(canvas().frame()->image.width(), shown.camera.width);
  }

  void OrbitsAboutTheFocus() {
    const Eigen::Vector3d before = Position(), focus = canvas().navigation().focus();
    const double distance = FocusDistance();
    Drag(Qt::LeftButton, {80, 20});
    QVERIFY(!canvas().navigation().view());
    QVERIFY((Position() - before).norm() > 0.1 * distance);
    QVERIFY(std::abs(FocusDistance() - distance) < 1e-9 * distance);
    QVERIFY((canvas().navigation().focus() - focus).norm() < 1e-12);
    // Dragged to the right, the camera goes to its left.
    const PosedCamera first = controller().facts()->Posed(*controller().facts()->views.front());
    QVERIFY((first.cam_from_world * Position()).x() < 0);
    QVERIFY(WaitSharp(*window_));
    QCOMPARE(canvas().frame()->scale, 1.0);
  }

  void PansAndZooms() {
    const Eigen::Vector3d before = Position(), forward = Forward();
    Drag(Qt::RightButton, {60, 0});
    QVERIFY((Position() - before).norm() > 0.01);
    QVERIFY((Forward() - forward).norm() < 1e-9);
    const double distance = FocusDistance();
    const QPointF at = Middle();
    QWheelEvent wheel(at, canvas().mapToGlobal(at), {}, {0, 240}, Qt::NoButton, Qt::NoModifier,
                      Qt::NoScrollPhase, false);
    QCoreApplication::sendEvent(&canvas(), &wheel);
    QVERIFY(FocusDistance() < 0.9 * distance);
    QVERIFY((Forward() - forward).norm() < 1e-9);
  }

  void DoubleClickSetsTheFocusOnTheSurface() {
    const SyntheticView& view = scene_->scene().views.front();
    const PosedCamera shown = canvas().navigation().Rendered();
    const int x = view.depth.width / 3, y = view.depth.height * 2 / 3;
    const double scale = double(shown.camera.width) / view.depth.width;
    const QRectF rect = canvas().ImageRect(shown);
    const QPointF at = rect.topLeft() +
                       QPointF((x + 0.5) * scale, (y + 0.5) * scale) / canvas().devicePixelRatioF();
    QTest::mouseDClick(&canvas(), Qt::LeftButton, {}, at.toPoint());
    QTRY_VERIFY_WITH_TIMEOUT(!canvas().navigation().view(), kWaitMs);
    const PosedCamera exact = controller().facts()->Posed(*controller().facts()->views.front());
    const Eigen::Vector3d truth = exact.Unproject({x + 0.5, y + 0.5}, view.depth(x, y));
    QVERIFY((canvas().navigation().focus() - truth).norm() < 0.1 * view.depth(x, y));
    // And the camera looks at it.
    QVERIFY(Forward().dot((canvas().navigation().focus() - Position()).normalized()) > 0.9999);
  }

  void FliesWithTheKeyboard() {
    const Eigen::Vector3d before = Position(), forward = Forward();
    QTest::keyPress(&canvas(), Qt::Key_W);
    QTRY_VERIFY_WITH_TIMEOUT((Position() - before).dot(forward) > 0.02, kWaitMs);
    QTest::keyRelease(&canvas(), Qt::Key_W);
    const Eigen::Vector3d there = Position();
    QTest::qWait(60);
    QVERIFY((Position() - there).norm() == 0);
    // Along the axis alone.
    const Eigen::Vector3d moved = (there - before).normalized();
    QVERIFY(moved.dot(forward) > 0.9999);
    QTest::keyPress(&canvas(), Qt::Key_E);
    QTRY_VERIFY_WITH_TIMEOUT((Position() - there).dot(canvas().navigation().up()) > 0.01, kWaitMs);
    QTest::keyRelease(&canvas(), Qt::Key_E);
  }

  void LookingAroundStaysOnTheSpot() {
    QTest::keyClick(&canvas(), Qt::Key_V);
    QVERIFY(canvas().fly_mode());
    const Eigen::Vector3d before = Position(), forward = Forward();
    Drag(Qt::LeftButton, {50, 0});
    QVERIFY((Position() - before).norm() < 1e-9);
    QVERIFY((Forward() - forward).norm() > 0.01);
    QTest::keyClick(&canvas(), Qt::Key_Escape);
    QVERIFY(!canvas().fly_mode());
    QVERIFY(window_->isVisible());
  }

  void FramesAndResets() {
    Drag(Qt::LeftButton, {200, 60});
    QTest::keyClick(&canvas(), Qt::Key_F);
    const Eigen::Vector3d center = canvas().navigation().center();
    const auto seen = canvas().navigation().Rendered().Project(center);
    QVERIFY(seen);
    const Camera camera = canvas().navigation().Rendered().camera;
    QVERIFY(std::abs(seen->x() - 0.5 * camera.width) < 1);
    QVERIFY(std::abs(seen->y() - 0.5 * camera.height) < 1);
    QTest::keyClick(&canvas(), Qt::Key_F, Qt::ShiftModifier);
    QCOMPARE(canvas().navigation().view(), controller().facts()->views.front());
  }

  void DepthAndFrustaToggle() {
    const QImage color = canvas().frame()->image;
    QTest::keyClick(&canvas(), Qt::Key_N);
    QVERIFY(WaitSharp(*window_));
    QCOMPARE(canvas().frame()->what, RenderWhat::kDepth);
    QVERIFY(Difference(canvas().frame()->image, color) > 10);
    const auto facts = controller().facts();
    Renderer renderer(facts->backend, *facts->original);
    RenderRequest request;
    request.depth_median = true;
    const DepthMap depth = renderer.Render(canvas().navigation().Rendered(), request).depth_median;
    QVERIFY(Difference(canvas().frame()->image, ToQImage(DepthPicture(depth))) < 0.01);
    QTest::keyClick(&canvas(), Qt::Key_N);
    QVERIFY(WaitSharp(*window_));
    QVERIFY(Difference(canvas().frame()->image, color) < 0.01);
    // Seen from farther back the cameras are in the picture.
    canvas().navigation().Zoom(-12);
    canvas().CameraMoved();
    QVERIFY(WaitSharp(*window_));
    const QImage without = canvas().grab().toImage();
    QTest::keyClick(&canvas(), Qt::Key_C);
    QVERIFY(window_->action("show.frusta")->isChecked());
    QTRY_VERIFY_WITH_TIMEOUT(!window_->photos().Thumbnail(scene_->scene().views[3].name).isNull(),
                             kWaitMs);
    QVERIFY(Difference(canvas().grab().toImage(), without) > 0.1);
  }

  void PhotoShowsWhileHeld() {
    const std::string name = scene_->scene().views.front().name;
    const QImage photo = ReadPicture(scene_->workspace() / "images" / name, 0);
    const QImage render = BareCanvas(*window_);
    QTest::keyPress(&canvas(), Qt::Key_P);
    QTRY_VERIFY_WITH_TIMEOUT(canvas().showing_photo(), kWaitMs);
    const QRect rect = canvas().ImageRect(canvas().navigation().Rendered()).toRect();
    const QImage shown = BareCanvas(*window_).copy(rect);
    const QImage expected =
        photo.scaled(shown.size(), Qt::IgnoreAspectRatio, Qt::SmoothTransformation);
    QVERIFY(Difference(shown.convertToFormat(QImage::Format_RGB32), expected) < 4);
    QTest::keyRelease(&canvas(), Qt::Key_P);
    QVERIFY(!canvas().showing_photo());
    QVERIFY(Difference(BareCanvas(*window_), render) < 0.01);
  }

  void OriginalShowsWhileHeld() {
    const QImage before = canvas().frame()->image;
    QVERIFY(AddTintedRegion() != 0);
    QTest::keyClick(&canvas(), Qt::Key_M);  // without the points
    QVERIFY(WaitSharp(*window_));
    const QImage after = canvas().frame()->image;
    QVERIFY(Difference(before, after) > 0.2);
    QTest::keyPress(&canvas(), Qt::Key_Backslash);
    QTRY_VERIFY_WITH_TIMEOUT(Difference(canvas().frame()->image, before) < 0.01, kWaitMs);
    QTest::keyRelease(&canvas(), Qt::Key_Backslash);
    QTRY_VERIFY_WITH_TIMEOUT(Difference(canvas().frame()->image, after) < 0.01, kWaitMs);
  }

  void SplitSliderShowsBothSides() {
    window_->resize(1500, 800);
    QVERIFY(WaitSharp(*window_));
    const QImage before = canvas().frame()->image;
    QVERIFY(AddTintedRegion() != 0);
    canvas().SetCloudShown(false);
    QTest::keyClick(&canvas(), Qt::Key_X);
    QTRY_VERIFY_WITH_TIMEOUT(canvas().IsSharp() && !canvas().frame()->before.isNull(), kWaitMs);
    QVERIFY(Difference(canvas().frame()->before, before) < 0.01);
    QVERIFY(Difference(canvas().frame()->image, before) > 0.2);
    // On the screen, with the line through the middle of the tinted object: its left is unchanged,
    // its right is tinted.
    const QImage now = canvas().frame()->image, old = canvas().frame()->before;
    int low = now.width(), high = 0;
    for (int y = 0; y < now.height(); ++y) {
      for (int x = 0; x < now.width(); ++x) {
        if (Apart(now.pixel(x, y), old.pixel(x, y)) <= 30) continue;
        low = std::min(low, x), high = std::max(high, x);
      }
    }
    const double line = 0.5 * (low + high + 1);
    canvas().SetSplitAt(line / now.width());
    const QRectF place = canvas().ImageRect(canvas().frame()->camera);
    const QImage screen = BareCanvas(*window_);
    int64_t sides[2] = {}, right_sides[2] = {};
    for (int y = 60; y < now.height() - 60; ++y) {  // without the labels
      for (int x = low; x <= high; ++x) {
        const QRgb then_pixel = old.pixel(x, y), now_pixel = now.pixel(x, y);
        // Without the line and its grip.
        if (std::abs(x + 0.5 - line) < 16 || Apart(then_pixel, now_pixel) <= 30) continue;
        const QRgb shown = screen.pixel(int(place.left()) + x, int(place.top()) + y);
        const bool is_old = Apart(shown, then_pixel) < Apart(shown, now_pixel);
        const bool left = x < line;
        ++sides[left];
        right_sides[left] += is_old == left;
      }
    }
    for (const bool left : {false, true}) {
      QVERIFY2(sides[left] > 50 && right_sides[left] > 0.97 * double(sides[left]),
               qPrintable(QString("%1: %2 of %3")
                              .arg(left ? "left" : "right")
                              .arg(right_sides[left])
                              .arg(sides[left])));
    }
    canvas().SetSplitAt(0.5);
    // Dragged to the right end everything is as it was; the camera stays.
    const QRectF rect = canvas().ImageRect(canvas().frame()->camera);
    const QPoint from = rect.center().toPoint();
    QTest::mousePress(&canvas(), Qt::LeftButton, {}, from);
    const QPoint to(int(rect.left() + 0.9 * rect.width()), from.y());
    QMouseEvent move(QEvent::MouseMove, to, canvas().mapToGlobal(to), Qt::NoButton, Qt::LeftButton,
                     Qt::NoModifier);
    QCoreApplication::sendEvent(&canvas(), &move);
    QTest::mouseRelease(&canvas(), Qt::LeftButton, {}, to);
    QVERIFY(std::abs(canvas().split_at() - 0.9) < 0.01);
    QVERIFY(canvas().navigation().view());
    QTest::keyClick(&canvas(), Qt::Key_Escape);
    QVERIFY(!canvas().split());
  }

  void TabHidesAndShowsThePanels() {
    auto* dock = window_->AddPanel("test", "Test", new QLabel("panel"), Qt::RightDockWidgetArea);
    QTRY_VERIFY(dock->isVisible());
    QTest::keyClick(&canvas(), Qt::Key_Tab);
    QVERIFY(!dock->isVisible());
    QTest::keyClick(&canvas(), Qt::Key_Tab);
    QVERIFY(dock->isVisible());
  }

  // The front tabs, the sizes, and the panels that the user had closed.
  void PanelsComeBackAsTheyWere() {
    const auto dock = [&](const char* name) { return window_->findChild<QDockWidget*>(name); };
    dock("quality")->raise();
    dock("scene")->raise();
    window_->resizeDocks({dock("views")}, {270}, Qt::Horizontal);
    window_->resizeDocks({dock("regions")}, {190}, Qt::Vertical);
    QTest::qWait(50);
    const auto state = [&] {
      QStringList text;
      for (const char* name : {"regions", "optimizer", "quality", "views", "scene"}) {
        const QDockWidget& one = *dock(name);
        const bool front = !one.visibleRegion().isEmpty();
        text << QString("%1 %2").arg(name, front ? QString("%1x%2 at %3,%4")
                                                       .arg(one.width())
                                                       .arg(one.height())
                                                       .arg(one.x())
                                                       .arg(one.y())
                                                 : QString("behind"));
      }
      return text;
    };
    const QStringList before = state();
    QTest::keyClick(&canvas(), Qt::Key_Tab);
    QTRY_VERIFY(!dock("quality")->isVisible());
    QTest::keyClick(&canvas(), Qt::Key_Tab);
    QTRY_COMPARE(state(), before);
  }

  void ThePictureIsCopied() {
    QApplication::clipboard()->clear();
    QTest::keyClick(&canvas(), Qt::Key_C, Qt::ControlModifier | Qt::ShiftModifier);
    const QImage copied = QApplication::clipboard()->image();
    QCOMPARE(copied.convertToFormat(QImage::Format_RGB32),
             BareCanvas(*window_).convertToFormat(QImage::Format_RGB32));
  }

  // The splat does not match the photos: the badge stays, and leads to the reason.
  void WarningsStayInSight() {
    auto* badge = window_->findChild<QToolButton*>("warnings");
    QVERIFY(Settle(controller()));
    QVERIFY(!badge->isVisible());
    Q_EMIT controller().results().sceneChecked({"the renders are not of this scene"});
    QVERIFY(badge->isVisible());
    window_->Say("something else");
    QVERIFY(badge->text().contains("1 warning"));
    QVERIFY(badge->toolTip().contains("not of this scene"));
    auto* scene = window_->findChild<QDockWidget*>("scene");
    QVERIFY(scene->visibleRegion().isEmpty());
    QTest::mouseClick(badge, Qt::LeftButton);
    QTRY_VERIFY(!scene->visibleRegion().isEmpty());
    controller().Close();
    QTRY_VERIFY(!badge->isVisible());
  }

  // The tool tip has the whole message if the status bar has no room for it.
  void AMessageThatDoesNotFitIsWholeInItsToolTip() {
    auto* message = window_->findChild<QLabel*>("message");
    const auto tip = [&](const QString& text) {
      window_->Say(text);
      const QPoint at(5, 5);
      QHelpEvent ask(QEvent::ToolTip, at, message->mapToGlobal(at));
      QCoreApplication::sendEvent(message, &ask);
      return QToolTip::text();
    };
    QVERIFY(tip("Wrote out.png").isEmpty());
    const QString path = "Wrote /home/" + QString("folder/").repeated(60) + "out.png";
    QCOMPARE(tip(path), path);
    QToolTip::hideText();
  }

  void TheFirstWindowFitsTheScreen() {
    for (const QSize& room : {QSize(1024, 700), QSize(1280, 720), QSize(3840, 2160)}) {
      const QSize size = MainWindow::FirstSize(room);
      QVERIFY(size.width() <= room.width() && size.height() <= room.height());
      QVERIFY(size.width() >= 900 && size.height() >= 600);
    }
    // And can be made that small, exploring and painting.
    QVERIFY2(
        window_->minimumSizeHint().width() <= 1000 && window_->minimumSizeHint().height() <= 640,
        qPrintable(QString("%1x%2")
                       .arg(window_->minimumSizeHint().width())
                       .arg(window_->minimumSizeHint().height())));
    window_->resize(1000, 650);
    QTRY_COMPARE(window_->size(), QSize(1000, 650));
    QTest::keyClick(&canvas(), Qt::Key_B);
    QVERIFY(WaitPainting(*window_));
    QTRY_COMPARE(window_->size(), QSize(1000, 650));
    for (const char* name : {"selectionAccept", "selectionCancel", "selectionTarget"}) {
      auto* widget = window_->findChild<QWidget*>(name);
      QCOMPARE(widget->visibleRegion().boundingRect().size(), widget->size());
    }
    Keep(*window_, "selection_small");
    QVERIFY(window_->selection().canvas().width() >= 400);
  }

  void ScreenshotIsWritten() {
    const QDir folder(QStandardPaths::writableLocation(QStandardPaths::PicturesLocation));
    const int before = int(folder.entryList({"retint-*.png"}).size());
    QTest::keyClick(&canvas(), Qt::Key_F2);
    const QStringList files = folder.entryList({"retint-*.png"});
    QCOMPARE(int(files.size()), before + 1);
    QVERIFY(!QImage(folder.filePath(files.back())).isNull());
  }

  void SavesAndRestoresTheCamera() {
    Drag(Qt::LeftButton, {90, -30});
    const Eigen::Vector3d there = Position(), forward = Forward();
    const std::string state = canvas().CameraState();
    canvas().ResetCamera();
    QVERIFY(canvas().RestoreCamera(state));
    QVERIFY((Position() - there).norm() < 1e-9);
    QVERIFY((Forward() - forward).norm() < 1e-9);
    for (const char* bad : {"", "[]", "{}", R"({"rotation_wxyz": [0,0,0,0]})"}) {
      QVERIFY(!canvas().RestoreCamera(bad));
    }
  }

  void SelectionModeIsEnteredAndLeft() {
    QTest::keyClick(&canvas(), Qt::Key_B);
    QVERIFY(window_->IsSelecting());
    QVERIFY(!window_->action("show.frusta")->isEnabled());  // its keys are the tools' now
    window_->selection().Leave();
    QTRY_VERIFY_WITH_TIMEOUT(!window_->IsSelecting(), kWaitMs);
    QVERIFY(window_->action("show.frusta")->isEnabled());
  }
};

}  // namespace retint

QTEST_MAIN(retint::MainWindowTest)
#include "main_window_test.moc"
