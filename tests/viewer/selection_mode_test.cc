// SPDX-License-Identifier: BSD-3-Clause
// Selection mode on a synthetic workspace: entered, painted with the mouse, accepted, and the
// session's regions held against the truth.
#include "viewer/selection/selection_mode.h"

#include <algorithm>
#include <future>
#include <memory>

#include <QComboBox>
#include <QMouseEvent>
#include <QPushButton>
#include <QSignalSpy>
#include <QTemporaryDir>
#include <QTest>
#include <QToolButton>

#include "synthetic/synthetic_scene.h"
#include "synthetic/synthetic_workspace.h"
#include "tests/support/iou.h"
#include "tests/viewer/viewer_scene.h"
#include "viewer/selection/scene_question.h"
#include "viewer/selection/stroke_preview.h"
#include "viewer/widgets/banner.h"

namespace retint {

constexpr int kWait = 60000;  // ms

class SelectionModeTest : public QObject {
  Q_OBJECT

 private:
  QTemporaryDir folder_;
  SyntheticScene scene_;
  int object_ = 0;
  int first_ = 0, second_ = 0;  // views that see the object whole
  std::unique_ptr<SceneController> controller_;
  std::unique_ptr<SelectionMode> mode_;

  const std::string& Name(int view) const { return scene_.views[size_t(view)].name; }

  Mask Truth(int view) const {
    const auto& ids = scene_.views[size_t(view)].object_ids;
    Mask mask(ids.width, ids.height);
    for (size_t i = 0; i < mask.data.size(); ++i) mask.data[i] = ids.data[i] == object_ ? 255 : 0;
    return mask;
  }

  // The half of a mask left of its middle column.
  static Mask LeftHalf(const Mask& mask) {
    int low = mask.width, high = 0;
    for (int y = 0; y < mask.height; ++y) {
      for (int x = 0; x < mask.width; ++x) {
        if (mask(x, y) == 0) continue;
        low = std::min(low, x), high = std::max(high, x);
      }
    }
    Mask half = mask;
    for (int y = 0; y < mask.height; ++y) {
      for (int x = (low + high) / 2; x < mask.width; ++x) half(x, y) = 0;
    }
    return half;
  }

  // Its longest row, which is an even one or one below.
  static Mask OneRow(const Mask& mask) {
    Mask line(mask.width, mask.height);
    int longest = 0;
    for (int y = 0; y < mask.height; ++y) {
      const auto row = mask.data.begin() + std::ptrdiff_t(mask.Index(0, y));
      const auto count = int(std::count(row, row + mask.width, uint8_t{255}));
      if (count <= longest) continue;
      longest = count;
      line = Mask(mask.width, mask.height);
      std::copy(row, row + mask.width, &line(0, y - y % 2));
    }
    return line;
  }

  // Over the views in which the object takes at least a hundred pixels.
  double MeanIou(const RegionSelection& selection) const {
    double sum = 0;
    int count = 0;
    for (size_t v = 0; v < scene_.views.size(); ++v) {
      const Mask truth = Truth(int(v));
      if (std::count(truth.data.begin(), truth.data.end(), uint8_t{255}) < 100) continue;
      sum += IouOf(selection.masks.at(Name(int(v))), truth);
      ++count;
    }
    return count > 0 ? sum / count : 0;
  }

  SelectionEntry Entry(int view, RegionId region = 0) const {
    const auto facts = controller_->facts();
    SelectionEntry entry;
    entry.view = QString::fromStdString(Name(view));
    entry.camera = facts->Posed(*facts->workspace->reconstruction.FindView(Name(view)));
    entry.region = region;
    return entry;
  }

  bool Enter(const SelectionEntry& entry) {
    QSignalSpy ready(mode_.get(), &SelectionMode::ready);
    if (!mode_->Enter(entry)) return false;
    return ready.count() > 0 || ready.wait(kWait);
  }

  // Drags a fine brush along every other row of the mask.
  void Paint(const Mask& mask, Qt::KeyboardModifiers modifiers = Qt::NoModifier) {
    SelectionCanvas& canvas = mode_->canvas();
    canvas.SetBrush({1.5, 1});
    PaintRows(canvas, mask, modifiers);
  }

  // 0: it was not accepted.
  RegionId Accept() {
    QSignalSpy accepted(mode_.get(), &SelectionMode::accepted);
    QTest::keyClick(&mode_->canvas(), Qt::Key_Return);
    if (accepted.count() == 0 && !accepted.wait(kWait)) return 0;
    return accepted.at(0).at(0).value<RegionId>();
  }

  std::shared_ptr<const RegionSelection> SelectionOf(RegionId id) const {
    const Region* region = controller_->regions().Find(id);
    return region ? region->selection : nullptr;
  }

  // Once `gate` says so.
  bool Open(std::shared_future<void> gate = {}) {
    QSignalSpy opened(controller_.get(), &SceneController::opened);
    controller_->OpenWith("scene", [this, gate](Monitor& monitor) {
      if (gate.valid()) gate.wait();
      SessionOptions options;
      options.backend = "cpu";
      const std::filesystem::path workspace = folder_.path().toStdString();
      return EditSession::Open(workspace, workspace / "splat.ply", options, monitor);
    });
    return opened.count() > 0 || opened.wait(kWait);
  }

  RegionId AddRegion(int view, const Mask& mask) {
    if (!Enter(Entry(view))) return 0;
    Paint(mask);
    return Accept();
  }

 private Q_SLOTS:
  void initTestCase() {
    qRegisterMetaType<retint::RegionId>("retint::RegionId");
    SyntheticOptions options;
    options.width = 200, options.height = 150, options.views = 8;
    Monitor monitor;
    scene_ = MakeSyntheticScene(options, monitor);
    // The largest object with two whole views that strokes can fill.
    int64_t largest = 0;
    for (const int object : scene_.still_life) {
      const auto& whole = scene_.whole_views[size_t(object)];
      if (whole.size() < 2 || scene_.object_names[size_t(object)] == "plant") continue;
      object_ = object;
      const Mask truth = Truth(whole[0]);
      const int64_t pixels = std::count(truth.data.begin(), truth.data.end(), uint8_t{255});
      if (pixels <= largest) continue;
      largest = pixels;
      first_ = whole.front(), second_ = whole.back();
    }
    QVERIFY(largest > 0);
    for (const int object : scene_.still_life) {
      object_ = object;
      const Mask truth = Truth(first_);
      if (std::count(truth.data.begin(), truth.data.end(), uint8_t{255}) == largest) break;
    }
    WriteSyntheticWorkspace(folder_.path().toStdString(), scene_, monitor);
  }

  void init() {
    controller_ = std::make_unique<SceneController>();
    controller_->colors().SetAutomaticRefit(false);
    QVERIFY(Open());
    mode_ = std::make_unique<SelectionMode>(controller_.get());
    SelectOptions select;
    select.depth_method = "gaussian";  // quick; stereo has tests of its own
    mode_->SetSelectOptions(select);
    mode_->resize(900, 700);
    mode_->show();
    QVERIFY(QTest::qWaitForWindowExposed(mode_.get()));
  }

  void cleanup() {
    mode_.reset();
    controller_.reset();
  }

  void AcceptingMakesARegionThatMeetsTheTruth() {
    QVERIFY(Enter(Entry(first_)));
    QCOMPARE(mode_->state(), SelectionMode::State::kPainting);
    Paint(Truth(first_));
    QVERIFY(IouOf(mode_->canvas().editor().mask(), Truth(first_)) > 0.75);
    const RegionId id = Accept();
    QVERIFY(id != 0);
    QCOMPARE(mode_->state(), SelectionMode::State::kIdle);
    const auto selection = SelectionOf(id);
    QVERIFY(selection);
    QCOMPARE(selection->masks.size(), scene_.views.size());
    const double iou = MeanIou(*selection);
    QVERIFY2(iou > 0.6, qPrintable(QString::number(iou)));
    QCOMPARE(selection->source.painted.size(), size_t{1});
    QCOMPARE(controller_->history().undo_label, std::string("Add Region 1"));
    const auto cloud = MakeOverlayCloud(*selection);
    QVERIFY(cloud && cloud->points.size() == selection->source.cloud.points.size());
    QCOMPARE(MakeOverlayCloud(*selection, 100)->points.size() <= 100, true);
    QVERIFY(!MakeOverlayCloud(RegionSelection{}));
  }

  void TheOutlineThatWasShownIsAccepted() {
    QVERIFY(Enter(Entry(first_)));
    SelectionCanvas& canvas = mode_->canvas();
    QTest::keyClick(&canvas, Qt::Key_S);
    PaintRows(canvas, OneRow(LeftHalf(Truth(first_))));
    QVERIFY(QTest::qWaitFor([&] { return !canvas.IsFinding(); }, kWait));
    const Mask shown = canvas.editor().mask();
    const RegionId id = Accept();
    QVERIFY(id != 0);
    QCOMPARE(SelectionOf(id)->source.painted.back().mask.data, shown.data);
    QCOMPARE(SelectionOf(id)->masks.at(Name(first_)).data, shown.data);
  }

  // The user's outline holds, with or without an answer, unless the user takes the scene's.
  void TheSceneAsksBeforeItChangesAnOutline() {
    QVERIFY(Enter(Entry(first_)));
    SelectionCanvas& canvas = mode_->canvas();
    QTest::keyClick(&canvas, Qt::Key_S);
    PaintRows(canvas, OneRow(Truth(first_)));
    QVERIFY(QTest::qWaitFor([&] { return !canvas.IsFinding(); }, kWait));
    const Mask mine = canvas.editor().mask();
    SceneAnswer answer;
    answer.mask = LeftHalf(Truth(first_));
    answer.differs = OutlinesDiffer(mine, answer.mask);
    answer.changed = 0.3, answer.may_stand = true;
    SceneQuestion& question = mode_->question();
    const auto click = [&](const char* name) {
      QTest::mouseClick(question.banner().findChild<QPushButton*>(name), Qt::LeftButton);
    };
    question.AskTheUser(answer);
    QVERIFY(question.IsAsking() && question.banner().text().contains("30 %"));
    QCOMPARE(canvas.hatched().data, answer.differs.data);
    Keep(*mode_, "question");
    QCOMPARE(canvas.editor().mask().data, mine.data);
    click("banner_answer0");
    QVERIFY(!question.IsAsking() && canvas.hatched().Empty());
    QCOMPARE(canvas.editor().mask().data, mine.data);

    question.AskTheUser(answer);
    click("banner_answer1");
    QVERIFY(!question.IsAsking() && canvas.hatched().Empty());
    QCOMPARE(canvas.editor().mask().data, answer.mask.data);
    QTest::keyClick(&canvas, Qt::Key_Z, Qt::ControlModifier);
    QCOMPARE(canvas.editor().mask().data, mine.data);

    // Another stroke withdraws the question; accepting means one's own outline.
    question.AskTheUser(answer);
    QTest::keyClick(&canvas, Qt::Key_G);
    QVERIFY(!question.IsAsking());
    const Mask grown = canvas.editor().mask();
    question.AskTheUser(answer);
    const RegionId id = Accept();
    QVERIFY(id != 0);
    QVERIFY(!question.IsAsking());
    QCOMPARE(SelectionOf(id)->masks.at(Name(first_)).data, grown.data);
  }

  void HowFarPaintGoesIsOneClick() {
    const auto button = [&](const char* name) { return mode_->findChild<QToolButton*>(name); };
    QVERIFY(Enter(Entry(first_)));
    QVERIFY(button("reachObject")->isChecked());  // the default
    QTest::mouseClick(button("reachExact"), Qt::LeftButton);
    QVERIFY(button("reachExact")->isChecked() && !button("reachObject")->isChecked());
    QVERIFY(ReachOf(mode_->projector_options()) == PaintReach::kExact);
    QCOMPARE(mode_->window()->focusWidget(), &mode_->canvas());  // the next key means the canvas
    Paint(LeftHalf(Truth(first_)));
    const Mask painted = mode_->canvas().editor().mask();
    const RegionId exact = Accept();
    QVERIFY(exact != 0);
    QCOMPARE(SelectionOf(exact)->masks.at(Name(first_)).data, painted.data);

    QVERIFY(Enter(Entry(first_)));
    QVERIFY(button("reachExact")->isChecked());
    QTest::mouseClick(button("reachObject"), Qt::LeftButton);
    Paint(LeftHalf(Truth(first_)));
    const RegionId object = Accept();
    QVERIFY(object != 0);
    QVERIFY(SelectionOf(object)->shares != SelectionOf(exact)->shares);
    // Options that stand for no choice press no button.
    ProjectorOptions quads;
    quads.kind = ProjectorKind::kQuads;
    mode_->SetProjectorOptions(quads);
    for (const char* name : {"reachSurface", "reachObject", "reachExact"}) {
      QVERIFY(!button(name)->isChecked());
    }
  }

  void ALaterRoundExtendsFromAnotherViewAsOneStep() {
    const RegionId id = AddRegion(first_, LeftHalf(Truth(first_)));
    QVERIFY(id != 0);
    const auto half = SelectionOf(id);
    const double before = MeanIou(*half);
    QVERIFY(Enter(Entry(second_, id)));
    // It starts from the first round's selection in this view.
    QCOMPARE(mode_->canvas().editor().mask().data, half->masks.at(Name(second_)).data);
    Paint(Truth(second_));
    QCOMPARE(Accept(), id);
    const auto whole = SelectionOf(id);
    const double after = MeanIou(*whole);
    QVERIFY2(after > before + 0.1, qPrintable(QString("%1 %2").arg(before).arg(after)));
    QVERIFY(IouOf(whole->masks.at(Name(second_)), Truth(second_)) > 0.7);
    QCOMPARE(whole->source.painted.size(), size_t{2});
    QCOMPARE(controller_->regions().regions.size(), size_t{1});
    QSignalSpy changed(controller_.get(), &SceneController::regionsChanged);
    controller_->Undo();
    QVERIFY(changed.wait(kWait));
    QCOMPARE(SelectionOf(id), half);
  }

  void ALaterRoundErasesFromAnotherView() {
    const RegionId id = AddRegion(first_, Truth(first_));
    QVERIFY(id != 0);
    QVERIFY(Enter(Entry(second_, id)));
    const Mask gone = LeftHalf(Truth(second_));
    QTest::keyClick(&mode_->canvas(), Qt::Key_E);
    Paint(gone);
    QTest::keyClick(&mode_->canvas(), Qt::Key_B);
    QCOMPARE(Accept(), id);
    const Mask& mask = SelectionOf(id)->masks.at(Name(second_));
    double left = 0, all = 0, kept = 0, rest = 0;
    const Mask truth = Truth(second_);
    for (size_t i = 0; i < mask.data.size(); ++i) {
      left += gone.data[i] > 0 && mask.data[i] >= 128;
      all += gone.data[i] > 0;
      const bool stays = truth.data[i] > 0 && gone.data[i] == 0;
      kept += stays && mask.data[i] >= 128;
      rest += stays;
    }
    QVERIFY2(left < 0.25 * all, qPrintable(QString::number(left / all)));
    QVERIFY2(kept > 0.6 * rest, qPrintable(QString::number(kept / rest)));
    // The first view's paint gave way too.
    const auto& painted = SelectionOf(id)->source.painted;
    QCOMPARE(painted.size(), size_t{2});
    QVERIFY(IouOf(painted[0].mask, Truth(first_)) < 0.8);
  }

  void TheTargetCanBeChosenUntilTheFirstStroke() {
    const RegionId id = AddRegion(first_, Truth(first_));
    QVERIFY(id != 0);
    QVERIFY(Enter(Entry(second_)));
    auto* target = mode_->findChild<QComboBox*>("selectionTarget");
    QVERIFY(target && target->isEnabled());
    QCOMPARE(target->count(), 2);
    QCOMPARE(target->currentIndex(), 0);
    QSignalSpy ready(mode_.get(), &SelectionMode::ready);
    target->setFocus();
    QTest::keyClick(target, Qt::Key_Down);
    QVERIFY(ready.count() > 0 || ready.wait(kWait));
    QCOMPARE(mode_->entry().region, id);
    QCOMPARE(mode_->canvas().editor().mask().data, SelectionOf(id)->masks.at(Name(second_)).data);
    Paint(LeftHalf(Truth(second_)), Qt::ControlModifier);
    QVERIFY(!target->isEnabled());
  }

  void AViewAlreadyPaintedShowsItsPaint() {
    const RegionId id = AddRegion(first_, Truth(first_));
    QVERIFY(id != 0);
    QVERIFY(Enter(Entry(first_, id)));
    QCOMPARE(mode_->canvas().editor().mask().data, SelectionOf(id)->source.painted[0].mask.data);
  }

  void AFreeCameraWorksToo() {
    SelectionEntry entry = Entry(first_);
    entry.view.clear();
    QVERIFY(Enter(entry));
    Paint(Truth(first_));
    const RegionId id = Accept();
    QVERIFY(id != 0);
    QVERIFY(MeanIou(*SelectionOf(id)) > 0.6);
    QCOMPARE(SelectionOf(id)->source.painted[0].name, std::string("free view 1"));
    // A later round from a place without a view: the selection as seen from there.
    entry.camera.cam_from_world.translation.z() += 0.1;
    entry.region = id;
    QVERIFY(Enter(entry));
    QVERIFY(mode_->canvas().editor().AnyInside());
    QVERIFY(IouOf(mode_->canvas().editor().mask(), Truth(first_)) > 0.4);
  }

  void NothingPaintedIsSaidSo() {
    QVERIFY(Enter(Entry(first_)));
    QVERIFY(mode_->message().isEmpty());
    QTest::keyClick(&mode_->canvas(), Qt::Key_Return);
    QCOMPARE(mode_->state(), SelectionMode::State::kPainting);
    QVERIFY(mode_->message().contains("paint"));
    QVERIFY(controller_->regions().regions.empty());
    Paint(Truth(first_));
    QVERIFY2(mode_->message().isEmpty(), "the next stroke clears it");
  }

  void NothingChangedIsSaidSo() {
    const RegionId id = AddRegion(first_, Truth(first_));
    QVERIFY(id != 0);
    const auto selection = SelectionOf(id);
    QVERIFY(Enter(Entry(second_, id)));
    QTest::keyClick(&mode_->canvas(), Qt::Key_Return);
    QCOMPARE(mode_->state(), SelectionMode::State::kPainting);
    QVERIFY(!mode_->message().isEmpty());
    QTest::keyClick(&mode_->canvas(), Qt::Key_A, Qt::ControlModifier | Qt::ShiftModifier);
    QTest::keyClick(&mode_->canvas(), Qt::Key_Return);
    QCOMPARE(mode_->state(), SelectionMode::State::kPainting);
    QVERIFY(!mode_->message().isEmpty());
    QCOMPARE(SelectionOf(id), selection);
  }

  void CancellingWhileComputingLeavesAllAsItWas() {
    QVERIFY(Enter(Entry(first_)));
    Paint(Truth(first_));
    const auto painted = mode_->canvas().editor().mask().data;
    QSignalSpy cancelled(controller_.get(), &SceneController::cancelled);
    // The worker is kept busy, so that there is time to cancel.
    controller_->Run("busy", [](EditSession&, Monitor& monitor) {
      while (!monitor.IsCancelled()) QTest::qSleep(1);
      monitor.ThrowIfCancelled();
    });
    QTest::keyClick(&mode_->canvas(), Qt::Key_Return);
    QCOMPARE(mode_->state(), SelectionMode::State::kComputing);
    QVERIFY(!mode_->Enter(Entry(second_)));
    QTest::keyClick(&mode_->canvas(), Qt::Key_A, Qt::ControlModifier);  // nothing may be painted
    auto* stop = mode_->findChild<QPushButton*>("selectionStop");
    QVERIFY(stop && stop->isVisible());
    QTest::mouseClick(stop, Qt::LeftButton);
    QTRY_COMPARE_WITH_TIMEOUT(mode_->state(), SelectionMode::State::kPainting, kWait);
    QVERIFY(!mode_->message().isEmpty());
    QVERIFY(mode_->canvas().editor().mask().data == painted);
    QVERIFY(mode_->canvas().editor().CanUndo());
    QVERIFY(controller_->regions().regions.empty());
    QVERIFY(!controller_->history().can_undo);
    // And it can be accepted after all.
    QVERIFY(Accept() != 0);
  }

  void AFailureLeadsBackToPainting() {
    SelectOptions select;
    select.depth_method = "colmap";  // there are no dense depth maps
    mode_->SetSelectOptions(select);
    QVERIFY(Enter(Entry(first_)));
    Paint(Truth(first_));
    QTest::keyClick(&mode_->canvas(), Qt::Key_Return);
    QTRY_COMPARE_WITH_TIMEOUT(mode_->state(), SelectionMode::State::kPainting, kWait);
    QVERIFY(!mode_->message().isEmpty());
    QVERIFY(controller_->regions().regions.empty());
  }

  void StrokesSurviveLeavingAndComingBack() {
    QVERIFY(Enter(Entry(first_)));
    Paint(Truth(first_));
    const auto painted = mode_->canvas().editor().mask().data;
    QSignalSpy left(mode_.get(), &SelectionMode::left);
    QTest::keyClick(&mode_->canvas(), Qt::Key_Escape);
    QCOMPARE(left.count(), 1);
    QCOMPARE(mode_->state(), SelectionMode::State::kIdle);
    QVERIFY(Enter(Entry(first_)));
    QVERIFY(mode_->canvas().editor().mask().data == painted);
    QVERIFY(mode_->canvas().editor().CanUndo());
    QTest::keyClick(&mode_->canvas(), Qt::Key_Escape);
    QVERIFY(Enter(Entry(second_)));
    QVERIFY(!mode_->canvas().editor().AnyInside());
  }

  void StrokesAreForgottenWithTheirScene() {
    QVERIFY(Enter(Entry(first_)));
    Paint(Truth(first_));
    QTest::keyClick(&mode_->canvas(), Qt::Key_Escape);
    QVERIFY(Open());  // another splat that has the same views
    QVERIFY(Enter(Entry(first_)));
    QVERIFY(!mode_->canvas().editor().AnyInside());
    QSignalSpy left(mode_.get(), &SelectionMode::left);
    QVERIFY(Open());
    QCOMPARE(left.count(), 1);
    QCOMPARE(mode_->state(), SelectionMode::State::kIdle);
  }

  void APreviewForgetsWhatItAskedAReplacedScene() {
    // The worker may still be at its pictures when the test ends.
    auto* preview = new StrokePreview(controller_.get(), mode_.get(), controller_.get());
    QVERIFY(Enter(Entry(first_)));
    std::promise<void> gate;
    QTimer::singleShot(0, this, [&] {
      Paint(Truth(first_));
      QVERIFY(preview->IsBusy());  // it waits for the scene
      gate.set_value();
    });
    QVERIFY(Open(gate.get_future().share()));
    QVERIFY(!preview->IsBusy());
  }

  void WhatIsGoneCannotBeExtended() {
    QVERIFY(!mode_->Enter(Entry(first_, 77)));
    const RegionId id = AddRegion(first_, LeftHalf(Truth(first_)));
    QVERIFY(Enter(Entry(second_, id)));
    Paint(Truth(second_));
    controller_->Undo();
    QTest::keyClick(&mode_->canvas(), Qt::Key_Return);
    QTRY_COMPARE_WITH_TIMEOUT(mode_->state(), SelectionMode::State::kPainting, kWait);
    QVERIFY(!mode_->message().isEmpty());
    QVERIFY(controller_->regions().regions.empty());
    // Unless it comes back: then the strokes are still there.
    const auto painted = mode_->canvas().editor().mask().data;
    QTest::keyClick(&mode_->canvas(), Qt::Key_Return);
    QVERIFY2(mode_->message().contains("was removed"), qPrintable(mode_->message()));
    QTest::keyClick(&mode_->canvas(), Qt::Key_Escape);
    QVERIFY(!mode_->HoldsPaint());
    controller_->Redo();
    QTRY_COMPARE_WITH_TIMEOUT(controller_->regions().regions.size(), size_t{1}, kWait);
    QVERIFY(mode_->HoldsPaint());
    QVERIFY(Enter(Entry(second_, id)));
    QVERIFY(mode_->canvas().editor().mask().data == painted);
    QSignalSpy left(mode_.get(), &SelectionMode::left);
    controller_->Close();
    QCOMPARE(left.count(), 1);
    QVERIFY(!mode_->Enter(SelectionEntry{}));
  }
};

}  // namespace retint

using retint::SelectionModeTest;
QTEST_MAIN(SelectionModeTest)
#include "selection_mode_test.moc"
