// SPDX-License-Identifier: BSD-3-Clause
// retint_bench_viewer: how quickly the window answers on a real capture. One JSON line a case.
//   QT_QPA_PLATFORM=offscreen retint_bench_viewer [--data DIR] [--scene fox] [--backend cpu]
//   QT_QPA_PLATFORM=offscreen retint_bench_viewer --memory      what a whole edit holds instead
// Under Xvfb leave the platform out. Limits: visible 3 s, 10 frames a second while moving, sharp
// 300 ms after the last movement, 30 ms a brush move, 100 ms a change of the colour.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <QApplication>
#include <QMouseEvent>
#include <QSignalSpy>
#include <QTemporaryDir>
#include <QTest>
#include <QTimer>

#include <CLI/CLI.hpp>

#include "base/stopwatch.h"
#include "colmap_io/image_io.h"
#include "viewer/selection/selection_mode.h"
#include "viewer/selection/stroke_preview.h"
#include "viewer/window/keep_memory.h"
#include "viewer/window/main_window.h"

namespace retint {
namespace {

constexpr int kWaitMs = 600000;

struct Flags {
  std::string data, scene = "fox", view = "0025.jpg", backend = "auto";
  int width = 1600, height = 1000;
  double seconds = 5;
  int cache_mb = 0;
  bool memory = false;
};

// A value of /proc/self/status, MiB; 0 without such a file.
double StatusMb(const std::string& name) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(name + ":")) return std::atof(line.c_str() + name.size() + 1) / 1024;
  }
  return 0;
}

// Sleeps until events come, without the 10 ms naps of QTest::qWaitFor(), and without keeping a core
// from those who work.
bool WaitFor(const std::function<bool()>& done) {
  const Stopwatch clock;
  QTimer wake;  // whatever comes, or does not
  wake.start(100);
  while (!done()) {
    if (clock.Milliseconds() > kWaitMs) return false;
    QCoreApplication::processEvents(QEventLoop::WaitForMoreEvents);
  }
  return true;
}

struct Series {
  std::vector<double> values;
  double At(double share) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[std::min(values.size() - 1, size_t(share * double(values.size())))];
  }
};

class Bench {
 public:
  explicit Bench(const Flags& flags) : flags_(flags) {}

  int Run() {
    const std::filesystem::path root = std::filesystem::path(flags_.data) / flags_.scene;
    const Stopwatch clock;
    window_ = std::make_unique<MainWindow>(&theme_);
    window_->resize(flags_.width, flags_.height);
    window_->show();
    if (!QTest::qWaitForWindowExposed(window_.get())) return Fail("no window");
    const double empty = clock.Milliseconds();
    window_->controller().colors().SetAutomaticRefit(false);
    OpenRequest request;
    request.workspace = root;
    request.splat = root / "splat.ply";
    request.options.backend = flags_.backend;
    if (flags_.cache_mb > 0) request.options.cache_bytes = size_t(flags_.cache_mb) << 20;
    const Stopwatch open;
    window_->files().OpenScene(request);
    if (!WaitFor([&] { return canvas().frame() != nullptr || window_->dialogs().box(); }) ||
        window_->dialogs().box()) {
      return Fail("the scene does not open");
    }
    const double first = open.Milliseconds();
    if (!WaitFor([&] { return canvas().IsSharp(); })) return Fail("nothing shows");
    std::printf(
        "{\"scene\":\"%s\",\"case\":\"open\",\"backend\":\"%s\",\"canvas\":[%d,%d],"
        "\"empty_window_ms\":%.0f,\"first_frame_ms\":%.0f,\"sharp_ms\":%.0f}\n",
        flags_.scene.c_str(), std::string(window_->controller().facts()->backend->Name()).c_str(),
        canvas().width(), canvas().height(), empty, first, open.Milliseconds());
    std::fflush(stdout);
    if (!canvas().GoTo(flags_.view)) return Fail("no such view");
    if (!WaitFor([&] { return canvas().IsSharp(); })) return Fail("nothing shows");
    QTest::qWait(1500);  // thumbnails
    if (flags_.memory) return WholeEdit(root) ? 0 : 1;
    return Move() && Brush(root) && Preview() ? 0 : 1;
  }

 private:
  Canvas& canvas() { return window_->canvas(); }
  static int Fail(const char* why) {
    std::fprintf(stderr, "retint_bench_viewer: %s\n", why);
    return 1;
  }

  static void SendMove(QWidget& widget, const QPoint& at) {
    QMouseEvent move(QEvent::MouseMove, at, widget.mapToGlobal(at), Qt::NoButton, Qt::LeftButton,
                     Qt::NoModifier);
    QCoreApplication::sendEvent(&widget, &move);
  }

  // Orbits with the mouse as fast as events come, then lets go and waits.
  bool Move() {
    Series rest;
    int frames = 0;
    double milliseconds = 0, scale = 0;
    const auto counted = QObject::connect(&canvas(), &Canvas::frameShown, [&] {
      if (!canvas().frame()->moving) return;
      ++frames;
      scale += canvas().frame()->scale;
    });
    for (int round = 0; round < 5; ++round) {
      const QPoint middle = canvas().rect().center();
      QTest::mousePress(&canvas(), Qt::LeftButton, {}, middle);
      const Stopwatch clock;
      for (int step = 0; clock.Milliseconds() < 200 * flags_.seconds; ++step) {
        const double angle = 0.05 * step;
        SendMove(canvas(), middle + QPoint(int(120 * std::sin(angle)), int(40 * std::sin(angle))));
        QTest::qWait(8);
      }
      milliseconds += clock.Milliseconds();
      const Stopwatch resting;
      QTest::mouseRelease(&canvas(), Qt::LeftButton, {}, middle);
      if (!WaitFor([&] { return canvas().IsSharp(); })) return Fail("no sharp frame") == 0;
      rest.values.push_back(resting.Milliseconds());
    }
    QObject::disconnect(counted);
    std::printf(
        "{\"scene\":\"%s\",\"case\":\"move\",\"frames_per_s\":%.1f,\"mean_scale\":%.2f,"
        "\"sharp_after_ms\":{\"median\":%.0f,\"worst\":%.0f}}\n",
        flags_.scene.c_str(), 1000 * frames / milliseconds, scale / std::max(1, frames),
        rest.At(0.5), rest.At(1));
    std::fflush(stdout);
    return true;
  }

  // A move of the mouse to the pixels on the screen, with a small and a large brush.
  bool Brush(const std::filesystem::path& root) {
    if (!canvas().GoTo(flags_.view)) return false;
    window_->EnterSelection();
    SelectionMode& mode = window_->selection();
    if (!WaitFor([&] { return mode.state() == SelectionMode::State::kPainting; })) return false;
    SelectionCanvas& paper = mode.canvas();
    const Mask& mask = paper.editor().mask();
    for (const double diameter : {24.0, 200.0}) {
      paper.SetBrush({diameter / 2, 1});
      Series moves;
      const QPoint middle = paper.rect().center();
      QTest::mousePress(&paper, Qt::LeftButton, {}, middle);
      for (int step = 0; step < 200; ++step) {
        const double angle = 0.15 * step, radius = 20 + step;
        const Stopwatch clock;
        SendMove(paper,
                 middle + QPoint(int(radius * std::cos(angle)), int(radius * std::sin(angle))));
        QCoreApplication::processEvents();
        moves.values.push_back(clock.Milliseconds());
      }
      QTest::mouseRelease(&paper, Qt::LeftButton, {}, middle);
      std::printf(
          "{\"scene\":\"%s\",\"case\":\"brush\",\"image\":[%d,%d],\"diameter_px\":%.0f,"
          "\"move_ms\":{\"median\":%.2f,\"p99\":%.2f,\"worst\":%.2f}}\n",
          flags_.scene.c_str(), mask.width, mask.height, diameter, moves.At(0.5), moves.At(0.99),
          moves.At(1));
      std::fflush(stdout);
    }
    if (!Strokes(paper)) return false;
    SelectOptions select;
    select.depth_method = "gaussian";  // does not measure the selection
    mode.SetSelectOptions(select);
    return Accept(root);
  }

  // From a move of the mouse to its selection, as veil and in the pictures of visible views.
  bool Strokes(SelectionCanvas& paper) {
    StrokePreview& preview = window_->stroke_preview();
    std::set<QString> views;
    const auto counted =
        QObject::connect(&preview, &StrokePreview::shown,
                         [&](const QString& view, const QImage&) { views.insert(view); });
    double veiled_ms = 0;
    const auto timed =
        QObject::connect(&paper.veil(), &SelectionVeil::changed,
                         [&](const GridRect&) { veiled_ms = since_start_.Milliseconds(); });
    Series first, veils, rounds;
    const QPoint middle = paper.rect().center();
    QTest::mousePress(&paper, Qt::LeftButton, {}, middle);
    for (int step = 0; step < 20; ++step) {
      if (!WaitFor([&] { return !preview.IsBusy(); })) return false;
      const int before = preview.rounds();
      const double began_ms = since_start_.Milliseconds();
      const Stopwatch clock;
      SendMove(paper, middle + QPoint(6 * step, 3 * step));
      if (!WaitFor([&] { return preview.rounds() > before && !preview.IsBusy(); })) return false;
      (step == 0 ? first : rounds).values.push_back(clock.Milliseconds());
      if (veiled_ms < began_ms) return Fail("no veil") == 0;
      if (step > 0) veils.values.push_back(veiled_ms - began_ms);
    }
    QTest::mouseRelease(&paper, Qt::LeftButton, {}, middle);
    QObject::disconnect(counted);
    QObject::disconnect(timed);
    std::printf(
        "{\"scene\":\"%s\",\"case\":\"stroke\",\"views\":%zu,\"first_ms\":%.0f,\"veil_ms\":{"
        "\"median\":%.0f,\"worst\":%.0f},\"move_ms\":{\"median\":%.0f,\"worst\":%.0f}}\n",
        flags_.scene.c_str(), views.size(), first.At(0.5), veils.At(0.5), veils.At(1),
        rounds.At(0.5), rounds.At(1));
    std::fflush(stdout);
    return true;
  }

  // Accepts the view's mask instead of the paint.
  bool Accept(const std::filesystem::path& root) {
    SelectionMode& mode = window_->selection();
    SelectionCanvas& paper = mode.canvas();
    const Mask& mask = paper.editor().mask();
    const auto painted = ViewFile(root / "masks", flags_.view);
    paper.SelectNone();
    paper.Edited(
        paper.editor().Fill(ReadMask(painted, mask.width, mask.height), Combine::kReplace));
    mode.Accept();
    return WaitFor([&] { return window_->current_region() != 0 && !window_->IsSelecting(); });
  }

  // Paints, recolors, refits, measures and closes, and says what the process holds after each.
  bool WholeEdit(const std::filesystem::path& root) {
    SceneController& controller = window_->controller();
    Holds("opened");
    window_->EnterSelection();
    if (!WaitFor([&] { return window_->selection().state() == SelectionMode::State::kPainting; }) ||
        !Accept(root)) {
      return false;
    }
    Holds("selected");
    controller.colors().SetAutomaticRefit(true);
    for (const float green : {0.3F, 0.5F, 0.9F}) {
      const RegionId id = window_->current_region();
      controller.Do(SetEdit{id, ColorEdit::Tint({0.3F, green, 1}), 1}, "");
      const auto fitted = [&] {
        const Region* region = controller.regions().Find(id);
        return controller.colors().optimizer().state == BackgroundOptimizer::State::kFinished &&
               region->fit && region->edit == ColorEdit::Tint({0.3F, green, 1});
      };
      if (!WaitFor(fitted)) return false;
      Holds("refitted");
    }
    QSignalSpy ready(&controller.results(), &SceneResults::qualityReady);
    controller.results().Evaluate(window_->current_region());
    if (!WaitFor([&] { return ready.count() > 0; })) return false;
    QTest::qWait(5000);  // thumbnails of the edit
    Holds("measured");
    controller.Close();
    QTest::qWait(4000);
    Holds("closed");
    return !controller.IsOpen();
  }

  void Holds(const char* when) {
    const Region* region = window_->controller().regions().Find(window_->current_region());
    const double fit =
        region && region->fit ? double(region->fit->summary.region_bytes) / (1 << 20) : 0;
    std::printf(
        "{\"scene\":\"%s\",\"case\":\"memory\",\"when\":\"%s\",\"holds_mib\":%.0f,"
        "\"peak_mib\":%.0f,\"weights_mib\":%.0f,\"seconds\":%.1f}\n",
        flags_.scene.c_str(), when, StatusMb("VmRSS"), StatusMb("VmHWM"), fit,
        since_start_.Milliseconds() / 1000);
    std::fflush(stdout);
  }

  // From a change of the color to the coefficients, and to the picture: one after the other, as in
  // a drag, and each while the optimizer works on the one before.
  bool Preview() {
    canvas().SetCloudShown(false);
    window_->controller().colors().SetAutomaticRefit(true);
    QTest::qWait(500);  // a hand is not sooner at the picker after it has accepted
    return Preview("preview", 30, 0) && Preview("preview_while_refitting", 15, 0.5) &&
           Preview("preview_while_refitting", 15, 2);
  }

  bool Preview(const char* name, int changes, double pause) {
    SceneController& controller = window_->controller();
    const RegionId id = window_->current_region();
    const auto rests = [&] {
      return canvas().IsSharp() && !controller.IsBusy() && !controller.colors().ShowsOriginal();
    };
    if (!WaitFor(rests)) return false;
    Series composed, shown, settled;
    int refitting = 0;
    for (int change = 0; change < changes; ++change) {
      QTest::qWait(int(1000 * pause));
      refitting += controller.colors().optimizer().Active();
      const ShPointer before = controller.colors().sh();
      const Stopwatch clock;
      controller.Do(SetEdit{id, ColorEdit::Tint({0.3F, 0.3F + 0.02F * float(change), 1}), 1},
                    "drag");
      if (!WaitFor([&] { return controller.colors().sh() != before; })) return false;
      composed.values.push_back(clock.Milliseconds());
      const ShPointer now = controller.colors().sh();
      if (!WaitFor([&] { return canvas().frame()->sh == now; })) return false;
      shown.values.push_back(clock.Milliseconds());
      if (!WaitFor([&] { return canvas().IsSharp(); })) return false;
      settled.values.push_back(clock.Milliseconds());
    }
    std::printf(
        "{\"scene\":\"%s\",\"case\":\"%s\",\"pause_s\":%.1f,\"refitting\":%d,"
        "\"composed_ms\":{\"median\":%.1f,\"worst\":%.1f},\"shown_ms\":{\"median\":%.1f,\"worst\":%"
        ".1f},\"sharp_ms\":{\"median\":%.1f,"
        "\"worst\":%.1f}}\n",
        flags_.scene.c_str(), name, pause, refitting, composed.At(0.5), composed.At(1),
        shown.At(0.5), shown.At(1), settled.At(0.5), settled.At(1));
    return true;
  }

  const Flags flags_;
  const Stopwatch since_start_;
  Theme theme_;
  std::unique_ptr<MainWindow> window_;
};

int Main(int argc, char** argv) {
  KeepSmallBlocks();  // as the editor does
  Flags flags;
  const char* data = std::getenv("RETINT_DATA");
  flags.data = data ? data : RETINT_SOURCE_DIR "/../shared/data";
  CLI::App app("How quickly the window answers");
  app.add_option("--data", flags.data, "Folder of the captures");
  app.add_option("--scene", flags.scene);
  app.add_option("--view", flags.view, "View with a mask in <scene>/masks");
  app.add_option("--backend", flags.backend);
  app.add_option("--width", flags.width, "Of the window");
  app.add_option("--height", flags.height);
  app.add_option("--seconds", flags.seconds, "Of moving the camera");
  app.add_flag("--memory", flags.memory, "What a whole edit holds, instead of how quick it is");
  app.add_option("--cache-mb", flags.cache_mb, "Geometry cache; 0: the editor's own");
  CLI11_PARSE(app, argc, argv);
  // Settings of its own: a fresh window every time.
  const QTemporaryDir home;
  qputenv("XDG_CONFIG_HOME", (home.path() + "/config").toLocal8Bit());
  qputenv("XDG_DATA_HOME", (home.path() + "/data").toLocal8Bit());
  QCoreApplication::setOrganizationName("retint-benchmark");
  int no_arguments = 1;
  QApplication qt(no_arguments, argv);
  return Bench(flags).Run();
}

}  // namespace
}  // namespace retint

int main(int argc, char** argv) { return retint::Main(argc, argv); }
