// SPDX-License-Identifier: BSD-3-Clause
// The palette of a desktop of high contrast, and dark tool bars.
#include <algorithm>
#include <cmath>
#include <utility>

#include <QDir>
#include <QFileInfo>
#include <QPushButton>
#include <QToolBar>
#include <QToolButton>

#include "tests/viewer/viewer_scene.h"
#include "viewer/widgets/icon.h"

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
    theme_->Choose(ThemeChoice::kSystem);
  }

  // WCAG AA, of all that is read.
  void TextIsReadInEveryTheme() {
    const auto light_of = [](const QColor& color) {
      const auto linear = [](double v) {
        return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
      };
      return 0.2126 * linear(color.redF()) + 0.7152 * linear(color.greenF()) +
             0.0722 * linear(color.blueF());
    };
    using P = QPalette;
    for (const ThemeChoice choice : {ThemeChoice::kLight, ThemeChoice::kDark}) {
      theme_->Choose(choice);
      const QPalette colors = QApplication::palette();
      for (const auto& [text, ground] :
           {std::pair(P::WindowText, P::Window), std::pair(P::Text, P::Base),
            std::pair(P::Text, P::AlternateBase), std::pair(P::ButtonText, P::Button),
            std::pair(P::PlaceholderText, P::Base), std::pair(P::PlaceholderText, P::Window),
            std::pair(P::ToolTipText, P::ToolTipBase), std::pair(P::Link, P::Window),
            std::pair(P::HighlightedText, P::Highlight)}) {
        const double a = light_of(colors.color(text)), b = light_of(colors.color(ground));
        const double contrast = (std::max(a, b) + 0.05) / (std::min(a, b) + 0.05);
        QVERIFY2(contrast >= 4.5, qPrintable(QString("%1 on %2 in %3: %4")
                                                 .arg(text)
                                                 .arg(ground)
                                                 .arg(ThemeName(choice))
                                                 .arg(contrast)));
      }
    }
    theme_->Choose(ThemeChoice::kSystem);
  }

  // The one button of the window that is filled with the accent.
  void PaintIsThePrimaryButton() {
    for (const ThemeChoice choice : {ThemeChoice::kLight, ThemeChoice::kDark}) {
      theme_->Choose(choice);
      QCoreApplication::processEvents();
      const QColor accent = QApplication::palette().color(QPalette::Highlight);
      int filled = 0;
      for (QToolButton* button :
           window_->findChild<QToolBar*>("tools")->findChildren<QToolButton*>()) {
        if (!button->isVisible()) continue;
        const QImage shown = button->grab().toImage();
        const bool is_filled = shown.pixelColor(shown.width() / 2, 3) == accent;
        filled += is_filled;
        QCOMPARE(is_filled, button->defaultAction() == window_->action("selection.enter"));
      }
      QCOMPARE(filled, 1);
    }
    theme_->Choose(ThemeChoice::kSystem);
  }

  void IconsHaveTheColorOfText() {
    for (const QColor& text : {QColor(Qt::black), QColor(225, 226, 229)}) {
      QPalette palette;
      palette.setColor(QPalette::ButtonText, text);
      const QDir icons(":/retint/icons");
      QVERIFY(!MakeIcon("brush", palette).isNull());
      for (const QString& file : icons.entryList()) {
        const QByteArray name = QFileInfo(file).baseName().toLatin1();
        const QImage image = MakeIcon(name, palette).pixmap(20, 20).toImage();
        int inked = 0;
        for (int i = 0; i < 400; ++i) inked += image.pixelColor(i % 20, i / 20) == text;
        QVERIFY2(inked > 5, name);
      }
    }
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
