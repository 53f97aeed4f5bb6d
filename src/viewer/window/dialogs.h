// SPDX-License-Identifier: BSD-3-Clause
// Message boxes over a window. They do not block the program: the answer arrives later. One is
// shown at a time; errors in the meantime follow it.
#pragma once

#include <deque>
#include <functional>
#include <utility>

#include <QMessageBox>
#include <QObject>
#include <QPointer>
#include <QString>

namespace retint {

class Dialogs : public QObject {
  Q_OBJECT

 public:
  explicit Dialogs(QWidget* window) : QObject(window), window_(window) {}

  // Takes the box and opens it.
  void Show(QMessageBox* box);
  void ShowError(const QString& title, const QString& message);
  // Runs `go` if the user agrees to `reason`, by a button that says `go_on`.
  void Ask(const QString& what, const QString& reason, const QString& go_on,
           std::function<void()> go);
  // Errors open above it while it shows, which would keep the keyboard otherwise.
  void SetFront(QWidget* front) { front_ = front; }

  QMessageBox* box() const { return box_; }  // the newest; null: gone
  bool IsOpen() const { return box_ && box_->isVisible(); }

 private:
  void NextError();

  QWidget* window_;
  QPointer<QWidget> front_;
  QPointer<QMessageBox> box_;
  std::deque<std::pair<QString, QString>> errors_;
};

}  // namespace retint
