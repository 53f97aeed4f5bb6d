// SPDX-License-Identifier: BSD-3-Clause
// The pictures of docs/viewer.md: the window on a synthetic workspace, driven as a user would, at
// 1600 x 1000, dark and light.   screenshots WORKSPACE FOLDER
// Run by apps/screenshots.sh.
#include <cstdio>
#include <functional>

#include <QAction>
#include <QApplication>
#include <QBuffer>
#include <QDir>
#include <QDockWidget>
#include <QFile>
#include <QSignalSpy>
#include <QTemporaryDir>
#include <QTest>

#include "colmap_io/image_io.h"
#include "viewer/main_window.h"
#include "viewer/selection/selection_mode.h"

namespace retint {
namespace {

constexpr int kWaitMs = 600000;
constexpr qint64 kMostBytes = 195000;  // of a picture: the repository keeps every one of them

class Photographer {
 public:
  Photographer(const QString& workspace, const QString& folder)
      : workspace_(workspace), folder_(folder) {}

  bool Run() {
    window_.resize(1600, 1000);
    window_.show();
    OpenRequest request;
    request.workspace = workspace_.toStdString();
    request.splat = request.workspace / "splat.ply";
    SceneController& controller = window_.controller();
    window_.OpenScene(request);
    if (!Wait([&] { return window_.canvas().IsSharp(); })) return false;
    window_.canvas().setFocus();
    // The view and mask that `retint synth` recommends to begin with.
    const QStringList masks = QDir(workspace_ + "/masks").entryList({"*.png"});
    if (masks.isEmpty()) return Fail("the workspace has no mask");
    const std::string view = masks.front().chopped(4).toStdString();
    const Mask mask = ReadMask((workspace_ + "/masks/" + masks.front()).toStdString());
    if (!window_.canvas().GoTo(view)) return Fail("no such view");
    if (!Wait([&] { return window_.canvas().IsSharp(); })) return false;

    // Selection mode, painted.
    window_.EnterSelection();
    SelectionMode& selection = window_.selection();
    if (!Wait([&] { return selection.state() == SelectionMode::State::kPainting; })) return false;
    selection.canvas().Edited(selection.canvas().editor().SetMask(mask));
    if (!Shoot("selection")) return false;
    selection.Accept();
    if (!Wait([&] { return window_.current_region() != 0 && !controller.IsBusy(); })) return false;
    const RegionId id = window_.current_region();
    controller.SetEdit(id, ColorEdit::Tint({0.35F, 0.55F, 1.0F}));
    controller.Rename(id, "Region 1");
    if (!Wait([&] {
          return controller.optimizer().state == BackgroundOptimizer::State::kFinished;
        })) {
      return false;
    }
    if (!Wait([&] { return window_.canvas().IsSharp(); })) return false;
    // With the selected points, the optimizer's curve beside.
    Raise("optimizer");
    QSignalSpy ready(&controller, &SceneController::qualityReady);
    controller.Evaluate(id);
    if (!Wait([&] { return ready.count() > 0 && !controller.IsBusy(); })) return false;
    if (!Shoot("regions")) return false;
    // From farther off, with the other cameras.
    window_.action("show.cloud")->trigger();
    window_.action("show.frusta")->trigger();
    window_.canvas().navigation().Orbit(90, 60);
    window_.canvas().navigation().Zoom(-5);
    window_.canvas().CameraMoved();
    if (!Wait([&] { return window_.canvas().IsSharp(); })) return false;
    QTest::qWait(1500);  // thumbnails
    if (!Shoot("main")) return false;
    // Before and after, measured.
    window_.action("show.frusta")->trigger();
    window_.canvas().GoTo(view);
    window_.action("show.split")->trigger();
    Raise("quality");
    if (!Wait([&] { return window_.canvas().IsSharp(); })) return false;
    if (!Shoot("quality")) return false;
    controller.CancelRefit();
    return true;
  }

 private:
  static bool Fail(const char* why) {
    std::fprintf(stderr, "screenshots: %s\n", why);
    return false;
  }

  bool Wait(const std::function<bool()>& done) {
    if (QTest::qWaitFor(done, kWaitMs)) return true;
    return Fail("waited too long");
  }

  void Raise(const char* dock) {
    auto* found = window_.findChild<QDockWidget*>(dock);
    if (found) found->raise();
    QTest::qWait(200);
  }

  bool Shoot(const QString& name) {
    for (const auto& [choice, suffix] :
         {std::pair{ThemeChoice::kDark, "dark"}, std::pair{ThemeChoice::kLight, "light"}}) {
      theme_.Choose(choice);
      QTest::qWait(300);
      const QString path = folder_ + "/viewer-" + name + "-" + suffix + ".jpg";
      const QImage picture = window_.grab().toImage();
      QByteArray bytes;
      for (int quality = 92; bytes.isEmpty() || bytes.size() > kMostBytes; quality -= 2) {
        bytes.clear();
        QBuffer buffer(&bytes);
        buffer.open(QIODevice::WriteOnly);
        if (quality < 10 || !picture.save(&buffer, "JPG", quality)) return Fail("no JPEG");
      }
      QFile file(path);
      if (!file.open(QIODevice::WriteOnly) || file.write(bytes) != bytes.size()) {
        return Fail("a picture cannot be written");
      }
    }
    theme_.Choose(ThemeChoice::kDark);
    return true;
  }

  QString workspace_, folder_;
  Theme theme_;
  MainWindow window_{&theme_};
};

int Main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: screenshots WORKSPACE FOLDER\n");
    return 2;
  }
  const QTemporaryDir home;
  qputenv("XDG_CONFIG_HOME", (home.path() + "/config").toLocal8Bit());
  qputenv("XDG_DATA_HOME", (home.path() + "/data").toLocal8Bit());
  QCoreApplication::setOrganizationName("retint-screenshots");
  QApplication app(argc, argv);
  QDir().mkpath(argv[2]);
  return Photographer(argv[1], argv[2]).Run() ? 0 : 1;
}

}  // namespace
}  // namespace retint

int main(int argc, char** argv) { return retint::Main(argc, argv); }
