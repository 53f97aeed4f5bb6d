// SPDX-License-Identifier: BSD-3-Clause
// Tasks of the controller's that wait for one another: cancelled, overtaken, and of a scene that is
// replaced meanwhile.
#include "viewer/scene/scene_controller.h"

#include <functional>
#include <future>
#include <vector>

#include "tests/viewer/viewer_scene.h"

namespace retint {

class SceneControllerTest : public QObject {
  Q_OBJECT

 private:
  std::unique_ptr<ViewerScene> scene_;
  ViewerScene::Subject subject_;
  std::unique_ptr<SceneController> controller_;

  // Keeps the worker until the promise is kept or broken.
  static SceneController::Work Until(std::promise<void>& gate) {
    return [opened = gate.get_future().share()](EditSession&, Monitor&) { opened.wait(); };
  }

  // Painted on one view, selected with the splat's own depth, which is quick.
  RegionId AddPaintedRegion() {
    SceneController::Round round;
    const auto facts = controller_->facts();
    const View* view = facts->workspace->reconstruction.FindView(subject_.first);
    round.paint.view = {subject_.first, facts->Posed(*view),
                        scene_->Masks(subject_.object).at(subject_.first)};
    round.name = "jug";
    round.edit = ColorEdit::Tint({0.2F, 0.9F, 0.3F});
    round.select = Select();
    RegionId id = 0;
    controller_->SelectRound(round, [&](RegionId added) { id = added; });
    return Settle(*controller_) ? id : 0;
  }
  static SelectOptions Select() {
    SelectOptions select;
    select.depth_method = "gaussian";
    return select;
  }
  std::string NameOf(RegionId id) const { return controller_->regions().Find(id)->name; }
  RegionId AddRegion(const QString& name) {
    QSignalSpy added(controller_.get(), &SceneController::regionAdded);
    AddRegionFromMasks(*controller_, name, scene_->Masks(subject_.object), ColorEdit());
    return Settle(*controller_) && !added.empty() ? added.back().front().value<RegionId>() : 0;
  }

 private Q_SLOTS:
  void initTestCase() {
    qRegisterMetaType<RegionId>("retint::RegionId");
    scene_ = std::make_unique<ViewerScene>();
    subject_ = scene_->MostVisible();
    QVERIFY(subject_.object != 0);
  }
  void cleanupTestCase() { scene_.reset(); }
  void init() {
    controller_ = std::make_unique<SceneController>();
    controller_->colors().SetAutomaticRefit(false);
    QSignalSpy opened(controller_.get(), &SceneController::opened);
    controller_->Open(scene_->Request());
    QVERIFY(opened.count() > 0 || opened.wait(kWaitMs));
  }
  void cleanup() { controller_.reset(); }

  void CancellingLeavesEditsThatWait() {
    const RegionId id = AddPaintedRegion();
    QVERIFY(id != 0);
    std::promise<void> gate;
    controller_->Run({}, Until(gate));
    controller_->Do(RenameRegion{id, "cup"});
    controller_->Run("waiting", [](EditSession&, Monitor&) { qFatal("it was cancelled"); });
    QSignalSpy cancelled(controller_.get(), &SceneController::cancelled);
    controller_->Cancel();
    QCoreApplication::processEvents();
    QCOMPARE(NameOf(id), "cup");
    gate.set_value();
    QVERIFY(Settle(*controller_));
    QCOMPARE(NameOf(id), "cup");
    QCOMPARE(cancelled.count(), 1);
    QCOMPARE(cancelled.front().front().toString(), "waiting");
  }

  void EditsShowAtOnceAsTheSessionMakesThem() {
    const RegionId jug = AddRegion("jug"), cup = AddRegion("cup"), lid = AddRegion("lid");
    QVERIFY(jug != 0 && cup != 0 && lid != 0);
    const std::vector<std::function<void()>> edits = {
        [&] {
          controller_->Do(SetEdit{cup, ColorEdit::Tint({0.2F, 1, 1}), 0.5F}, "");
        },
        [&] {
          controller_->Do(SetVisible{jug, false});
        },
        [&] {
          controller_->Do(RenameRegion{lid, "cover"});
        },
        [&] {
          controller_->Do(MoveRegion{lid, 1});
        },
        [&] {
          controller_->Do(MoveRegion{jug, 99});
        },  // after the last
        [&] { controller_->Do(RemoveRegion{cup}); },
    };
    for (const auto& edit : edits) {
      std::promise<void> gate;
      controller_->Run({}, Until(gate));
      const RegionSet before = controller_->regions();
      edit();
      const RegionSet shown = controller_->regions();
      QVERIFY(!shown.SavesLike(before));
      gate.set_value();
      QVERIFY(Settle(*controller_));
      QVERIFY(shown.SavesLike(controller_->regions()));  // which are the session's now
    }
  }

  void OnlyTheNewestSelectionIsMadeAgain() {
    const RegionId id = AddPaintedRegion();
    QVERIFY(id != 0);
    std::promise<void> gate;
    bool saved = false;
    QSignalSpy again(controller_.get(), &SceneController::selectedAgain);
    controller_->Run({}, Until(gate));
    controller_->SelectAgain(id, Select(), {});
    controller_->Run(
        "saving", [](EditSession&, Monitor&) {}, [&] { saved = true; });
    controller_->SelectAgain(id, Select(), {});
    gate.set_value();
    QVERIFY(Settle(*controller_));
    QVERIFY(saved);
    QCOMPARE(again.count(), 1);
  }

  void SelectingAgainLeavesOtherTasksThatWait() {
    const RegionId id = AddPaintedRegion();
    QVERIFY(id != 0);
    bool saved = false;
    QSignalSpy again(controller_.get(), &SceneController::selectedAgain);
    // Once the first is at work.
    connect(
        controller_.get(), &SceneController::taskChanged, this,
        [&] {
          controller_->Run(
              "saving", [](EditSession&, Monitor&) {}, [&] { saved = true; });
          controller_->SelectAgain(id, Select(), {});
        },
        Qt::SingleShotConnection);
    controller_->SelectAgain(id, Select(), {});
    QVERIFY(QTest::qWaitFor([&] { return !again.empty(); }, kWaitMs));
    QVERIFY(Settle(*controller_));
    QVERIFY(saved);
  }

  void AReplacedSceneIsNotFittedAnyMore() {
    QVERIFY(AddPaintedRegion() != 0);
    RefitJob endless;
    endless.options.solver = Solver::kAdam;
    endless.options.adam.iterations = 0;
    controller_->colors().SetRefitJob(endless);
    QSignalSpy opened(controller_.get(), &SceneController::opened);
    controller_->Open(scene_->Request());
    std::promise<void> gate;
    controller_->Run({}, Until(gate));
    controller_->colors().StartRefit();
    QVERIFY(opened.wait(kWaitMs));
    gate.set_value();
    QVERIFY(Settle(*controller_));
  }
};

}  // namespace retint

QTEST_MAIN(retint::SceneControllerTest)
#include "scene_controller_test.moc"
