// SPDX-License-Identifier: BSD-3-Clause
// A Qt plugin that process_test.cc loads into the real retint-viewer, which itself knows nothing of
// tests: it acts with mouse and keys on the widgets that it finds and writes what it saw to a file.
//   RETINT_DRIVE   look | paint | recover
//   RETINT_SAW     the file
#include <cstdlib>
#include <functional>

#include <QAbstractButton>
#include <QAction>
#include <QApplication>
#include <QFile>
#include <QGenericPlugin>
#include <QMainWindow>
#include <QMessageBox>
#include <QTest>
#include <QTimer>
#include <QTreeWidget>

namespace {

constexpr int kWaitMs = 120000;

class Driver : public QObject {
 public:
  Driver() { QTimer::singleShot(0, this, &Driver::Start); }

 private:
  void Start() {
    const QByteArray task = qgetenv("RETINT_DRIVE");
    if (task == "look") Say(Look());
    if (task == "paint") Say(Paint() ? "painted" : "failed");
    if (task == "recover") Say(Recover() ? "recovered" : "failed");
  }

  static void Say(const QByteArray& what) {
    QFile file(qEnvironmentVariable("RETINT_SAW"));
    if (file.open(QIODevice::WriteOnly)) file.write(what);
  }
  static bool Wait(const std::function<bool()>& done) { return QTest::qWaitFor(done, kWaitMs); }

  static QMainWindow* Window() {
    for (QWidget* widget : QApplication::topLevelWidgets()) {
      auto* window = qobject_cast<QMainWindow*>(widget);
      if (window && window->isVisible()) return window;
    }
    return nullptr;
  }
  // Without a window manager nobody else makes it active, as keys want it.
  static bool Activate() {
    Window()->activateWindow();
    return QTest::qWaitForWindowActive(Window());
  }
  static int Regions() {
    auto* list = Window()->findChild<QTreeWidget*>("region_list");
    return list ? list->topLevelItemCount() : -1;
  }

  // What the Scene panel says of the scene that opened, a line a fact.
  static QByteArray Look() {
    if (!Wait([] { return Window() != nullptr; })) return "no window";
    auto* enter = Window()->findChild<QAction*>("selection.enter");
    auto* facts = Window()->findChild<QTreeWidget*>("scene_facts");
    if (!enter || !facts || !Wait([=] { return enter->isEnabled(); })) return "nothing opened";
    QByteArray text = "Title: " + Window()->windowTitle().toUtf8() + "\n";
    for (int i = 0; i < facts->topLevelItemCount(); ++i) {
      const QTreeWidgetItem* item = facts->topLevelItem(i);
      text += (item->text(0) + ": " + item->text(1) + "\n").toUtf8();
    }
    return text;
  }

  // Selects a disc in the middle of the view.
  static bool Paint() {
    if (!Wait([] { return Window() != nullptr; })) return false;
    auto* enter = Window()->findChild<QAction*>("selection.enter");
    if (!enter || !Wait([=] { return enter->isEnabled(); }) || !Activate()) return false;
    QTest::keyClick(Window(), Qt::Key_B);
    auto* accept = Window()->findChild<QAbstractButton*>("selectionAccept");
    auto* paper = Window()->findChild<QWidget*>("selectionCanvas");
    if (!accept || !paper || !Wait([=] { return accept->isVisible() && accept->isEnabled(); })) {
      return false;
    }
    for (int i = 0; i < 10; ++i) QTest::keyClick(paper, Qt::Key_BracketRight);
    QTest::mouseClick(paper, Qt::LeftButton, {}, paper->rect().center());
    QTest::keyClick(paper, Qt::Key_Return);
    return Wait([] { return Regions() == 1; });
  }

  static bool Recover() {
    QMessageBox* box = nullptr;
    const bool asked = Wait([&] {
      box = Window() ? Window()->findChild<QMessageBox*>() : nullptr;
      return box && box->isVisible();
    });
    if (!asked) return false;
    for (QAbstractButton* button : box->buttons()) {
      if (box->buttonRole(button) == QMessageBox::AcceptRole) {
        QTest::mouseClick(button, Qt::LeftButton);
        break;
      }
    }
    return Wait([] { return Regions() == 1; });
  }
};

class DriverPlugin : public QGenericPlugin {
  Q_OBJECT
  Q_PLUGIN_METADATA(IID QGenericPluginFactoryInterface_iid FILE "driver_plugin.json")

 public:
  QObject* create(const QString&, const QString&) override { return new Driver; }
};

}  // namespace

#include "driver_plugin.moc"
