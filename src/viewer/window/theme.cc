// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/theme.h"

#include <cstdlib>

#include <QApplication>
#include <QPalette>
#include <QToolTip>

#include "viewer/window/flat_style.h"

namespace retint {
namespace {

// Difference in lightness of text and window. Other desktop palettes have at most 240.
constexpr int kHighContrast = 250;

struct Shades {
  QColor window, base, alternate, button, text, dim, border, highlight, highlighted;
};

// Text, dim text and text on the accent color have a contrast of at least 4.5 (WCAG AA).
const Shades kDark{{43, 45, 48},    {32, 33, 36}, {38, 40, 43},   {55, 57, 61},   {225, 226, 229},
                   {168, 171, 176}, {70, 73, 78}, {47, 109, 200}, {255, 255, 255}};
const Shades kLight{{240, 240, 242}, {255, 255, 255}, {246, 247, 249},
                    {248, 248, 249}, {28, 29, 31},    {92, 95, 101},
                    {190, 192, 196}, {38, 110, 210},  {255, 255, 255}};
// Dim text has a contrast of at least 7.
const Shades kBlack{{0, 0, 0},       {0, 0, 0},       {32, 32, 32},  {0, 0, 0}, {255, 255, 255},
                    {176, 176, 176}, {255, 255, 255}, {255, 230, 0}, {0, 0, 0}};
const Shades kWhite{{255, 255, 255}, {255, 255, 255}, {236, 236, 236}, {255, 255, 255}, {0, 0, 0},
                    {84, 84, 84},    {0, 0, 0},       {0, 0, 170},     {255, 255, 255}};

const Shades& ShadesOf(bool dark, bool high_contrast) {
  if (high_contrast) return dark ? kBlack : kWhite;
  return dark ? kDark : kLight;
}

QPalette PaletteOf(const Shades& shades) {
  QPalette palette;
  palette.setColor(QPalette::Window, shades.window);
  palette.setColor(QPalette::WindowText, shades.text);
  palette.setColor(QPalette::Base, shades.base);
  palette.setColor(QPalette::AlternateBase, shades.alternate);
  palette.setColor(QPalette::Text, shades.text);
  palette.setColor(QPalette::PlaceholderText, shades.dim);
  palette.setColor(QPalette::Button, shades.button);
  palette.setColor(QPalette::ButtonText, shades.text);
  palette.setColor(QPalette::ToolTipBase, shades.base);
  palette.setColor(QPalette::ToolTipText, shades.text);
  palette.setColor(QPalette::BrightText, QColor(255, 90, 90));
  palette.setColor(QPalette::Highlight, shades.highlight);
  palette.setColor(QPalette::HighlightedText, shades.highlighted);
  const bool dark = shades.window.lightness() < 128;
  palette.setColor(QPalette::Link,
                   dark ? shades.highlight.lighter(165) : shades.highlight.darker(115));
  palette.setColor(QPalette::Light, shades.button.lighter(115));
  palette.setColor(QPalette::Midlight, shades.button.lighter(107));
  palette.setColor(QPalette::Mid, shades.border);
  palette.setColor(QPalette::Dark, shades.border.darker(120));
  palette.setColor(QPalette::Shadow, shades.border.darker(150));
  for (const auto role : {QPalette::WindowText, QPalette::Text, QPalette::ButtonText}) {
    palette.setColor(QPalette::Disabled, role, shades.dim);
  }
  palette.setColor(QPalette::Disabled, QPalette::Highlight, shades.border);
  return palette;
}

}  // namespace

ThemeChoice ParseTheme(const QString& name) {
  if (name == "light") return ThemeChoice::kLight;
  if (name == "dark") return ThemeChoice::kDark;
  return ThemeChoice::kSystem;
}

QString ThemeName(ThemeChoice choice) {
  switch (choice) {
    case ThemeChoice::kLight:
      return "light";
    case ThemeChoice::kDark:
      return "dark";
    default:
      return "system";
  }
}

Theme::Theme(QObject* parent) : QObject(parent) {
  // The palette is the platform's until we set one.
  const QPalette platform = QApplication::palette();
  const int window = platform.color(QPalette::Window).lightness();
  const int text = platform.color(QPalette::WindowText).lightness();
  system_dark_ = window < 128;
  high_contrast_ = std::abs(window - text) >= kHighContrast;
  QApplication::setStyle(new FlatStyle);
  Apply();
}

void Theme::Choose(ThemeChoice choice) {
  choice_ = choice;
  Apply();
}

bool Theme::dark() const {
  return choice_ == ThemeChoice::kDark || (choice_ == ThemeChoice::kSystem && system_dark_);
}

void Theme::Apply() {
  const QPalette palette = PaletteOf(ShadesOf(dark(), high_contrast_));
  QApplication::setPalette(palette);
  QToolTip::setPalette(palette);
  Q_EMIT changed();
}

}  // namespace retint
