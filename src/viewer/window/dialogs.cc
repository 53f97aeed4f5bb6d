// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/window/dialogs.h"

#include <algorithm>

#include <QLabel>
#include <QPushButton>
#include <QTimer>

#include "viewer/widgets/long_text.h"

namespace retint {

void Dialogs::Ask(const QString& what, const QString& reason, const QString& go_on,
                  std::function<void()> go) {
  auto* box = new QMessageBox(QMessageBox::Warning, what, what, QMessageBox::Cancel, window_);
  box->setInformativeText(reason);
  QPushButton* agree = box->addButton(go_on, QMessageBox::DestructiveRole);
  box->setDefaultButton(QMessageBox::Cancel);
  connect(box, &QMessageBox::buttonClicked, this, [=](QAbstractButton* button) {
    if (button == agree) go();
  });
  Show(box);
}

void Dialogs::Show(QMessageBox* box) {
  constexpr int kLongWord = 60;  // characters; a dialog becomes this wide
  box->setTextFormat(Qt::PlainText);
  box->setText(Breakable(box->text(), kLongWord));
  box->setInformativeText(Breakable(box->informativeText(), kLongWord));
  box->setTextInteractionFlags(Qt::TextSelectableByMouse);
  // Otherwise, a dialog is only as wide as its title.
  if (auto* text = box->findChild<QLabel*>("qt_msgbox_informativelabel")) {
    const QFontMetrics font = text->fontMetrics();
    const int whole = font.boundingRect(QRect(), Qt::TextDontClip, text->text()).width();
    text->setMinimumWidth(std::max(text->minimumSizeHint().width(),
                                   std::min(whole, kLongWord * font.averageCharWidth())));
  }
  box->setAttribute(Qt::WA_DeleteOnClose);
  box_ = box;
  connect(box, &QDialog::finished, this, [this] {
    // After the dialog has closed, so that the next one stays open.
    QTimer::singleShot(0, this, &Dialogs::NextError);
  });
  box->open();
}

void Dialogs::ShowError(const QString& title, const QString& message) {
  errors_.emplace_back(title, message);
  if (!box_) NextError();
}

void Dialogs::NextError() {
  if (errors_.empty() || IsOpen()) return;
  const auto [title, message] = errors_.front();
  errors_.pop_front();
  QWidget* parent = front_ && front_->isVisible() ? front_.data() : window_;
  auto* box = new QMessageBox(QMessageBox::Warning, title, title, QMessageBox::Ok, parent);
  box->setInformativeText(message);
  Show(box);
}

}  // namespace retint
