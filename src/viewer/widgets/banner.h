// SPDX-License-Identifier: BSD-3-Clause
// A line that lies over a canvas and stays until it is answered: what matters, or needs an answer,
// must not vanish as a line of the status bar does. It never takes the keyboard from the canvas.
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
  // A button. Whichever is pressed closes the banner first.
  struct Answer {
    QString text;
    QString tip = {};
    std::function<void()> act = {};  // none: it only closes
  };
  struct Message {
    QString text;
    // The first one is the default: Return chooses it while the banner has the keyboard. Without
    // answers there is a button that closes.
    std::vector<Answer> answers = {};
    QImage picture = {};                // shown small; may be null
    std::function<void()> open = {};    // a click on the picture
    std::function<void()> closed = {};  // it went, by an answer or without one
  };

  explicit Banner(QWidget* over);  // its parent, at whose lower edge it lies

  void Show(Message message);  // instead of what it showed
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
