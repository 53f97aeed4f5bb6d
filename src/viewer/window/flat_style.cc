// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/flat_style.h"

#include <algorithm>

#include <QPainter>
#include <QPainterPath>
#include <QStyleFactory>
#include <QStyleOption>
#include <QWidget>

namespace retint {
namespace {

constexpr double kRound = 4;  // radius of corners, pixels
constexpr int kGroove = 4;    // of sliders and progress

QColor WithAlpha(QColor color, int alpha) {
  color.setAlpha(alpha);
  return color;
}

bool Has(const QStyleOption& option, QStyle::StateFlag flag) { return (option.state & flag) != 0; }

// The outline of a control; in the accent color if it has the keyboard.
QColor LineOf(const QStyleOption& option) {
  const bool marked = Has(option, QStyle::State_HasFocus) && Has(option, QStyle::State_Enabled);
  return option.palette.color(marked ? QPalette::Highlight : QPalette::Mid);
}

void Fill(QPainter& painter, const QRectF& rect, const QColor& fill, const QColor& line,
          double round = kRound) {
  painter.save();
  painter.setRenderHint(QPainter::Antialiasing);
  painter.setPen(line.isValid() ? QPen(line) : QPen(Qt::NoPen));
  painter.setBrush(fill.isValid() ? QBrush(fill) : QBrush(Qt::NoBrush));
  const double half = line.isValid() ? 0.5 : 0;
  painter.drawRoundedRect(rect.adjusted(half, half, -half, -half), round, round);
  painter.restore();
}

// The shade for a hovered or pressed control.
QColor Shade(const QStyleOption& option) {
  if (!Has(option, QStyle::State_Enabled)) return {};
  const QColor text = option.palette.color(QPalette::ButtonText);
  if (Has(option, QStyle::State_Sunken)) return WithAlpha(text, 44);
  return Has(option, QStyle::State_MouseOver) ? WithAlpha(text, 22) : QColor();
}

bool IsPrimary(const QStyleOption& option, const QWidget* widget) {
  if (!Has(option, QStyle::State_Enabled)) return false;
  if (widget && widget->property(kPrimary).toBool()) return true;
  const auto* button = qstyleoption_cast<const QStyleOptionButton*>(&option);
  return button && button->features.testFlag(QStyleOptionButton::DefaultButton);
}

void DrawButton(const QStyleOption& option, QPainter& painter, const QWidget* widget) {
  const auto* button = qstyleoption_cast<const QStyleOptionButton*>(&option);
  const bool on = Has(option, QStyle::State_On);
  const bool flat = button && button->features.testFlag(QStyleOptionButton::Flat) && !on;
  const QPalette& colors = option.palette;
  if (IsPrimary(option, widget)) {
    Fill(painter, option.rect, colors.color(QPalette::Highlight), LineOf(option));
  } else if (!flat) {
    Fill(painter, option.rect, colors.color(QPalette::Button), LineOf(option));
  } else if (Has(option, QStyle::State_HasFocus)) {
    Fill(painter, option.rect, {}, LineOf(option));
  }
  if (on) {
    const QColor accent = colors.color(QPalette::Highlight);
    Fill(painter, option.rect, WithAlpha(accent, 60), accent);
  }
  if (const QColor shade = Shade(option); shade.isValid()) Fill(painter, option.rect, shade, {});
}

void DrawToolButton(const QStyleOption& option, QPainter& painter, const QWidget* widget) {
  const QPalette& colors = option.palette;
  const QColor accent = colors.color(QPalette::Highlight);
  const bool framed = !Has(option, QStyle::State_AutoRaise) ||
                      colors.color(QPalette::Mid) == colors.color(QPalette::WindowText);
  if (IsPrimary(option, widget)) {
    Fill(painter, option.rect, accent, {});
  } else if (Has(option, QStyle::State_On)) {
    Fill(painter, option.rect, WithAlpha(accent, 70), accent);
  } else if (framed || Has(option, QStyle::State_HasFocus)) {
    Fill(painter, option.rect, framed ? colors.color(QPalette::Button) : QColor(), LineOf(option));
  }
  if (const QColor shade = Shade(option); shade.isValid()) Fill(painter, option.rect, shade, {});
}

void DrawCheckBox(const QStyleOption& option, QPainter& painter) {
  const QPalette& colors = option.palette;
  const bool set = Has(option, QStyle::State_On) || Has(option, QStyle::State_NoChange);
  const QColor line =
      WithAlpha(colors.color(QPalette::Text), Has(option, QStyle::State_Enabled) ? 170 : 80);
  const QRectF box(option.rect);
  Fill(painter, box, set ? colors.color(QPalette::Highlight) : colors.color(QPalette::Base),
       set ? QColor(colors.color(QPalette::Highlight)) : line, 3);
  if (!set) return;
  painter.save();
  painter.setRenderHint(QPainter::Antialiasing);
  painter.setPen(QPen(colors.color(QPalette::HighlightedText), 1.8, Qt::SolidLine, Qt::RoundCap));
  const auto at = [&](double x, double y) {
    return box.topLeft() + QPointF(x * box.width(), y * box.height());
  };
  if (Has(option, QStyle::State_NoChange)) {
    painter.drawLine(at(0.25, 0.5), at(0.75, 0.5));
  } else {
    painter.drawPolyline(QPolygonF({at(0.22, 0.52), at(0.43, 0.73), at(0.78, 0.3)}));
  }
  painter.restore();
}

void DrawRadio(const QStyleOption& option, QPainter& painter) {
  const QPalette& colors = option.palette;
  const bool set = Has(option, QStyle::State_On);
  const QColor line =
      WithAlpha(colors.color(QPalette::Text), Has(option, QStyle::State_Enabled) ? 170 : 80);
  const QRectF ring = QRectF(option.rect).adjusted(0, 0, -1, -1);
  const double half = ring.width() / 2, dot = half / 2;
  const QColor accent = colors.color(QPalette::Highlight);
  Fill(painter, ring, set ? accent : colors.color(QPalette::Base), set ? accent : line, half);
  if (!set) return;
  Fill(painter, ring.adjusted(dot, dot, -dot, -dot), colors.color(QPalette::HighlightedText), {},
       dot);
}

void DrawArrow(QPainter& painter, const QRectF& in, const QColor& color, bool up = false) {
  painter.save();
  painter.setRenderHint(QPainter::Antialiasing);
  painter.setPen(QPen(color, 1.5, Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin));
  const QPointF c = in.center();
  const double side = std::min({4.0, in.width() / 3, in.height() / 2}), rise = up ? -1 : 1;
  painter.drawPolyline(
      QPolygonF({c + QPointF(-side, -rise * side / 2), c + QPointF(0, rise * side / 2),
                 c + QPointF(side, -rise * side / 2)}));
  painter.restore();
}

// On the buttons of a panel's title: a cross closes it, an arrow takes it out of the window.
void DrawTitleMark(QPainter& painter, const QRectF& in, const QColor& color, bool closes) {
  constexpr double kHalf = 3.5;
  const QPointF c = in.center(), down(kHalf, kHalf), up(kHalf, -kHalf);
  painter.save();
  painter.setRenderHint(QPainter::Antialiasing);
  painter.setPen(QPen(color, 1.3, Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin));
  painter.drawLine(c - up, c + up);
  if (closes) {
    painter.drawLine(c - down, c + down);
  } else {
    painter.drawPolyline(QPolygonF({c + up - QPointF(5, 0), c + up, c + up + QPointF(0, 5)}));
  }
  painter.restore();
}

void DrawTab(const QStyleOptionTab& tab, QPainter& painter) {
  const bool chosen = Has(tab, QStyle::State_Selected);
  if (!chosen && Has(tab, QStyle::State_MouseOver)) {
    painter.fillRect(tab.rect, WithAlpha(tab.palette.color(QPalette::WindowText), 18));
  }
  QRect line = tab.rect;
  line.setTop(line.bottom() - (chosen ? 1 : 0));
  painter.fillRect(line, tab.palette.color(chosen ? QPalette::Highlight : QPalette::Mid));
  if (Has(tab, QStyle::State_HasFocus)) {
    Fill(painter, tab.rect, {}, tab.palette.color(QPalette::Highlight));
  }
}

void DrawProgress(const QStyleOptionProgressBar& bar, QPainter& painter) {
  const QPalette& colors = bar.palette;
  const double span = bar.maximum - bar.minimum;
  QRectF part = bar.rect;
  part.setTop(part.center().y() - kGroove / 2.0);
  part.setHeight(kGroove);
  Fill(painter, part, colors.color(QPalette::Mid), {}, kGroove / 2.0);
  if (span > 0)
    part.setWidth(part.width() * std::clamp((bar.progress - bar.minimum) / span, 0., 1.));
  if (span <= 0) part.adjust(part.width() / 3, 0, -part.width() / 3, 0);  // unknown progress
  if (part.width() > 0) Fill(painter, part, colors.color(QPalette::Highlight), {}, kGroove / 2.0);
}

}  // namespace

FlatStyle::FlatStyle() : QProxyStyle(QStyleFactory::create("Fusion")) {}

void FlatStyle::drawPrimitive(PrimitiveElement element, const QStyleOption* option,
                              QPainter* painter, const QWidget* widget) const {
  const QPalette& colors = option->palette;
  switch (element) {
    case PE_PanelButtonCommand:
      return DrawButton(*option, *painter, widget);
    case PE_PanelButtonTool:
      return DrawToolButton(*option, *painter, widget);
    case PE_IndicatorCheckBox:
    case PE_IndicatorItemViewItemCheck:
      return DrawCheckBox(*option, *painter);
    case PE_IndicatorRadioButton:
      return DrawRadio(*option, *painter);
    case PE_PanelLineEdit: {
      const auto* frame = qstyleoption_cast<const QStyleOptionFrame*>(option);
      const bool framed = frame && frame->lineWidth > 0;
      return Fill(*painter, option->rect, colors.color(QPalette::Base),
                  framed ? LineOf(*option) : QColor(), framed ? kRound : 0);
    }
    case PE_Frame:
      return Fill(*painter, option->rect, {}, colors.color(QPalette::Mid), 0);
    case PE_FrameStatusBarItem:
    case PE_FrameDockWidget:
    case PE_FrameTabBarBase:
    case PE_FrameButtonBevel:
    case PE_PanelMenuBar:
    case PE_PanelStatusBar:
      return;
    case PE_IndicatorToolBarSeparator: {
      const QPoint c = option->rect.center();
      painter->fillRect(QRect(c.x(), c.y() - 8, 1, 16), colors.color(QPalette::Mid));
      return;
    }
    default:
      return QProxyStyle::drawPrimitive(element, option, painter, widget);
  }
}

void FlatStyle::drawControl(ControlElement element, const QStyleOption* option, QPainter* painter,
                            const QWidget* widget) const {
  const QPalette& colors = option->palette;
  switch (element) {
    case CE_ToolBar:
    case CE_MenuBarEmptyArea:
      return painter->fillRect(option->rect, colors.color(QPalette::Window));
    case CE_MenuBarItem: {
      const auto* item = qstyleoption_cast<const QStyleOptionMenuItem*>(option);
      if (!item) break;
      painter->fillRect(option->rect, colors.color(QPalette::Window));
      if (Has(*option, State_Selected)) {
        Fill(*painter, option->rect, WithAlpha(colors.color(QPalette::WindowText), 30), {});
      }
      int flags = Qt::AlignCenter | Qt::TextShowMnemonic | Qt::TextDontClip | Qt::TextSingleLine;
      if (!proxy()->styleHint(SH_UnderlineShortcut, option, widget)) flags |= Qt::TextHideMnemonic;
      return proxy()->drawItemText(painter, option->rect, flags, colors,
                                   Has(*option, State_Enabled), item->text, QPalette::WindowText);
    }
    case CE_DockWidgetTitle: {
      const auto* dock = qstyleoption_cast<const QStyleOptionDockWidget*>(option);
      if (!dock || dock->verticalTitleBar) break;
      painter->save();
      QFont bold = painter->font();
      bold.setBold(true);
      painter->setFont(bold);
      const QRect text = subElementRect(SE_DockWidgetTitleBarText, option, widget);
      const QString shown =
          QFontMetrics(bold).elidedText(dock->title, Qt::ElideRight, text.width());
      proxy()->drawItemText(painter, text, Qt::AlignLeft | Qt::AlignVCenter, colors, true, shown,
                            QPalette::WindowText);
      return painter->restore();
    }
    case CE_TabBarTabShape:
      if (const auto* tab = qstyleoption_cast<const QStyleOptionTab*>(option)) {
        return DrawTab(*tab, *painter);
      }
      break;
    case CE_ProgressBarGroove:
      return;
    case CE_ProgressBarContents:
      if (const auto* bar = qstyleoption_cast<const QStyleOptionProgressBar*>(option)) {
        return DrawProgress(*bar, *painter);
      }
      break;
    case CE_PushButtonLabel:
      if (const auto* button = qstyleoption_cast<const QStyleOptionButton*>(option);
          button && IsPrimary(*option, widget)) {
        QStyleOptionButton light = *button;
        light.palette.setColor(QPalette::ButtonText, colors.color(QPalette::HighlightedText));
        return QProxyStyle::drawControl(element, &light, painter, widget);
      }
      break;
    case CE_ToolButtonLabel:
      if (const auto* button = qstyleoption_cast<const QStyleOptionToolButton*>(option)) {
        // Qt's own arrow is black, even on a dark tool bar.
        if (widget && widget->objectName() == "qt_toolbar_ext_button") {
          return proxy()->drawItemText(painter, option->rect, Qt::AlignCenter, colors, true,
                                       QStringLiteral("»"), QPalette::ButtonText);
        }
        const bool closes = widget && widget->objectName() == "qt_dockwidget_closebutton";
        if (closes || (widget && widget->objectName() == "qt_dockwidget_floatbutton")) {
          return DrawTitleMark(*painter, option->rect, colors.color(QPalette::WindowText), closes);
        }
        if (!IsPrimary(*option, widget)) break;
        QStyleOptionToolButton light = *button;
        light.palette.setColor(QPalette::ButtonText, colors.color(QPalette::HighlightedText));
        return QProxyStyle::drawControl(element, &light, painter, widget);
      }
      break;
    default:
      break;
  }
  QProxyStyle::drawControl(element, option, painter, widget);
}

void FlatStyle::drawComplexControl(ComplexControl control, const QStyleOptionComplex* option,
                                   QPainter* painter, const QWidget* widget) const {
  switch (control) {
    case CC_ToolButton:
      // Qt draws no panel for a tool button without hover.
      if (IsPrimary(*option, widget)) DrawToolButton(*option, *painter, widget);
      break;
    case CC_ComboBox:
      return DrawCombo(*option, *painter, widget);
    case CC_SpinBox:
      return DrawSpin(*option, *painter, widget);
    case CC_Slider:
      return DrawSlider(*option, *painter, widget);
    case CC_ScrollBar:
      return DrawScrollBar(*option, *painter, widget);
    default:
      break;
  }
  QProxyStyle::drawComplexControl(control, option, painter, widget);
}

void FlatStyle::DrawCombo(const QStyleOptionComplex& option, QPainter& painter,
                          const QWidget* widget) const {
  const auto* box = qstyleoption_cast<const QStyleOptionComboBox*>(&option);
  const QPalette& colors = option.palette;
  Fill(painter, option.rect, colors.color(box && box->editable ? QPalette::Base : QPalette::Button),
       LineOf(option));
  if (const QColor shade = Shade(option); shade.isValid()) Fill(painter, option.rect, shade, {});
  const QRect arrow = proxy()->subControlRect(CC_ComboBox, &option, SC_ComboBoxArrow, widget);
  DrawArrow(painter, arrow, colors.color(QPalette::ButtonText));
}

void FlatStyle::DrawSpin(const QStyleOptionComplex& option, QPainter& painter,
                         const QWidget* widget) const {
  const auto* spin = qstyleoption_cast<const QStyleOptionSpinBox*>(&option);
  const QPalette& colors = option.palette;
  if (!spin || spin->frame) {
    Fill(painter, option.rect, colors.color(QPalette::Base), LineOf(option));
  }
  if (!spin || spin->buttonSymbols == QAbstractSpinBox::NoButtons) return;
  for (const auto& [part, step, up] :
       {std::tuple(SC_SpinBoxUp, QAbstractSpinBox::StepUpEnabled, true),
        std::tuple(SC_SpinBoxDown, QAbstractSpinBox::StepDownEnabled, false)}) {
    const bool can = spin->stepEnabled.testFlag(step) && Has(option, State_Enabled);
    DrawArrow(painter, proxy()->subControlRect(CC_SpinBox, &option, part, widget),
              colors.color(can ? QPalette::Active : QPalette::Disabled, QPalette::ButtonText), up);
  }
}

void FlatStyle::DrawSlider(const QStyleOptionComplex& option, QPainter& painter,
                           const QWidget* widget) const {
  const auto* slider = qstyleoption_cast<const QStyleOptionSlider*>(&option);
  if (!slider) return;
  const QPalette& colors = option.palette;
  const bool enabled = Has(option, State_Enabled);
  const QRectF handle = proxy()->subControlRect(CC_Slider, &option, SC_SliderHandle, widget);
  QRectF groove = proxy()->subControlRect(CC_Slider, &option, SC_SliderGroove, widget);
  const QPointF c = groove.center();
  const bool across = slider->orientation == Qt::Horizontal;
  groove = across ? QRectF(groove.left(), c.y() - kGroove / 2.0, groove.width(), kGroove)
                  : QRectF(c.x() - kGroove / 2.0, groove.top(), kGroove, groove.height());
  Fill(painter, groove, colors.color(QPalette::Mid), {}, kGroove / 2.0);
  const double side = std::min({handle.width(), handle.height(), 14.0});
  const QRectF knob(handle.center() - QPointF(side / 2, side / 2), QSizeF(side, side));
  const QColor accent =
      colors.color(enabled ? QPalette::Active : QPalette::Disabled, QPalette::Highlight);
  const QColor ring =
      colors.color(Has(option, State_HasFocus) ? QPalette::WindowText : QPalette::Window);
  Fill(painter, knob, accent, ring, side / 2);
}

void FlatStyle::DrawScrollBar(const QStyleOptionComplex& option, QPainter& painter,
                              const QWidget* widget) const {
  painter.fillRect(option.rect, option.palette.color(QPalette::Window));
  if (!Has(option, State_Enabled)) return;
  const QRectF thumb = proxy()->subControlRect(CC_ScrollBar, &option, SC_ScrollBarSlider, widget);
  const bool held = option.activeSubControls & SC_ScrollBarSlider &&
                    (Has(option, State_MouseOver) || Has(option, State_Sunken));
  const QColor text = option.palette.color(QPalette::WindowText);
  const bool strong = option.palette.color(QPalette::Mid) == text;
  Fill(painter, thumb.adjusted(3, 3, -3, -3), strong ? text : WithAlpha(text, held ? 130 : 75), {},
       3);
}

int FlatStyle::styleHint(StyleHint hint, const QStyleOption* option, const QWidget* widget,
                         QStyleHintReturn* answer) const {
  // Icons explain buttons that were designed with them, but not Cancel.
  if (hint == SH_DialogButtonBox_ButtonsHaveIcons) return 0;
  return QProxyStyle::styleHint(hint, option, widget, answer);
}

}  // namespace retint
