// SPDX-License-Identifier: BSD-3-Clause
// retint_bench_newcomer: plays a newcomer in the real window, from the start page to a recolored
// object, by mouse on visible widgets only, and says how long each step takes. One JSON line a
// step; a picture of the window after it with --shots.
//   xvfb-run -a -s "-screen 0 1920x1200x24" retint_bench_newcomer [--shots DIR]      the sample
//   ... retint_bench_newcomer --scene fox [--object 0.5 0.4 0.2 0.15]
// Then, in the same window: a dragged camera, and the report page.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <QPushButton>
#include <QToolBar>

#include <CLI/CLI.hpp>

#include "base/error.h"
#include "base/stopwatch.h"
#include "tests/benchmarks/main.h"
#include "tests/viewer/viewer_scene.h"
#include "viewer/panels/color_picker.h"
#include "viewer/panels/mask_view.h"
#include "viewer/selection/stroke_preview.h"
#include "viewer/window/keep_memory.h"

namespace retint {
namespace {

constexpr int kLongMs = 600000;
constexpr int kMoveMs = 8;         // between two events of a mouse
constexpr double kMovePixels = 8;  // 1,000 pixels a second
constexpr int kMostInteractions = 5;

// An ellipse about the object in the first view, in shares of the picture: center and radii.
using Ellipse = std::array<double, 4>;
const std::map<std::string, Ellipse> kObjects = {{"sample", {0.632, 0.634, 0.062, 0.083}},
                                                 {"fox", {0.53, 0.41, 0.2, 0.1}}};

struct Flags {
  std::string data, scene = "sample", shots;
  std::vector<double> object;
  double pause = 1.5;
};

class Newcomer {
 public:
  explicit Newcomer(Flags flags) : flags_(std::move(flags)) {}

  int Run() {
    window_ = std::make_unique<MainWindow>(&theme_);
    window_->show();
    if (!QTest::qWaitForWindowExposed(window_.get()) || !Activate(*window_)) {
      return Fail("no window");
    }
    window_->files().Start({});
    window_->Welcome();
    Shoot("start");
    since_start_ = Stopwatch();
    const bool done = Open() && Paint() && Stroke() && Accept() && Color();
    if (!done) return 1;
    std::printf(
        "{\"scene\":\"%s\",\"step\":\"all\",\"interactions\":%d,\"most\":%d,\"pause_s\":%.1f,"
        "\"preview_s\":%.1f,\"fit_s\":%.1f}\n",
        flags_.scene.c_str(), interactions_, kMostInteractions, flags_.pause, preview_s_, fit_s_);
    return DragCamera() && Report() ? 0 : 1;
  }

 private:
  Canvas& canvas() { return window_->canvas(); }
  SceneController& controller() { return window_->controller(); }
  SelectionMode& selection() { return window_->selection(); }

  static int Fail(const std::string& why) {
    std::fprintf(stderr, "retint_bench_newcomer: %s\n", why.c_str());
    return 1;
  }

  // A question that a newcomer would have to answer is one that this script cannot.
  bool Wait(const char* what, const std::function<bool()>& done) {
    const bool came =
        QTest::qWaitFor([&] { return done() || window_->dialogs().box(); }, kLongMs) && done();
    if (came) return true;
    const QMessageBox* box = window_->dialogs().box();
    Fail(std::string("no ") + what + (box ? ": " + box->text().toStdString() : ""));
    Shoot("failed");
    return false;
  }

  // Time stands still meanwhile.
  void Shoot(const std::string& name) {
    if (flags_.shots.empty()) return;
    const Stopwatch clock;
    const std::string path =
        flags_.shots + "/" + flags_.scene + "-" + std::to_string(interactions_) + "-" + name;
    window_->grab().save(QString::fromStdString(path + ".png"));
    hidden_ms_ += clock.Milliseconds();
  }
  double Seconds() { return (since_start_.Milliseconds() - hidden_ms_) / 1000; }

  // What a hand and an eye need between two interactions.
  void Pause() { QTest::qWait(int(1000 * flags_.pause)); }

  // Only what a mouse can reach.
  bool Reaches(QWidget* widget, const QPoint& at) {
    if (!widget || !widget->isVisible() || !widget->isEnabled()) return false;
    QWidget* top = window_->childAt(widget->mapTo(window_.get(), at));
    return top && (top == widget || widget->isAncestorOf(top));
  }
  bool Click(const char* what, QWidget* widget) {
    if (!Reaches(widget, widget ? widget->rect().center() : QPoint())) {
      Shoot("failed");
      return Fail(std::string(what) + " cannot be clicked") == 0;
    }
    ++interactions_;
    QTest::mouseClick(widget, Qt::LeftButton);
    return true;
  }
  // As fast as a hand, and without the release.
  static void DragSlowly(QWidget* widget, const std::vector<QPointF>& corners) {
    QTest::mousePress(widget, Qt::LeftButton, {}, corners.front().toPoint());
    for (size_t i = 1; i < corners.size(); ++i) {
      const QPointF from = corners[i - 1], by = corners[i] - from;
      const int moves = std::max(1, int(std::hypot(by.x(), by.y()) / kMovePixels));
      for (int move = 1; move <= moves; ++move) {
        const QPoint at = (from + by * move / moves).toPoint();
        QMouseEvent event(QEvent::MouseMove, at, widget->mapToGlobal(at), Qt::NoButton,
                          Qt::LeftButton, {});
        QCoreApplication::sendEvent(widget, &event);
        QTest::qWait(kMoveMs);
      }
    }
  }

  void Print(const char* step, const std::string& times) {
    std::printf("{\"scene\":\"%s\",\"step\":\"%s\",\"interactions\":%d,%s,\"at_s\":%.1f}\n",
                flags_.scene.c_str(), step, interactions_, times.c_str(), Seconds());
    std::fflush(stdout);
  }
  static std::string Time(const char* name, double milliseconds) {
    char text[80];
    std::snprintf(text, sizeof text, "\"%s_ms\":%.0f", name, milliseconds);
    return text;
  }

  bool Open() {
    Pause();
    const Stopwatch clock;
    if (flags_.scene == "sample") {
      if (!Click("the sample", window_->findChild<QWidget*>("welcome_sample"))) return false;
    } else {
      ++interactions_;
      if (!Drop(*window_, std::filesystem::path(flags_.data) / flags_.scene)) {
        return Fail("the folder cannot be dropped") == 0;
      }
    }
    if (!Wait("picture", [&] { return canvas().frame() != nullptr; })) return false;
    const double first = clock.Milliseconds();
    if (!Wait("sharp picture", [&] { return canvas().IsSharp(); })) return false;
    Print("open", Time("picture", first) + "," + Time("sharp", clock.Milliseconds()));
    Shoot("opened");
    return true;
  }

  bool Paint() {
    Pause();
    const Stopwatch clock;
    const auto* bar = window_->findChild<QToolBar*>("tools");
    if (!Click("Paint", bar->widgetForAction(window_->action("selection.enter")))) return false;
    if (!Wait("paper", [&] { return selection().state() == SelectionMode::State::kPainting; })) {
      return false;
    }
    Print("paint", Time("ready", clock.Milliseconds()));
    Shoot("paper");
    return true;
  }

  // One stroke to and fro over the object, without lifting the mouse.
  bool Stroke() {
    Pause();
    SelectionCanvas& paper = selection().canvas();
    const Mask& mask = paper.editor().mask();
    const auto& [x, y, rx, ry] = object();
    const double radius = paper.brush().radius;
    const double a = std::max(1.0, rx * mask.width - radius);
    const double b = std::max(1.0, ry * mask.height - radius);
    std::vector<QPointF> corners;
    const int rows = std::max(2, int(std::ceil(2 * b / (1.6 * radius))) + 1);
    for (int row = 0; row < rows; ++row) {
      const double up = -1 + 2.0 * row / (rows - 1);
      const double side = a * std::sqrt(1 - 0.7 * up * up);
      for (const double sign : {row % 2 ? 1.0 : -1.0, row % 2 ? -1.0 : 1.0}) {
        const Eigen::Vector2d at =
            paper.transform().ToWidget({x * mask.width + sign * side, y * mask.height + b * up});
        corners.emplace_back(at.x(), at.y());
      }
    }
    for (const QPointF& corner : corners) {
      if (Reaches(&paper, corner.toPoint())) continue;
      Shoot("failed");
      return Fail("something covers the object") == 0;
    }
    double veil_ms = 0;
    const Stopwatch clock;
    const auto timed = QObject::connect(&paper.veil(), &SelectionVeil::changed, [&] {
      if (veil_ms == 0) veil_ms = clock.Milliseconds();
    });
    ++interactions_;
    DragSlowly(&paper, corners);
    QTest::mouseRelease(&paper, Qt::LeftButton, {}, corners.back().toPoint());
    QObject::disconnect(timed);
    Print("stroke", Time("selection_shows_after_first_press", veil_ms) + "," +
                        Time("hand", clock.Milliseconds()));
    return true;
  }

  bool Accept() {
    Pause();
    Shoot("painted");
    auto* button = selection().canvas().findChild<QPushButton*>("acceptHere");
    std::string stages;
    std::string last;
    const Stopwatch clock;
    const auto told =
        QObject::connect(&controller(), &SceneController::progress, [&](const QString& stage) {
          if (stage.toStdString() == last) return;
          last = stage.toStdString();
          char text[120];
          std::snprintf(text, sizeof text, "%s\"%s\":%.0f", stages.empty() ? "" : ",", last.c_str(),
                        clock.Milliseconds());
          stages += text;
        });
    if (!Click("Accept", button)) return false;
    if (!Wait("region", [&] { return window_->current_region() != 0; })) return false;
    const double accepted = clock.Milliseconds();
    QObject::disconnect(told);
    const auto* mask = window_->findChild<MaskView*>("mask_view");
    if (!Wait("mask", [&] { return mask->IsReady(); })) return false;
    Print("accept", Time("accepted", accepted) + "," + Time("mask", clock.Milliseconds()) +
                        ",\"stages_begin_ms\":{" + stages + "}");
    Shoot("accepted");
    return true;
  }

  // The object changes while the mouse is down. To a blue of the same lightness and chroma.
  bool Color() {
    Pause();
    auto* hues = window_->findChild<HueStrip*>("hue_strip");
    const QImage original = canvas().frame()->image;
    const QPointF from(0.2 * hues->width(), hues->height() / 2.0);
    const QPointF to(0.62 * hues->width(), hues->height() / 2.0);
    if (!Reaches(hues, from.toPoint()) || !Reaches(hues, to.toPoint())) {
      Shoot("failed");
      return Fail("the colors are not in sight") == 0;
    }
    double first = 0;
    const Stopwatch clock;
    const auto timed = QObject::connect(&canvas(), &Canvas::frameShown, [&] {
      if (first == 0 && !controller().colors().ShowsOriginal() &&
          canvas().frame()->sh == controller().colors().sh()) {
        first = clock.Milliseconds();
      }
    });
    ++interactions_;
    DragSlowly(hues, {from, to});
    const double dragged = clock.Milliseconds();
    if (!Wait("preview", [&] { return first > 0 && canvas().IsSharp(); })) return false;
    const QImage preview = canvas().frame()->image;
    preview_s_ = Seconds();
    QObject::disconnect(timed);
    QTest::mouseRelease(hues, Qt::LeftButton, {}, to.toPoint());
    const Stopwatch released;
    Shoot("preview");
    const auto& colors = controller().colors();
    if (!Wait("fit", [&] {
          const Region* region = controller().regions().Find(window_->current_region());
          return region && region->fit && !colors.optimizer().Active() && canvas().IsSharp() &&
                 canvas().frame()->sh == colors.sh();
        })) {
      return false;
    }
    fit_s_ = Seconds();
    const QImage fitted = canvas().frame()->image;
    char more[160];
    std::snprintf(
        more, sizeof more,
        ",\"steps\":%d,\"preview_from_fit_levels\":%.1f,\"original_from_fit_levels\":%.1f",
        colors.optimizer().steps, Apart(preview, fitted, original),
        Apart(original, fitted, original));
    Print("color", Time("shows_after_first_press", first) + "," + Time("hand", dragged) + "," +
                       Time("fit_after_release", released.Milliseconds()) + more);
    Shoot("fitted");
    return true;
  }

  // Mean difference of two pictures where the edit changes a channel by more than 16 levels.
  static double Apart(const QImage& a, const QImage& b, const QImage& original) {
    if (a.size() != b.size() || a.size() != original.size()) return -1;
    const auto levels = [](QRgb p, QRgb q) {
      return std::abs(qRed(p) - qRed(q)) + std::abs(qGreen(p) - qGreen(q)) +
             std::abs(qBlue(p) - qBlue(q));
    };
    double sum = 0;
    int64_t pixels = 0;
    for (int y = 0; y < a.height(); ++y) {
      for (int x = 0; x < a.width(); ++x) {
        if (levels(b.pixel(x, y), original.pixel(x, y)) <= 3 * 16) continue;
        sum += levels(a.pixel(x, y), b.pixel(x, y)) / 3.0;
        ++pixels;
      }
    }
    return pixels > 0 ? sum / double(pixels) : 0;
  }

  bool DragCamera() {
    int frames = 0;
    double scale = 0;
    const auto counted = QObject::connect(&canvas(), &Canvas::frameShown, [&] {
      if (!canvas().frame()->moving) return;
      ++frames;
      scale += canvas().frame()->scale;
    });
    const QPointF middle = canvas().rect().center();
    std::vector<QPointF> path = {middle};
    for (int i = 0; i < 60; ++i) {
      path.push_back(middle + QPointF(200 * std::sin(0.3 * i), 60 * std::sin(0.2 * i)));
    }
    const Stopwatch clock;
    DragSlowly(&canvas(), path);
    const double seconds = clock.Milliseconds() / 1000;
    QTest::mouseRelease(&canvas(), Qt::LeftButton, {}, path.back().toPoint());
    QObject::disconnect(counted);
    const Stopwatch resting;
    if (!Wait("sharp picture", [&] { return canvas().IsSharp(); })) return false;
    std::printf(
        "{\"scene\":\"%s\",\"step\":\"camera\",\"canvas\":[%d,%d],\"frames_per_s\":%.1f,"
        "\"mean_scale\":%.2f,\"sharp_after_ms\":%.0f}\n",
        flags_.scene.c_str(), canvas().width(), canvas().height(), frames / seconds,
        scale / std::max(1, frames), resting.Milliseconds());
    std::fflush(stdout);
    return true;
  }

  bool Report() {
    QSignalSpy written(&controller().results(), &SceneResults::written);
    const QTemporaryDir folder;
    const Stopwatch clock;
    controller().results().WriteReport(folder.filePath("report.html").toStdString());
    if (!Wait("report", [&] { return written.count() > 0; })) return false;
    std::printf("{\"scene\":\"%s\",\"step\":\"report\",\"written_ms\":%.0f,\"views\":%zu}\n",
                flags_.scene.c_str(), clock.Milliseconds(), controller().facts()->views.size());
    return true;
  }

  Ellipse object() const {
    if (flags_.object.size() == 4) {
      return {flags_.object[0], flags_.object[1], flags_.object[2], flags_.object[3]};
    }
    return kObjects.at(flags_.scene);
  }

  const Flags flags_;
  int interactions_ = 0;
  double hidden_ms_ = 0, preview_s_ = 0, fit_s_ = 0;
  Stopwatch since_start_;
  Theme theme_;
  std::unique_ptr<MainWindow> window_;
};

int Main(int argc, char** argv) {
  KeepSmallBlocks();  // as the editor does
  Flags flags;
  const char* data = std::getenv("RETINT_DATA");
  flags.data = data ? data : RETINT_SOURCE_DIR "/../shared/data";
  CLI::App app("How long a newcomer needs to a recolored object");
  app.add_option("--data", flags.data, "Folder of the captures");
  app.add_option("--scene", flags.scene, "sample, or a folder of the captures with a splat.ply");
  app.add_option("--object", flags.object,
                 "Ellipse to paint in the first view: center and radii in shares of the picture")
      ->expected(4);
  app.add_option("--pause", flags.pause, "Seconds before each interaction");
  app.add_option("--shots", flags.shots, "Folder for a picture of the window after each step");
  CLI11_PARSE(app, argc, argv);
  if (flags.object.empty() && !kObjects.contains(flags.scene)) {
    throw OptionError("--scene " + flags.scene + " needs --object");
  }
  const QTemporaryDir home;
  UseOwnFolders(home.path());
  QCoreApplication::setOrganizationName("retint-benchmark");
  int no_arguments = 1;
  QApplication qt(no_arguments, argv);
  return Newcomer(flags).Run();
}

}  // namespace
}  // namespace retint

int main(int argc, char** argv) {
  return retint::RunProgram("retint_bench_newcomer", retint::Main, argc, argv);
}
