// SPDX-License-Identifier: BSD-3-Clause
// Exploring, as far as main_window_test.cc does not test it: other mouse buttons, flying in all
// directions, adaptive resolution, clicks on frusta, points behind surfaces, the list of keys, full
// screen, theme.
#include <functional>
#include <optional>

#include <QAction>
#include <QCheckBox>
#include <QComboBox>
#include <QDialog>
#include <QDialogButtonBox>
#include <QFile>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QMenu>
#include <QScreen>
#include <QScrollBar>
#include <QTableWidget>
#include <QToolBar>
#include <QToolButton>

#include "tests/viewer/viewer_scene.h"
#include "viewer/canvas/canvas_overlays.h"
#include "viewer/panels/views_panel.h"
#include "viewer/window/keys_dialog.h"
#include "viewer/window/preferences_dialog.h"

namespace retint {

class ExploreTest : public ViewerTest {
  Q_OBJECT

 private:
  const Navigation& navigation() { return canvas().navigation(); }
  // Row 0: right, 1: down, 2: forward.
  Eigen::Matrix3d Axes() {
    return navigation().Rendered().cam_from_world.rotation.toRotationMatrix();
  }
  double FocusDistance() { return (Position() - navigation().focus()).norm(); }

  // How far holding a key has moved the camera, and how much faster than plainly it flies;
  // nothing when it does not move.
  struct Flight {
    Eigen::Vector3d moved;
    double factor;
  };
  std::optional<Flight> Fly(Qt::Key key, Qt::KeyboardModifiers modifiers = {}) {
    // Alt comes down first, as a hand does it: neither the menu bar nor a panel may take it.
    if (modifiers & Qt::AltModifier) QTest::keyPress(&canvas(), Qt::Key_Alt, Qt::AltModifier);
    const Eigen::Vector3d start = Position();
    QTest::keyPress(&canvas(), key, modifiers);
    const bool moves = QTest::qWaitFor([&] { return Position() != start; }, kWaitMs);
    const Flight flight = {Position() - start, canvas().fly_factor()};
    QTest::keyRelease(&canvas(), key, modifiers);
    if (modifiers & Qt::AltModifier) QTest::keyRelease(&canvas(), Qt::Key_Alt);
    if (!moves || !canvas().hasFocus()) return std::nullopt;
    return flight;
  }

  KeysDialog* OpenKeys() {
    PressKey(*window_, Qt::Key_F1);
    auto* dialog = window_->findChild<KeysDialog*>();
    return dialog && dialog->isVisible() ? dialog : nullptr;
  }

  // The menu of that name that is open; null: none.
  QMenu* OpenMenu(const char* name) {
    auto* menu = window_->findChild<QMenu*>(name);
    return menu && menu->isVisible() ? menu : nullptr;
  }

 private Q_SLOTS:
  void initTestCase() { MakeScene(); }
  void cleanupTestCase() { scene_.reset(); }
  void init() { QVERIFY(ShowScene()); }
  void cleanup() {
    window_.reset();
    for (const char* key : {"geometry", "layout"}) QSettings().remove(key);
  }

  void TheMiddleButtonOrbitsPansAndZooms() {
    const Eigen::Vector3d start = Position(), focus = navigation().focus();
    const double distance = FocusDistance();
    Drag(Qt::MiddleButton, {60, 10});
    QVERIFY((Position() - start).norm() > 0.05 * distance);
    QVERIFY(std::abs(FocusDistance() - distance) < 1e-9 * distance);
    QVERIFY((navigation().focus() - focus).norm() < 1e-12);
    const Eigen::Vector3d there = Position();
    const Eigen::Matrix3d axes = Axes();
    Drag(Qt::MiddleButton, {40, 30}, Qt::ShiftModifier);
    QVERIFY((Axes() - axes).norm() < 1e-9);
    // Dragged right and down, the picture goes along: the camera moves left and up.
    const Eigen::Vector3d panned = axes * (Position() - there);
    QVERIFY(panned.x() < 0 && panned.y() < 0 && std::abs(panned.z()) < 1e-9 * distance);
    const double before = FocusDistance();
    Drag(Qt::MiddleButton, {0, -80}, Qt::ControlModifier);
    QVERIFY(FocusDistance() < 0.95 * before);
    Drag(Qt::MiddleButton, {0, 160}, Qt::ControlModifier);
    QVERIFY(FocusDistance() > before);
  }

  // The camera turns about the point under the cursor, which does not move on the screen.
  void OrbitTurnsAboutWhatIsUnderTheCursor() {
    const SyntheticView& view = scene_->scene().views.front();
    const int x = view.depth.width / 3, y = view.depth.height * 2 / 3;
    const PosedCamera exact = controller().facts()->Posed(*controller().facts()->views.front());
    const Eigen::Vector3d truth = exact.Unproject({x + 0.5, y + 0.5}, view.depth(x, y));
    const PosedCamera shown = navigation().Rendered();
    const double scale = double(shown.camera.width) / view.depth.width;
    const QPoint at = (canvas().ImageRect(shown).topLeft() +
                       QPointF((x + 0.5) * scale, (y + 0.5) * scale) / canvas().devicePixelRatioF())
                          .toPoint();
    QTest::mousePress(&canvas(), Qt::LeftButton, {}, at);
    // Its depth is measured beside; within a tenth, as the Gaussians and the surface differ.
    QTRY_VERIFY_WITH_TIMEOUT((navigation().focus() - truth).norm() < 0.1 * view.depth(x, y),
                             kWaitMs);
    const Eigen::Vector3d focus = navigation().focus();
    QVERIFY(navigation().view());  // a press alone moves nothing
    const auto before = shown.Project(focus);
    for (int step = 1; step <= 10; ++step) {
      const QPoint to = at + QPoint(6 * step, 2 * step);
      QMouseEvent move(QEvent::MouseMove, to, canvas().mapToGlobal(to), Qt::NoButton,
                       Qt::LeftButton, Qt::NoModifier);
      QCoreApplication::sendEvent(&canvas(), &move);
    }
    QTest::mouseRelease(&canvas(), Qt::LeftButton, {}, at + QPoint(60, 20));
    QVERIFY((Position() - exact.Center()).norm() > 0.05 * view.depth(x, y));
    // The free camera fills the canvas, so that the picture's corner may be another.
    const PosedCamera now = navigation().Rendered();
    const auto after = now.Project(focus);
    QVERIFY(before && after);
    const QPointF from = canvas().ImageRect(shown).topLeft() + QPointF(before->x(), before->y());
    const QPointF there = canvas().ImageRect(now).topLeft() + QPointF(after->x(), after->y());
    // Less than this drag's 63 pixels by far: it turns on the spot, but for the level horizon and
    // a principal point that is not in the middle.
    QVERIFY2(QLineF(from, there).length() < 12,
             qPrintable(QString::number(QLineF(from, there).length())));
  }

  // Below the name of a view lies its picture, right of a portrait the surround.
  void ALongNameOfAPhotoIsCutShort() {
    SyntheticScene scene = scene_->scene();
    for (SyntheticView& view : scene.views) view.name.insert(0, std::string(200, 'w'));
    for (auto& [id, view] : scene.reconstruction.views) {
      view.name.insert(0, std::string(200, 'w'));
    }
    OpenRequest request = scene_->Request();
    request.workspace = scene_->folder() / "long";
    request.splat = request.workspace / "splat.ply";
    Monitor monitor;
    WriteSyntheticWorkspace(request.workspace, scene, monitor);
    QSignalSpy opened(&controller(), &SceneController::opened);
    window_->files().OpenScene(request);
    QTRY_COMPARE_WITH_TIMEOUT(opened.count(), 1, kWaitMs);
    window_->SetPanelsShown(false);
    QVERIFY(canvas().GoTo(scene.views.front().name) && WaitSharp(*window_));
    const double left = canvas().ImageRect(navigation().Rendered()).left();
    QVERIFY(left > 100);  // there is room beside the picture
    const QImage image = canvas().grab().toImage();
    for (int y = 0; y < 40; ++y) QCOMPARE(image.pixel(image.width() - 3, y), image.pixel(2, y));
  }

  void EveryFlyKeyMovesAlongItsAxis() {
    const std::tuple<Qt::Key, int, double> keys[] = {{Qt::Key_W, 2, 1},  {Qt::Key_S, 2, -1},
                                                     {Qt::Key_A, 0, -1}, {Qt::Key_D, 0, 1},
                                                     {Qt::Key_Q, 1, 1},  {Qt::Key_E, 1, -1}};
    for (const auto& [key, axis, sign] : keys) {
      const auto flight = Fly(key);
      QVERIFY2(flight, QKeySequence(key).toString().toUtf8());
      const Eigen::Vector3d moved = Axes() * flight->moved;
      // Along this axis alone, but for rounding.
      QVERIFY2(sign * moved[axis] > (1 - 1e-9) * moved.norm(),
               QKeySequence(key).toString().toUtf8());
    }
  }

  void ShiftFliesFasterAndAltSlower() {
    // navigation_test.cc has the distance that a factor makes.
    const auto plain = Fly(Qt::Key_W), fast = Fly(Qt::Key_S, Qt::ShiftModifier);
    QVERIFY(plain && fast);
    QCOMPARE(plain->factor, 1.0);
    QCOMPARE(fast->factor, 10.0);
    // Each of these letters is a menu's or a panel's with Alt.
    for (const Qt::Key key : {Qt::Key_W, Qt::Key_A, Qt::Key_S, Qt::Key_D, Qt::Key_Q, Qt::Key_E}) {
      const auto slow = Fly(key, Qt::AltModifier);
      QVERIFY2(slow, QKeySequence(key).toString().toUtf8());
      QCOMPARE(slow->factor, 0.1);
      QVERIFY(!QApplication::activePopupWidget());
    }
    // And so it is with Alt coming and going while one flies.
    QTest::keyPress(&canvas(), Qt::Key_W);
    QTest::keyClick(&canvas(), Qt::Key_Alt, Qt::AltModifier);
    QVERIFY(canvas().hasFocus());
    const Eigen::Vector3d start = Position();
    QTRY_VERIFY((Position() - start).norm() > 0);
    QTest::keyRelease(&canvas(), Qt::Key_W);
  }

  void WhatIsHeldEndsWithTheFocus() {
    QTest::keyPress(&canvas(), Qt::Key_W);
    QTest::keyPress(&canvas(), Qt::Key_Backslash);
    QVERIFY(canvas().showing_original());
    window_->findChild<QComboBox*>("views_order")->setFocus();
    QVERIFY(!canvas().showing_original());
    const Eigen::Vector3d there = Position();
    QTest::qWait(60);
    QCOMPARE(Position(), there);
  }

  void FramesAreSmallWhileMovingAndSharpAtRest() {
    auto* renderer = window_->findChild<RenderThread*>();
    QVERIFY(renderer);
    renderer->SetFrameBudget(1e-3);  // no machine keeps to this
    std::vector<std::shared_ptr<const Frame>> frames;
    connect(&canvas(), &Canvas::frameShown, this, [&] { frames.push_back(canvas().frame()); });
    for (int i = 0; i < 6; ++i) {
      const size_t shown = frames.size();
      Drag(Qt::LeftButton, {20, 0});
      QVERIFY(QTest::qWaitFor([&] { return frames.size() > shown; }, kWaitMs));
    }
    QVERIFY(WaitSharp(*window_));
    disconnect(&canvas(), nullptr, this, nullptr);
    const auto small = std::count_if(frames.begin(), frames.end(), [](const auto& frame) {
      return frame->moving && frame->scale < 1 && frame->image.width() < frame->camera.camera.width;
    });
    QVERIFY2(small > 0, qPrintable(QString::number(frames.size())));
    const auto& sharp = frames.back();
    QCOMPARE(sharp->scale, 1.0);
    QCOMPARE(sharp->image.width(), canvas().width());
  }

  void TheStatusBarSaysWhatIsThere() {
    Drag(Qt::LeftButton, {20, 0});
    Drag(Qt::LeftButton, {20, 0});
    const auto text = [&](const char* name) { return window_->findChild<QLabel*>(name)->text(); };
    QTRY_VERIFY_WITH_TIMEOUT((Drag(Qt::LeftButton, {5, 0}), text("speed").endsWith("fps")),
                             kWaitMs);
    QCOMPARE(text("backend"), QString::fromStdString(BackendName()).toUpper());
    QCOMPARE(
        text("gaussians"),
        QLocale().toString(qulonglong(window_->controller().facts()->original->NumGaussians())) +
            " Gaussians");
    QTRY_VERIFY(text("memory").remove(" MB").toDouble() > 20);
  }

  void OnlyMovingFramesCountAsFramesASecond() {
    for (int i = 0; i < 200 && canvas().frames_per_second() == 0; ++i) {
      Drag(Qt::LeftButton, {5, 0});
      QTest::qWait(10);
    }
    QVERIFY(canvas().frames_per_second() > 0);
    QVERIFY(WaitSharp(*window_));
    const double speed = canvas().frames_per_second();
    // Frames of the window's size and of colors, long after the camera has come to rest.
    QTest::qWait(400);
    for (const int height : {700, 680, 660}) {
      int moving = 0;
      connect(&canvas(), &Canvas::frameShown, this,
              [&] { moving += canvas().frame()->moving ? 1 : 0; });
      window_->resize(window_->width(), height);
      QTRY_VERIFY_WITH_TIMEOUT(moving > 0, kWaitMs);
      disconnect(&canvas(), nullptr, this, nullptr);
      Q_EMIT window_->controller().colors().shChanged();
      QVERIFY(WaitSharp(*window_));
      QTest::qWait(150);
    }
    QCOMPARE(canvas().frames_per_second(), speed);
    // Nor does the first frame after a rest.
    canvas().navigation().Zoom(0.1);
    canvas().CameraMoved();
    QVERIFY(WaitSharp(*window_));
    QCOMPARE(canvas().frames_per_second(), speed);
  }

  void TheDepthHasNoTwoSides() {
    PressKey(*window_, Qt::Key_N);
    QVERIFY(WaitSharp(*window_));
    const QImage depth = BareCanvas(*window_);
    PressKey(*window_, Qt::Key_X);
    QVERIFY(WaitSharp(*window_));
    QVERIFY(canvas().split() && BareCanvas(*window_) == depth);
    // There is no handle to drag either: dragging where it would be orbits.
    const Eigen::Vector3d before = Position();
    Drag(Qt::LeftButton, {50, 0});
    QVERIFY(Position() != before && canvas().split_at() == 0.5);
    PressKey(*window_, Qt::Key_F, Qt::ShiftModifier);
    PressKey(*window_, Qt::Key_N);
    QVERIFY(WaitSharp(*window_));
    QVERIFY(!canvas().frame()->before.isNull());
  }

  void AMissingOrBadPhotoIsSaid() {
    const auto copy = scene_->folder() / "without_photos";
    std::filesystem::copy(scene_->workspace(), copy, std::filesystem::copy_options::recursive);
    const std::string missing = scene_->scene().views[0].name;
    const std::string bad = scene_->scene().views[1].name;
    std::filesystem::remove(copy / "images" / missing);
    QFile file(QString::fromStdString((copy / "images" / bad).string()));
    QVERIFY(file.open(QIODevice::WriteOnly));
    file.write("no picture");
    file.close();
    OpenRequest request = scene_->Request();
    request.workspace = copy;
    QSignalSpy opened(&window_->controller(), &SceneController::opened);
    window_->files().OpenScene(request);
    QTRY_COMPARE_WITH_TIMEOUT(opened.count(), 1, kWaitMs);
    QVERIFY(WaitSharp(*window_));
    QVERIFY(Settle(window_->controller()));  // the check of the scene has a message too
    auto* message = window_->findChild<QLabel*>("message");
    const auto says = [&](const std::string& name, const char* what) {
      return message->text().contains(what) &&
             message->text().contains(QString::fromStdString(name));
    };
    PressKey(*window_, Qt::Key_F, Qt::ShiftModifier);
    QTest::keyPress(&canvas(), Qt::Key_P);
    QTRY_VERIFY2_WITH_TIMEOUT(says(missing, "is missing"), qPrintable(message->text()), kWaitMs);
    QVERIFY(!canvas().showing_photo() && canvas().lacks_photo());
    PressKey(*window_, Qt::Key_Right);  // held on
    QTRY_VERIFY2_WITH_TIMEOUT(says(bad, "cannot be read"), qPrintable(message->text()), kWaitMs);
    PressKey(*window_, Qt::Key_Right);
    QTRY_VERIFY_WITH_TIMEOUT(canvas().showing_photo(), kWaitMs);
    PressKey(*window_, Qt::Key_Left);  // known by now
    QVERIFY2(says(bad, "cannot be read"), qPrintable(message->text()));
    QTest::keyRelease(&canvas(), Qt::Key_P);
    QVERIFY(!canvas().lacks_photo());
  }

  void DoubleClickOnAFrustumGoesToItsView() {
    const auto facts = window_->controller().facts();
    double sum = 0;
    for (const View* view : facts->views) {
      sum += (view->cam_from_world.OriginInSource() - navigation().center()).norm();
    }
    const double size = 0.07 * sum / double(facts->views.size());
    canvas().navigation().Zoom(-14);
    canvas().navigation().Orbit(0, 120);
    canvas().CameraMoved();
    PressKey(*window_, Qt::Key_C);
    QVERIFY(WaitSharp(*window_));
    const View& view = *facts->views[4];
    const PosedCamera posed = facts->Posed(view);
    const PosedCamera shown = navigation().Rendered();
    const auto at = shown.Project(posed.Unproject({80, 60}, size));
    QVERIFY(at);
    const QPointF point = canvas().ImageRect(shown).topLeft() + QPointF(at->x(), at->y());
    QVERIFY(canvas().rect().contains(point.toPoint()));
    QTest::mouseDClick(&canvas(), Qt::LeftButton, {}, point.toPoint());
    QVERIFY(navigation().view());
    QCOMPARE(navigation().view()->name, view.name);
  }

  void PointsBehindASurfaceAreHidden() {
    const SyntheticView& view = scene_->scene().views.front();
    const PosedCamera posed =
        window_->controller().facts()->Posed(*window_->controller().facts()->views.front());
    const QImage plain = canvas().frame()->image;
    for (const double factor : {0.97, 1.3}) {
      auto cloud = std::make_shared<OverlayCloud>();
      cloud->opacity = 1;
      for (int y = 30; y < 90; y += 3) {
        for (int x = 40; x < 120; x += 3) {
          cloud->points.push_back(
              posed.Unproject({x + 0.5, y + 0.5}, factor * view.depth(x, y)).cast<float>());
        }
      }
      canvas().SetCloud(cloud);
      QVERIFY(WaitSharp(*window_));
      const QImage image = canvas().frame()->image;
      const QRgb color = qRgb(cloud->color[0], cloud->color[1], cloud->color[2]);
      size_t drawn = 0;
      for (int y = 0; y < image.height(); ++y) {
        for (int x = 0; x < image.width(); ++x) {
          drawn += image.pixel(x, y) == color && plain.pixel(x, y) != color;
        }
      }
      const size_t all = cloud->points.size();
      if (factor < 1) {
        QVERIFY2(drawn > 2 * all, qPrintable(QString::number(drawn)));  // squares of 2 x 2
      } else {
        QVERIFY2(drawn < all / 4, qPrintable(QString::number(drawn)));
      }
    }
  }

  void F11FillsTheScreenAndEscapeNeverQuits() {
    PressKey(*window_, Qt::Key_F11);
    QVERIFY(window_->isFullScreen());
    PressKey(*window_, Qt::Key_X);
    PressKey(*window_, Qt::Key_N);
    for (int i = 0; i < 8; ++i) PressKey(*window_, Qt::Key_Escape);
    QVERIFY(!window_->isFullScreen());
    QVERIFY(!canvas().split() && !canvas().depth());
    QVERIFY(window_->isVisible() && window_->controller().IsOpen() && !window_->dialogs().box());
  }

  // The list scrolls where the screen is small.
  void TheListOfKeysFitsTheScreen() {
    KeysDialog* dialog = OpenKeys();
    QVERIFY(dialog);
    const QSize room = dialog->screen()->availableSize();
    QVERIFY(dialog->width() < room.width() && dialog->height() < room.height());
    constexpr QSize kSmall(1024, 700);
    const QSize small = KeysDialog::FirstSize(kSmall, dialog->fontMetrics());
    QFont large = dialog->font();
    large.setPointSize(2 * large.pointSize());
    const QSize wide = KeysDialog::FirstSize({3000, 700}, QFontMetrics(large));
    QVERIFY(wide.width() > 3 * small.width() / 2);
    constexpr int kDecorations = 40;  // pixels; a title and a frame
    QVERIFY(small.width() < kSmall.width() && small.height() < kSmall.height() - kDecorations);
    dialog->resize(small);
    QTest::qWait(0);
    QCOMPARE(dialog->size(), small);
    Keep(*dialog, "keys_small");
    auto* close = dialog->findChild<QDialogButtonBox*>();
    QVERIFY(dialog->rect().contains(close->geometry()));
    QVERIFY(dialog->findChild<QTableWidget*>()->verticalScrollBar()->maximum() > 0);
  }

  void F1ListsTheKeys() {
    KeysDialog* dialog = OpenKeys();
    QVERIFY(dialog);
    auto* table = dialog->findChild<QTableWidget*>();
    const auto keys_of = [&](const QString& what) {
      for (int row = 0; row < table->rowCount(); ++row) {
        if (table->item(row, 0)->text() == what && table->item(row, 1)) {
          return table->item(row, 1)->text();
        }
      }
      return QString("?");
    };
    QCOMPARE(keys_of("Fly forward"), QString("W"));
    QCOMPARE(keys_of("Orbit around what is under the cursor"), QString("left drag, middle drag"));
  }

  void PreferencesActAtOnceAndAreKept() {
    QAction* open = nullptr;
    for (QAction* action : window_->findChildren<QAction*>()) {
      if (QString(action->text()).remove('&').startsWith("Preferences")) open = action;
    }
    QVERIFY(open);
    open->trigger();
    auto* dialog = window_->findChild<QDialog*>("preferences");
    QVERIFY(dialog && dialog->isVisible());
    const auto choose = [&](const char* box, const QString& name) {
      auto* choices = dialog->findChild<QComboBox*>(box);
      choices->setFocus();
      QTest::keyClick(choices, Qt::Key_Home);
      while (choices->currentText() != name) {
        const int at = choices->currentIndex();
        QTest::keyClick(choices, Qt::Key_Down);
        if (choices->currentIndex() == at) break;
      }
    };
    choose("preferred_theme", "Light");
    QTRY_VERIFY(window_->palette().color(QPalette::Window).lightness() > 200);
    choose("preferred_theme", "Dark");
    QTRY_VERIFY(window_->palette().color(QPalette::Window).lightness() < 80);
    QCOMPARE(QSettings().value("theme").toString(), QString("dark"));
    auto* refit = dialog->findChild<QCheckBox*>("preferred_refit");
    QVERIFY(refit->isChecked());
    QTest::mouseClick(refit, Qt::LeftButton, {}, {8, refit->height() / 2});
    QVERIFY(!controller().colors().automatic_refit());
    const auto type = [&](const char* field, const QString& text) {
      dialog->findChild<QLineEdit*>(field)->setFocus();
      QTest::keyClicks(dialog->findChild<QLineEdit*>(field), text);
    };
    type("preferred_network", "/a/encoder.onnx");
    type("preferred_decoder", "/a/decoder.onnx");
    type("preferred_runtime", "/a/lib");
    QCOMPARE(Preferences::Load().NetworkName(), QString("onnx:/a/encoder.onnx,/a/decoder.onnx"));
    QCOMPARE(qgetenv("RETINT_ONNX_RUNTIME"), QByteArray("/a/lib"));
    dialog->findChild<QLineEdit*>("preferred_runtime")->clear();
    QVERIFY(qgetenv("RETINT_ONNX_RUNTIME") != QByteArray("/a/lib"));
    dialog->close();
    MainWindow next(theme_.get());
    QVERIFY(!next.controller().colors().automatic_refit());
    for (const char* key : {"theme", "automatic_refit", "frame_ms", "network", "network_decoder"}) {
      QSettings().remove(key);
    }
    theme_->Choose(ThemeChoice::kSystem);
  }

  // A right click; a right drag pans, as ever.
  void TheCanvasHasAMenu() {
    Drag(Qt::RightButton, {40, 20});
    QVERIFY(!OpenMenu("canvas_menu"));
    const Eigen::Vector3d before = Position();
    QTest::mouseClick(&canvas(), Qt::RightButton, {}, Middle());
    QMenu* menu = nullptr;
    QTRY_VERIFY((menu = OpenMenu("canvas_menu")));
    QVERIFY(Position() == before);
    Keep(*menu, "canvas-menu");
    QVERIFY(!canvas().depth());
    menu->setActiveAction(window_->action("show.depth"));
    QTest::keyClick(menu, Qt::Key_Return);
    QVERIFY(canvas().depth());
    canvas().SetDepth(false);
  }

  // A right click goes to the view, so that "Paint" means it.
  void TheListOfViewsHasAMenu() {
    auto* list = window_->findChild<ViewsPanel*>()->findChild<QListWidget*>();
    QListWidgetItem* item = list->item(2);
    list->scrollToItem(item);
    QVERIFY(canvas().GoTo(scene_->scene().views[0].name));
    Q_EMIT list->customContextMenuRequested(list->visualItemRect(item).center());
    QMenu* menu = nullptr;
    QTRY_VERIFY((menu = OpenMenu("views_menu")));
    QVERIFY(canvas().picture());
    QCOMPARE(canvas().picture()->name, item->data(Qt::UserRole).toString().toStdString());
    menu->setActiveAction(window_->action("selection.enter"));
    QTest::keyClick(menu, Qt::Key_Return);
    QVERIFY(WaitPainting(*window_));
    QTest::keyClick(&window_->selection().canvas(), Qt::Key_Escape);
    QTRY_VERIFY(!window_->IsSelecting());
  }

  // One place to choose the canvas's contents: over its corner, not in the tool bar.
  void TheSwitchOverTheCanvasSaysWhatShows() {
    auto* over = window_->findChild<QWidget*>("view_switch");
    QVERIFY(over->isVisible() && over->geometry().right() < canvas().width());
    const std::pair<const char*, std::function<bool()>> shows[] = {
        {"show.frusta", [&] { return canvas().frusta(); }},
        {"show.depth", [&] { return canvas().depth(); }},
        {"show.cloud", [&] { return canvas().cloud_shown(); }},
        {"show.split", [&] { return canvas().split(); }}};
    for (const auto& [command, is_shown] : shows) {
      QToolButton* button = nullptr;
      for (auto* one : over->findChildren<QToolButton*>()) {
        if (one->defaultAction() == window_->action(command)) button = one;
      }
      QVERIFY2(button, command);
      for (auto* one : window_->findChild<QToolBar*>("tools")->findChildren<QToolButton*>()) {
        QVERIFY2(one->defaultAction() != window_->action(command), command);
      }
      const bool before = is_shown();
      QTest::mouseClick(button, Qt::LeftButton);
      QVERIFY2(is_shown() != before && button->isChecked() == is_shown(), command);
      QTest::mouseClick(button, Qt::LeftButton);
      QVERIFY2(is_shown() == before, command);
    }
    // In a window that becomes narrower it stays in the corner.
    window_->SetSideShown(Qt::LeftDockWidgetArea, false);
    QTRY_COMPARE(over->geometry().right(), canvas().width() - 11);
    QVERIFY(WaitSharp(*window_));
    Keep(*window_, "switch");
  }

  void TheGizmoTurnsTheCamera() {
    auto* gizmo = window_->findChild<OrientationGizmo*>();
    QVERIFY(gizmo->isVisible());
    const Eigen::Vector3d up = navigation().up(), focus = navigation().focus();
    const double distance = FocusDistance();
    // From above.
    QTest::mouseClick(gizmo, Qt::LeftButton, {}, gizmo->EndOf(2, true).toPoint());
    QVERIFY((Axes().row(2).transpose() + up).norm() < 1e-6);
    QVERIFY((navigation().focus() - focus).norm() < 1e-9);
    QVERIFY(std::abs(FocusDistance() - distance) < 1e-6 * distance);
    QVERIFY(!navigation().view());
    // From a side the horizon is level.
    QTest::mouseClick(gizmo, Qt::LeftButton, {}, gizmo->EndOf(0, true).toPoint());
    QVERIFY(std::abs(Axes().row(2).dot(up)) < 1e-6 && std::abs(Axes().row(0).dot(up)) < 1e-6);
    QVERIFY((Axes().row(2).transpose() + navigation().Axes().col(0)).norm() < 1e-6);
    // A drag orbits.
    const Eigen::Vector3d before = Position();
    DragAlong(gizmo, {{38, 38}, {58, 38}, {60, 44}});
    QVERIFY((Position() - before).norm() > 0.05 * distance);
    QVERIFY(std::abs(FocusDistance() - distance) < 1e-6 * distance);
    QVERIFY(WaitSharp(*window_));
    Keep(*window_, "gizmo");
  }
};

}  // namespace retint

QTEST_MAIN(retint::ExploreTest)
#include "explore_test.moc"
