// SPDX-License-Identifier: BSD-3-Clause
// A small synthetic workspace on disk and a window on it, for tests that act with mouse and keys.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <QAbstractButton>
#include <QApplication>
#include <QCoreApplication>
#include <QDropEvent>
#include <QFileDialog>
#include <QLineEdit>
#include <QMessageBox>
#include <QMimeData>
#include <QMouseEvent>
#include <QPointer>
#include <QRegularExpression>
#include <QSettings>
#include <QSignalSpy>
#include <QTemporaryDir>
#include <QTest>
#include <QTimer>
#include <QToolButton>
#include <QUrl>

#include "synthetic/synthetic_scene.h"
#include "synthetic/synthetic_workspace.h"
#include "tests/support/iou.h"
#include "viewer/selection/selection_mode.h"
#include "viewer/window/main_window.h"

namespace retint {

#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
inline constexpr int kWaitMs = 600000;
#else
inline constexpr int kWaitMs = 60000;
#endif

// A region of masks alone, by image name: regionAdded() follows.
inline void AddRegionFromMasks(SceneController& controller, const QString& name,
                               std::map<std::string, Mask> masks, const ColorEdit& edit) {
  const auto id = std::make_shared<RegionId>(0);
  controller.Run(
      "Adding a region",
      [=, masks = std::move(masks)](EditSession& session, Monitor& monitor) {
        *id = session.store().Add(name.toStdString(), masks, {}, edit, monitor);
      },
      [=, &controller] { Q_EMIT controller.regionAdded(*id); });
}

// Settings, data and pictures of the test's own, so that no test sees the user's or another's.
inline void UseOwnFolders(const QString& folder) {
  qputenv("XDG_CONFIG_HOME", (folder + "/config").toLocal8Bit());
  qputenv("XDG_DATA_HOME", (folder + "/data").toLocal8Bit());
  qputenv("XDG_PICTURES_DIR", (folder + "/pictures").toLocal8Bit());
  qputenv("HOME", folder.toLocal8Bit());
  QCoreApplication::setOrganizationName("retint-test");
  QCoreApplication::setApplicationName("retint-viewer-test");
}

// Opens the parts of panels that are closed at first.
inline void OpenDrawers(const QWidget& window) {
  for (auto* drawer : window.findChildren<QToolButton*>(QRegularExpression("_advanced$"))) {
    drawer->setChecked(true);
  }
}

// Which backend is tested: the CPU's, unless the caller has a device.
inline std::string BackendName() {
  return qEnvironmentVariable("RETINT_TEST_BACKEND", "cpu").toStdString();
}

// A lens for ViewerScene: a fisheye that sees 190 degrees, on photos twice as wide and high.
inline const std::string kWideFisheye = "WIDE_FISHEYE";

class ViewerScene {
 public:
  // `lens`: a model that MakeLens() knows, or kWideFisheye; empty: pinhole photos.
  explicit ViewerScene(int width = 160, int height = 120, int views = 6,
                       const std::string& lens = {}) {
    UseOwnFolders(folder_.path());
    SyntheticOptions options;
    options.width = width, options.height = height, options.views = views;
    Monitor monitor;
    scene_ = MakeSyntheticScene(options, monitor);
    if (lens == kWideFisheye) {
      const double focal = 2 * width / (190 * M_PI / 180);
      TakeThroughLens(Camera{0,
                             CameraModelId::kOpenCVFisheye,
                             2 * width,
                             2 * height,
                             {focal, focal, double(width), double(height), 0, 0, 0, 0}},
                      options, &scene_, monitor);
    } else if (!lens.empty()) {
      const Camera& pinhole = scene_.reconstruction.cameras.begin()->second;
      TakeThroughLens(MakeLens(lens, pinhole), options, &scene_, monitor);
    }
    WriteSyntheticWorkspace(workspace(), scene_, monitor);
  }

  std::filesystem::path folder() const { return folder_.path().toStdString(); }
  std::filesystem::path workspace() const { return folder() / "workspace"; }
  const SyntheticScene& scene() const { return scene_; }

  OpenRequest Request() const {
    OpenRequest request;
    request.workspace = workspace();
    request.splat = workspace() / "splat.ply";
    request.options.backend = BackendName();
    return request;
  }

  // The largest object that at least two views see whole, and the first and last of these views.
  struct Subject {
    int object = 0;
    std::string first, second;
  };
  Subject MostVisible() const {
    Subject subject;
    int64_t largest = 0;
    for (const int object : scene_.still_life) {
      const auto& whole = scene_.whole_views[size_t(object)];
      if (whole.size() < 2) continue;
      const auto& ids = scene_.views[size_t(whole.front())].object_ids.data;
      const int64_t pixels = std::count(ids.begin(), ids.end(), object);
      if (pixels <= largest) continue;
      largest = pixels;
      subject = {object, scene_.views[size_t(whole.front())].name,
                 scene_.views[size_t(whole.back())].name};
    }
    return subject;
  }

  // Of an object in every view.
  std::map<std::string, Mask> Masks(int object) const {
    std::map<std::string, Mask> masks;
    for (const SyntheticView& view : scene_.views) {
      Mask mask(view.object_ids.width, view.object_ids.height);
      for (size_t i = 0; i < mask.data.size(); ++i) {
        mask.data[i] = view.object_ids.data[i] == object ? 255 : 0;
      }
      masks[view.name] = mask;
    }
    return masks;
  }

 private:
  QTemporaryDir folder_;
  SyntheticScene scene_;
};

// Without a window manager nobody makes a window active, nor again when a dialog of its closes.
inline bool Activate(QWidget& window) {
  if (window.isActiveWindow()) return true;
  window.activateWindow();
  return QTest::qWaitForWindowActive(&window);
}

// A shown window with the scene open and its first sharp frame on the screen.
inline std::unique_ptr<MainWindow> OpenWindow(Theme& theme, const ViewerScene& scene) {
  auto window = std::make_unique<MainWindow>(&theme);
  window->resize(1330, 680);
  window->show();
  window->controller().colors().SetAutomaticRefit(false);
  window->files().OpenScene(scene.Request());
  if (!QTest::qWaitFor([&] { return window->canvas().IsSharp(); }, kWaitMs)) return nullptr;
  if (!Activate(*window)) return nullptr;
  // Its defaults leave room for the picture; tests want to see panels.
  for (const auto side : {Qt::LeftDockWidgetArea, Qt::RightDockWidgetArea}) {
    window->SetSideShown(side, true);
  }
  if (!QTest::qWaitFor([&] { return window->canvas().IsSharp(); }, kWaitMs)) return nullptr;
  window->canvas().setFocus();
  return window;
}

// The whole frame of the newest camera and colors on the screen.
inline bool WaitSharp(MainWindow& window) {
  return QTest::qWaitFor([&] { return window.canvas().IsSharp(); }, kWaitMs);
}

// The canvas without the controls over it.
inline QImage BareCanvas(MainWindow& window) {
  std::vector<QWidget*> over;
  for (const char* name : {"view_switch", "orientation_gizmo"}) {
    over.push_back(window.findChild<QWidget*>(name));
  }
  for (QWidget* one : over) one->hide();
  const QImage picture = window.canvas().grab().toImage();
  for (QWidget* one : over) one->show();
  return picture;
}

// A picture for a look by eye, where RETINT_SCREENSHOTS names a folder.
inline void Keep(QWidget& widget, const char* name) {
  const QString folder = qEnvironmentVariable("RETINT_SCREENSHOTS");
  if (!folder.isEmpty()) widget.grab().save(folder + "/" + name + ".png");
}

// Presses and moves along points of a widget.
inline void DragHeld(QWidget* widget, const QList<QPoint>& path,
                     Qt::MouseButton button = Qt::LeftButton,
                     Qt::KeyboardModifiers modifiers = Qt::NoModifier) {
  QTest::mousePress(widget, button, modifiers, path.front());
  for (const QPoint& at : path) {
    QMouseEvent move(QEvent::MouseMove, at, widget->mapToGlobal(at), Qt::NoButton, button,
                     modifiers);
    QCoreApplication::sendEvent(widget, &move);
  }
}

// And releases.
inline void DragAlong(QWidget* widget, const QList<QPoint>& path,
                      Qt::MouseButton button = Qt::LeftButton,
                      Qt::KeyboardModifiers modifiers = Qt::NoModifier) {
  DragHeld(widget, path, button, modifiers);
  QTest::mouseRelease(widget, button, modifiers, path.back());
}

// A drop from another program, which prefers to move, and also has the name as text. Returns the
// action that it is told; ignored if no widget accepts it.
inline Qt::DropAction Drop(QWidget& onto, const QUrl& url,
                           Qt::DropActions may = Qt::CopyAction | Qt::MoveAction) {
  QMimeData data;
  data.setUrls({url});
  data.setText(url.toString());
  const auto moves = Qt::ShiftModifier;
  QDragEnterEvent enter({10, 10}, may, &data, Qt::LeftButton, moves);
  QCoreApplication::sendEvent(&onto, &enter);
  if (!enter.isAccepted()) return Qt::IgnoreAction;
  QDropEvent drop({10, 10}, may, &data, Qt::LeftButton, moves);
  QCoreApplication::sendEvent(&onto, &drop);
  return drop.isAccepted() ? drop.dropAction() : Qt::IgnoreAction;
}

// A file; false when nothing there wants it.
inline bool Drop(QWidget& onto, const std::filesystem::path& path) {
  return Drop(onto, QUrl::fromLocalFile(QString::fromStdString(path.string()))) == Qt::CopyAction;
}

// The base of most tests of the window: one scene for all cases, and a window for each.
class ViewerTest : public QObject {
 protected:
  void MakeScene(int width = 160, int height = 120, int views = 6, const std::string& lens = {}) {
    qRegisterMetaType<RegionId>("retint::RegionId");
    scene_ = std::make_unique<ViewerScene>(width, height, views, lens);
    theme_ = std::make_unique<Theme>();
  }
  bool ShowScene() {
    window_ = OpenWindow(*theme_, *scene_);
    return window_ != nullptr;
  }

  Canvas& canvas() { return window_->canvas(); }
  SceneController& controller() { return window_->controller(); }
  Eigen::Vector3d Position() { return canvas().navigation().Rendered().Center(); }
  QPoint Middle() { return canvas().rect().center(); }
  // From the middle of the canvas.
  void Drag(Qt::MouseButton button, QPoint by, Qt::KeyboardModifiers modifiers = {}) {
    DragAlong(&canvas(), {Middle(), Middle() + by / 2, Middle() + by}, button, modifiers);
  }

  // 0: it did not come to be, or does not show.
  RegionId AddTintedRegion() {
    QSignalSpy added(&controller(), &SceneController::regionAdded);
    AddRegionFromMasks(controller(), "jug", scene_->Masks(scene_->scene().still_life.front()),
                       ColorEdit::Tint({0.2F, 0.9F, 0.3F}));
    if (added.count() == 0 && !added.wait(kWaitMs)) return 0;
    const RegionId id = added.at(0).at(0).value<RegionId>();
    const bool shown = QTest::qWaitFor(
        [&] { return !controller().colors().ShowsOriginal() && canvas().IsSharp(); }, kWaitMs);
    return shown ? id : 0;
  }

  std::unique_ptr<ViewerScene> scene_;
  std::unique_ptr<Theme> theme_;
  std::unique_ptr<MainWindow> window_;
};

// Drags the brush along every other row of a mask.
inline void PaintRows(SelectionCanvas& paper, const Mask& mask,
                      Qt::KeyboardModifiers modifiers = Qt::NoModifier) {
  const auto at = [&](int x, int y) {
    const Eigen::Vector2d point = paper.transform().ToWidget({x + 0.5, y + 0.5});
    return QPoint(int(point.x()), int(point.y()));
  };
  for (int y = 0; y < mask.height; y += 2) {
    for (int x = 0; x < mask.width; ++x) {
      if (mask(x, y) == 0) continue;
      int last = x;
      while (last + 1 < mask.width && mask(last + 1, y) != 0) ++last;
      DragAlong(&paper, {at(x, y), at(last, y)}, Qt::LeftButton, modifiers);
      x = last;
    }
  }
}

// The same with a brush of two pixels.
inline void PaintFinely(SelectionCanvas& paper, const Mask& mask,
                        Qt::KeyboardModifiers modifiers = Qt::NoModifier) {
  for (int i = 0; i < 60; ++i) QTest::keyClick(&paper, Qt::Key_BracketLeft);
  for (int i = 0; i < 2; ++i) QTest::keyClick(&paper, Qt::Key_BracketRight);
  PaintRows(paper, mask, modifiers);
}

// Until the selection mode has its view.
inline bool WaitPainting(MainWindow& window) {
  return QTest::qWaitFor(
      [&] { return window.selection().state() == SelectionMode::State::kPainting; }, kWaitMs);
}

// Types a path into the next file dialog and confirms it. The dialog has an event loop of its own,
// so call this before opening it.
inline void AnswerFileDialog(const std::filesystem::path& path) {
  static QPointer<QTimer> before;
  delete before;  // whose dialog never came
  auto* timer = new QTimer(qApp);
  before = timer;
  QObject::connect(timer, &QTimer::timeout, timer, [timer, path] {
    auto* dialog = qobject_cast<QFileDialog*>(QApplication::activeModalWidget());
    if (!dialog) return;
    timer->deleteLater();
    timer->stop();
    auto* name = dialog->findChild<QLineEdit*>("fileNameEdit");
    name->setText(QString::fromStdString(path.string()));
    QTest::keyClick(name, Qt::Key_Return);
    if (dialog->isVisible()) static_cast<QDialog*>(dialog)->reject();  // it did not like that
  });
  timer->start(20);
}

// Cancels the next file dialog; call it before the dialog opens. Counts the dialogs.
inline void CancelFileDialog(int* came) {
  auto* timer = new QTimer(qApp);
  QObject::connect(timer, &QTimer::timeout, timer, [timer, came] {
    auto* dialog = qobject_cast<QFileDialog*>(QApplication::activeModalWidget());
    if (!dialog) return;
    timer->deleteLater();
    timer->stop();
    ++*came;
    static_cast<QDialog*>(dialog)->reject();
  });
  timer->start(20);
}

// A key on the canvas as shortcuts want it: in an active window.
inline void PressKey(MainWindow& window, Qt::Key key,
                     Qt::KeyboardModifiers modifiers = Qt::NoModifier) {
  if (!Activate(window)) qWarning("the window does not become active");
  window.canvas().setFocus();
  QTest::keyClick(&window.canvas(), key, modifiers);
}

// The window's question or complaint, once it is there; null when none comes.
inline QMessageBox* WaitDialog(MainWindow& window) {
  const bool came = QTest::qWaitFor(
      [&] { return window.dialogs().box() && window.dialogs().box()->isVisible(); }, kWaitMs);
  return came ? window.dialogs().box() : nullptr;
}

// Presses the dialog's button of a role; false when there is no such dialog or button.
inline bool ClickRole(MainWindow& window, QMessageBox::ButtonRole role) {
  QMessageBox* dialog = WaitDialog(window);
  if (!dialog) return false;
  for (QAbstractButton* button : dialog->buttons()) {
    if (dialog->buttonRole(button) != role) continue;
    QTest::mouseClick(button, Qt::LeftButton);
    return true;
  }
  return false;
}

// The text of an error message, which is then closed.
inline QString ReadError(MainWindow& window) {
  QMessageBox* dialog = WaitDialog(window);
  if (!dialog) return "no dialog came";
  const QString text = dialog->informativeText();
  dialog->button(QMessageBox::Ok)->click();  // a mouse may come before the dialog is laid out
  (void)QTest::qWaitFor(
      [&] { return !window.dialogs().box() || !window.dialogs().box()->isVisible(); }, kWaitMs);
  return text;
}

// Until the worker has done all that was asked for so far.
inline bool Settle(SceneController& controller) {
  bool done = false;
  if (!controller.Run(
          {}, [](EditSession&, Monitor&) {}, [&] { done = true; }))
    return false;
  return QTest::qWaitFor([&] { return done; }, kWaitMs);
}

// How far a mask reaches from one of its pixels to all four sides; -1 outside.
inline int ReachWithin(const Mask& mask, int x, int y) {
  const auto inside = [&](int i, int j) { return mask.Contains(i, j) && mask(i, j) > 0; };
  int reach = -1;
  for (int r = 0; inside(x - r, y) && inside(x + r, y) && inside(x, y - r) && inside(x, y + r);
       ++r) {
    reach = r;
  }
  return reach;
}

// Mean absolute difference of two pictures in steps of 1 / 255; 255 for other sizes.
inline double Difference(const QImage& a, const QImage& b) {
  if (a.size() != b.size() || a.isNull()) return 255;
  double sum = 0;
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) {
      const QRgb p = a.pixel(x, y), q = b.pixel(x, y);
      sum += std::abs(qRed(p) - qRed(q)) + std::abs(qGreen(p) - qGreen(q)) +
             std::abs(qBlue(p) - qBlue(q));
    }
  }
  return sum / (3.0 * a.width() * a.height());
}

// Largest difference of a channel.
inline int Apart(QRgb a, QRgb b) {
  return std::max({std::abs(qRed(a) - qRed(b)), std::abs(qGreen(a) - qGreen(b)),
                   std::abs(qBlue(a) - qBlue(b))});
}

// Pixels that differ visibly; all of them for pictures of other sizes.
inline int64_t ChangedPixels(const QImage& a, const QImage& b) {
  if (a.size() != b.size() || a.isNull()) return std::max<int64_t>(1, a.width() * a.height());
  constexpr int kVisible = 12;
  int64_t changed = 0;
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) changed += Apart(a.pixel(x, y), b.pixel(x, y)) > kVisible;
  }
  return changed;
}

}  // namespace retint
