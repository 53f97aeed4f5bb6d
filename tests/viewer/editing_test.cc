// SPDX-License-Identifier: BSD-3-Clause
// Changes of the scene, in the window on a synthetic workspace: edits, the optimizer, sessions,
// exports, and failures during them.
#include <atomic>

#include <QAction>
#include <QComboBox>
#include <QFile>
#include <QListWidget>
#include <QMenu>
#include <QPushButton>
#include <QToolButton>

#include "colmap_io/image_io.h"
#include "splat_io/splat_io.h"
#include "tests/viewer/viewer_scene.h"
#include "viewer/scene/session_store.h"

namespace retint {

class EditingTest : public ViewerTest {
  Q_OBJECT

 private Q_SLOTS:
  void initTestCase() { MakeScene(); }
  void cleanupTestCase() { scene_.reset(); }
  void init() { QVERIFY(ShowScene()); }
  void cleanup() { window_.reset(); }

  void EditsPreviewUndoAndRedo() {
    const QImage before = canvas().frame()->image;
    const RegionId id = AddTintedRegion();
    QVERIFY(id != 0);
    QCOMPARE(window_->current_region(), id);
    QVERIFY(window_->IsModified());
    controller().Do(SetEdit{id, ColorEdit::Tint({1, 0.1F, 0.1F}), 1}, "drag");
    controller().Do(SetEdit{id, ColorEdit::Tint({1, 0.2F, 0.2F}), 1}, "drag");
    QCOMPARE(controller().regions().Find(id)->edit.Affine().gain(1, 1), 0.2F);  // at once
    QTRY_COMPARE_WITH_TIMEOUT(controller().history().undo_label, std::string("Tint in jug"),
                              kWaitMs);
    QTest::keyClick(&canvas(), Qt::Key_Z, Qt::ControlModifier);
    QTRY_COMPARE_WITH_TIMEOUT(controller().regions().Find(id)->edit.Affine().gain(1, 1), 0.9F,
                              kWaitMs);
    QTest::keyClick(&canvas(), Qt::Key_Z, Qt::ControlModifier);
    QTRY_VERIFY_WITH_TIMEOUT(controller().regions().regions.empty(), kWaitMs);
    QTRY_VERIFY_WITH_TIMEOUT(
        canvas().IsSharp() && Difference(canvas().frame()->image, before) < 0.01, kWaitMs);
    QVERIFY(!window_->IsModified());
    QTest::keyClick(&canvas(), Qt::Key_Z, Qt::ControlModifier | Qt::ShiftModifier);
    QTRY_COMPARE_WITH_TIMEOUT(controller().regions().regions.size(), size_t{1}, kWaitMs);
  }

  void TheHistoryLeadsToEveryStep() {
    const RegionId id = AddTintedRegion();
    QVERIFY(id != 0);
    controller().Do(RenameRegion{id, "pot"});
    controller().Do(SetVisible{id, false});
    QVERIFY(Settle(controller()));
    auto* menu = window_->findChild<QMenu*>("history");
    // The texts from top to bottom, the current one in brackets.
    const auto entries = [&] {
      Q_EMIT menu->aboutToShow();
      QStringList texts;
      for (const QAction* one : menu->actions()) {
        texts << (one->isChecked() ? "[" + one->text() + "]" : one->text());
      }
      return texts;
    };
    QCOMPARE(entries(), QStringList({"[Hide pot]", "Rename pot", "Add jug", "Before these edits"}));
    menu->actions()[2]->trigger();
    QVERIFY(Settle(controller()));
    QCOMPARE(entries(), QStringList({"Hide pot", "Rename pot", "[Add jug]", "Before these edits"}));
    QCOMPARE(controller().regions().regions.front().name, std::string("jug"));
    QVERIFY(controller().regions().regions.front().visible);
    menu->actions()[3]->trigger();
    QVERIFY(Settle(controller()));
    QVERIFY(controller().regions().regions.empty());
    menu->actions()[0]->trigger();
    QVERIFY(Settle(controller()));
    QVERIFY(!controller().regions().regions.front().visible);
    QVERIFY(controller().history().can_undo && !controller().history().can_redo);
  }

  void TheThumbnailsShowTheEdit() {
    const auto subject = scene_->MostVisible();
    auto* list = window_->findChild<QListWidget*>("views_list");
    QListWidgetItem* item = nullptr;
    for (int row = 0; row < list->count(); ++row) {
      const QString name = list->item(row)->data(Qt::UserRole).toString();
      if (name.toStdString() == subject.first) item = list->item(row);
    }
    QVERIFY(item);
    list->scrollToItem(item);
    const auto picture = [&] { return item->data(Qt::UserRole + 1).value<QImage>(); };
    QTRY_VERIFY_WITH_TIMEOUT(!picture().isNull(), kWaitMs);
    const QImage photo = picture();
    QSignalSpy added(&controller(), &SceneController::regionAdded);
    AddRegionFromMasks(controller(), "jug", scene_->Masks(subject.object),
                       ColorEdit::Tint({0.1F, 0.9F, 0.1F}));
    QTRY_COMPARE_WITH_TIMEOUT(added.count(), 1, kWaitMs);
    QTRY_VERIFY_WITH_TIMEOUT(picture() != photo, kWaitMs);
    // Green inside, as the picture of the whole view.
    const auto facts = controller().facts();
    Renderer renderer(facts->backend, *facts->original);
    renderer.SetSh(*controller().colors().sh());
    const View* view = facts->workspace->reconstruction.FindView(subject.first);
    const QImage whole = ToQImage(renderer.Render(facts->Posed(*view)).rgb);
    QCOMPARE(picture().size(), whole.size());  // the views of this scene are as small
    QCOMPARE(ChangedPixels(picture(), whole), int64_t{0});
    controller().Undo();
    QTRY_VERIFY_WITH_TIMEOUT(picture() == photo, kWaitMs);
  }

  void ThumbnailsThatAnOrderBringsUpShowTheEdit() {
    const auto subject = scene_->MostVisible();
    auto* list = window_->findChild<QListWidget*>("views_list");
    QListWidgetItem* last = list->item(list->count() - 1);
    list->setFixedHeight(150);  // room for the first
    QTRY_VERIFY(!list->visualItemRect(last).intersects(list->viewport()->rect()));
    const auto picture = [](const QListWidgetItem* item) {
      return item->data(Qt::UserRole + 1).value<QImage>();
    };
    QTRY_VERIFY_WITH_TIMEOUT(!picture(last).isNull(), kWaitMs);
    const QImage photo = picture(last), first = picture(list->item(0));
    // Only the last view has a mask, so that it comes first.
    const std::string name = last->data(Qt::UserRole).toString().toStdString();
    QSignalSpy added(&controller(), &SceneController::regionAdded);
    AddRegionFromMasks(controller(), "jug", {{name, scene_->Masks(subject.object).at(name)}},
                       ColorEdit::Tint({0.1F, 0.9F, 0.1F}));
    QTRY_COMPARE_WITH_TIMEOUT(added.count(), 1, kWaitMs);
    QTRY_VERIFY_WITH_TIMEOUT(picture(list->item(0)) != first, kWaitMs);
    QTest::qWait(500);  // longer than the rest before the pictures on the screen are rendered
    QVERIFY(Settle(controller()));
    QCOMPARE(picture(last), photo);
    auto* order = window_->findChild<QComboBox*>("views_order");
    order->setFocus();
    QTest::keyClick(order, Qt::Key_Down);
    QCOMPARE(list->row(last), 0);
    QTRY_VERIFY_WITH_TIMEOUT(picture(last) != photo, kWaitMs);
  }

  void OptimizerRunsAndFinishes() {
    QVERIFY(AddTintedRegion() != 0);
    const auto closed_form = controller().colors().sh();
    controller().colors().StartRefit();
    QTRY_VERIFY_WITH_TIMEOUT(
        controller().colors().optimizer().state == BackgroundOptimizer::State::kFinished, kWaitMs);
    QVERIFY(controller().colors().optimizer().steps > 0);
    QVERIFY(!controller().colors().optimizer().losses.empty());
    QTRY_VERIFY_WITH_TIMEOUT(controller().regions().regions.front().fit != nullptr, kWaitMs);
    QVERIFY(*controller().colors().sh() != *closed_form);
    QSignalSpy ready(&controller().results(), &SceneResults::qualityReady);
    controller().results().Evaluate(window_->current_region());
    QVERIFY(ready.count() > 0 || ready.wait(kWaitMs));
    const auto report = ready.at(0).at(1).value<QualityReport>();
    QVERIFY(report.train.psnr_inside_after > report.train.psnr_inside_before);
  }

  void BadScenesAreExplainedAndKeepTheOpenOne() {
    const auto facts = controller().facts();
    const auto folder = scene_->folder() / "bad";
    std::filesystem::create_directories(folder / "empty");
    QFile broken(QString::fromStdString((folder / "broken.ply").string()));
    QVERIFY(broken.open(QIODevice::WriteOnly));
    broken.write("ply\nformat binary_little_endian 1.0\nelement vertex 10\n");
    broken.close();
    OpenRequest request = scene_->Request();
    request.splat = folder / "broken.ply";
    window_->files().OpenScene(request);
    QVERIFY(ReadError(*window_).contains("broken.ply"));
    request = scene_->Request();
    request.workspace = folder / "empty";
    window_->files().OpenScene(request);
    QVERIFY(ReadError(*window_).contains("empty"));
    request = scene_->Request();
    request.splat = folder / "missing.ply";
    window_->files().OpenScene(request);
    QVERIFY(ReadError(*window_).contains("missing.ply"));
    request = scene_->Request();
    request.options.backend = "abacus";
    window_->files().OpenScene(request);
    QVERIFY(ReadError(*window_).contains("abacus"));
    window_->files().OpenPaths({QString::fromStdString((folder / "empty").string())});
    QVERIFY(ReadError(*window_).contains("COLMAP"));
    window_->files().OpenPaths({"/no/such/path"});
    QVERIFY(ReadError(*window_).contains("/no/such/path"));
    window_->files().OpenSession(folder / "nothing.retint");
    QVERIFY(ReadError(*window_).contains("nothing.retint"));
    QCOMPARE(controller().facts(), facts);
    QVERIFY(controller().IsOpen());
  }

  void WritingToABadPlaceIsExplained() {
    QVERIFY(AddTintedRegion() != 0);
    controller().results().WriteSplat("/proc/retint/out.ply");
    QVERIFY(ReadError(*window_).contains("/proc/retint"));
    const auto out = scene_->folder() / "out.ply";
    QSignalSpy written(&controller().results(), &SceneResults::written);
    controller().results().WriteSplat(out);
    QVERIFY(written.count() > 0 || written.wait(kWaitMs));
    QVERIFY(std::filesystem::file_size(out) > 1000);
    controller().results().WriteViews(scene_->folder() / "views");
    QVERIFY(written.wait(kWaitMs));
    QCOMPARE(ReadImage8(scene_->folder() / "views" / "000.png.png").width, 160);
    controller().results().WriteFrames(scene_->folder() / "frames",
                                       canvas().navigation().Turntable(3, 64, 48));
    QVERIFY(written.wait(kWaitMs));
    QCOMPARE(ReadImage8(scene_->folder() / "frames" / "0002.png").height, 48);
  }

  // A device says how much memory is free; the program's own memory says nothing.
  void WhatMemoryIsShortIsSaid() {
    struct DeviceShort : std::bad_alloc {
      const char* what() const noexcept override { return "device: 12 MB asked for, 3 MB free"; }
    };
    controller().Run("Trying", [](EditSession&, Monitor&) { throw DeviceShort(); });
    QCOMPARE(ReadError(*window_), QString("device: 12 MB asked for, 3 MB free"));
    controller().Run("Trying", [](EditSession&, Monitor&) { throw std::bad_alloc(); });
    QCOMPARE(ReadError(*window_), QString("out of memory"));
    controller().OpenWith("short",
                          [](Monitor&) -> std::unique_ptr<EditSession> { throw DeviceShort(); });
    QCOMPARE(ReadError(*window_), QString("device: 12 MB asked for, 3 MB free"));
    QVERIFY(controller().IsOpen());
  }

  void DropsOpenAScene() {
    QSignalSpy opened(&controller(), &SceneController::opened);
    QVERIFY(Drop(*window_, scene_->workspace()));
    QVERIFY(opened.count() > 0 || opened.wait(kWaitMs));
    QVERIFY(WaitSharp(*window_));
  }

  void SavesAndRestoresASession() {
    const RegionId id = AddTintedRegion();
    QVERIFY(id != 0);
    Drag(Qt::LeftButton, {40, 10});
    const Eigen::Vector3d there = Position();
    const auto folder = scene_->folder() / "work.retint";
    QSignalSpy saved(&window_->sessions(), &SessionStore::saved);
    window_->sessions().Save(folder);
    QVERIFY(saved.count() > 0 || saved.wait(kWaitMs));
    QVERIFY(!window_->IsModified());
    const auto sh = controller().colors().sh();
    controller().Do(RenameRegion{id, "pot"});
    QTRY_VERIFY_WITH_TIMEOUT(window_->IsModified(), kWaitMs);
    // Opened again: asks about unsaved changes.
    QSignalSpy restored(&window_->sessions(), &SessionStore::restored);
    window_->files().OpenSession(folder);
    QVERIFY(WaitDialog(*window_));
    QVERIFY(ClickRole(*window_, QMessageBox::DestructiveRole));
    QVERIFY(restored.count() > 0 || restored.wait(kWaitMs));
    QCOMPARE(controller().regions().regions.size(), size_t{1});
    QCOMPARE(controller().regions().regions.front().name, std::string("jug"));
    QCOMPARE(window_->current_region(), controller().regions().regions.front().id);
    QVERIFY((Position() - there).norm() < 1e-9);
    QTRY_VERIFY_WITH_TIMEOUT(*controller().colors().sh() == *sh, kWaitMs);
    QVERIFY(!window_->IsModified());
  }

  void AutosaveOutlivesACrash() {
    QVERIFY(AddTintedRegion() != 0);
    QTRY_VERIFY_WITH_TIMEOUT(window_->sessions().autosave() != nullptr, kWaitMs);
    const auto folder = window_->sessions().autosave()->folder();
    QTRY_VERIFY_WITH_TIMEOUT(std::filesystem::exists(folder / "session.json"), kWaitMs);
    QCOMPARE(ReadSessionInfo(folder).regions, size_t{1});
    // Undone, there is nothing left to lose.
    controller().Undo();
    QTRY_VERIFY_WITH_TIMEOUT(!std::filesystem::exists(folder / "session.json"), kWaitMs);
  }

  void ClosingWhileTheOptimizerRunsAsks() {
    QVERIFY(AddTintedRegion() != 0);
    RefitJob job;
    job.options.solver = Solver::kAdam;
    job.options.adam.iterations = 1000000;
    controller().colors().SetRefitJob(job);
    controller().colors().StartRefit();
    QTRY_VERIFY_WITH_TIMEOUT(controller().colors().optimizer().steps > 0, kWaitMs);
    window_->close();
    QVERIFY(WaitDialog(*window_));
    QVERIFY(window_->dialogs().box()->informativeText().contains("optimizer"));
    QVERIFY(ClickRole(*window_, QMessageBox::RejectRole));
    QVERIFY(window_->isVisible());
    QVERIFY(controller().colors().optimizer().Active());
    QTRY_VERIFY(!window_->dialogs().box());
    window_->close();
    QVERIFY(WaitDialog(*window_));
    QVERIFY(ClickRole(*window_, QMessageBox::DestructiveRole));
    QTRY_VERIFY_WITH_TIMEOUT(!window_->isVisible(), kWaitMs);
    QVERIFY(!controller().colors().optimizer().Active());
    window_.reset();  // joins every thread
  }

  void LoadingCanBeCancelled() {
    MainWindow other(theme_.get());
    other.show();
    QSignalSpy cancelled(&other.controller(), &SceneController::openCancelled);
    QSignalSpy opened(&other.controller(), &SceneController::opened);
    // A load that takes until it is cancelled; one that does not hear of it opens the scene.
    const auto give_up = std::make_shared<std::atomic<bool>>(false);
    other.controller().OpenWith("slow", [give_up, request = scene_->Request()](Monitor& monitor) {
      while (!monitor.IsCancelled() && !*give_up) QTest::qSleep(2);
      return EditSession::Open(request.workspace, request.splat, request.options, monitor);
    });
    auto* cancel = other.findChild<QToolButton*>("cancel");
    QTRY_VERIFY_WITH_TIMEOUT(cancel->isVisible(), kWaitMs);
    QTest::mouseClick(cancel, Qt::LeftButton);
    const bool ended =
        QTest::qWaitFor([&] { return cancelled.count() + opened.count() > 0; }, kWaitMs);
    *give_up = true;
    QVERIFY(ended);
    QCOMPARE(cancelled.count(), 1);
    QVERIFY(!other.controller().IsOpen() && !other.dialogs().box());
    QVERIFY(other.findChild<QPushButton*>("welcome_open")->isVisible());
    // And then it opens.
    other.files().OpenScene(scene_->Request());
    QTRY_COMPARE_WITH_TIMEOUT(opened.count(), 1, kWaitMs);
  }

  void WhatTwoRegionsShowIsWhatIsExported() {
    const auto masks = scene_->Masks(scene_->MostVisible().object);
    QVERIFY(canvas().GoTo(scene_->MostVisible().first));
    AffineColor dim;
    dim.gain *= 0.3F;
    dim.offset = {0.6F, 0, 0};
    const ColorEdit paint = ColorEdit::FromAffine(dim), green = ColorEdit::Tint({0.2F, 1, 0.2F});
    QSignalSpy added(&controller(), &SceneController::regionAdded);
    AddRegionFromMasks(controller(), "paint", masks, paint);
    AddRegionFromMasks(controller(), "green", masks, green);
    QTRY_COMPARE_WITH_TIMEOUT(added.count(), 2, kWaitMs);
    const RegionId first = controller().regions().regions[0].id;
    const RegionId second = controller().regions().regions[1].id;
    canvas().SetCloudShown(false);
    const auto facts = controller().facts();
    const auto out = scene_->folder() / "two.ply";
    // The canvas, once it shows the session's export; null if it does not.
    const auto shown = [&]() -> QImage {
      QSignalSpy written(&controller().results(), &SceneResults::written);
      controller().results().WriteSplat(out);
      if (!QTest::qWaitFor([&] { return written.count() == 1; }, kWaitMs)) return {};
      const GaussianModel exported = ReadSplat(out);
      const bool there = QTest::qWaitFor(
          [&] {
            return *controller().colors().sh() == exported.sh && canvas().IsSharp() &&
                   canvas().frame()->sh == controller().colors().sh();
          },
          kWaitMs);
      if (!there) return {};
      Renderer renderer(facts->backend, exported);
      const QImage expected = ToQImage(renderer.Render(canvas().navigation().Rendered()).rgb);
      const QImage image = canvas().frame()->image;
      return ChangedPixels(image, expected) == 0 ? image : QImage();
    };
    const QImage both = shown();
    QVERIFY(!both.isNull());
    controller().Do(MoveRegion{second, 0});
    const QImage swapped = shown();
    QVERIFY(!swapped.isNull() && ChangedPixels(swapped, both) > 100);
    controller().Do(SetVisible{first, false});
    const QImage hidden = shown();
    QVERIFY(!hidden.isNull() && ChangedPixels(hidden, swapped) > 100);
    controller().Do(SetEdit{second, green, 0.3F});
    const QImage weak = shown();
    QVERIFY(!weak.isNull() && ChangedPixels(weak, hidden) > 100);
    for (int i = 0; i < 3; ++i) controller().Undo();
    QVERIFY(shown() == both);
  }

  void ExportedPicturesCarryTheEdit() {
    const auto facts = controller().facts();
    const auto masks = scene_->Masks(scene_->MostVisible().object);
    const std::string view = scene_->MostVisible().first;
    QSignalSpy added(&controller(), &SceneController::regionAdded);
    AddRegionFromMasks(controller(), "jug", masks, ColorEdit::Tint({0.2F, 0.9F, 0.3F}));
    QTRY_COMPARE_WITH_TIMEOUT(added.count(), 1, kWaitMs);
    QTRY_VERIFY_WITH_TIMEOUT(!controller().colors().ShowsOriginal(), kWaitMs);
    QSignalSpy written(&controller().results(), &SceneResults::written);
    controller().results().WriteViews(scene_->folder() / "tinted", {view});
    const auto cameras = canvas().navigation().Turntable(4, 160, 120);
    controller().results().WriteFrames(scene_->folder() / "turn", cameras);
    QTRY_COMPARE_WITH_TIMEOUT(written.count(), 2, kWaitMs);
    Renderer renderer(facts->backend, *facts->original);
    const auto render = [&](const PosedCamera& camera) {
      return ToQImage(renderer.Render(camera).rgb);
    };
    const auto read = [](const std::filesystem::path& path) { return ToQImage(ReadImage8(path)); };
    std::vector<std::pair<QImage, PosedCamera>> pictures = {
        {read(scene_->folder() / "tinted" / (view + ".png")),
         facts->Posed(*facts->workspace->reconstruction.FindView(view))}};
    for (size_t i = 0; i < cameras.size(); ++i) {
      const std::string name = "000" + std::to_string(i) + ".png";
      pictures.emplace_back(read(scene_->folder() / "turn" / name), cameras[i]);
    }
    // In the region, and hardly elsewhere.
    const QImage plain = render(pictures[0].second);
    const Mask& mask = masks.at(view);
    int64_t inside = 0, outside = 0, all_inside = 0;
    for (int y = 0; y < mask.height; ++y) {
      for (int x = 0; x < mask.width; ++x) {
        const bool differs = Apart(plain.pixel(x, y), pictures[0].first.pixel(x, y)) > 12;
        all_inside += mask(x, y) != 0;
        (mask(x, y) ? inside : outside) += differs;
      }
    }
    QVERIFY2(inside > all_inside / 2 && outside < all_inside / 2,
             qPrintable(QString("%1 of %2, %3").arg(inside).arg(all_inside).arg(outside)));
    int64_t changed = 0;
    for (const auto& [picture, camera] : pictures) {
      renderer.SetSh(facts->original->sh);
      changed += ChangedPixels(picture, render(camera)) > 20;
      renderer.SetSh(*controller().colors().sh());
      QCOMPARE(ChangedPixels(picture, render(camera)), int64_t{0});
    }
    QVERIFY2(changed >= 3, qPrintable(QString::number(changed)));  // the turn may pass behind it
  }
};

}  // namespace retint

QTEST_MAIN(retint::EditingTest)
#include "editing_test.moc"
