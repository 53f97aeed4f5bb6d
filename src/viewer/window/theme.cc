// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/theme.h"

#include <QApplication>
#include <QDBusConnection>
#include <QDBusMessage>
#include <QDBusPendingCallWatcher>
#include <QDBusPendingReply>
#include <QDBusVariant>
#include <QPainter>
#include <QPalette>
#include <QProxyStyle>
#include <QStyleFactory>
#include <QStyleOption>
#include <QToolTip>

namespace retint {
namespace {

constexpr const char* kService = "org.freedesktop.portal.Desktop";
constexpr const char* kPath = "/org/freedesktop/portal/desktop";
constexpr const char* kInterface = "org.freedesktop.portal.Settings";
constexpr const char* kSpace = "org.freedesktop.appearance";
constexpr const char* kKey = "color-scheme";
constexpr unsigned kPrefersDark = 1;

struct Shades {
  QColor window, base, alternate, button, text, dim, border, highlight;
};

const Shades kDark{{43, 45, 48},    {32, 33, 36},    {38, 40, 43}, {55, 57, 61},
                   {225, 226, 229}, {145, 148, 153}, {24, 25, 27}, {53, 116, 205}};
const Shades kLight{{240, 240, 242}, {255, 255, 255}, {246, 247, 249}, {248, 248, 249},
                    {28, 29, 31},    {120, 123, 128}, {190, 192, 196}, {38, 110, 210}};

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
  palette.setColor(QPalette::HighlightedText, Qt::white);
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
// that is not checked. Nor does one see there which button of several is down.
class FramedStyle : public QProxyStyle {
 public:
  FramedStyle() : QProxyStyle(QStyleFactory::create("Fusion")) {}

  void drawPrimitive(PrimitiveElement element, const QStyleOption* option, QPainter* painter,
                     const QWidget* widget) const override {
    QProxyStyle::drawPrimitive(element, option, painter, widget);
    const bool is_box = element == PE_IndicatorCheckBox || element == PE_IndicatorItemViewItemCheck;
    const bool is_down = element == PE_PanelButtonTool && option->state & State_On;
    if (!is_box && !is_down) return;
    QColor frame = option->palette.color(is_box ? QPalette::Text : QPalette::Highlight);
    if (is_box) frame.setAlpha(option->state & State_Enabled ? 150 : 60);
    painter->save();
    painter->setBrush(Qt::NoBrush);
    painter->setPen(frame);
    // All of the line lies inside, also where it is wider than a pixel of the screen.
    painter->setRenderHint(QPainter::Antialiasing);
    painter->drawRect(QRectF(option->rect).adjusted(0.5, 0.5, -0.5, -0.5));
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
  system_dark_ = QApplication::palette().color(QPalette::Window).lightness() < 128;
  QApplication::setStyle(new FramedStyle);
  Apply();
  QDBusConnection bus = QDBusConnection::sessionBus();
  if (!bus.isConnected()) return;
  bus.connect(kService, kPath, kInterface, "SettingChanged", this,
              SLOT(OnSetting(QString, QString, QDBusVariant)));
  QDBusMessage ask = QDBusMessage::createMethodCall(kService, kPath, kInterface, "Read");
  ask << QString(kSpace) << QString(kKey);
  auto* watcher = new QDBusPendingCallWatcher(bus.asyncCall(ask), this);
  connect(watcher, &QDBusPendingCallWatcher::finished, this, [this, watcher] {
    const QDBusPendingReply<QVariant> reply = *watcher;
    watcher->deleteLater();
    if (reply.isError()) return;
    // The portal wraps the value once more than it says.
    QVariant value = reply.value();
    while (value.canConvert<QDBusVariant>()) value = value.value<QDBusVariant>().variant();
    SetSystemScheme(value.toUInt());
  });
}

void Theme::OnSetting(const QString& space, const QString& key, const QDBusVariant& value) {
  if (space == kSpace && key == kKey) SetSystemScheme(value.variant().toUInt());
}

void Theme::SetSystemScheme(unsigned scheme) {
  system_dark_ = scheme == kPrefersDark;
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
  const QPalette palette = PaletteOf(dark() ? kDark : kLight);
  QApplication::setPalette(palette);
  QToolTip::setPalette(palette);
  Q_EMIT changed();
}

}  // namespace retint
