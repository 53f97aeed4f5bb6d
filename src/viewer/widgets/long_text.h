// SPDX-License-Identifier: BSD-3-Clause
// Long names in labels. Without spaces, they would make their panel wider.
#pragma once

#include <QLabel>
#include <QPushButton>
#include <QString>

namespace retint {

// The text for a label that wraps its lines. Words longer than `long_word` characters can break
// anywhere.
QString Breakable(const QString& text, int long_word = 24);
// While `owner` lives, text copied from such a label is the original text.
void CopyUnbroken(QObject* owner);

// One line. If there is not enough room, it is cut, and its tool tip shows the whole text.
class ElidedLabel : public QLabel {
 public:
  ElidedLabel();
  QSize minimumSizeHint() const override;

 protected:
  bool event(QEvent* event) override;
  void paintEvent(QPaintEvent* event) override;

 private:
  QString Shown() const;
};

// The same for a button; its text is cut in the middle.
class ElidedButton : public QPushButton {
 public:
  explicit ElidedButton(const QString& title);

 protected:
  void resizeEvent(QResizeEvent* event) override;

 private:
  void ShowTitle();

  const QString title_;
};

}  // namespace retint
