// SPDX-License-Identifier: BSD-3-Clause
// Two hundred random edits, undos and view changes in the real window, the same ones every time.
// Every undo leads back to the state before to the bit, and memory to where it was.
#include <malloc.h>
#include <unistd.h>

#include <cstdio>
#include <random>

#include "tests/viewer/viewer_scene.h"
#include "viewer/selection/selection_mode.h"

namespace retint {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kMeasured = false;  // the sanitizer keeps freed memory
#else
constexpr bool kMeasured = true;
#endif

class SoakTest : public ViewerTest {
  Q_OBJECT

 private:
  static constexpr int kEdits = 200;
  static constexpr size_t kMostRegions = 4;

  std::mt19937 random_{20250607};

  const std::vector<Region>& Regions() { return controller().regions().regions; }
  int Below(int count) { return int(random_() % uint32_t(count)); }
  float Unit() { return float(random_() % 1000) / 1000; }
  RegionId Any() { return Regions()[size_t(Below(int(Regions().size())))].id; }

  // Memory of this process, after the allocator has returned free memory.
  static double ResidentMb() {
    malloc_trim(0);
    long total = 0, resident = 0;
    std::FILE* file = std::fopen("/proc/self/statm", "r");
    if (file && std::fscanf(file, "%ld %ld", &total, &resident) != 2) resident = 0;
    if (file) std::fclose(file);
    return double(resident) * double(sysconf(_SC_PAGESIZE)) / (1 << 20);
  }

  static bool Same(const RegionSet& a, const RegionSet& b) {
    return std::equal(a.regions.begin(), a.regions.end(), b.regions.begin(), b.regions.end(),
                      [](const Region& x, const Region& y) {
                        return x.id == y.id && x.name == y.name && x.selection == y.selection &&
                               x.edit == y.edit && x.strength == y.strength &&
                               x.visible == y.visible;
                      });
  }

  bool PaintARegion() {
    QTest::keyClick(&canvas(), Qt::Key_B);
    SelectionMode& mode = window_->selection();
    const auto paints = [&] { return mode.state() == SelectionMode::State::kPainting; };
    // A question about strokes on another view, which were left.
    if (!QTest::qWaitFor([&] { return paints() || window_->dialogs().box(); }, kWaitMs))
      return false;
    if (window_->dialogs().box() && !ClickRole(*window_, QMessageBox::DestructiveRole))
      return false;
    if (!QTest::qWaitFor(paints, kWaitMs)) return false;
    SelectionCanvas& paper = mode.canvas();
    for (int i = 0; i < 3; ++i) {
      const QPoint from = paper.rect().center() + QPoint(Below(120) - 60, Below(80) - 40);
      DragAlong(&paper, {from, from + QPoint(Below(60), Below(60))}, Qt::LeftButton,
                Below(4) == 0 ? Qt::ControlModifier : Qt::NoModifier);
      if (Below(3) == 0) QTest::keyClick(&paper, Qt::Key_Z, Qt::ControlModifier);
    }
    const bool accept = Below(2) == 0 && Regions().size() < kMostRegions;
    QTest::keyClick(&paper, accept ? Qt::Key_Return : Qt::Key_Escape);
    // If paint cannot become a selection, a message says so, and Esc leaves.
    (void)QTest::qWaitFor([&] { return mode.state() != SelectionMode::State::kComputing; },
                          kWaitMs);
    if (window_->IsSelecting()) QTest::keyClick(&paper, Qt::Key_Escape);
    return QTest::qWaitFor([&] { return !window_->IsSelecting(); }, kWaitMs);
  }

  // One thing that a user may do.
  bool Act() {
    const auto& views = controller().facts()->views;
    const int what = Below(20);
    if (what == 0 || (Regions().empty() && what < 10)) {
      if (Regions().size() >= kMostRegions) return true;
      const auto& objects = scene_->scene().still_life;
      AddRegionFromMasks(controller(), "region",
                         scene_->Masks(objects[size_t(Below(int(objects.size())))]),
                         ColorEdit::Tint({Unit(), Unit(), Unit()}));
      return Settle(controller());
    }
    if (what >= 10 || Regions().empty()) {
      switch (what) {
        case 10:
        case 11:
          return canvas().GoTo(views[size_t(Below(int(views.size())))]->name);
        case 12:
          DragAlong(&canvas(), {canvas().rect().center(),
                                canvas().rect().center() + QPoint(Below(80) - 40, Below(40) - 20)});
          return true;
        case 13:
          QTest::keyClick(&canvas(), Below(2) ? Qt::Key_N : Qt::Key_X);
          return true;
        case 14:
          QTest::keyClick(&canvas(), Below(2) ? Qt::Key_C : Qt::Key_M);
          return true;
        case 15:
          return PaintARegion();
        case 16:
          controller().colors().StartRefit();
          if (Below(2)) QTest::qWait(Below(60));
          controller().colors().CancelRefit();
          return true;
        case 17:
        case 18:
          QTest::keyClick(&canvas(), Qt::Key_Z, Qt::ControlModifier);
          return true;
        default:
          QTest::keyClick(&canvas(), Qt::Key_Y, Qt::ControlModifier);
          return true;
      }
    }
    const RegionId id = Any();
    switch (what) {
      case 1:
      case 2:
      case 3:
        controller().Do(SetEdit{id, ColorEdit::Tint({Unit(), Unit(), Unit()}), Unit()});
        break;
      case 4:
        controller().Do(RenameRegion{id, "name " + std::to_string(Below(100))});
        break;
      case 5:
        controller().Do(SetVisible{id, Below(2) == 0});
        break;
      case 6:
        controller().Do(MoveRegion{id, size_t(Below(int(Regions().size())))});
        break;
      case 7:
        if (Regions().size() < kMostRegions) controller().Duplicate(id);
        break;
      case 8:
        controller().Do(RemoveRegion{id});
        break;
      default:
        controller().SetSolo(controller().solo() ? 0 : id);
    }
    return true;
  }

  // `count` actions; after each, window and session must agree. Then undoes
  // everything.
  bool Round(int count) {
    for (int i = 0; i < count; ++i) {
      const RegionSet before = controller().regions();
      const bool could = controller().history().can_undo;
      if (!Act() || !Settle(controller())) return false;
      // A step back and forth now and then: to the bit.
      if (Below(5) == 0 && controller().history().can_undo && could) {
        const RegionSet now = controller().regions();
        controller().Undo();
        controller().Redo();
        if (!Settle(controller()) || !Same(controller().regions(), now)) return false;
      }
      if (Below(8) == 0 && !WaitSharp(*window_)) return false;
    }
    controller().colors().CancelRefit();
    controller().SetSolo(0);
    while (controller().history().can_undo) {
      controller().Undo();
      if (!Settle(controller())) return false;
    }
    return Regions().empty() &&
           QTest::qWaitFor(
               [&] { return controller().colors().ShowsOriginal() && canvas().IsSharp(); },
               kWaitMs);
  }

  bool Reopen() {
    controller().Close();
    QSignalSpy opened(&controller(), &SceneController::opened);
    window_->files().OpenScene(scene_->Request());
    if (!QTest::qWaitFor([&] { return opened.count() == 1; }, kWaitMs)) return false;
    if (canvas().split()) canvas().SetSplit(false);
    if (canvas().depth()) canvas().SetDepth(false);
    return WaitSharp(*window_);
  }

 private Q_SLOTS:
  void initTestCase() {
    MakeScene(96, 72, 5);
    QVERIFY(ShowScene());
    SelectOptions select;
    select.depth_method = "gaussian";
    window_->selection().SetSelectOptions(select);
  }
  void cleanupTestCase() {
    window_.reset();
    scene_.reset();
  }

  void RandomEditsLeaveNothingBehind() {
    // Caches, threads and fonts, which are made once and kept, are made here.
    QVERIFY(Round(120));
    QVERIFY(Reopen());
    const double before = ResidentMb();
    QVERIFY(Round(kEdits));
    QVERIFY(!window_->dialogs().box());
    QVERIFY(!window_->IsModified());
    const double undone = ResidentMb();
    QVERIFY(Reopen());
    const double after = ResidentMb();
    const QString figures =
        QString("%1 MB, all undone %2 MB, reopened %3 MB").arg(before).arg(undone).arg(after);
    qInfo("%s", qPrintable(figures));
    if (!kMeasured) return;
    QVERIFY2(after < 1.1 * before, qPrintable(figures));
    // Redo keeps memory, within the history's budget.
    QVERIFY2(undone < 1.5 * before, qPrintable(figures));
  }
};

}  // namespace retint

QTEST_MAIN(retint::SoakTest)
#include "soak_test.moc"
