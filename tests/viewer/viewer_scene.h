// SPDX-License-Identifier: BSD-3-Clause
// A small synthetic workspace on disk and a window on it, for tests that act with mouse and keys.
#pragma once

#include <memory>

#include <QCoreApplication>
#include <QSettings>
#include <QSignalSpy>
#include <QTemporaryDir>
#include <QTest>

#include "scene/synthetic.h"
#include "session/synthetic_workspace.h"
#include "viewer/main_window.h"

namespace retint {

inline constexpr int kWaitMs = 60000;

// Settings, data and pictures of the test's own, so that no test sees the user's or another's.
inline void UseOwnFolders(const QString& folder) {
  qputenv("XDG_CONFIG_HOME", (folder + "/config").toLocal8Bit());
  qputenv("XDG_DATA_HOME", (folder + "/data").toLocal8Bit());
  qputenv("XDG_PICTURES_DIR", (folder + "/pictures").toLocal8Bit());
  qputenv("HOME", folder.toLocal8Bit());
  QCoreApplication::setOrganizationName("retint-test");
  QCoreApplication::setApplicationName("retint-viewer-test");
}

class ViewerScene {
 public:
  ViewerScene() {
    UseOwnFolders(folder_.path());
    SyntheticOptions options;
    options.width = 160, options.height = 120, options.views = 6;
    Monitor monitor;
    scene_ = MakeSyntheticScene(options, monitor);
    WriteSyntheticWorkspace(workspace(), scene_, monitor);
  }

  std::filesystem::path folder() const { return folder_.path().toStdString(); }
  std::filesystem::path workspace() const { return folder() / "workspace"; }
  const SyntheticScene& scene() const { return scene_; }

  OpenRequest Request() const {
    OpenRequest request;
    request.workspace = workspace();
    request.splat = workspace() / "splat.ply";
    request.options.backend = "cpu";
    return request;
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

// A shown window with the scene open and its first sharp frame on the screen.
inline std::unique_ptr<MainWindow> OpenWindow(Theme& theme, const ViewerScene& scene) {
  auto window = std::make_unique<MainWindow>(&theme);
  window->resize(900, 640);
  window->show();
  window->controller().SetAutomaticRefit(false);
  window->OpenScene(scene.Request());
  if (!QTest::qWaitFor([&] { return window->canvas().IsSharp(); }, kWaitMs)) return nullptr;
  window->activateWindow();
  window->canvas().setFocus();
  return window;
}

// The canvas at rest again.
inline bool WaitSharp(MainWindow& window) {
  return QTest::qWaitFor([&] { return window.canvas().IsSharp(); }, kWaitMs);
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

}  // namespace retint
