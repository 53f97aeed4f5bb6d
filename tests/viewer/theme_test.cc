// SPDX-License-Identifier: BSD-3-Clause
// What a desktop asks for: high contrast, by its palette or its portal, and dark tool bars.
#include <algorithm>

#include <QDBusVariant>
#include <QPushButton>
#include <QToolBar>
#include <QToolButton>

#include "tests/viewer/viewer_scene.h"

namespace retint {

class ThemeTest : public ViewerTest {
  Q_OBJECT

 private Q_SLOTS:
  void initTestCase() { MakeScene(); }
  void cleanupTestCase() { scene_.reset(); }
  void init() { QVERIFY(ShowScene()); }
  void cleanup() { window_.reset(); }

  // A desktop's black and white is taken over, and controls have an end on it.
  void HighContrastFollowsTheDesktop() {
    const QPalette before = QApplication::palette();
    for (const bool dark : {true, false}) {
      const QColor window = dark ? Qt::black : Qt::white, text = dark ? Qt::white : Qt::black;
      QPalette desktop(window);
      desktop.setColor(QPalette::Window, window);
      desktop.setColor(QPalette::WindowText, text);
      QApplication::setPalette(desktop);
      Theme theme;
      // A portal that knows of no such setting has no preference.
      for (const char* key : {"contrast", "color-scheme"}) {
        QVERIFY(QMetaObject::invokeMethod(&theme, "OnAnswer", Q_ARG(QString, QString(key)),
                                          Q_ARG(unsigned, 0u)));
      }
      QVERIFY(theme.high_contrast());
      QCOMPARE(theme.dark(), dark);
      QCOMPARE(QApplication::palette().color(QPalette::Base), window);
      QCOMPARE(QApplication::palette().color(QPalette::ButtonText), text);
      QPushButton button("Open");
      button.resize(80, 30);
      QCOMPARE(button.grab().toImage().pixelColor(40, 0), text);
      Keep(*window_, dark ? "black" : "white");
    }
    QApplication::setPalette(before);
    Theme theme;
    QVERIFY(!theme.high_contrast());
    // Later by the portal.
    const auto tell = [&](const char* key, uint value) {
      QMetaObject::invokeMethod(
          &theme, "OnSetting", Q_ARG(QString, QString("org.freedesktop.appearance")),
          Q_ARG(QString, QString(key)), Q_ARG(QDBusVariant, QDBusVariant(value)));
    };
    tell("contrast", 1);
    tell("color-scheme", 1);
    QVERIFY(theme.high_contrast() && theme.dark());
    QCOMPARE(QApplication::palette().color(QPalette::Window), QColor(Qt::black));
    tell("contrast", 0);
    QVERIFY(!theme.high_contrast() && theme.dark());
    theme_->Choose(ThemeChoice::kSystem);
  }

  // Where a tool bar has no room for all of its buttons; Qt's own picture of the arrow is black.
  void TheRestOfAToolBarIsFoundOnADarkOne() {
    theme_->Choose(ThemeChoice::kDark);
    QToolBar bar;
    for (int i = 0; i < 9; ++i) bar.addAction("Previous view");
    bar.resize(200, 30);
    bar.show();
    auto* rest = bar.findChild<QToolButton*>("qt_toolbar_ext_button");
    QTRY_VERIFY(rest && rest->isVisible());
    const QImage shown = rest->grab().toImage();
    int brightest = 0;
    for (int i = 0; i < shown.width() * shown.height(); ++i) {
      brightest =
          std::max(brightest, shown.pixelColor(i % shown.width(), i / shown.width()).lightness());
    }
    QVERIFY2(brightest > 150, qPrintable(QString::number(brightest)));
    theme_->Choose(ThemeChoice::kSystem);
  }
};

}  // namespace retint

QTEST_MAIN(retint::ThemeTest)
#include "theme_test.moc"
