// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/widgets/long_text.h"

#include <QClipboard>
#include <QGuiApplication>
#include <QHelpEvent>
#include <QPainter>
#include <QStyle>
#include <QToolTip>

namespace retint {
namespace {

constexpr QChar kBreak(0x200B);  // a space of width 0

}  // namespace

QString Breakable(const QString& text, int long_word) {
  QString result;
  int run = 0;  // number of characters in the word
  for (const QChar c : text) {
    const bool breaks = c.isSpace() || c == '/' || c == '-';  // lines break there already
    run = breaks ? 0 : run + 1;
    if (run > long_word && !c.isLowSurrogate() && !c.isMark()) result += kBreak;
    result += c;
  }
  return result;
}

void CopyUnbroken(QObject* owner) {
  QClipboard* clipboard = QGuiApplication::clipboard();
  QObject::connect(clipboard, &QClipboard::changed, owner, [clipboard](QClipboard::Mode mode) {
    const bool ours =
        mode == QClipboard::Selection ? clipboard->ownsSelection() : clipboard->ownsClipboard();
    const QString text = ours ? clipboard->text(mode) : QString();
    if (text.contains(kBreak)) clipboard->setText(QString(text).remove(kBreak), mode);
  });
}

ElidedLabel::ElidedLabel() {
  setTextFormat(Qt::PlainText);
  setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Preferred);
}

QSize ElidedLabel::minimumSizeHint() const { return {0, QLabel::minimumSizeHint().height()}; }

QString ElidedLabel::Shown() const {
  return fontMetrics().elidedText(text(), Qt::ElideRight, contentsRect().width());
}

bool ElidedLabel::event(QEvent* event) {
  if (event->type() == QEvent::ToolTip && toolTip().isEmpty() && Shown() != text()) {
    QToolTip::showText(static_cast<QHelpEvent*>(event)->globalPos(), text(), this);
    return true;
  }
  return QLabel::event(event);
}

void ElidedLabel::paintEvent(QPaintEvent* /*event*/) {
  QPainter painter(this);
  style()->drawItemText(&painter, contentsRect(), int(alignment()), palette(), isEnabled(), Shown(),
                        foregroundRole());
}

ElidedButton::ElidedButton(const QString& title) : title_(title) {
  setToolTip(title);
  setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Fixed);
  ShowTitle();
}

void ElidedButton::ShowTitle() {
  constexpr int kAround = 16;  // pixels for the frame and its padding
  setText(fontMetrics().elidedText(title_, Qt::ElideMiddle, width() - kAround).replace("&", "&&"));
}

void ElidedButton::resizeEvent(QResizeEvent* event) {
  QPushButton::resizeEvent(event);
  ShowTitle();
}

}  // namespace retint
