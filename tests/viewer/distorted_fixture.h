// SPDX-License-Identifier: BSD-3-Clause
// A scene of a distorted camera in the real window, and a hand that paints on its photos.
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <string>

#include <QToolButton>

#include "colmap_io/image_io.h"
#include "opening/photo_paint.h"
#include "tests/viewer/viewer_scene.h"

namespace retint {

class DistortedFixture : public ViewerTest {
 protected:
  ViewerScene::Subject subject_;

  SelectionMode& selection() { return window_->selection(); }
  SelectionCanvas& paper() { return selection().canvas(); }
  const SyntheticView& Photo(const std::string& name) const {
    return *std::ranges::find(scene_->scene().views, name, &SyntheticView::name);
  }
  Mask Truth(const std::string& view) { return scene_->Masks(subject_.object).at(view); }
  std::shared_ptr<const RegionSelection> Selection() {
    const Region* region = controller().regions().Find(window_->current_region());
    return region ? region->selection : nullptr;
  }

  // A scene through a lens, in a window that stands at the subject's first view.
  bool Open(const std::string& lens) {
    MakeScene(200, 150, 6, lens);
    subject_ = scene_->MostVisible();
    if (subject_.object == 0 || !ShowScene()) return false;
    const UserPicture* home = canvas().picture();
    if (!home) return false;
    const auto shown = controller().facts()->Shown(*home).camera;
    if (canvas().navigation().Exact().camera != shown) return false;
    SelectOptions select;
    select.depth_method = "gaussian";  // quick; stereo has tests of its own
    selection().SetSelectOptions(select);
    return canvas().GoTo(subject_.first) && WaitSharp(*window_);
  }
  bool EnterPainting() {
    PressKey(*window_, Qt::Key_Return);
    return WaitPainting(*window_);
  }
  bool EnterExtending() {
    QTest::mouseClick(window_->findChild<QToolButton*>("region_extend"), Qt::LeftButton);
    return WaitPainting(*window_);
  }
  bool Accept() {
    QTest::keyClick(&paper(), Qt::Key_Return);
    return QTest::qWaitFor([&] { return !window_->IsSelecting(); }, kWaitMs) &&
           window_->current_region() != 0 && WaitSharp(*window_);
  }
  QPoint OnPaper(double x, double y) {
    const Eigen::Vector2d at = paper().transform().ToWidget({x, y});
    return {int(std::lround(at.x())), int(std::lround(at.y()))};
  }
  // Of the pixels inside a mask.
  static Eigen::Vector2d Middle(const Mask& mask) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double count = 0;
    for (int y = 0; y < mask.height; ++y) {
      for (int x = 0; x < mask.width; ++x) {
        if (mask(x, y) >= 128) sum += Eigen::Vector2d(x + 0.5, y + 0.5), ++count;
      }
    }
    return sum / std::max(1.0, count);
  }

  // Runs on the worker until it is done.
  bool Do(SceneController::Work work) {
    bool done = false;
    if (!controller().Run({}, std::move(work), [&] { done = true; })) return false;
    return QTest::qWaitFor([&] { return done; }, kWaitMs);
  }

  void WhatTheCommandLineFinds(const Mask& painted) {
    const std::filesystem::path brush = scene_->folder() / "brush.png";
    WritePng(brush, painted);
    std::map<std::string, Mask> masks;
    QVERIFY(Do([&](EditSession& session, Monitor& monitor) {
      const auto on_views = session.scene().pictures().ReadBrush(subject_.first, brush);
      const SelectionResult selected =
          session.selection().Select(on_views, selection().select_options(), monitor);
      masks = session.selection()
                  .Project(selected.cloud, on_views, selection().projector_options(), monitor)
                  .masks;
    }));
    QCOMPARE(Selection()->masks.size(), masks.size());
    for (const auto& [name, mask] : masks) QVERIFY(Selection()->masks.at(name).data == mask.data);
  }

  void Close() {
    window_.reset();
    scene_.reset();
  }
};

}  // namespace retint
