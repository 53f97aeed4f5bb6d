// SPDX-License-Identifier: BSD-3-Clause
// Names in labels: one that is long and has no spaces must not make its panel wider.
#pragma once

#include <QLabel>
#include <QPushButton>
#include <QString>

namespace retint {

// The same text for a label that wraps its lines. Words of more than `long_word` characters may be
// broken anywhere.
QString Breakable(const QString& text, int long_word = 24);
// As long as `owner` lives, text that is copied from such a label is as it was.
void CopyUnbroken(QObject* owner);

// One line, cut short where there is no room for it. Its tool tip is then the whole of it.
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

// The same, of a button; its middle is cut.
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
