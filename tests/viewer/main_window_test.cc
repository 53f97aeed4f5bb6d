// SPDX-License-Identifier: BSD-3-Clause
// The window on a synthetic workspace: opened, explored and closed with mouse and keys, and the
// outcome read off the camera, the picture and the session.
#include "viewer/main_window.h"

#include <atomic>

#include <QAction>
#include <QDir>
#include <QDockWidget>
#include <QDropEvent>
#include <QFile>
#include <QLabel>
#include <QLineEdit>
#include <QMimeData>
#include <QPushButton>
#include <QStandardPaths>
#include <QToolButton>
#include <QUrl>

#include "colmap_io/image_io.h"
#include "splat_io/splat_io.h"
#include "tests/viewer/viewer_scene.h"
#include "viewer/selection/selection_mode.h"
#include "viewer/session_store.h"

namespace retint {

class MainWindowTest : public ViewerTest {
  Q_OBJECT

 private:
  Eigen::Vector3d Position() { return canvas().navigation().Rendered().Center(); }
  Eigen::Vector3d Forward() {
    return canvas()
        .navigation()
        .Rendered()
        .cam_from_world.rotation.toRotationMatrix()
        .row(2)
        .transpose();
  }
  double FocusDistance() { return (Position() - canvas().navigation().focus()).norm(); }

  RegionId AddTintedRegion() {
    QSignalSpy added(&controller(), &SceneController::regionAdded);
    controller().AddRegionFromMasks("jug", scene_->Masks(scene_->scene().still_life.front()),
                                    ColorEdit::Tint({0.2F, 0.9F, 0.3F}));
    if (added.count() == 0 && !added.wait(kWaitMs)) return 0;
    const RegionId id = added.at(0).at(0).value<RegionId>();
    const bool shown = QTest::qWaitFor(
        [&] { return !controller().ShowsOriginal() && canvas().IsSharp(); }, kWaitMs);
    return shown ? id : 0;
  }

  // The text of the dialog that a fault must bring; closes it.
  QString AnswerError() {
    QMessageBox* dialog = WaitDialog(*window_);
    if (!dialog) return "no dialog came";
    const QString text = dialog->informativeText();
    dialog->button(QMessageBox::Ok)->click();
    return text;
  }

  void ClickRole(QMessageBox::ButtonRole role) {
    for (QAbstractButton* button : window_->dialog()->buttons()) {
      if (window_->dialog()->buttonRole(button) == role) return button->click();
    }
    QFAIL("the dialog has no such button");
  }

 private Q_SLOTS:
  void initTestCase() { MakeScene(); }
  void cleanupTestCase() { scene_.reset(); }

  void init() { QVERIFY(ShowScene()); }
  void cleanup() { window_.reset(); }

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
    // On the screen: the same pose, the aspect kept within a pixel, the centre where it belongs.
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
    const QImage render = canvas().grab().toImage();
    QTest::keyPress(&canvas(), Qt::Key_P);
    QTRY_VERIFY_WITH_TIMEOUT(canvas().showing_photo(), kWaitMs);
    const QRect rect = canvas().ImageRect(canvas().navigation().Rendered()).toRect();
    const QImage shown = canvas().grab(rect).toImage();
    const QImage expected =
        photo.scaled(shown.size(), Qt::IgnoreAspectRatio, Qt::SmoothTransformation);
    QVERIFY(Difference(shown.convertToFormat(QImage::Format_RGB32), expected) < 4);
    QTest::keyRelease(&canvas(), Qt::Key_P);
    QVERIFY(!canvas().showing_photo());
    QVERIFY(Difference(canvas().grab().toImage(), render) < 0.01);
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
    // On the screen: with the line through the middle of what was tinted, its left is as it was,
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
    const QImage screen = canvas().grab().toImage();
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

  void EditsPreviewUndoAndRedo() {
    const QImage before = canvas().frame()->image;
    const RegionId id = AddTintedRegion();
    QVERIFY(id != 0);
    QCOMPARE(window_->current_region(), id);
    QVERIFY(window_->IsModified());
    controller().SetEdit(id, ColorEdit::Tint({1, 0.1F, 0.1F}), 1, "drag");
    controller().SetEdit(id, ColorEdit::Tint({1, 0.2F, 0.2F}), 1, "drag");
    QCOMPARE(controller().regions().Find(id)->edit.gain(1, 1), 0.2F);  // at once
    QTRY_COMPARE_WITH_TIMEOUT(controller().history().undo_label, std::string("Recolor jug"),
                              kWaitMs);
    QTest::keyClick(&canvas(), Qt::Key_Z, Qt::ControlModifier);
    QTRY_COMPARE_WITH_TIMEOUT(controller().regions().Find(id)->edit.gain(1, 1), 0.9F, kWaitMs);
    QTest::keyClick(&canvas(), Qt::Key_Z, Qt::ControlModifier);
    QTRY_VERIFY_WITH_TIMEOUT(controller().regions().regions.empty(), kWaitMs);
    QTRY_VERIFY_WITH_TIMEOUT(
        canvas().IsSharp() && Difference(canvas().frame()->image, before) < 0.01, kWaitMs);
    QVERIFY(!window_->IsModified());
    QTest::keyClick(&canvas(), Qt::Key_Z, Qt::ControlModifier | Qt::ShiftModifier);
    QTRY_COMPARE_WITH_TIMEOUT(controller().regions().regions.size(), size_t{1}, kWaitMs);
  }

  void OptimizerRunsAndFinishes() {
    QVERIFY(AddTintedRegion() != 0);
    const auto closed_form = controller().sh();
    controller().StartRefit();
    QTRY_VERIFY_WITH_TIMEOUT(
        controller().optimizer().state == BackgroundOptimizer::State::kFinished, kWaitMs);
    QVERIFY(controller().optimizer().steps > 0);
    QVERIFY(!controller().optimizer().losses.empty());
    QTRY_VERIFY_WITH_TIMEOUT(controller().regions().regions.front().fit != nullptr, kWaitMs);
    QVERIFY(*controller().sh() != *closed_form);
    QSignalSpy ready(&controller(), &SceneController::qualityReady);
    controller().Evaluate(window_->current_region());
    QVERIFY(ready.count() > 0 || ready.wait(kWaitMs));
    const auto report = ready.at(0).at(1).value<QualityReport>();
    QVERIFY(report.train.psnr_inside_after > report.train.psnr_inside_before);
  }

  void TabHidesAndShowsThePanels() {
    auto* dock = window_->AddPanel("test", "Test", new QLabel("panel"), Qt::RightDockWidgetArea);
    QTRY_VERIFY(dock->isVisible());
    QTest::keyClick(&canvas(), Qt::Key_Tab);
    QVERIFY(!dock->isVisible());
    QTest::keyClick(&canvas(), Qt::Key_Tab);
    QVERIFY(dock->isVisible());
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

  void BadScenesAreExplainedAndKeepTheOpenOne() {
    const auto facts = controller().facts();
    const auto folder = scene_->folder() / "bad";
    std::filesystem::create_directories(folder / "empty");
    QFile broken(QString::fromStdString((folder / "broken.ply").string()));
    QVERIFY(broken.open(QIODevice::WriteOnly));
    broken.write("ply\nformat binary_little_endian 1.0\nelement vertex 10\n");
    broken.close();
    OpenRequest request = scene_->Request();
    request.splat = folder / "broken.ply";
    window_->OpenScene(request);
    QVERIFY(AnswerError().contains("broken.ply"));
    request = scene_->Request();
    request.workspace = folder / "empty";
    window_->OpenScene(request);
    QVERIFY(AnswerError().contains("empty"));
    request = scene_->Request();
    request.splat = folder / "missing.ply";
    window_->OpenScene(request);
    QVERIFY(AnswerError().contains("missing.ply"));
    request = scene_->Request();
    request.options.backend = "abacus";
    window_->OpenScene(request);
    QVERIFY(AnswerError().contains("abacus"));
    window_->OpenPaths({QString::fromStdString((folder / "empty").string())});
    QVERIFY(AnswerError().contains("COLMAP"));
    window_->OpenPaths({"/no/such/path"});
    QVERIFY(AnswerError().contains("/no/such/path"));
    window_->OpenSession(folder / "nothing.retint");
    QVERIFY(AnswerError().contains("nothing.retint"));
    QCOMPARE(controller().facts(), facts);
    QVERIFY(controller().IsOpen());
  }

  void WritingToABadPlaceIsExplained() {
    QVERIFY(AddTintedRegion() != 0);
    controller().WriteSplat("/proc/retint/out.ply");
    QVERIFY(AnswerError().contains("/proc/retint"));
    const auto out = scene_->folder() / "out.ply";
    QSignalSpy written(&controller(), &SceneController::written);
    controller().WriteSplat(out);
    QVERIFY(written.count() > 0 || written.wait(kWaitMs));
    QVERIFY(std::filesystem::file_size(out) > 1000);
    controller().WriteViews(scene_->folder() / "views");
    QVERIFY(written.wait(kWaitMs));
    QCOMPARE(ReadImage8(scene_->folder() / "views" / "000.png.png").width, 160);
    controller().WriteFrames(scene_->folder() / "frames",
                             canvas().navigation().Turntable(3, 64, 48));
    QVERIFY(written.wait(kWaitMs));
    QCOMPARE(ReadImage8(scene_->folder() / "frames" / "0002.png").height, 48);
  }

  void DropsOpenAScene() {
    QSignalSpy opened(&controller(), &SceneController::opened);
    QMimeData data;
    data.setUrls({QUrl::fromLocalFile(QString::fromStdString(scene_->workspace().string()))});
    QDragEnterEvent enter({10, 10}, Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
    QCoreApplication::sendEvent(window_.get(), &enter);
    QVERIFY(enter.isAccepted());
    QDropEvent drop({10, 10}, Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
    QCoreApplication::sendEvent(window_.get(), &drop);
    QVERIFY(opened.count() > 0 || opened.wait(kWaitMs));
    QVERIFY(WaitSharp(*window_));
  }

  void SavesAndRestoresASession() {
    const RegionId id = AddTintedRegion();
    QVERIFY(id != 0);
    Drag(Qt::LeftButton, {40, 10});
    const Eigen::Vector3d there = Position();
    const auto folder = scene_->folder() / "work.retint";
    QSignalSpy saved(&window_->sessions(), &SessionStore::saved);
    window_->sessions().Save(folder);
    QVERIFY(saved.count() > 0 || saved.wait(kWaitMs));
    QVERIFY(!window_->IsModified());
    const auto sh = controller().sh();
    controller().Rename(id, "pot");
    QTRY_VERIFY_WITH_TIMEOUT(window_->IsModified(), kWaitMs);
    // Opened again: asks about what was not saved.
    QSignalSpy restored(&window_->sessions(), &SessionStore::restored);
    window_->OpenSession(folder);
    QVERIFY(WaitDialog(*window_));
    ClickRole(QMessageBox::DestructiveRole);
    QVERIFY(restored.count() > 0 || restored.wait(kWaitMs));
    QCOMPARE(controller().regions().regions.size(), size_t{1});
    QCOMPARE(controller().regions().regions.front().name, std::string("jug"));
    QVERIFY((Position() - there).norm() < 1e-9);
    QTRY_VERIFY_WITH_TIMEOUT(*controller().sh() == *sh, kWaitMs);
    QVERIFY(!window_->IsModified());
  }

  void AutosaveOutlivesACrash() {
    QVERIFY(AddTintedRegion() != 0);
    QTRY_VERIFY_WITH_TIMEOUT(window_->sessions().autosave() != nullptr, kWaitMs);
    const auto folder = window_->sessions().autosave()->folder();
    QTRY_VERIFY_WITH_TIMEOUT(std::filesystem::exists(folder / "session.json"), kWaitMs);
    QCOMPARE(ReadSessionInfo(folder).regions, size_t{1});
    // Undone, there is nothing left to lose.
    controller().Undo();
    QTRY_VERIFY_WITH_TIMEOUT(!std::filesystem::exists(folder / "session.json"), kWaitMs);
  }

  void ClosingWhileTheOptimizerRunsAsks() {
    QVERIFY(AddTintedRegion() != 0);
    RefitJob job;
    job.options.solver = Solver::kAdam;
    job.options.iterations = 1000000;
    controller().SetRefitJob(job);
    controller().StartRefit();
    QTRY_VERIFY_WITH_TIMEOUT(controller().optimizer().steps > 0, kWaitMs);
    window_->close();
    QVERIFY(WaitDialog(*window_));
    QVERIFY(window_->dialog()->informativeText().contains("optimiser"));
    ClickRole(QMessageBox::RejectRole);
    QVERIFY(window_->isVisible());
    QVERIFY(controller().optimizer().Active());
    QTRY_VERIFY(!window_->dialog());
    window_->close();
    QVERIFY(WaitDialog(*window_));
    ClickRole(QMessageBox::DestructiveRole);
    QTRY_VERIFY_WITH_TIMEOUT(!window_->isVisible(), kWaitMs);
    QVERIFY(!controller().optimizer().Active());
    window_.reset();  // joins every thread
  }

  void LoadingCanBeCancelled() {
    MainWindow other(theme_.get());
    other.show();
    QSignalSpy failed(&other.controller(), &SceneController::openFailed);
    QSignalSpy opened(&other.controller(), &SceneController::opened);
    // A load that takes until it is cancelled; one that does not hear of it opens the scene.
    const auto give_up = std::make_shared<std::atomic<bool>>(false);
    other.controller().OpenWith("slow", [give_up, request = scene_->Request()](Monitor& monitor) {
      while (!monitor.IsCancelled() && !*give_up) QTest::qSleep(2);
      return EditSession::Open(request.workspace, request.splat, request.options, monitor);
    });
    auto* cancel = other.findChild<QToolButton*>("cancel");
    QTRY_VERIFY_WITH_TIMEOUT(cancel->isVisible(), kWaitMs);
    QTest::mouseClick(cancel, Qt::LeftButton);
    const bool ended = QTest::qWaitFor([&] { return failed.count() + opened.count() > 0; }, 10000);
    *give_up = true;
    QVERIFY(ended);
    QCOMPARE(failed.count(), 1);
    QCOMPARE(failed.at(0).at(0).toString(), QString("cancelled"));
    QVERIFY(!other.controller().IsOpen() && !other.dialog());
    QVERIFY(other.findChild<QPushButton*>("welcome_open")->isVisible());
    // And then it opens.
    other.OpenScene(scene_->Request());
    QTRY_COMPARE_WITH_TIMEOUT(opened.count(), 1, kWaitMs);
  }

  void WhatTwoRegionsShowIsWhatIsExported() {
    const auto masks = scene_->Masks(scene_->MostVisible().object);
    QVERIFY(canvas().GoTo(scene_->MostVisible().first));
    ColorEdit paint, green = ColorEdit::Tint({0.2F, 1, 0.2F});
    paint.gain *= 0.3F;
    paint.offset = {0.6F, 0, 0};
    QSignalSpy added(&controller(), &SceneController::regionAdded);
    controller().AddRegionFromMasks("paint", masks, paint);
    controller().AddRegionFromMasks("green", masks, green);
    QTRY_COMPARE_WITH_TIMEOUT(added.count(), 2, kWaitMs);
    const RegionId first = controller().regions().regions[0].id;
    const RegionId second = controller().regions().regions[1].id;
    canvas().SetCloudShown(false);
    const auto facts = controller().facts();
    const auto out = scene_->folder() / "two.ply";
    // The canvas, once it shows what the session exports; null when it does not.
    const auto shown = [&]() -> QImage {
      QSignalSpy written(&controller(), &SceneController::written);
      controller().WriteSplat(out);
      if (!QTest::qWaitFor([&] { return written.count() == 1; }, kWaitMs)) return {};
      const GaussianModel exported = ReadSplat(out);
      const bool there = QTest::qWaitFor(
          [&] {
            return *controller().sh() == exported.sh && canvas().IsSharp() &&
                   canvas().frame()->sh == controller().sh();
          },
          kWaitMs);
      if (!there) return {};
      Renderer renderer(facts->backend, exported);
      const QImage expected = ToQImage(renderer.Render(canvas().navigation().Rendered()).rgb);
      const QImage image = canvas().frame()->image;
      return ChangedPixels(image, expected) == 0 ? image : QImage();
    };
    const QImage both = shown();
    QVERIFY(!both.isNull());
    controller().Move(second, 0);
    const QImage swapped = shown();
    QVERIFY(!swapped.isNull() && ChangedPixels(swapped, both) > 100);
    controller().SetVisible(first, false);
    const QImage hidden = shown();
    QVERIFY(!hidden.isNull() && ChangedPixels(hidden, swapped) > 100);
    controller().SetEdit(second, green, 0.3F);
    const QImage weak = shown();
    QVERIFY(!weak.isNull() && ChangedPixels(weak, hidden) > 100);
    for (int i = 0; i < 3; ++i) controller().Undo();
    QVERIFY(shown() == both);
  }

  void ExportedPicturesCarryTheEdit() {
    const auto facts = controller().facts();
    const auto masks = scene_->Masks(scene_->MostVisible().object);
    const std::string view = scene_->MostVisible().first;
    QSignalSpy added(&controller(), &SceneController::regionAdded);
    controller().AddRegionFromMasks("jug", masks, ColorEdit::Tint({0.2F, 0.9F, 0.3F}));
    QTRY_COMPARE_WITH_TIMEOUT(added.count(), 1, kWaitMs);
    QTRY_VERIFY_WITH_TIMEOUT(!controller().ShowsOriginal(), kWaitMs);
    QSignalSpy written(&controller(), &SceneController::written);
    controller().WriteViews(scene_->folder() / "tinted", {view});
    const auto cameras = canvas().navigation().Turntable(4, 160, 120);
    controller().WriteFrames(scene_->folder() / "turn", cameras);
    QTRY_COMPARE_WITH_TIMEOUT(written.count(), 2, kWaitMs);
    Renderer renderer(facts->backend, *facts->original);
    const auto render = [&](const PosedCamera& camera) {
      return ToQImage(renderer.Render(camera).rgb);
    };
    const auto read = [](const std::filesystem::path& path) { return ToQImage(ReadImage8(path)); };
    std::vector<std::pair<QImage, PosedCamera>> pictures = {
        {read(scene_->folder() / "tinted" / (view + ".png")),
         facts->Posed(*facts->workspace->reconstruction.FindView(view))}};
    for (size_t i = 0; i < cameras.size(); ++i) {
      const std::string name = "000" + std::to_string(i) + ".png";
      pictures.emplace_back(read(scene_->folder() / "turn" / name), cameras[i]);
    }
    // In the region, and hardly elsewhere.
    const QImage plain = render(pictures[0].second);
    const Mask& mask = masks.at(view);
    int64_t inside = 0, outside = 0, all_inside = 0;
    for (int y = 0; y < mask.height; ++y) {
      for (int x = 0; x < mask.width; ++x) {
        const bool differs = Apart(plain.pixel(x, y), pictures[0].first.pixel(x, y)) > 12;
        all_inside += mask(x, y) != 0;
        (mask(x, y) ? inside : outside) += differs;
      }
    }
    QVERIFY2(inside > all_inside / 2 && outside < all_inside / 2,
             qPrintable(QString("%1 of %2, %3").arg(inside).arg(all_inside).arg(outside)));
    int64_t changed = 0;
    for (const auto& [picture, camera] : pictures) {
      renderer.SetSh(facts->original->sh);
      changed += ChangedPixels(picture, render(camera)) > 20;
      renderer.SetSh(*controller().sh());
      QCOMPARE(ChangedPixels(picture, render(camera)), int64_t{0});
    }
    QVERIFY2(changed >= 3, qPrintable(QString::number(changed)));  // the turn may pass behind it
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
