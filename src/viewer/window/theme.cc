// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/theme.h"

#include <cstdlib>

#include <QApplication>
#include <QPainter>
#include <QPalette>
#include <QProxyStyle>
#include <QStyleFactory>
#include <QStyleOption>
#include <QToolTip>

namespace retint {
namespace {

// Of text and window, in lightness; other palettes of desktops have at most 240.
constexpr int kHighContrast = 250;

struct Shades {
  QColor window, base, alternate, button, text, dim, border, highlight, highlighted;
};

const Shades kDark{{43, 45, 48},    {32, 33, 36}, {38, 40, 43},   {55, 57, 61},   {225, 226, 229},
                   {145, 148, 153}, {24, 25, 27}, {53, 116, 205}, {255, 255, 255}};
const Shades kLight{{240, 240, 242}, {255, 255, 255}, {246, 247, 249},
                    {248, 248, 249}, {28, 29, 31},    {120, 123, 128},
                    {190, 192, 196}, {38, 110, 210},  {255, 255, 255}};
// Dim text has a contrast of 7 at least.
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
  palette.setColor(QPalette::Link, shades.highlight.lighter(125));
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

// Fusion draws the frame of a check box darker than the window: on a dark one nobody sees a box
// that is not checked. Nor does one see there which button of several is down, nor the arrow that
// leads to what a tool bar has no room for, which is a black picture. On black and on white no
// control has an end, unless it has a frame in the color of text.
class FramedStyle : public QProxyStyle {
 public:
  FramedStyle() : QProxyStyle(QStyleFactory::create("Fusion")) {}

  void drawPrimitive(PrimitiveElement element, const QStyleOption* option, QPainter* painter,
                     const QWidget* widget) const override {
    QProxyStyle::drawPrimitive(element, option, painter, widget);
    const bool is_box = element == PE_IndicatorCheckBox || element == PE_IndicatorItemViewItemCheck;
    const bool is_down = element == PE_PanelButtonTool && option->state & State_On;
    const auto* frame = qstyleoption_cast<const QStyleOptionFrame*>(option);
    const bool is_field = element == PE_PanelLineEdit && frame && frame->lineWidth > 0;
    if (is_box || is_down) {
      QColor color = option->palette.color(is_box ? QPalette::Text : QPalette::Highlight);
      if (is_box) color.setAlpha(option->state & State_Enabled ? 150 : 60);
      DrawFrame(painter, option->rect, color);
    } else if (is_field || element == PE_PanelButtonCommand || element == PE_PanelButtonTool) {
      FrameControl(painter, *option);
    }
  }

  void drawControl(ControlElement element, const QStyleOption* option, QPainter* painter,
                   const QWidget* widget) const override {
    const auto* button = qstyleoption_cast<const QStyleOptionToolButton*>(option);
    if (button && widget && widget->objectName() == "qt_toolbar_ext_button") {
      proxy()->drawItemText(painter, option->rect, Qt::AlignCenter, option->palette, true,
                            QStringLiteral("»"), QPalette::ButtonText);
      return;
    }
    QProxyStyle::drawControl(element, option, painter, widget);
    if (element == CE_TabBarTabShape || element == CE_ProgressBarGroove) {
      FrameControl(painter, *option);
    }
  }

  void drawComplexControl(ComplexControl control, const QStyleOptionComplex* option,
                          QPainter* painter, const QWidget* widget) const override {
    QProxyStyle::drawComplexControl(control, option, painter, widget);
    const auto frame_part = [&](SubControl part) {
      FrameControl(painter, *option, subControlRect(control, option, part, widget));
    };
    if (control == CC_ComboBox || control == CC_SpinBox) FrameControl(painter, *option);
    if (control == CC_Slider) {
      frame_part(SC_SliderGroove);
      frame_part(SC_SliderHandle);
    }
    if (control == CC_ScrollBar) frame_part(SC_ScrollBarSlider);
  }

 private:
  void FrameControl(QPainter* painter, const QStyleOption& option, QRect rect = {}) const {
    const QPalette& colors = option.palette;
    const QColor text = colors.color(QPalette::Active, QPalette::WindowText);
    if (colors.color(QPalette::Mid) != text) return;  // borders of other shades are not so strong
    const bool marked = (option.state & (State_HasFocus | State_On | State_Selected)) != 0;
    DrawFrame(painter, rect.isNull() ? option.rect : rect,
              colors.color(marked ? QPalette::Highlight : QPalette::ButtonText));
  }

  static void DrawFrame(QPainter* painter, const QRect& rect, const QColor& color) {
    painter->save();
    painter->setBrush(Qt::NoBrush);
    painter->setPen(color);
    // All of the line lies inside, also where it is wider than a pixel of the screen.
    painter->setRenderHint(QPainter::Antialiasing);
    painter->drawRect(QRectF(rect).adjusted(0.5, 0.5, -0.5, -0.5));
    painter->restore();
  }
};

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
  // Before anything of ours is set, the palette is the platform's.
  const QPalette platform = QApplication::palette();
  const int window = platform.color(QPalette::Window).lightness();
  const int text = platform.color(QPalette::WindowText).lightness();
  system_dark_ = window < 128;
  high_contrast_ = std::abs(window - text) >= kHighContrast;
  QApplication::setStyle(new FramedStyle);
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
