// SPDX-License-Identifier: BSD-3-Clause
// The panels in the real window, with mouse and keys, checked by the session's state and by pixels;
// the list of regions and its picker are in regions_panel_test.cc, the optimizer in
// optimizer_panel_test.cc.
#include <cmath>
#include <future>

#include <QAction>
#include <QCheckBox>
#include <QDialog>
#include <QHeaderView>
#include <QLineEdit>
#include <QListWidget>
#include <QMenu>
#include <QTabBar>
#include <QTableWidget>
#include <QToolButton>
#include <QTreeWidget>

#include "tests/viewer/panels_fixture.h"
#include "viewer/panels/mask_view.h"
#include "viewer/panels/quality_panel.h"
#include "viewer/scene/session_store.h"

namespace retint {

class PanelsTest : public PanelsFixture {
  Q_OBJECT

 private Q_SLOTS:
  void initTestCase() { MakeTheme(); }
  void init() { QVERIFY(ShowScene()); }
  void cleanup() { Close(); }

  // --- Views -------------------------------------------------------------------------------------

  void ViewsHavePicturesAndBadgesAndAreJumpedTo() {
    auto* list = Find<QListWidget>("views_list");
    QCOMPARE(list->count(), 6);
    for (int row = 0; row < 6; ++row) {
      QTRY_VERIFY_WITH_TIMEOUT(!list->item(row)->data(Qt::UserRole + 1).value<QImage>().isNull(),
                               kWaitMs);
      QVERIFY(list->item(row)->data(Qt::UserRole + 2).toString().isEmpty());
    }
    QVERIFY(AddRegions());
    for (int row = 0; row < 6; ++row) {
      QTRY_VERIFY(list->item(row)->data(Qt::UserRole + 2).toString().contains("%"));
    }
    const QPoint third = list->visualItemRect(list->item(3)).center();
    QTest::mouseClick(list->viewport(), Qt::LeftButton, {}, third);
    QTest::mouseDClick(list->viewport(), Qt::LeftButton, {}, third);
    QVERIFY(window_->canvas().navigation().view());
    QCOMPARE(window_->canvas().navigation().view()->name, std::string("view3"));
    // The next command is for that view.
    QVERIFY(window_->canvas().hasFocus());
    QTest::keyClick(QApplication::focusWidget(), Qt::Key_Return);
    QVERIFY(window_->IsSelecting());
    QVERIFY(WaitPainting(*window_));
    QTest::keyClick(&window_->selection().canvas(), Qt::Key_Escape);
    QTRY_VERIFY(!window_->IsSelecting());
    list->setFocus();
    QTest::keyClick(list, Qt::Key_Home);
    QTest::keyClick(list, Qt::Key_Return);
    QCOMPARE(window_->canvas().navigation().view()->name, std::string("view0"));
    QVERIFY(!window_->IsSelecting());
  }

  void WorstViewsFirstOnDemand() {
    QVERIFY(AddRegions());
    auto* order = Find<QComboBox>("views_order");
    auto* list = Find<QListWidget>("views_list");
    QualityReport report;
    connect(&Controller().results(), &SceneResults::qualityReady, this,
            [&](RegionId, const QualityReport& ready) { report = ready; });
    order->setFocus();
    QTest::keyClick(order, Qt::Key_End);
    QTRY_VERIFY_WITH_TIMEOUT(report.views.size() == 6, kWaitMs);
    disconnect(&Controller(), nullptr, this, nullptr);
    QTRY_VERIFY(list->item(0)->data(Qt::UserRole + 2).toString().contains("dB"));
    for (int row = 0; row < 6; ++row) {
      QCOMPARE(list->item(row)->data(Qt::UserRole).toString().toStdString(),
               report.views[size_t(row)].name);
      if (row > 0) {
        QVERIFY(report.views[size_t(row)].psnr_inside >= report.views[size_t(row) - 1].psnr_inside);
      }
    }
    // Of another edit nothing is known; chosen again, it is measured again.
    QVERIFY(Find<QTableWidget>("report_table")->rowCount() > 0);
    QVERIFY(Find<QLabel>("psnr_inside")->text().contains("dB"));
    Controller().Do(SetEdit{Regions()[1].id, ColorEdit::Tint({0.1F, 0.9F, 0.3F})});
    QCOMPARE(order->currentText(), QString("By name"));
    for (int row = 0; row < 6; ++row) {
      QVERIFY(!list->item(row)->data(Qt::UserRole + 2).toString().contains("dB"));
    }
    QCOMPARE(Find<QTableWidget>("report_table")->rowCount(), 0);
    QVERIFY(!Find<QLabel>("psnr_inside")->text().contains("dB"));
    order->setFocus();
    QTest::keyClick(order, Qt::Key_End);
    QTRY_VERIFY_WITH_TIMEOUT(list->item(0)->data(Qt::UserRole + 2).toString().contains("dB"),
                             kWaitMs);
    QCOMPARE(order->currentText(), QString("Worst first (measures)"));
  }

  // The box names the order that is in force once the wanted one will not come.
  void AnOrderThatIsGivenUpLeavesTheOneBefore() {
    QVERIFY(AddRegions());
    auto* order = Find<QComboBox>("views_order");
    QSignalSpy cancelled(&Controller(), &SceneController::cancelled);
    std::promise<void> go_on;  // the worker waits for it, so that measuring waits too
    const std::shared_future<void> wait = go_on.get_future().share();
    Controller().Run({}, [wait](EditSession&, Monitor&) { wait.wait(); });
    order->setFocus();
    QTest::keyClick(order, Qt::Key_Down);
    QCOMPARE(order->currentText(), QString("Largest mask first"));
    QTest::keyClick(order, Qt::Key_End);
    QCOMPARE(order->currentText(), QString("Worst first (measures)"));
    Controller().Cancel();
    go_on.set_value();
    QTRY_VERIFY_WITH_TIMEOUT(cancelled.count() > 0, kWaitMs);
    QCOMPARE(order->currentText(), QString("Largest mask first"));
  }

  void BoardsWithoutPhotosShowRenders() {
    OpenRequest request = Controller().facts()->request;
    std::filesystem::remove_all(*folder_ / "ws" / "images");
    for (auto* dock : window_->findChildren<QDockWidget*>()) dock->close();  // they render too
    QSignalSpy opened(&Controller(), &SceneController::opened);
    window_->files().OpenScene(request);
    QTRY_COMPARE_WITH_TIMEOUT(opened.count(), 1, kWaitMs);
    Canvas& canvas = window_->canvas();
    canvas.navigation().Zoom(-14);
    canvas.CameraMoved();
    QVERIFY(WaitSharp(*window_));
    canvas.SetFrusta(true);
    const QImage lines = canvas.grab().toImage();
    constexpr int kOfLines = 100;  // pixels; five boards are more than that
    QTRY_VERIFY_WITH_TIMEOUT(ChangedPixels(lines, canvas.grab().toImage()) > kOfLines, kWaitMs);
  }

  // --- Quality -----------------------------------------------------------------------------------

  void TheSwitchesActOnTheCanvas() {
    QVERIFY(AddRegions());
    Show("quality");
    Canvas& canvas = window_->canvas();
    auto* slider = Find<QSlider>("split_slider");
    QVERIFY(!slider->isEnabled());
    Find<QCheckBox>("split_switch")->click();
    QVERIFY(canvas.split() && slider->isEnabled());
    slider->setFocus();
    QTest::keyClick(slider, Qt::Key_Home);
    QCOMPARE(canvas.split_at(), 0.0);
    QTest::keyClick(slider, Qt::Key_PageUp);
    QVERIFY(canvas.split_at() > 0);
    canvas.SetSplit(false);  // by its own key
    QVERIFY(!Find<QCheckBox>("split_switch")->isChecked());
    Find<QCheckBox>("depth_switch")->click();
    QVERIFY(canvas.depth());
    Find<QCheckBox>("depth_switch")->click();
    QVERIFY(!canvas.depth());
  }

  void TheMaskLiesOverThePicture() {
    QVERIFY(AddRegions());
    Show("quality");
    Canvas& canvas = window_->canvas();
    canvas.GoTo("view2");
    QTRY_VERIFY_WITH_TIMEOUT(canvas.IsSharp(), kWaitMs);
    const QImage plain = canvas.grab().toImage();
    auto* mask = Find<MaskView>("mask_view");
    Find<QCheckBox>("mask_switch")->click();
    QTRY_VERIFY_WITH_TIMEOUT(mask->IsReady(), kWaitMs);
    const QImage covered = canvas.grab().toImage();
    // "right" is the right part of the picture.
    const QRectF rect = canvas.ImageRect(canvas.navigation().Rendered());
    int left = 0, right = 0;
    for (int y = int(rect.top()) + 1; y < int(rect.bottom()) - 1; y += 2) {
      for (int x = int(rect.left()) + 1; x < int(rect.right()) - 1; x += 2) {
        if (plain.pixel(x, y) == covered.pixel(x, y)) continue;
        (x < rect.center().x() ? left : right) += 1;
      }
    }
    QVERIFY2(right > 500 && right > 3 * left, qPrintable(QString("%1 %2").arg(left).arg(right)));
    canvas.StepView(1);
    QVERIFY(!mask->IsReady());  // of another camera
    QTRY_VERIFY_WITH_TIMEOUT(mask->IsReady(), kWaitMs);
    // The key does the same, and takes the points away that would lie over it.
    QVERIFY(window_->action("show.mask")->isChecked());
    PressKey(*window_, Qt::Key_M, Qt::ShiftModifier);
    QVERIFY(!Find<QCheckBox>("mask_switch")->isChecked());
    QVERIFY(!window_->action("show.mask")->isChecked());
    canvas.SetCloudShown(true);
    PressKey(*window_, Qt::Key_M, Qt::ShiftModifier);
    QVERIFY(Find<QCheckBox>("mask_switch")->isChecked() && !canvas.cloud_shown());
    QTRY_VERIFY_WITH_TIMEOUT(mask->IsReady(), kWaitMs);
    // The points take the mask away in turn.
    PressKey(*window_, Qt::Key_M);
    QVERIFY(canvas.cloud_shown() && !Find<QCheckBox>("mask_switch")->isChecked());
    QVERIFY(!mask->isVisible() && !window_->action("show.mask")->isChecked());
  }

  void TheReportHasTheFigures() {
    QVERIFY(AddRegions());
    Show("quality");
    QualityReport report;
    connect(&Controller().results(), &SceneResults::qualityReady, this,
            [&](RegionId, const QualityReport& ready) { report = ready; });
    QTest::mouseClick(Find<QPushButton>("quality_measure"), Qt::LeftButton);
    QTRY_VERIFY_WITH_TIMEOUT(report.train.views == 6, kWaitMs);
    disconnect(&Controller(), nullptr, this, nullptr);
    auto* table = Find<QTableWidget>("report_table");
    QTRY_COMPARE(table->rowCount(), 6);
    QCOMPARE(table->item(0, 0)->text(), QString("6"));
    QCOMPARE(table->item(2, 0)->text(), QString::number(report.train.psnr_inside_after, 'f', 2));
    QCOMPARE(table->item(2, 1)->text(), QString("–"));  // nothing is held out
    auto* worst = Find<QTableWidget>("worst_table");
    QCOMPARE(worst->rowCount(), 5);
    QVERIFY(Find<QLabel>("psnr_inside")->text().contains("dB"));
    worst->setFocus();
    worst->setCurrentCell(1, 0);
    QTest::keyClick(worst, Qt::Key_Return);
    QCOMPARE(window_->canvas().navigation().view()->name, report.worst[1].name);
    // Of a region that is gone there are no figures.
    QTest::keyClick(List(), Qt::Key_Delete);
    QTRY_COMPARE(List()->topLevelItemCount(), 1);
    QCOMPARE(table->rowCount(), 0);
    QCOMPARE(worst->rowCount(), 0);
    QVERIFY(!Find<QLabel>("psnr_inside")->text().contains("dB"));
  }

  void RegistrationResidualsAreListed() {
    SelectionSource source = TinySource(scene_);
    PaintedReport& report = source.reports.front();
    report.view = "IMG_5881.jpg";
    report.registration.accepted = true;
    report.registration.points_used = 1240;
    report.registration.rms_before = 0.0921;
    report.registration.rms_after = 0.0757;
    report.registration.heldout_before = report.registration.heldout_after = 0.0812;
    PaintedReport few;  // sparse points, of which nothing can be said
    few.view = "IMG_5882.jpg";
    few.registration.points_used = 2;
    source.reports.push_back(few);
    bool done = false;
    Controller().Run(
        {},
        [&](EditSession& session, Monitor& monitor) {
          session.store().Add("painted", MasksOf(scene_), scene_.shares,
                              ColorEdit::Tint({0.5F, 1, 1}), monitor, source);
        },
        [&] { done = true; });
    QTRY_VERIFY_WITH_TIMEOUT(done, kWaitMs);
    QTRY_COMPARE(List()->topLevelItemCount(), 1);
    Select(0);
    Show("quality");
    auto* table = Find<QTableWidget>("registration_table");
    QCOMPARE(table->rowCount(), 4);  // of each view the name, and its numbers
    QCOMPARE(table->item(0, 0)->text(), QString("IMG_5881.jpg"));
    QCOMPARE(table->item(1, 0)->text(), QString("1240"));
    QCOMPARE(table->item(1, 1)->text(), QString("0.0921\n→ 0.0757"));
    QCOMPARE(table->item(1, 2)->text(), QString("0.0812"));  // it did not change
    QCOMPARE(table->item(1, 3)->text(), QString("yes"));
    QCOMPARE(table->item(3, 0)->text(), QString("2"));
    for (const int column : {1, 2}) QCOMPARE(table->item(3, column)->text(), QString("–"));
    // All of its row shows, whatever width the columns get.
    auto* dock = Find<QDockWidget>("quality");
    for (const int width : {330, 420, 340}) {
      window_->resizeDocks({dock}, {width}, Qt::Horizontal);
      QTest::qWait(50);
      Keep(*window_, qPrintable(QString("registration_%1").arg(width)));
      const QRect row = table->visualItemRect(table->item(1, 0));
      QVERIFY2(table->viewport()->rect().contains(row.left(), row.bottom()),
               qPrintable(QString("%1 of %2").arg(row.bottom()).arg(table->viewport()->height())));
      QVERIFY(table->rowHeight(1) >= table->verticalHeader()->sectionSizeHint(1));
      // No header is cut, and no value wraps.
      for (int column = 0; column < table->columnCount(); ++column) {
        const int given = table->columnWidth(column);
        const int header = table->horizontalHeader()->sectionSizeHint(column);
        const int value =
            table->itemDelegate()->sizeHint({}, table->model()->index(1, column)).width();
        QVERIFY2(
            given >= std::max(header, value),
            qPrintable(
                QString("column %1: %2 of %3, %4").arg(column).arg(given).arg(header).arg(value)));
      }
    }
  }

  // --- Scene -------------------------------------------------------------------------------------

  void TheSceneIsDescribed() {
    Show("scene");
    auto* facts = Find<QTreeWidget>("scene_facts");
    QMap<QString, QString> text;
    for (int row = 0; row < facts->topLevelItemCount(); ++row) {
      text[facts->topLevelItem(row)->text(0)] = facts->topLevelItem(row)->text(1);
    }
    QVERIFY(text["Splat"].endsWith("ws/splat.ply"));
    QCOMPARE(text["Gaussians"], QString("120"));
    QVERIFY(text["Camera"].startsWith("PINHOLE 64×48"));
    QVERIFY(text["SH degree"].startsWith("2 "));
    QCOMPARE(text["Views"], QString("6"));
  }

  void AMisplacedSplatAndMissingPhotosAreWarnedOf() {
    // Both in a workspace of their own: the splat elsewhere, two photos gone.
    std::filesystem::copy(*folder_ / "ws", *folder_ / "odd",
                          std::filesystem::copy_options::recursive);
    for (const size_t v : {size_t{1}, size_t{4}}) {
      std::filesystem::remove(*folder_ / "odd" / "images" / ViewName(v));
    }
    GaussianModel moved = scene_.model;
    for (float& mean : moved.means) mean += 100;
    WriteSplat(*folder_ / "odd" / "splat.ply", moved);
    OpenRequest request;
    request.workspace = *folder_ / "odd";
    request.splat = *folder_ / "odd" / "splat.ply";
    request.options.backend = "cpu";
    Show("scene");
    auto* list = Find<QListWidget>("scene_warnings");
    QTRY_VERIFY_WITH_TIMEOUT(window_->canvas().IsSharp(), kWaitMs);
    window_->files().OpenScene(request);
    const auto warns = [&](const QString& part) {
      for (int row = 0; row < list->count(); ++row) {
        if (list->item(row)->text().contains(part)) return true;
      }
      return false;
    };
    QTRY_VERIFY_WITH_TIMEOUT(warns("2 of 6 views are missing: view1, view4"), kWaitMs);
    QVERIFY(warns("another frame"));
    QVERIFY(list->isVisible());
  }

  // --- Files -------------------------------------------------------------------------------------

  void ASessionIsSavedAndRestored() {
    QVERIFY(AddRegions());
    QVERIFY(window_->IsModified());
    window_->canvas().GoTo("view4");
    QSignalSpy saved(&window_->sessions(), &SessionStore::saved);
    window_->sessions().Save(*folder_ / "edit.retint");
    QTRY_COMPARE_WITH_TIMEOUT(saved.count(), 1, kWaitMs);
    QTRY_VERIFY(!window_->IsModified());
    const FloatArray before = *Controller().colors().sh();
    Select(0);
    QTest::keyClick(List(), Qt::Key_Delete);
    QCOMPARE(SessionRegions().regions.size(), size_t(1));
    window_->action("edit.undo")->trigger();
    QCOMPARE(SessionRegions().regions.size(), size_t(2));

    MainWindow other(theme_.get());
    other.resize(1600, 1000);
    other.show();
    QSignalSpy restored(&other.sessions(), &SessionStore::restored);
    other.controller().colors().SetAutomaticRefit(false);
    other.files().OpenSession(*folder_ / "edit.retint");
    QTRY_COMPARE_WITH_TIMEOUT(restored.count(), 1, kWaitMs);
    QTRY_VERIFY(SameBits(*other.controller().colors().sh(), before));
    QCOMPARE(other.findChild<RowTree*>("region_list")->topLevelItemCount(), 2);
    QVERIFY(other.canvas().navigation().view());
    QCOMPARE(other.canvas().navigation().view()->name, std::string("view4"));
    QVERIFY(!other.IsModified());
  }

  void PicturesAreExportedThroughTheDialog() {
    QVERIFY(AddRegions());
    QSignalSpy written(&Controller().results(), &SceneResults::written);
    const auto ask = [&](int entry, const QString& folder) {
      Find<QMenu>("export")->actions()[entry]->trigger();
      auto* dialog = Find<QDialog>("export_dialog");
      auto* where = dialog->findChild<QLineEdit*>("export_folder");
      where->selectAll();
      QTest::keyClicks(where, folder);
      return dialog;
    };
    const QString out = QString::fromStdString((*folder_ / "out").string());
    QDialog* dialog = ask(2, QString::fromStdString(*folder_ / "ws" / "splat.ply") + "/out");
    QVERIFY(!dialog->findChild<QPushButton*>("export_write")->isEnabled());
    QVERIFY(dialog->findChild<QLabel*>("export_problem")->text().contains("not a folder"));
    dialog->reject();
    QTRY_VERIFY(!window_->findChild<QDialog*>("export_dialog"));
    dialog = ask(2, out);
    QTest::mouseClick(dialog->findChild<QPushButton*>("export_write"), Qt::LeftButton);
    QTRY_COMPARE_WITH_TIMEOUT(written.count(), 1, kWaitMs);
    QCOMPARE(ReadImage8(*folder_ / "out" / "view5.png").width, 64);
    QTRY_VERIFY(!window_->findChild<QDialog*>("export_dialog"));
    dialog = ask(4, out + "/turn");
    dialog->findChild<QComboBox*>("export_choice")->setCurrentIndex(1);
    QVERIFY(!dialog->findChild<QComboBox*>("export_size")->isEnabled());  // the views have theirs
    dialog->findChild<QDoubleSpinBox*>("export_seconds")->setValue(0.1);  // 3 frames
    QTest::mouseClick(dialog->findChild<QPushButton*>("export_write"), Qt::LeftButton);
    QTRY_COMPARE_WITH_TIMEOUT(written.count(), 2, kWaitMs);
    QVERIFY(std::filesystem::exists(*folder_ / "out" / "turn" / "0002.png"));
    QVERIFY(!std::filesystem::exists(*folder_ / "out" / "turn" / "0003.png"));
  }

  // --- All ---------------------------------------------------------------------------------------

  void EveryPanelIsReachedByKeyAndTabStaysInIt() {
    QVERIFY(AddRegions());
    const char* panels[] = {"regions", "optimizer", "quality", "views", "scene"};
    for (int i = 0; i < 5; ++i) {
      window_->canvas().setFocus();
      QTest::keyClick(window_.get(), Qt::Key(Qt::Key_1 + i), Qt::AltModifier);
      auto* dock = Find<QDockWidget>(panels[i]);
      QVERIFY2(dock->isAncestorOf(QApplication::focusWidget()), panels[i]);
      QWidget* first = QApplication::focusWidget();
      if (panels[i] == std::string_view("regions")) QCOMPARE(first, List());
      QTest::keyClick(first, Qt::Key_Tab);
      QVERIFY2(window_->panels_shown(), "Tab is the panel's while the focus is there");
      QVERIFY2(QApplication::focusWidget() && QApplication::focusWidget() != first, panels[i]);
      // The scene's list alone is the whole of its panel.
      const bool more = std::string_view(panels[i]) != "scene";
      QVERIFY2(!more || dock->isAncestorOf(QApplication::focusWidget()), panels[i]);
      QTest::keyClick(QApplication::focusWidget(), Qt::Key_Escape);
      QVERIFY2(window_->canvas().hasFocus(), panels[i]);
    }
  }

  // All around, forwards and back: also behind the tab of another panel there are controls.
  void TabGoesToNothingThatIsBehindATab() {
    QVERIFY(AddRegions());
    auto* list = Find<QTreeWidget>("region_list");
    for (const auto& [key, modifiers] :
         {std::pair(Qt::Key_Tab, Qt::NoModifier), std::pair(Qt::Key_Backtab, Qt::ShiftModifier)}) {
      list->setFocus();
      int controls = 0;
      do {
        QTest::keyClick(QApplication::focusWidget(), key, modifiers);
        const QWidget* at = QApplication::focusWidget();
        QVERIFY(at);
        for (const char* name :
             {"regions", "optimizer", "quality", "views", "scene", "selection"}) {
          auto* dock = Find<QDockWidget>(name);
          QVERIFY2(!dock->isAncestorOf(at) || !dock->visibleRegion().isEmpty(),
                   qPrintable(name + QString(": ") + at->objectName()));
        }
        QVERIFY(window_->panels_shown() && ++controls < 500);
      } while (QApplication::focusWidget() != list && !window_->canvas().hasFocus());
      QVERIFY(controls > 5);
    }
    // The tabs are worked by arrows.
    auto* scene = Find<QDockWidget>("scene");
    for (auto* tabs : window_->findChildren<QTabBar*>()) {
      if (tabs->tabText(0) != "Views") continue;
      tabs->setFocus();
      QVERIFY(scene->visibleRegion().isEmpty());
      QTest::keyClick(tabs, Qt::Key_Right);
      QTRY_VERIFY(!scene->visibleRegion().isEmpty());
      return;
    }
    QFAIL("there are no tabs");
  }

  void EveryControlHasATooltipAndIsReachable() {
    for (const char* name : {"regions", "optimizer", "quality", "views", "scene"}) {
      auto* dock = Find<QDockWidget>(name);
      int controls = 0;
      for (auto* widget : dock->widget()->findChildren<QWidget*>()) {
        const bool control =
            qobject_cast<QAbstractButton*>(widget) || qobject_cast<QComboBox*>(widget) ||
            qobject_cast<QAbstractSlider*>(widget) || widget->inherits("QAbstractSpinBox");
        // Parts of other widgets are reached through these.
        if (!control || widget->objectName().startsWith("qt_") || widget->inherits("QScrollBar") ||
            widget->inherits("QTableCornerButton")) {
          continue;
        }
        ++controls;
        const QByteArray what =
            (name + QString(": ") + widget->metaObject()->className() + " " + widget->objectName())
                .toUtf8();
        QVERIFY2(!widget->toolTip().isEmpty() || !widget->accessibleName().isEmpty(), what);
        QVERIFY2(widget->focusPolicy() & Qt::TabFocus, what);
      }
      QVERIFY2(controls > 0 || QString(name) == "scene", name);
    }
  }

  void NothingIsCutOff() {
    QVERIFY(AddRegions());
    const std::pair<ThemeChoice, QSize> cases[] = {{ThemeChoice::kLight, {1600, 1000}},
                                                   {ThemeChoice::kDark, {1024, 700}},
                                                   {ThemeChoice::kDark, {1900, 1100}}};
    for (const auto& [theme, size] : cases) {
      theme_->Choose(theme);
      window_->resize(size);
      QTRY_COMPARE(window_->size(), size);
      for (const char* name : {"regions", "optimizer", "quality", "views", "scene"}) {
        Show(name);
        auto* dock = Find<QDockWidget>(name);
        for (auto* widget : dock->widget()->findChildren<QWidget*>()) {
          if (!widget->isVisible() || widget->objectName().startsWith("qt_")) continue;
          const auto* label = qobject_cast<QLabel*>(widget);
          const bool text = (label && !label->wordWrap() &&
                             label->sizePolicy().horizontalPolicy() != QSizePolicy::Ignored) ||
                            qobject_cast<QAbstractButton*>(widget);
          if (!text || widget->inherits("QTableCornerButton")) continue;
          const QString what =
              QString("%1: %2 '%3' has %4x%5 of %6x%7 pixels")
                  .arg(name, widget->metaObject()->className(), widget->property("text").toString())
                  .arg(widget->width())
                  .arg(widget->height())
                  .arg(widget->minimumSizeHint().width())
                  .arg(widget->minimumSizeHint().height());
          QVERIFY2(widget->width() >= widget->minimumSizeHint().width() &&
                       widget->height() >= widget->minimumSizeHint().height(),
                   qPrintable(what));
        }
      }
      QCOMPARE(window_->size(), size);
      const QByteArray name = QByteArray::number(size.width());
      for (const char* panel : {"optimizer", "views"}) Show(panel);
      Keep(*window_, ("optimizer" + name).constData());
      for (const char* panel : {"quality", "scene"}) Show(panel);
      Keep(*window_, ("quality" + name).constData());
    }
    theme_->Choose(ThemeChoice::kLight);
  }
};

}  // namespace retint

QTEST_MAIN(retint::PanelsTest)
#include "panels_test.moc"
