// SPDX-License-Identifier: BSD-3-Clause
// Undecided pixels of the paint, hatched in the picture and as an order of the views. The selection
// of a stroke while the user draws it, beside the paint and in the pictures of other views. With
// mouse and keys.
#include <cmath>

#include <QComboBox>
#include <QLabel>
#include <QListWidget>

#include "selection/mask_projector.h"
#include "selection/paint_shares.h"
#include "tests/viewer/viewer_scene.h"
#include "viewer/canvas/photo_loader.h"
#include "viewer/canvas/uncertainty.h"
#include "viewer/selection/selection_mode.h"
#include "viewer/selection/stroke_preview.h"

namespace retint {

class UncertainTest : public ViewerTest {
  Q_OBJECT

 private:
  ViewerScene::Subject subject_;

  Mask Truth(const std::string& view) { return scene_->Masks(subject_.object).at(view); }

  static int64_t Size(const Mask& mask) {
    return std::count_if(mask.data.begin(), mask.data.end(), [](uint8_t v) { return v != 0; });
  }

  bool Enter() {
    if (!canvas().GoTo(subject_.first) || !WaitSharp(*window_)) return false;
    PressKey(*window_, Qt::Key_B);
    return WaitPainting(*window_);
  }
  bool PaintAndAccept() {
    SelectOptions select;
    select.depth_method = "gaussian";  // quick; stereo has tests of its own
    window_->selection().SetSelectOptions(select);
    if (!Enter()) return false;
    SelectionCanvas& paper = window_->selection().canvas();
    paper.Edited(paper.editor().Fill(Truth(subject_.first), Combine::kReplace));
    QTest::keyClick(&paper, Qt::Key_Return);
    if (!QTest::qWaitFor([&] { return !window_->IsSelecting(); }, kWaitMs)) return false;
    canvas().SetCloudShown(false);
    return window_->current_region() != 0 && WaitSharp(*window_);
  }

  // Draws around the pixel of the object that lies deepest, which stays without paint, and holds.
  Eigen::Vector2i DrawAround() {
    SelectionCanvas& paper = window_->selection().canvas();
    const Mask truth = Truth(subject_.first);
    Eigen::Vector2i deepest(0, 0);
    int most = -1;
    for (int y = 0; y < truth.height; ++y) {
      for (int x = 0; x < truth.width; ++x) {
        const int reach = ReachWithin(truth, x, y);
        if (reach > most) most = reach, deepest = {x, y};
      }
    }
    paper.SetBrush({1.5, 1});
    QList<QPoint> path;
    for (const double radius : {2.0, 4.0, 6.0, 8.0}) {
      constexpr int kSteps = 24;
      for (int step = 0; step <= kSteps; ++step) {
        const double angle = 2 * M_PI * step / kSteps;
        const Eigen::Vector2d at =
            paper.transform().ToWidget({deepest.x() + 0.5 + radius * std::cos(angle),
                                        deepest.y() + 0.5 + radius * std::sin(angle)});
        path << QPoint(int(std::lround(at.x())), int(std::lround(at.y())));
      }
    }
    DragHeld(&paper, path);
    return deepest;
  }

  // Pixels for which the completion is at least 0.2 uncertain, as the worker sees it.
  Mask Undecided() {
    Mask mask;
    const auto shares = window_->uncertainty().found()->undecided;
    const PosedCamera camera = canvas().frame()->camera;
    controller().Run({}, [&, shares, camera](EditSession& session, Monitor&) {
      ProjectorOptions options;
      options.share_threshold = 0.2;
      mask = RenderShares(session.scene().renderer(), camera, *shares, options);
    });
    return Settle(controller()) ? mask : Mask();
  }

 private Q_SLOTS:
  void initTestCase() {
    MakeScene();
    subject_ = scene_->MostVisible();
    QVERIFY(subject_.object != 0);
  }
  void cleanupTestCase() { scene_.reset(); }
  void init() { QVERIFY(ShowScene()); }
  void cleanup() { window_.reset(); }

  void WhatPaintHasNotDecidedIsHatched() {
    QVERIFY(PaintAndAccept());
    QSignalSpy progress(&controller(), &SceneController::progress);
    PressKey(*window_, Qt::Key_U);
    QVERIFY(window_->action("show.uncertain")->isChecked());
    QVERIFY(QTest::qWaitFor([&] { return window_->uncertainty().found() != nullptr; }, kWaitMs));
    // The current stage in plain words.
    QStringList stages;
    for (const auto& step : progress) stages << step.at(0).toString();
    QVERIFY2(stages.contains("deciding what nobody painted"), qPrintable(stages.join(", ")));
    for (const char* internal : {"completion", "projection", "suggestion", "depth"}) {
      QVERIFY2(!stages.contains(internal), internal);
    }
    // Where most of it shows.
    QVERIFY(canvas().GoTo(window_->uncertainty().found()->views.front().view));
    QVERIFY(WaitSharp(*window_));
    const QImage hatched = canvas().frame()->image;
    Keep(*window_, "hatched");
    const Mask mask = Undecided();
    QCOMPARE(QSize(mask.width, mask.height), hatched.size());
    PressKey(*window_, Qt::Key_U);
    QVERIFY(!window_->action("show.uncertain")->isChecked());
    QVERIFY(WaitSharp(*window_));
    const QImage plain = canvas().frame()->image;
    int64_t inside = 0, lines = 0;
    for (int y = 0; y < mask.height; ++y) {
      for (int x = 0; x < mask.width; ++x) {
        inside += mask(x, y) >= 128;
        const QRgb now = hatched.pixel(x, y);
        if (now == plain.pixel(x, y)) continue;
        ++lines;
        QVERIFY2(mask(x, y) >= 128, "a decided surface is hatched");
        QVERIFY(now == qRgb(0, 0, 0) || now == qRgb(255, 255, 255));
      }
    }
    // Lines take four tenths, less where the surface itself is black or white.
    QVERIFY2(inside > 0 && 10 * lines > inside && 5 * lines < 3 * inside,
             qPrintable(QStringLiteral("%1 of %2").arg(lines).arg(inside)));
  }

  void ViewsAreInTheOrderInWhichToPaintThem() {
    QVERIFY(PaintAndAccept());
    auto* order = window_->findChild<QComboBox*>("views_order");
    order->setFocus();
    auto* shown = window_->findChild<QListWidget*>("views_list");
    shown->setCurrentRow(shown->count() - 1);
    shown->scrollToBottom();
    // From its list, with Return and with Space.
    for (const Qt::Key choose : {Qt::Key_Space, Qt::Key_Return}) {
      order->showPopup();
      QTRY_VERIFY(order->view()->isVisible());
      QTest::keyClick(order->view(), Qt::Key_Down);
      QTest::keyClick(order->view(), choose);
      QTRY_VERIFY(!order->view()->isVisible());
    }
    QVERIFY(Activate(*window_));
    QCOMPARE(order->currentText(), QString("To paint next (computes)"));
    QVERIFY(QTest::qWaitFor([&] { return window_->uncertainty().found() != nullptr; }, kWaitMs));
    const auto& views = window_->uncertainty().found()->views;
    QCOMPARE(views.size(), scene_->scene().views.size() - 1);
    auto* list = window_->findChild<QListWidget*>("views_list");
    for (size_t i = 0; i < views.size(); ++i) {
      const QString name = QString::fromStdString(views[i].view);
      QVERIFY(list->item(int(i))->toolTip().startsWith(name));
      QVERIFY(views[i].view != subject_.first);
    }
    QVERIFY(list->item(0)->toolTip().contains("would settle"));
    QVERIFY(list->viewport()->rect().contains(list->visualItemRect(list->item(0)).center()));

    // Strokes there continue the region; in other orders they make a new one.
    Q_EMIT list->itemActivated(list->item(0));
    QVERIFY(WaitSharp(*window_));
    QCOMPARE(canvas().picture()->name, views.front().view);
    canvas().setFocus();
    PressKey(*window_, Qt::Key_Return);
    QVERIFY(WaitPainting(*window_));
    QCOMPARE(window_->selection().entry().region, window_->current_region());
    QTest::keyClick(&window_->selection().canvas(), Qt::Key_Escape);
    QVERIFY(!window_->IsSelecting());
    order->setFocus();
    QTest::keyClick(order, Qt::Key_Home);
    canvas().setFocus();
    PressKey(*window_, Qt::Key_Return);
    QVERIFY(WaitPainting(*window_));
    QCOMPARE(window_->selection().entry().region, RegionId(0));
  }

  void WithoutARegionThereIsNothingToHatch() {
    QSignalSpy refused(&window_->uncertainty(), &Uncertainty::refused);
    PressKey(*window_, Qt::Key_U);
    QCOMPARE(refused.count(), 1);
    QVERIFY(!window_->uncertainty().found());
  }

  void AStrokeShowsInOtherViewsWhileItIsDrawn() {
    QVERIFY(Enter());
    StrokePreview& preview = window_->stroke_preview();
    QMap<QString, QImage> overlays;
    connect(&preview, &StrokePreview::shown, this,
            [&](const QString& view, const QImage& overlay) { overlays[view] = overlay; });
    QSignalSpy finished(&preview, &StrokePreview::finished);
    SelectionCanvas& paper = window_->selection().canvas();
    const QPoint middle = paper.rect().center();
    DragHeld(&paper, {middle, middle + QPoint(20, 0)});
    QVERIFY(paper.editor().InStroke());
    QVERIFY(finished.count() > 0 || finished.wait(kWaitMs));
    QVERIFY(paper.editor().InStroke());
    QVERIFY(!overlays.isEmpty());
    QTest::mouseRelease(&paper, Qt::LeftButton, {}, middle + QPoint(20, 0));
    QVERIFY(QTest::qWaitFor([&] { return !preview.IsBusy(); }, kWaitMs));

    // Of the whole object: in another view it is where the object is.
    overlays.clear();
    paper.Edited(paper.editor().Fill(Truth(subject_.first), Combine::kReplace));
    QVERIFY(QTest::qWaitFor([&] { return !preview.IsBusy(); }, kWaitMs));
    // Parts that the painted view does not see are missing, and not much else is there.
    double most = 0;
    for (const auto& [name, truth] : scene_->Masks(subject_.object)) {
      const QImage overlay = overlays.value(QString::fromStdString(name));
      if (overlay.isNull() || name == subject_.first) continue;
      double right = 0, wrong = 0;
      for (int y = 0; y < truth.height; ++y) {
        for (int x = 0; x < truth.width; ++x) {
          const int ox = x * overlay.width() / truth.width;
          const int oy = y * overlay.height() / truth.height;
          if (qAlpha(overlay.pixel(ox, oy)) > 0) (truth(x, y) ? right : wrong) += 1;
        }
      }
      if (right > 2 * wrong) most = std::max(most, right / double(Size(truth)));
    }
    QVERIFY2(most > 0.3, qPrintable(QString::number(most)));
    QSignalSpy cleared(&preview, &StrokePreview::cleared);
    QTest::keyClick(&paper, Qt::Key_Escape);
    QVERIFY(!window_->IsSelecting());
    QCOMPARE(cleared.count(), 1);
  }

  void AVeilShowsWhatAStrokeSelectsBesideThePaint() {
    QVERIFY(Enter());
    StrokePreview& preview = window_->stroke_preview();
    SelectionCanvas& paper = window_->selection().canvas();
    const auto veils = [&] { return !preview.IsBusy() && !paper.veil().mask().Empty(); };
    const auto is_gone = [&] { return paper.veil().mask().Empty(); };
    const auto press = [&](Qt::Key key, Qt::KeyboardModifiers modifiers = {}) {
      QVERIFY(Activate(*window_));
      QTest::keyClick(&paper, key, modifiers);
    };
    // While it is drawn, over the object's pixel that the paint goes around.
    const Eigen::Vector2i at = DrawAround();
    QTRY_VERIFY_WITH_TIMEOUT(veils(), kWaitMs);
    QVERIFY(paper.editor().InStroke());
    const Mask truth = Truth(subject_.first);
    QCOMPARE(paper.veil().mask().width, truth.width);
    QVERIFY(truth(at.x(), at.y()) > 0);
    QVERIFY(paper.editor().mask()(at.x(), at.y()) < 128);
    QVERIFY(paper.veil().mask()(at.x(), at.y()) >= 128);
    Keep(*window_, "veil");
    const Eigen::Vector2d middle = paper.transform().ToWidget(at.cast<double>().array() + 0.5);
    const QPoint over(int(middle.x()), int(middle.y()));
    const QRgb veiled = paper.grab().toImage().pixel(over);

    // The switch hides it and the overlays of the small pictures, of the next stroke too.
    QSignalSpy cleared(&preview, &StrokePreview::cleared);
    press(Qt::Key_V, Qt::ShiftModifier);
    QVERIFY(!window_->action("show.look_ahead")->isChecked());
    QCOMPARE(cleared.count(), 1);
    QTRY_VERIFY(is_gone());
    QVERIFY(paper.grab().toImage().pixel(over) != veiled);
    const int rounds = preview.rounds();
    press(Qt::Key_Escape);
    QTest::mouseRelease(&paper, Qt::LeftButton);
    QVERIFY(!paper.editor().AnyInside());
    DrawAround();
    QVERIFY(Settle(controller()));
    QVERIFY(is_gone());
    QCOMPARE(preview.rounds(), rounds);
    press(Qt::Key_V, Qt::ShiftModifier);
    QVERIFY(window_->action("show.look_ahead")->isChecked());
    QTRY_VERIFY_WITH_TIMEOUT(veils(), kWaitMs);

    // Gone with the stroke that is given up, taken back, or left.
    press(Qt::Key_Escape);
    QTest::mouseRelease(&paper, Qt::LeftButton);
    QVERIFY(!paper.editor().AnyInside());
    QTRY_VERIFY(is_gone());
    DrawAround();
    QTest::mouseRelease(&paper, Qt::LeftButton);
    QTRY_VERIFY_WITH_TIMEOUT(veils(), kWaitMs);
    press(Qt::Key_Z, Qt::ControlModifier);
    QTRY_VERIFY(is_gone());
    press(Qt::Key_Y, Qt::ControlModifier);
    QTRY_VERIFY_WITH_TIMEOUT(veils(), kWaitMs);
    press(Qt::Key_Escape);
    QVERIFY(!window_->IsSelecting());
    QTRY_VERIFY(is_gone());
  }

  void PaintAloneKeepsWhatItHardlySees() {
    const auto facts = controller().facts();
    const View& view = *facts->workspace->reconstruction.FindView(subject_.first);
    const PosedCamera camera = facts->Posed(view);
    std::vector<float> none, before;
    controller().Run({}, [&](EditSession& session, Monitor&) {
      const Mask nothing(camera.camera.width, camera.camera.height);
      const std::vector<float> all(session.scene().original().NumGaussians(), 1.0F);
      before = PaintShares(session.scene().renderer(), camera, nothing, all);
      none = PaintShares(session.scene().renderer(), camera, nothing, {});
    });
    QVERIFY(Settle(controller()));
    QCOMPARE(none, std::vector<float>(none.size(), 0.0F));
    const auto kept = std::count(before.begin(), before.end(), 1.0F);
    const auto gone = std::count_if(before.begin(), before.end(), [](float m) { return m < 0.5F; });
    QVERIFY(kept > 0 && gone > 0);  // beside the picture; in front of everything
  }
};

}  // namespace retint

QTEST_MAIN(retint::UncertainTest)
#include "uncertain_test.moc"
