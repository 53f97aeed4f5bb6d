// SPDX-License-Identifier: BSD-3-Clause
// A line over a canvas that stays until the user answers it. Important messages and questions must
// not vanish, as lines of the status bar do. It never takes the keyboard from the canvas.
#pragma once

#include <functional>
#include <vector>

#include <QFrame>
#include <QImage>
#include <QString>

class QHBoxLayout;
class QLabel;
class QToolButton;

namespace retint {

class Banner : public QFrame {
  Q_OBJECT

 public:
  // A button. Pressing one first closes the banner.
  struct Answer {
    QString text;
    QString tip = {};
    std::function<void()> act = {};  // none: only close the banner
  };
  struct Message {
    QString text;
    // The first is the default: Return chooses it while the banner has the keyboard. Without
    // answers, the banner has a button to close it.
    std::vector<Answer> answers = {};
    QImage picture = {};                // shown small; may be null
    std::function<void()> open = {};    // a click on the picture
    std::function<void()> closed = {};  // it has closed, with or without an answer
  };

  explicit Banner(QWidget* over);  // its parent; it lies at the lower edge

  void Show(Message message);  // replaces the message that is shown
  void Close();
  bool IsShown() const { return !isHidden(); }
  bool Asks() const { return IsShown() && !message_.answers.empty(); }
  QString text() const;

 protected:
  bool event(QEvent* event) override;
  bool eventFilter(QObject* object, QEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;

 private:
  void Choose(size_t answer);
  void Place();

  Message message_;
  QToolButton* picture_;
  QLabel* text_;
  QHBoxLayout* buttons_;
  QToolButton* close_;
};

}  // namespace retint
