// SPDX-License-Identifier: BSD-3-Clause
// A window of 1024 x 700 pixels, the smallest supported one. In all panels, edit modes and
// selection mode, no label, button or box is cut, and nothing scrolls sideways.
// RETINT_WINDOW=WIDTHxHEIGHT sets another size, to look at (RETINT_SCREENSHOTS).
#include <optional>

#include <QAbstractScrollArea>
#include <QAbstractSpinBox>
#include <QAction>
#include <QCheckBox>
#include <QComboBox>
#include <QDockWidget>
#include <QLabel>
#include <QScrollArea>
#include <QScrollBar>
#include <QStackedLayout>
#include <QTableWidget>
#include <QToolButton>
#include <QTreeWidget>

#include "tests/viewer/viewer_scene.h"
#include "viewer/panels/edit_panel.h"
#include "viewer/selection/selection_bar.h"
#include "viewer/selection/selection_mode.h"

namespace retint {

class SmallWindowTest : public ViewerTest {
  Q_OBJECT

 private:
  static QString Describe(const QWidget* widget) {
    QString text;
    if (const auto* label = qobject_cast<const QLabel*>(widget)) text = label->text();
    if (const auto* button = qobject_cast<const QAbstractButton*>(widget)) text = button->text();
    return QStringLiteral("%1 '%2' \"%3\" has %4 x %5")
        .arg(widget->metaObject()->className(), widget->objectName(), text)
        .arg(widget->width())
        .arg(widget->height());
  }

  // The size that the widget needs for all of its text; empty if it decides itself.
  static QSize Needed(QWidget* widget) {
    if (const auto* label = qobject_cast<QLabel*>(widget)) {
      if (label->text().isEmpty()) return {};
      if (label->wordWrap()) return {0, label->heightForWidth(label->width())};
      // One that ignores its width holds a name of the user's, which may be of any length.
      if (label->sizePolicy().horizontalPolicy() == QSizePolicy::Ignored) return {};
      return label->sizeHint();
    }
    if (widget->inherits("QDockWidgetTitleButton")) return {};  // Qt's own
    if (qobject_cast<QAbstractButton*>(widget)) return widget->minimumSizeHint();
    if (qobject_cast<QComboBox*>(widget)) return widget->minimumSizeHint();
    if (qobject_cast<QAbstractSpinBox*>(widget)) return {0, widget->sizeHint().height()};
    return {};
  }

  // Whether the widget exceeds the window or its parent sideways; downward there is scrolling.
  static bool LiesBeside(const QWidget* widget) {
    const auto* window = widget->window();
    for (const QWidget* in = widget->parentWidget(); in; in = in->parentWidget()) {
      const int left = widget->mapTo(in, QPoint(0, 0)).x();
      if (left < 0 || left + widget->width() > in->width()) return true;
      if (in == window) break;
    }
    return false;
  }

  // The cut texts of visible widgets below `of`, one per line.
  static QStringList Cut(QWidget* of) {
    QStringList cut;
    for (QWidget* widget : of->findChildren<QWidget*>()) {
      if (!widget->isVisible()) continue;
      if (const auto* area = qobject_cast<QAbstractScrollArea*>(widget)) {
        if (area->horizontalScrollBar()->maximum() > area->horizontalScrollBar()->minimum()) {
          cut << QStringLiteral("%1 scrolls sideways").arg(Describe(widget));
        }
        continue;
      }
      const QSize needed = Needed(widget);
      if (!needed.isValid()) continue;
      constexpr int kFrame = 1;  // pixel of a button's own frame that rows of a grid may share
      if (widget->width() < needed.width() || widget->height() < needed.height() - kFrame) {
        cut << QStringLiteral("%1, needs %2 x %3")
                   .arg(Describe(widget))
                   .arg(needed.width())
                   .arg(needed.height());
      } else if (LiesBeside(widget)) {
        cut << QStringLiteral("%1 and lies beside what holds it").arg(Describe(widget));
      }
    }
    return cut;
  }

  // Empty: nothing is cut. The layouts have settled.
  QString CutNow(const QString& where, QWidget* of) {
    QTest::qWait(30);
    Keep(*window_, qPrintable("small-" + where));
    const QStringList cut = Cut(of);
    return cut.isEmpty() ? QString() : where + ": " + cut.join("; ");
  }

  // At its size before its panels are laid out, as on a screen that small.
  void Open(const QSize& size) {
    window_ = std::make_unique<MainWindow>(theme_.get());
    window_->resize(size);
    window_->show();
    OpenDrawers(*window_);
    window_->controller().colors().SetAutomaticRefit(false);
    window_->files().OpenScene(scene_->Request());
    QVERIFY(QTest::qWaitFor([&] { return canvas().IsSharp(); }, kWaitMs));
    QCOMPARE(window_->size(), size);
  }

 private Q_SLOTS:
  void initTestCase() { MakeScene(); }
  void cleanupTestCase() { scene_.reset(); }
  void init() {
    const QStringList sides = qEnvironmentVariable("RETINT_WINDOW", "1024x700").split('x');
    Open({sides.value(0).toInt(), sides.value(1).toInt()});
  }
  void cleanup() { window_.reset(); }

  void TheStartPageIsWhole() {
    const QString path = "/home/" + QString("pots & pans/").repeated(60);
    QSettings().setValue("recent", QStringList{path + "work.retint", "/home/work.retint"});
    controller().Close();
    auto* title = window_->findChild<QLabel*>("welcome_title");
    QTRY_VERIFY_WITH_TIMEOUT(title->isVisible(), kWaitMs);
    const QString cut = CutNow("start", window_->centralWidget());
    QVERIFY2(cut.isEmpty(), qPrintable(cut));
    QSettings().remove("recent");
  }

  // Also where they are as narrow as they can be, as a window makes them that begins on a screen of
  // 800 pixels.
  void PanelsAreWhole() {
    QVERIFY(AddTintedRegion() != 0);
    const auto docks = window_->findChildren<QDockWidget*>();
    QStringList cut;
    for (const char* size : {"", "narrow-"}) {
      for (auto* dock : docks) {
        window_->SetSideShown(window_->dockWidgetArea(dock), true);
        dock->raise();
        const QString one = CutNow(size + dock->objectName(), dock);
        if (!one.isEmpty()) cut << one;
      }
      window_->resizeDocks(docks, QList<int>(docks.size(), 1), Qt::Horizontal);
    }
    QVERIFY2(cut.isEmpty(), qPrintable(cut.join("\n")));
  }

  void ModesOfAnEditAreWhole() {
    QVERIFY(AddTintedRegion() != 0);
    auto* dock = window_->findChild<QDockWidget*>("regions");
    window_->SetSideShown(Qt::RightDockWidgetArea, true);
    dock->raise();
    QStringList cut;
    std::optional<QPoint> place;  // of the steps
    for (const char* mode : {"recolor", "tint", "adjust", "curves", "levels", "grade", "lut",
                             "gradient", "palette", "picture"}) {
      auto* action = dock->findChild<QAction*>(QStringLiteral("mode_") + mode);
      QVERIFY(action && action->isVisible());
      action->trigger();
      if (auto* ranged = dock->findChild<QCheckBox*>("adjust_ranged"); ranged->isVisible()) {
        ranged->setChecked(true);
      }
      const QString one = CutNow(mode, dock);
      if (!one.isEmpty()) cut << one;
      // Neither a gap about the page nor a list that moves.
      auto* page = dock->findChild<EditPanel*>()->layout()->findChild<QStackedLayout*>();
      const QWidget* shown = page->currentWidget();
      const int needed = shown->hasHeightForWidth() ? shown->heightForWidth(shown->width())
                                                    : shown->sizeHint().height();
      QCOMPARE(shown->height(), needed);
      const QPoint now = dock->findChild<QWidget*>("operation_list")->mapTo(dock, QPoint());
      QCOMPARE(place.value_or(now), now);
      place = now;
    }
    QVERIFY2(cut.isEmpty(), qPrintable(cut.join("\n")));
  }

  void LongNamesOfRegionsAreCutShort() {
    const RegionId region = AddTintedRegion();
    QVERIFY(region != 0);
    controller().Do(RenameRegion{region, QString(200, 'w').toStdString()});
    RefitJob job;
    job.options.solver = Solver::kAdam;
    job.options.adam.iterations = 1000000;
    controller().colors().SetRefitJob(job);
    controller().colors().StartRefit();
    auto* state = window_->findChild<QLabel*>("optimizer_state");
    QTRY_VERIFY_WITH_TIMEOUT(state->text().contains("wwww"), kWaitMs);
    for (const char* panel : {"optimizer_panel", "regions_panel"}) {
      QVERIFY(window_->findChild<QWidget*>(panel)->minimumSizeHint().width() < 330);
    }
    controller().colors().CancelRefit();
    controller().results().Evaluate(region);
    auto* quality = window_->findChild<QWidget*>("quality_panel");
    auto* report = quality->findChild<QTableWidget*>("report_table");
    QTRY_VERIFY_WITH_TIMEOUT(report->rowCount() > 0, kWaitMs);
    QVERIFY(quality->minimumSizeHint().width() < 330);
  }

  void SelectionModeIsWhole() {
    window_->EnterSelection();
    QVERIFY(WaitPainting(*window_));
    QStringList cut;
    for (const int key : {Qt::Key_B, Qt::Key_W, Qt::Key_I, Qt::Key_S, Qt::Key_F, Qt::Key_K}) {
      QTest::keyClick(&window_->selection().canvas(), Qt::Key(key));
      const QString one = CutNow(QStringLiteral("tool-%1").arg(QChar(key)), &window_->selection());
      if (!one.isEmpty()) cut << one;
    }
    QVERIFY2(cut.isEmpty(), qPrintable(cut.join("\n")));
  }

  // Also beside a panel.
  void TheToolsAreOneRow() {
    for (const bool beside : {false, true}) {
      window_->SetSideShown(Qt::RightDockWidgetArea, beside);
      window_->EnterSelection();
      QVERIFY(WaitPainting(*window_));
      QTest::qWait(30);
      const QRect paper = window_->selection().canvas().geometry();
      const QSize room = window_->selection().size();
      // A row of buttons with its margins.
      constexpr int kRow = 44;
      QVERIFY2(room.height() - paper.height() <= 2 * kRow,
               qPrintable(QString::number(room.height() - paper.height())));
      auto* more = window_->findChild<QToolButton*>("toolOptions");
      int lists = 0;
      for (auto* button : window_->selection().findChildren<QToolButton*>()) {
        if (!button->objectName().startsWith("tool") || !button->isCheckable()) continue;
        QTest::mouseClick(button, Qt::LeftButton);
        QTest::qWait(10);
        QCOMPARE(window_->selection().canvas().geometry(), paper);
        lists += more->isVisible();
        for (auto* option : window_->findChild<ToolStrip*>()->findChildren<SliderBox*>()) {
          if (!option->isVisible() ||
              option->parentWidget() == more->parentWidget()->findChild<QFrame*>("toolOptionsList"))
            continue;
          QVERIFY(option->geometry().right() < option->parentWidget()->width());
        }
      }
      QVERIFY(lists > 0);
      // Tools without room are in the list.
      QTest::keyClick(&window_->selection().canvas(), Qt::Key_W);
      QVERIFY(more->isVisible());
      QTest::mouseClick(more, Qt::LeftButton);
      auto* list = window_->findChild<QFrame*>("toolOptionsList");
      QTRY_VERIFY(list->isVisible());
      Keep(*list, "tool-options");
      Keep(*window_, beside ? "tools-beside" : "tools");
      QVERIFY(!list->findChildren<SliderBox*>().isEmpty());
      list->hide();
      for (int i = 0; i < 2; ++i) {  // gives up the tool, then leaves
        QTest::keyClick(&window_->selection().canvas(), Qt::Key_Escape);
      }
      QTRY_VERIFY(!window_->IsSelecting());
    }
  }

  // In a window of 1600 pixels, whatever was done with the tool so far.
  void HintsOfToolsAreWhole() {
    window_.reset();
    Open({1600, 1000});
    window_->EnterSelection();
    QVERIFY(WaitPainting(*window_));
    SelectionCanvas& paper = window_->selection().canvas();
    auto* hint = window_->findChild<QLabel*>("selectionHint");
    auto* strip = window_->findChild<ActionStrip*>();
    strip->SetTargets({"New region"}, 0, "IMG_5881.jpg");
    QStringList cut;
    const auto look = [&](const QString& when) {
      QTest::qWait(20);
      Keep(*window_, qPrintable("hint-" + when));
      if (hint->text().contains("…")) cut << when + ": " + hint->text();
    };
    constexpr Qt::Key kKeys[] = {Qt::Key_B, Qt::Key_E, Qt::Key_R, Qt::Key_L, Qt::Key_P, Qt::Key_S,
                                 Qt::Key_W, Qt::Key_I, Qt::Key_H, Qt::Key_X, Qt::Key_K, Qt::Key_F};
    for (const Qt::Key key : kKeys) {
      QTest::keyClick(&paper, key);
      look(QStringLiteral("%1").arg(QChar(key)));
    }
    const QPoint middle = paper.rect().center();
    QTest::keyClick(&paper, Qt::Key_I);
    for (const QPoint& by : {QPoint(0, 0), QPoint(40, 0), QPoint(40, 40)}) {
      QTest::mouseClick(&paper, Qt::LeftButton, {}, middle + by);
      look(QStringLiteral("corner-%1-%2").arg(by.x()).arg(by.y()));
    }
    QTest::keyClick(&paper, Qt::Key_S);
    for (const auto& [by, modifiers] :
         {std::pair(QPoint(0, 0), Qt::KeyboardModifiers()),
          std::pair(QPoint(90, 90), Qt::KeyboardModifiers(Qt::ControlModifier))}) {
      DragAlong(&paper, {middle + by, middle + by + QPoint(30, 10)}, Qt::LeftButton, modifiers);
      QTRY_VERIFY_WITH_TIMEOUT(!paper.IsFinding(), kWaitMs);
      look(QStringLiteral("scribble-%1").arg(by.x()));
    }
    QVERIFY2(cut.isEmpty(), qPrintable(cut.join("\n")));
    QCOMPARE(hint->toolTip(), paper.Hint());
  }

  // Whatever the panels show, and whatever the tool has for options.
  void ThePictureStaysWhereItIs() {
    const RegionId region = AddTintedRegion();
    QVERIFY(region != 0);
    const auto place = [](const QWidget& of) {
      QTest::qWait(30);
      return QRect(of.mapTo(of.window(), QPoint()), of.size());
    };
    window_->SetSideShown(Qt::RightDockWidgetArea, true);
    const QRect before = place(canvas());
    // Measured values do not make the panel wider.
    auto* optimizer = window_->findChild<QWidget*>("optimizer_panel");
    const int needed = optimizer->minimumSizeHint().width();
    QualityReport report;
    report.train.views = 100;
    report.train.psnr_inside_before = report.train.psnr_inside_after = 88.88;
    Q_EMIT controller().results().qualityReady(region, report);
    QVERIFY(window_->findChild<QLabel*>("psnr_inside")->text().contains("88.88"));
    QCOMPARE(place(canvas()), before);
    QCOMPARE(optimizer->minimumSizeHint().width(), needed);
    for (const char* name : {"selection", "optimizer"}) {
      auto* dock = window_->findChild<QDockWidget*>(name);
      dock->raise();
      for (auto* box : dock->findChildren<QComboBox*>()) {
        for (int i = 0; i < box->count(); ++i) {
          box->setCurrentIndex(i);
          Q_EMIT box->activated(i);
          QCOMPARE(place(canvas()), before);
        }
      }
    }
    auto* dock = window_->findChild<QDockWidget*>("regions");
    dock->raise();
    for (auto* action : dock->findChildren<QAction*>()) {
      if (!action->objectName().startsWith("mode_") || !action->isVisible()) continue;
      action->trigger();
      QCOMPARE(place(canvas()), before);
    }
    window_->EnterSelection();
    QVERIFY(WaitPainting(*window_));
    const SelectionCanvas& paper = window_->selection().canvas();
    const QRect paints = place(paper);
    for (auto* button : window_->selection().findChildren<QToolButton*>()) {
      if (!button->objectName().startsWith("tool")) continue;
      button->click();
      QCOMPARE(place(paper), paints);
    }
  }

  // By area, with the panels that a first window shows.
  void ThePictureHasTheMostOfTheWindow() {
    constexpr double kLeast = 0.65;
    for (const QSize& size : {QSize(1024, 700), QSize(1440, 900), QSize(1600, 1000)}) {
      window_.reset();
      Open(size);
      QTest::qWait(30);
      Keep(*window_, qPrintable(QStringLiteral("room-%1").arg(size.width())));
      const double share =
          double(canvas().width()) * canvas().height() / (double(size.width()) * size.height());
      QVERIFY2(share >= kLeast, qPrintable(QStringLiteral("%1: %2").arg(size.width()).arg(share)));
      QCOMPARE(window_->IsSideShown(Qt::RightDockWidgetArea), size.width() > 1024);
    }
  }

  // A click on the strip at a side, a panel's key and Tab. Beside the panels of one side the
  // picture keeps most of the smallest window's width.
  void PanelsFoldToStrips() {
    auto* left = window_->findChild<QAbstractButton*>("left_strip");
    auto* right = window_->findChild<QAbstractButton*>("right_strip");
    auto* views = window_->findChild<QDockWidget*>("views");
    auto* regions = window_->findChild<QDockWidget*>("regions");
    QVERIFY(!views->isVisible() && !regions->isVisible());
    QTest::mouseClick(right, Qt::LeftButton);
    QTRY_VERIFY(regions->isVisible());
    QVERIFY(!views->isVisible());
    QTest::qWait(30);
    Keep(*window_, "strip-right");
    QVERIFY2(canvas().width() >= 0.65 * window_->width(),
             qPrintable(QString::number(canvas().width())));
    // There is no room for both.
    QTest::mouseClick(left, Qt::LeftButton);
    QTRY_VERIFY(views->isVisible());
    QVERIFY(!regions->isVisible());
    PressKey(*window_, Qt::Key_Tab);
    QTRY_VERIFY(!views->isVisible());
    PressKey(*window_, Qt::Key_Tab);
    QTRY_VERIFY(views->isVisible());
    QVERIFY(!regions->isVisible());
    PressKey(*window_, Qt::Key_2, Qt::AltModifier);
    QTRY_VERIFY(window_->findChild<QDockWidget*>("optimizer")->isVisible());
    QVERIFY(!views->isVisible());
    QTest::mouseClick(right, Qt::LeftButton);
    QTRY_VERIFY(!window_->IsSideShown(Qt::RightDockWidgetArea));
    QCOMPARE(window_->width(), 1024);
  }

  // A full HD screen of twice the pixels has room for 960 x 540.
  void TheFirstWindowFitsAFineScreen() {
    constexpr QSize kRoom(960, 540);
    const QSize least = window_->minimumSizeHint(), first = MainWindow::FirstSize(kRoom);
    QVERIFY2(least.width() <= first.width() && least.height() <= first.height(),
             qPrintable(QStringLiteral("%1 x %2").arg(least.width()).arg(least.height())));
    window_.reset();
    Open(first);  // and stays as large, while the panels come and fold
    window_->EnterSelection();
    QVERIFY(WaitPainting(*window_));
    const QString cut = CutNow("fine", &window_->selection());
    QVERIFY2(cut.isEmpty(), qPrintable(cut));
    QCOMPARE(window_->size(), first);
  }
};

}  // namespace retint

QTEST_MAIN(retint::SmallWindowTest)
#include "small_window_test.moc"
