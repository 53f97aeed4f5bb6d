// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/widgets/banner.h"

#include <algorithm>
#include <utility>

#include <QApplication>
#include <QEvent>
#include <QHBoxLayout>
#include <QKeyEvent>
#include <QLabel>
#include <QLayoutItem>
#include <QPixmap>
#include <QPushButton>
#include <QToolButton>
#include <QVBoxLayout>

namespace retint {
namespace {

constexpr int kMargin = 12;  // pixels to the edges of the parent
constexpr int kWidest = 680;
constexpr QSize kPicture(96, 72);

}  // namespace

Banner::Banner(QWidget* over) : QFrame(over) {
  setObjectName("banner");
  setFrameShape(QFrame::StyledPanel);
  setAutoFillBackground(true);
  setAttribute(Qt::WA_NoMousePropagation);  // a click on the banner does not paint
  setCursor(Qt::ArrowCursor);
  picture_ = new QToolButton;
  picture_->setObjectName("banner_picture");
  picture_->setAutoRaise(true);
  picture_->setIconSize(kPicture);
  picture_->setFocusPolicy(Qt::TabFocus);
  picture_->setToolTip(tr("Show it large"));
  picture_->setAccessibleName(tr("Show it large"));
  text_ = new QLabel;
  text_->setObjectName("banner_text");
  text_->setWordWrap(true);
  close_ = new QToolButton;
  close_->setObjectName("banner_close");
  close_->setAutoRaise(true);
  close_->setText(QStringLiteral("✕"));
  close_->setFocusPolicy(Qt::TabFocus);
  close_->setToolTip(tr("Close"));
  close_->setAccessibleName(tr("Close"));
  // The buttons are below the text, so that both fit a narrow canvas.
  auto* column = new QVBoxLayout;
  column->addWidget(text_, 1);
  buttons_ = new QHBoxLayout;
  buttons_->addStretch();
  column->addLayout(buttons_);
  auto* row = new QHBoxLayout(this);
  row->setContentsMargins(10, 8, 10, 8);
  row->setSpacing(10);
  row->addWidget(picture_, 0, Qt::AlignTop);
  row->addLayout(column, 1);
  row->addWidget(close_, 0, Qt::AlignTop);
  connect(close_, &QToolButton::clicked, this, &Banner::Close);
  connect(picture_, &QToolButton::clicked, this, [this] {
    if (message_.open) message_.open();
  });
  over->installEventFilter(this);
  hide();
}

QString Banner::text() const { return IsShown() ? message_.text : QString(); }

void Banner::Show(Message message) {
  Close();
  message_ = std::move(message);
  text_->setText(message_.text);
  picture_->setVisible(!message_.picture.isNull());
  picture_->setEnabled(bool(message_.open));
  if (!message_.picture.isNull()) {
    const double ratio = devicePixelRatioF();
    QImage small =
        message_.picture.scaled(kPicture * ratio, Qt::KeepAspectRatio, Qt::SmoothTransformation);
    small.setDevicePixelRatio(ratio);
    picture_->setIcon(QPixmap::fromImage(std::move(small)));
  }
  while (buttons_->count() > 1) {  // the first is the stretch
    QLayoutItem* item = buttons_->takeAt(1);
    item->widget()->hide();
    item->widget()->deleteLater();  // it may be the pressed one
    delete item;
  }
  for (size_t i = 0; i < message_.answers.size(); ++i) {
    auto* button = new QPushButton(message_.answers[i].text);
    button->setObjectName(QString("banner_answer%1").arg(i));
    button->setToolTip(message_.answers[i].tip);
    button->setFocusPolicy(Qt::TabFocus);
    button->setDefault(i == 0);
    connect(button, &QPushButton::clicked, this, [this, i] { Choose(i); });
    buttons_->addWidget(button);
  }
  close_->setVisible(message_.answers.empty());
  show();
  Place();
}

void Banner::Close() {
  if (!IsShown()) return;
  const bool had_keyboard = isAncestorOf(QApplication::focusWidget());
  const std::function<void()> closed = std::exchange(message_, {}).closed;
  hide();
  if (had_keyboard) parentWidget()->setFocus();
  if (closed) closed();
}

void Banner::Choose(size_t answer) {
  const std::function<void()> act = message_.answers[answer].act;
  Close();
  if (act) act();
}

void Banner::Place() {
  const QWidget& over = *parentWidget();
  const int width = std::clamp(over.width() - 2 * kMargin, 0, kWidest);
  layout()->activate();
  const int height = std::max(layout()->totalHeightForWidth(width), minimumSizeHint().height());
  setGeometry((over.width() - width) / 2, over.height() - kMargin - height, width, height);
  raise();
}

// The window has shortcuts for these keys, too.
bool Banner::event(QEvent* event) {
  if (event->type() == QEvent::ShortcutOverride) {
    const int key = static_cast<QKeyEvent*>(event)->key();
    if (key == Qt::Key_Return || key == Qt::Key_Enter || key == Qt::Key_Escape ||
        key == Qt::Key_Tab || key == Qt::Key_Backtab) {
      event->accept();
      return true;
    }
  }
  return QFrame::event(event);
}

bool Banner::eventFilter(QObject* object, QEvent* event) {
  if (object == parentWidget() && event->type() == QEvent::Resize && IsShown()) Place();
  return QFrame::eventFilter(object, event);
}

void Banner::keyPressEvent(QKeyEvent* event) {
  const bool enter = event->key() == Qt::Key_Return || event->key() == Qt::Key_Enter;
  if (enter) {
    auto* button = qobject_cast<QAbstractButton*>(QApplication::focusWidget());
    if (button && isAncestorOf(button)) return button->click();
    if (!message_.answers.empty()) return Choose(0);
  }
  if (enter || event->key() == Qt::Key_Escape) return Close();
  QFrame::keyPressEvent(event);
}

}  // namespace retint
