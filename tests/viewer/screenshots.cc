// SPDX-License-Identifier: BSD-3-Clause
// The pictures of docs/viewer.md: the window on a synthetic workspace, driven as a user would, dark
// and light.   screenshots WORKSPACE FOLDER [WIDTH HEIGHT]
// Of the window's size, 1600 x 1000 where none is given. With a size, also its start page, menus
// and dialogs, for a look by eye. Run by apps/screenshots.sh.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <string>

#include <QAbstractButton>
#include <QAction>
#include <QApplication>
#include <QBuffer>
#include <QCheckBox>
#include <QDialog>
#include <QDir>
#include <QFile>
#include <QMenu>
#include <QMenuBar>
#include <QPainter>
#include <QSignalSpy>
#include <QTemporaryDir>
#include <QTest>

#include "colmap_io/image_io.h"
#include "viewer/panels/edit_panel.h"
#include "viewer/panels/operation_views.h"
#include "viewer/panels/tone_graph.h"
#include "viewer/selection/selection_mode.h"
#include "viewer/selection/stroke_preview.h"
#include "viewer/window/main_window.h"

namespace retint {
namespace {

constexpr int kWaitMs = 600000;
constexpr int kGap = 8;  // pixels between the shots of modes
// Of a picture: the repository keeps every one of the usual size.
constexpr double kMostBytes = 195000, kMostBytesOfPixel = kMostBytes / (1600 * 1000);

class Photographer {
 public:
  Photographer(const QString& workspace, const QString& folder, const QSize& size, bool all)
      : workspace_(workspace), folder_(folder), size_(size), all_(all) {}

  bool Run() {
    window_.resize(size_);
    window_.show();
    if (all_ && !(QTest::qWaitForWindowExposed(&window_) && Shoot("start"))) return false;
    OpenRequest request;
    request.workspace = workspace_.toStdString();
    request.splat = request.workspace / "splat.ply";
    SceneController& controller = window_.controller();
    window_.files().OpenScene(request);
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
    // With the resulting selection in the other views.
    QSignalSpy looked(&window_.stroke_preview(), &StrokePreview::finished);
    selection.canvas().Edited(selection.canvas().editor().Fill(mask, Combine::kReplace));
    if (!Wait([&] { return looked.count() > 0 && !window_.stroke_preview().IsBusy(); })) {
      return false;
    }
    if (!Shoot("selection")) return false;
    selection.Accept();
    if (!Wait([&] { return window_.current_region() != 0 && !controller.IsBusy(); })) return false;
    const RegionId id = window_.current_region();
    controller.Do(
        SetEdit{id, {{NewOperation(ColorOperationKind::kRecolor, QColor("#3060ff"))}, 1}});
    controller.Do(RenameRegion{id, "Region 1"});
    if (!Wait([&] {
          return controller.colors().optimizer().state == BackgroundOptimizer::State::kFinished;
        })) {
      return false;
    }
    if (!Wait([&] { return window_.canvas().IsSharp(); })) return false;
    // With the selected points, the optimizer's curve beside.
    Raise("optimizer");
    QSignalSpy ready(&controller.results(), &SceneResults::qualityReady);
    controller.results().Evaluate(id);
    if (!Wait([&] { return ready.count() > 0 && !controller.IsBusy(); })) return false;
    QTest::qWait(1500);  // small pictures that show the edit
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
    window_.action("show.split")->trigger();
    if (!ShootModes()) return false;
    if (all_ && !(ShootMenus() && ShootDialogs())) return false;
    controller.colors().CancelRefit();
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
    window_.action(std::string("panel.") + dock)->trigger();  // also if its side is folded
    window_.canvas().setFocus();
    QTest::qWait(200);
  }

  // The modes side by side.
  bool ShootModes() {
    auto* panel = window_.findChild<EditPanel*>("edit_panel");
    const QStringList modes = {"recolor", "adjust", "curves", "levels", "gradient", "palette"};
    for (const QString& mode : modes) {
      window_.findChild<QAction*>("mode_" + mode)->trigger();
      if (mode == "adjust") window_.findChild<QCheckBox*>("adjust_ranged")->setChecked(true);
      if (mode == "palette") {
        QTest::mouseClick(window_.findChild<QAbstractButton*>("palette_measure"), Qt::LeftButton);
        if (!Wait([&] {
              return !window_.controller().IsBusy() && !panel->edit().NeedsMainColor();
            })) {
          return false;
        }
      }
      if (mode == "curves") {
        auto* graph = panel->findChild<ToneGraph*>("curve_graph");
        if (!Wait([&] { return graph->HasHistogram(); })) return false;
      }
      QTest::qWait(300);
      shots_[mode] = panel->grab().toImage();
    }
    std::vector<QImage> shots;
    for (const QString& mode : modes) shots.push_back(shots_[mode]);
    return Keep(SideBySide(shots), "modes-dark");
  }

  QImage SideBySide(std::vector<QImage> shots) {
    int width = 0, height = 0;
    for (QImage& shot : shots) {
      shot.setDevicePixelRatio(1);
      width += shot.width() + kGap, height = std::max(height, shot.height());
    }
    QImage all(width + kGap, height + 2 * kGap, QImage::Format_RGB32);
    all.fill(window_.palette().color(QPalette::Window));
    QPainter painter(&all);
    int x = kGap;
    for (const QImage& shot : shots) {
      painter.drawImage(x, kGap, shot);
      x += shot.width() + kGap;
    }
    return all;
  }

  bool ShootMenus() {
    std::vector<QImage> shots;
    for (const QAction* one : window_.menuBar()->actions()) {
      one->menu()->popup(window_.mapToGlobal(QPoint(40, 40)));
      QTest::qWait(200);
      shots.push_back(one->menu()->grab().toImage());
      one->menu()->close();
    }
    return Keep(SideBySide(shots), "menus-dark");
  }

  bool ShootDialogs() {
    const auto shoot = [this](QAction* opens, const QString& name) {
      opens->trigger();
      QDialog* dialog = nullptr;
      if (!Wait([&] {
            for (QDialog* one : window_.findChildren<QDialog*>()) {
              if (one->isVisible()) dialog = one;
            }
            return dialog != nullptr;
          })) {
        return false;
      }
      QTest::qWait(1000);  // what it measures
      const QImage picture = dialog->grab().toImage();
      dialog->reject();
      QTest::qWait(100);
      return Keep(picture, "dialog-" + name + "-dark");
    };
    const auto named = [this](const QString& text) {
      const auto actions = window_.findChildren<QAction*>();
      return *std::ranges::find_if(
          actions, [&](const QAction* one) { return QString(one->text()).remove('&') == text; });
    };
    return shoot(window_.action("file.open"), "open") &&
           shoot(named("Preferences…"), "preferences") && shoot(named("Turntable…"), "turntable") &&
           shoot(named("Masks of the current region…"), "masks") &&
           shoot(window_.action("help.keys"), "keys");
  }

  bool Shoot(const QString& name) {
    for (const auto& [choice, suffix] :
         {std::pair{ThemeChoice::kDark, "dark"}, std::pair{ThemeChoice::kLight, "light"}}) {
      theme_.Choose(choice);
      QTest::qWait(300);
      if (!Keep(window_.grab().toImage(), name + "-" + suffix)) return false;
    }
    theme_.Choose(ThemeChoice::kDark);
    return true;
  }

  bool Keep(const QImage& picture, const QString& name) {
    QByteArray bytes;
    const double most =
        std::max(kMostBytes, kMostBytesOfPixel * double(picture.width()) * picture.height());
    for (int quality = 92; bytes.isEmpty() || double(bytes.size()) > most; quality -= 2) {
      bytes.clear();
      QBuffer buffer(&bytes);
      buffer.open(QIODevice::WriteOnly);
      if (quality < 10 || !picture.save(&buffer, "JPG", quality)) return Fail("no JPEG");
    }
    QFile file(folder_ + "/viewer-" + name + ".jpg");
    if (!file.open(QIODevice::WriteOnly) || file.write(bytes) != bytes.size()) {
      return Fail("a picture cannot be written");
    }
    return true;
  }

  QString workspace_, folder_;
  QSize size_;
  bool all_;
  std::map<QString, QImage> shots_;  // of the modes
  Theme theme_;
  MainWindow window_{&theme_};
};

int Main(int argc, char** argv) {
  const QSize size = argc == 5 ? QSize(std::atoi(argv[3]), std::atoi(argv[4])) : QSize(1600, 1000);
  if ((argc != 3 && argc != 5) || size.isEmpty()) {
    std::fprintf(stderr, "usage: screenshots WORKSPACE FOLDER [WIDTH HEIGHT]\n");
    return 2;
  }
  const QTemporaryDir home;
  qputenv("XDG_CONFIG_HOME", (home.path() + "/config").toLocal8Bit());
  qputenv("XDG_DATA_HOME", (home.path() + "/data").toLocal8Bit());
  QCoreApplication::setOrganizationName("retint-screenshots");
  QApplication app(argc, argv);
  QDir().mkpath(argv[2]);
  return Photographer(argv[1], argv[2], size, argc == 5).Run() ? 0 : 1;
}

}  // namespace
}  // namespace retint

int main(int argc, char** argv) { return retint::Main(argc, argv); }
